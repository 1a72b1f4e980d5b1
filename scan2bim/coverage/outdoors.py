"""What beyond the spaces of a storey may be a room that nobody scanned, and what lies out of doors.

Few scanners write down the pulses that did not return, so that the sky is seldom known. But windows look outdoors, and
what one sees of a room through its door are walls and ceiling higher than a door.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scan2bim.coverage.rooms import Rooms, drawn
from scan2bim.coverage.voxels import Field, near
from scan2bim.model.elements import Building, Door, Opening, Storey, Wall, Window
from scan2bim.model.queries import point_on_wall

Bools = NDArray[np.bool_]

ROUND_SIGHT = 3.0
"""Metres round what was seen through a door, beyond the building's outline, within which unknown floor counts."""
BEFORE_WINDOW = 3.0
"""Metres before a window, to its sides as well, that are taken as out of doors: as far as a room is deep."""
COVERED = 0.1
"""Share of the floor seen through a door over which something must have been seen: outdoors it is a tree or eaves."""
LEAST_VIEW = 0.5
"""Square metres of floor: what is seen of less may be a reveal or a lintel."""
BESIDE_VIEW = 0.3
"""Metres round what was seen of the floor within which what hangs over it counts: a room's walls."""
DOOR_WIDTH = 1.3
"""Metres: a wider window is none that is a door."""
STEP_OVER, DOOR_HEAD = 0.2, 1.6
"""Metres over the floor: an opening without a door that begins below the one and ends above the other may be a door."""


@dataclass(frozen=True, slots=True, eq=False)
class Above:
    """Columns (r, c) of which something was seen overhead, and those that are known to lie under the sky."""

    covered: Bools
    sky: Bools


def may_be_room(
    building: Building, storey: Storey, field: Field, outside: Bools, reached: Bools, above: Above
) -> Bools:
    """Columns ``outside`` of spaces and walls that may be a room.

    Within the rectangle round the building those that no window looks out to; beyond it those round what was seen
    through doors (``reached``) and is a room.
    """
    rooms = field.found.rooms
    sky = (above.sky | field.columns(before_windows(storey, rooms))) & outside
    covered = above.covered & outside
    inner = _footprint(building, rooms, field) & ~sky
    return outside & (inner | _round_sight(_views_of_rooms(reached & outside, covered, sky, field), outside, field))


def before_windows(storey: Storey, rooms: Rooms) -> Bools:
    """Pixels that a window looks out to: a fan before it on either side of its wall. What may be a door is left out."""
    mask = np.zeros(rooms.space.shape, np.bool_)
    for wall in storey.walls:
        for opening in wall.openings:
            narrow = opening.width.value <= DOOR_WIDTH
            if isinstance(opening.fill, Window) and not (narrow and is_passable(opening)):
                for side in (1.0, -1.0):
                    mask |= drawn([_fan(wall, opening, side)], rooms)
    return mask & (rooms.space < 0)


def is_passable(opening: Opening) -> bool:
    """Whether one sees and goes through an opening as it was found, or could.

    A door that was seen from one side alone is easily taken for a window that ends near the floor.
    """
    if isinstance(opening.fill, Door):
        return opening.fill.state in ("open", "ajar")
    sill = opening.sill.value
    return opening.fill is None or (sill < STEP_OVER and sill + opening.height.value > DOOR_HEAD)


def _fan(wall: Wall, opening: Opening, side: float) -> list[tuple[float, float]]:
    face, start = wall.thickness.value / 2, opening.offset.value
    end, deep = start + opening.width.value, BEFORE_WINDOW
    flat = ((start, face), (end, face), (end + deep, face + deep), (start - deep, face + deep))
    return [point_on_wall(wall, along, side * across, 0.0)[:2] for along, across in flat]


def _views_of_rooms(seen: Bools, covered: Bools, sky: Bools, field: Field) -> Bools:
    """Of the connected views beyond doors those of rooms: enough is covered, and more than speaks for the outdoors."""
    count, found = cv2.connectedComponents(seen.astype(np.uint8), connectivity=4)
    parts = found.astype(np.int64)
    edge = 2 * round(BESIDE_VIEW / field.size) + 1
    around = cv2.dilate(parts.astype(np.float32), np.ones((edge, edge), np.uint8)).astype(np.int64)
    size, room, open_ = (
        np.bincount(parts_[m], minlength=count) for parts_, m in ((parts, seen), (around, covered), (around, sky))
    )
    rooms = (size * field.size**2 >= LEAST_VIEW) & (room > open_) & (room >= COVERED * size)
    rooms[0] = False
    return rooms[parts]


def _round_sight(reached: Bools, outside: Bools, field: Field) -> Bools:
    """Columns round those that were seen through doors, without a wall between."""
    _, parts = cv2.connectedComponents(outside.astype(np.uint8), connectivity=4)
    return near(reached, round(ROUND_SIGHT / field.size)) & np.isin(parts, np.unique(parts[reached]))


def _footprint(building: Building, rooms: Rooms, field: Field) -> Bools:
    """Columns within the rectangle round all storeys, along the main directions."""
    corners = [p for s in building.storeys for space in s.spaces for p in space.outline]
    ends = [p for s in building.storeys for wall in s.walls for p in (wall.start, wall.end)]
    turned = rooms.turned(np.array([*corners, *ends])) / field.size
    low, high = np.floor(turned.min(0)).astype(int), np.ceil(turned.max(0)).astype(int)
    mask = np.zeros(field.labels.shape[1:], np.bool_)
    mask[max(low[1], 0) : max(high[1], 0), max(low[0], 0) : max(high[0], 0)] = True
    return mask
