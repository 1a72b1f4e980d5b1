"""Doors of an IFC model in other states than it was drawn in: leaves of our own hung in the model's openings."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.effects import World
from scan2bim.simulate.mesh import Patches
from scan2bim.simulate.parts import Patch, WallFrame, door_patches, leaf_frame, leaves_of
from scan2bim.simulate.raycast import Caster
from scan2bim.simulate.scene import DoorSpec, Rgb, WallSpec
from scan2bim.simulate.variation import dress
from scan2bim.simulate.walls_of_ifc import wall_and_frame
from scan2bim.truth.ifc import HostedOpening
from scan2bim.truth.values import DoorTruth

F64 = NDArray[np.float64]
Rng = np.random.Generator
Doors = Literal["as-modelled", "mixed", "closed", "open"]

TWO_LEAVES = 1.3
"""Metres: wider doors have two leaves."""
LEAST_OPEN = math.radians(15)
OPEN = (math.radians(55), math.radians(115))
AJAR = (math.radians(12), math.radians(28))
SHARES = {"mixed": (0.45, 0.15), "closed": (0.0, 0.0), "open": (1.0, 0.0)}
"""Shares of doors that stand open and ajar."""
ROOM = 0.05
"""Metres between an open leaf and what it would touch."""
BLOCKED = 0.5
"""Share of an opening that the model's own door must fill to be a closed one."""
CLEAR_OF_JAMB = 0.15
"""Metres from the hinge from which on a leaf may touch something: nearer are jamb and casing."""
BESIDE = 0.2
"""Metres beside an opening and before the wall at which the wall's colour is looked for."""
DEFAULT_WALL: Rgb = (222, 219, 210)


@dataclass(frozen=True, slots=True, eq=False)
class HungDoor:
    """A leaf of our own in one of the model's openings; ``truth`` is what is to be found."""

    patches: tuple[Patch, ...]
    truth: DoorTruth


def hang_doors(
    hosted: Iterable[tuple[HostedOpening, DoorTruth]], world: World, doors: Doors, rng: Rng
) -> list[HungDoor]:
    """Doors for the model's openings; ``world`` is the model without any."""
    return [_hang(one, true, world, SHARES[doors], rng) for one, true in hosted]


def _hang(one: HostedOpening, true: DoorTruth, world: World, shares: tuple[float, float], rng: Rng) -> HungDoor:
    wall, _, frame = wall_and_frame(one)
    colour = _wall_colour(one, world)
    door = DoorSpec(true.name, 0.0, wall.length, true.height, leaves=2 if wall.length > TWO_LEAVES else 1)
    door = dress(door, colour, wall.thickness, rng, hard=rng.random() < 0.15)
    door = replace(
        door,
        hinge=true.hinge if true.hinge in ("start", "end") else door.hinge,
        swing=true.swing if true.swing in ("left", "right") else ("left" if rng.random() < 0.5 else "right"),
    )
    drawn = float(rng.random())
    if drawn < sum(shares):
        angle = float(rng.uniform(*(OPEN if drawn < shares[0] else AJAR)))
        door = replace(door, recess=0.0, angle=_free_angle(replace(door, recess=0.0, angle=angle), wall, one, world))
    found = true.model_copy(
        update={
            "state": door.state,
            "angle": door.angle,
            "hinge": "both" if door.leaves == 2 else door.hinge,
            "swing": door.swing,
            "recess": door.recess,
            "leaves": door.leaves,
            "contrast": max(abs(a - b) for a, b in zip(door.colour, colour, strict=True)) / 255.0,
        }
    )
    return HungDoor(tuple(door_patches(door, wall, frame)), found)


def _free_angle(door: DoorSpec, wall: WallSpec, one: HostedOpening, world: World) -> float:
    """The widest angle up to the door's own at which no leaf touches anything; 0 where there is none."""
    _, _, frame = wall_and_frame(one)
    for angle in np.arange(door.angle, LEAST_OPEN, -math.radians(5)):
        turned = replace(door, angle=float(angle))
        if all(_is_free(leaf, wall, frame, world) for leaf in leaves_of(turned)):
            return float(angle)
    return 0.0


def _is_free(leaf: DoorSpec, wall: WallSpec, frame: WallFrame, world: World) -> bool:
    """Whether nothing is met along both faces of the leaf, from clear of the jamb to beyond its tip."""
    place = leaf_frame(leaf, wall, frame)
    heights = leaf.height * np.array([0.1, 0.5, 0.95])
    starts = [place.point(CLEAR_OF_JAMB, y, z) for y in (-ROOM, leaf.leaf_thickness + ROOM) for z in heights]
    along = np.tile(place.axes[:, 0], (len(starts), 1))
    return bool((world.rays(np.array(starts), along).range > leaf.width - CLEAR_OF_JAMB + ROOM).all())


def _wall_colour(one: HostedOpening, world: World) -> Rgb:
    """Of what rays meet on the wall beside the opening; a light grey where they meet nothing."""
    wall, _, frame = wall_and_frame(one)
    half, height = wall.thickness / 2, min(1.2, one.corners[2][2] - one.corners[0][2])
    starts, towards = list[F64](), list[F64]()
    for x in (-BESIDE, wall.length + BESIDE):
        for side in (1.0, -1.0):
            starts.append(frame.point(x, side * (half + BESIDE), height))
            towards.append(-side * frame.axes[:, 1])
    hits = world.rays(np.array(starts), np.array(towards))
    met = hits.patch[hits.range < BESIDE + 0.05]
    if not len(met):
        return DEFAULT_WALL
    red, green, blue = np.median(world.patches.rgb[met], axis=0).astype(int).tolist()
    return red, green, blue


def is_closed(one: HostedOpening, own: Patches) -> bool:
    """Whether the model's own door, ``own``, fills its opening as a closed one does."""
    wall, storey, frame = wall_and_frame(one)
    x, z = (np.linspace(0.05, 0.95, 12) * size for size in (wall.length, storey.height))
    gx, gz = (grid.ravel() for grid in np.meshgrid(x, z))
    far = wall.thickness / 2 + 0.15
    starts = np.array([frame.point(float(a), far, float(b)) for a, b in zip(gx, gz, strict=True)])
    along = np.tile(-frame.axes[:, 1], (len(starts), 1))
    return float((Caster(own).rays(starts, along).range < 2 * far).mean()) >= BLOCKED
