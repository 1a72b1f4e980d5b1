"""What hangs on walls and stands before them is no opening."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from modelled import Modelled, model_of, rectangle_of, rectangle_overlap, scan_of
from synthetic import Scanned, scanned, two_rooms

from scan2bim.simulate import decor
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.scanner import ScannerSpec, Sweep
from scan2bim.simulate.scene import Box, Scene, WallSpec

SPEC = ScannerSpec(step=math.radians(0.6))
MIRROR = "mirror"


def furnished() -> Scene:
    """``two_rooms`` with pictures, boards, cabinets, a wardrobe, radiators and a mirror at its walls."""
    scene = two_rooms(0.3)
    (storey,) = scene.storeys
    walls: dict[str, WallSpec] = {wall.name: wall for wall in storey.walls}
    middle, west, east, north = (walls[n] for n in ("middle wall", "outer wall 4", "outer wall 2", "outer wall 3"))
    boxes: list[Box] = [
        decor.mounted(MIRROR, middle, 1, (3.3, 1.0), (0.8, 0.01, 0.9), (200, 200, 200)),
        *decor.electrical_cabinet("switches", middle, -1, 0.6, 0.8, full=True),
        *decor.picture("painting", middle, 1, 0.7, 0.9, 0.7),
        *decor.cabinet("wardrobe", west, 1, 1.2, 1.6, 2.1, (196, 170, 130)),
        *decor.poster("poster", west, 1, 3.2, 0.9, 1.3),
        *decor.radiator("radiator", north, 1, 2.0, 1.0),
        *decor.whiteboard("board", east, 1, 2.0, 1.8),
        *decor.electrical_cabinet("meters", east, 1, 3.6, 0.6, full=False),
    ]
    return dataclasses.replace(scene, storeys=(dataclasses.replace(storey, boxes=(*storey.boxes, *boxes)),))


def mirrored(sweep: Sweep, patches: set[int]) -> Sweep:
    """With the rays that met a mirror ending 1.5 m behind it."""
    met = np.isin(sweep.patch, list(patches))
    away = np.linalg.norm(sweep.xyz, axis=1, keepdims=True)
    xyz = np.where(met[:, None], sweep.xyz * (1 + 1.5 / away), sweep.xyz)
    return dataclasses.replace(sweep, xyz=xyz)


@pytest.fixture(scope="module")
def truth() -> Scanned:
    scan = scanned(furnished(), SPEC)
    mesh = build_mesh(scan.scene)
    patches = {k for k, element in enumerate(mesh.element) if mesh.names[element] == MIRROR}
    return dataclasses.replace(scan, sweeps=tuple(mirrored(sweep, patches) for sweep in scan.sweeps))


@pytest.fixture(scope="module")
def model(truth: Scanned) -> Modelled:
    return model_of([scan_of(sweep) for sweep in truth.sweeps])


def test_only_true_doors_and_windows_are_found_among_what_hangs_on_walls(model: Modelled, truth: Scanned) -> None:
    true = [np.array(t.corners) for t in (*truth.truth.doors, *truth.truth.windows)]
    for opening in model.openings:
        assert max(rectangle_overlap(c, rectangle_of(opening, model)) for c in true) > 0.5, opening
    assert len(model.openings) == len(true)
