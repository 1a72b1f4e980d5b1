"""The share of each face that was seen, hidden or never looked at, written into the model's evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from scan2bim.cloud.scene import Scene, load_scene
from scan2bim.coverage.faces import StoreyFaces, look_at_faces
from scan2bim.coverage.look import BLOCKED, LOOKED_THROUGH, SEEN
from scan2bim.coverage.residuals import residuals_of
from scan2bim.model.elements import Building, Element, FaceView, Storey

E = TypeVar("E", bound=Element)

LEAST_AREA = 0.01
"""Square metres below which a face is left out: nothing of it bounds a space."""


def covered(building: Building, surfel_folder: Path, scan_folders: Sequence[Path]) -> Building:
    """The building with its coverage by the scans whose results lie in these folders."""
    return with_coverage(building, load_scene(surfel_folder, scan_folders), scan_folders)


def with_coverage(building: Building, scene: Scene, scan_folders: Sequence[Path]) -> Building:
    """The building with what was seen of the faces of its walls, slabs and ceilings, and how well each scan fits.

    scan_folders: of the read stage, in the order of the building's scans.
    """
    faces = look_at_faces(building, scene)
    storeys = [s if f is None else _viewed(s, f) for s, f in zip(building.storeys, faces, strict=True)]
    residuals = residuals_of([f for f in faces if f is not None], scan_folders, scene.stations)
    scans = [s.model_copy(update={"residual": residuals.get(i)}) for i, s in enumerate(building.scans)]
    return building.model_copy(update={"storeys": tuple(storeys), "scans": tuple(scans)})


def face_views(found: StoreyFaces) -> dict[str, tuple[FaceView, ...]]:
    """By element what was seen of its faces. What was looked through and never seen is an opening, and left out."""
    panels, marks = found.panels, found.marks
    owner, area, bits = panels.face[panels.cell_panel], panels.cell_area, marks.bits
    seen = (bits & SEEN) > 0
    there = panels.asked & (seen | ((bits & LOOKED_THROUGH) == 0))
    whole, shown, hidden = (
        np.bincount(owner[mask], weights=area[mask], minlength=len(panels.faces))
        for mask in (there, there & seen, there & ~seen & ((bits & BLOCKED) > 0))
    )
    views: dict[str, tuple[FaceView, ...]] = {}
    for number, face in enumerate(panels.faces):
        if whole[number] < LEAST_AREA:
            continue
        seen_share = round(float(shown[number] / whole[number]), 3)
        occluded = min(round(float(hidden[number] / whole[number]), 3), round(1.0 - seen_share, 3))
        points, flat, squares = marks.tally[number].tolist()
        view = FaceView(
            side=face.side,
            area=round(float(whole[number]), 2),
            seen=seen_share,
            occluded=occluded,
            unseen=max(0.0, round(1.0 - seen_share - occluded, 3)),
            points=int(points),
            rms=round(math.sqrt(squares / flat), 4) if flat else None,
        )
        views[face.element] = (*views.get(face.element, ()), view)
    return views


def _viewed(storey: Storey, found: StoreyFaces) -> Storey:
    views = face_views(found)
    return storey.model_copy(
        update={
            "walls": tuple(_with(wall, views) for wall in storey.walls),
            "slabs": tuple(_with(slab, views) for slab in storey.slabs),
            "coverings": tuple(_with(covering, views) for covering in storey.coverings),
            "roofs": tuple(_with(roof, views) for roof in storey.roofs),
        }
    )


def _with(element: E, views: Mapping[str, tuple[FaceView, ...]]) -> E:
    if element.id not in views:
        return element
    evidence = element.evidence.model_copy(update={"faces": views[element.id]})
    return element.model_copy(update={"evidence": evidence})
