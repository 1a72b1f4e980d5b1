"""The stretch of an IFC wall round an opening as a wall of our own, so that our doors and windows fit in."""

from __future__ import annotations

from scan2bim.simulate.parts import WallFrame, wall_frame
from scan2bim.simulate.scene import StoreySpec, WallSpec
from scan2bim.truth.ifc import HostedOpening


def wall_and_frame(one: HostedOpening) -> tuple[WallSpec, StoreySpec, WallFrame]:
    """A wall as long as the opening is wide, from its start, on a storey as high as its lower edge."""
    a, b = one.corners[0], one.corners[1]
    wall = WallSpec("wall", (a[0], a[1]), (b[0], b[1]), max(one.strip.thickness, 0.06))
    storey = StoreySpec("storey", (wall,), (), elevation=a[2], height=one.corners[2][2] - a[2])
    return wall, storey, wall_frame(wall, storey)
