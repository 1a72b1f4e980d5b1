"""The openings stage: doors, windows and passages in the walls of all storeys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from scan2bim.cloud.scene import Scene, load_scene
from scan2bim.config import OpeningSettings
from scan2bim.geometry.plan_index import PlanIndex
from scan2bim.openings.open import find_open
from scan2bim.openings.shapes import OpeningShape, save_openings
from scan2bim.openings.virtual import virtual_panoramas
from scan2bim.openings.wall_image import wall_image
from scan2bim.structure.shapes import StoreyShape, StructureShape


def find_openings(
    structure_folder: Path,
    surfel_folder: Path,
    scan_folders: Sequence[Path],
    folder: Path,
    settings: OpeningSettings,
    progress: Callable[[float], None],
) -> None:
    """Find the openings of all walls and write them to ``folder``/openings.json."""
    scene = load_scene(surfel_folder, scan_folders)
    structure = StructureShape.load(structure_folder / "structure.json")
    save_openings(openings_of(structure, scene, progress), folder / "openings.json")


def openings_of(structure: StructureShape, scene: Scene, progress: Callable[[float], None]) -> list[OpeningShape]:
    """Openings of all walls, storey by storey."""
    found: list[OpeningShape] = []
    for number, storey in enumerate(structure.storeys):
        z = scene.surfels.xyz[:, 2]
        near = scene.surfels.pick((z > storey.floor - 0.2) & (z < storey.top + 0.2))
        panoramas = scene.panoramas or virtual_panoramas(storey, near)
        index = PlanIndex(near.xyz)
        for place, wall in enumerate(storey.walls):
            beside = near.pick(index.along(np.array([wall.start, wall.end]), wall.thickness / 2 + 0.1))
            found += find_open(number, place, wall, wall_image(wall, beside, panoramas))
        progress((number + 1) / len(structure.storeys))
    return _once(found, structure.storeys)


def _once(found: list[OpeningShape], storeys: Sequence[StoreyShape]) -> list[OpeningShape]:
    """Without the less sure of two openings that overlap in one wall."""
    kept: list[OpeningShape] = []
    for opening in sorted(found, key=lambda o: (-o.confidence, o.storey, o.wall, o.offset)):
        rivals = [k for k in kept if (k.storey, k.wall) == (opening.storey, opening.wall)]
        wall = storeys[opening.storey].walls[opening.wall]
        length = float(np.hypot(wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]))
        fits = opening.offset > -0.01 and opening.offset + opening.width < length + 0.01
        if fits and not any(_overlap(opening, k) for k in rivals):
            kept.append(opening)
    return sorted(kept, key=lambda o: (o.storey, o.wall, o.offset))


def _overlap(a: OpeningShape, b: OpeningShape) -> bool:
    sideways = min(a.offset + a.width, b.offset + b.width) - max(a.offset, b.offset)
    upwards = min(a.sill + a.height, b.sill + b.height) - max(a.sill, b.sill)
    return sideways > 0 and upwards > 0
