"""The surfaces of an IFC model as patches that rays meet: colours and glass by the model's own materials."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scan2bim.simulate.mesh import Patches, gather
from scan2bim.simulate.parts import FINISHES, Patch, window_patches
from scan2bim.simulate.scene import Placement, Rgb, WindowSpec
from scan2bim.simulate.walls_of_ifc import wall_and_frame
from scan2bim.truth.ifc import HostedOpening, IfcReading
from scan2bim.truth.ifc_file import Entity, Mesh

CLEAR = 0.35
"""Transparency from which on a material is glass."""
LEFT_OUT = ("IfcFeatureElement", "IfcVirtualElement", "IfcReinforcingElement", "IfcElementAssembly")
"""What no scanner meets: openings, imaginary borders, what is inside concrete; assemblies come by their parts."""
PAINT: dict[str, tuple[Rgb, str]] = {
    "IfcWall": ((222, 219, 210), "paint"),
    "IfcSlab": ((160, 156, 150), "plain"),
    "IfcCovering": ((228, 228, 224), "plain"),
    "IfcDoor": ((146, 100, 62), "wood"),
    "IfcWindow": ((236, 236, 234), "plain"),
    "IfcPlate": ((150, 165, 165), "plain"),
    "IfcFurnishingElement": ((150, 120, 90), "plain"),
}
"""Colour where the model gives none, and finish, by class."""
GREY: tuple[Rgb, str] = ((170, 168, 164), "plain")


def solid_patches(reading: IfcReading, *, doors: bool) -> Patches:
    """All that a ray can meet in the model; ``doors``: with the model's own doors that hang in walls."""
    hung = {one.fill.id() for one in reading.hosted if one.fill is not None and hangs(one)}
    wanted = [e for e in reading.model.of("IfcElement") if _is_met(e) and (doors or e.id() not in hung)]
    windows = {one.fill.id(): one for one in reading.hosted if one.fill is not None and one.fill.is_a("IfcWindow")}
    parts: list[Patches] = []
    for element, mesh in reading.model.meshes(wanted, voids=True):
        window = windows.get(element.id())
        if window is not None and window.wall is not None and not _glass_of(mesh).any():
            # Its panes cannot be told from its frame: a plain window of its size takes its place.
            parts.append(gather(_plain_window(window), Placement()))
        else:
            parts.append(patches_of(mesh, element))
    return joined(parts)


def hangs(one: HostedOpening) -> bool:
    """Whether it is a door in a wall."""
    return one.fill is not None and one.wall is not None and bool(one.fill.is_a("IfcDoor"))


def _is_met(element: Entity) -> bool:
    return not any(element.is_a(name) for name in LEFT_OUT)


def patches_of(mesh: Mesh, element: Entity) -> Patches:
    """An element's triangles, coloured."""
    kind = next((name for name in PAINT if element.is_a(name)), "")
    colour, finish = PAINT.get(kind, GREY)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    n = len(a)
    rgb = np.tile(np.array(colour, dtype=np.uint8), (n, 1))
    styled = mesh.material >= 0
    rgb[styled] = np.round(np.clip(mesh.colours[mesh.material[styled], :3], 0.0, 1.0) * 255).astype(np.uint8)
    return Patches(
        origin=a,
        u=b - a,
        v=c - a,
        half=np.ones(n, dtype=np.bool_),
        element=np.zeros(n, dtype=np.int32),
        rgb=rgb,
        names=(str(element.GlobalId),),
        finish=np.full(n, FINISHES.index(finish), dtype=np.int8),
        glass=_glass_of(mesh),
    )


def _glass_of(mesh: Mesh) -> NDArray[np.bool_]:
    clear = np.append(mesh.colours[:, 3], 0.0)
    return np.asarray(clear[mesh.material] >= CLEAR)


def _plain_window(one: HostedOpening) -> Iterable[Patch]:
    wall, _, frame = wall_and_frame(one)
    low, high = one.corners[0], one.corners[2]
    window = WindowSpec("window", 0.0, 0.0, wall.length, high[2] - low[2], mullions=int(wall.length > 1.4), pane=True)
    return window_patches(dataclasses.replace(window, name=str(one.fill.GlobalId) if one.fill else "window"), frame)


def joined(parts: list[Patches]) -> Patches:
    """Patches of several as one value."""
    if not parts:
        return gather([], Placement())
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    number = {name: i for i, name in enumerate(names)}
    elements = [np.array([number[name] for name in part.names], dtype=np.int32)[part.element] for part in parts]
    return Patches(
        origin=np.concatenate([p.origin for p in parts]),
        u=np.concatenate([p.u for p in parts]),
        v=np.concatenate([p.v for p in parts]),
        half=np.concatenate([p.half for p in parts]),
        element=np.concatenate(elements),
        rgb=np.concatenate([p.rgb for p in parts]),
        names=names,
        finish=np.concatenate([p.finish for p in parts]),
        glass=np.concatenate([p.glass for p in parts]),
    )
