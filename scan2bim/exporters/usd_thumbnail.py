"""Small pictures of assets, as asset libraries show them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from pxr import Gf, Usd, UsdGeom

from scan2bim.geometry.meshes import Floats
from scan2bim.model.colours import to_srgb

_SIZE: Final = 256  # pixels a side, as asset libraries want it
_MARGIN: Final = 16  # pixels
_BACK: Final = (245, 245, 245)


def write_thumbnail(stage: Usd.Stage, path: Path) -> None:
    """Draw the stage's shown meshes as seen from the front (from -y), nearest last, as a PNG file."""
    faces = [face for prim in stage.Traverse() if UsdGeom.Mesh(prim) for face in _faces(prim)]
    image = np.full((_SIZE, _SIZE, 3), _BACK, np.uint8)
    if faces:
        corners = np.concatenate([points for points, _ in faces])
        low, high = corners[:, [0, 2]].min(axis=0), corners[:, [0, 2]].max(axis=0)
        scale = (_SIZE - 2 * _MARGIN) / max(float((high - low).max()), 1e-6)
        for points, colour in sorted(faces, key=lambda face: -float(face[0][:, 1].mean())):
            plan = (points[:, [0, 2]] - (low + high) / 2) * scale * (1, -1) + _SIZE / 2
            cv2.fillPoly(image, [np.round(plan).astype(np.int32)], colour)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(".png", image)[1].tobytes())


def _faces(prim: Usd.Prim) -> Sequence[tuple[Floats, tuple[int, int, int]]]:
    """Triangles (3, 3) of a mesh that look to the front, each with its colour as blue, green, red."""
    mesh = UsdGeom.Mesh(prim)
    colours = mesh.GetDisplayColorAttr().Get()
    if UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide or not colours:
        return []
    matrix: Gf.Matrix4d = mesh.ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    place = np.array(matrix)
    points = np.array(mesh.GetPointsAttr().Get(), np.float64) @ place[:3, :3] + place[3, :3]
    triangles = points[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)]
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    red, green, blue = to_srgb(tuple(colours[0]))
    return [(corners, (blue, green, red)) for corners in triangles[across[:, 1] < 0.0]]
