"""The faces of all storeys with what the scans saw of them."""

from __future__ import annotations

from dataclasses import dataclass

from scan2bim.cloud.scene import Scene
from scan2bim.coverage.look import Bins, Marks, bins_of, look, mark_points, no_marks
from scan2bim.coverage.panels import Panels, panels_of
from scan2bim.coverage.rooms import RIM, Rooms, rooms_of
from scan2bim.model.elements import Building


@dataclass(frozen=True, slots=True, eq=False)
class StoreyFaces:
    """The faces of a storey with what was seen of them."""

    rooms: Rooms
    panels: Panels
    bins: Bins
    marks: Marks


def look_at_faces(
    building: Building, scene: Scene, rim: float = RIM, *, holes: bool = False
) -> list[StoreyFaces | None]:
    """For each storey its faces and what the scans saw of them; None for a storey without spaces.

    rim: metres round the spaces that their raster reaches. holes: whether stations are asked about openings, too.
    """
    out: list[StoreyFaces | None] = []
    for storey in building.storeys:
        rooms = rooms_of(storey, building.frame.yaw, rim)
        if rooms is None:
            out.append(None)
            continue
        panels = panels_of(storey, rooms)
        bins, marks = bins_of(panels, rooms), no_marks(panels)
        mark_points(panels, rooms, bins, scene.surfels, scene.stations, marks)
        out.append(StoreyFaces(rooms, panels, bins, marks))
    for panorama in scene.panoramas.values():  # outside, since the ranges of many do not stay in memory
        for found in out:
            if found is not None:
                look(found.panels, found.rooms, panorama, found.marks, holes=holes)
    return out
