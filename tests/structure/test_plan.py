"""Rasters of a storey: what counts as its ceiling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely import box
from surfaces import F64, level, room, surfels_of, upright

from scan2bim.structure.build import has_floor
from scan2bim.structure.cells import Cells
from scan2bim.structure.faces import find_faces
from scan2bim.structure.plan import Plan, plan_of
from scan2bim.structure.spaces import find_spaces, joined
from scan2bim.structure.storeys import StoreyLevels, layers_of


def plan_from(parts: list[F64], seen_by: list[int], stations: list[list[float]], top: float) -> Plan:
    """The plan of a storey from parts that stations saw."""
    number = np.concatenate([np.full(len(part), k) for part, k in zip(parts, seen_by, strict=True)])
    surfels = surfels_of(np.concatenate(parts), number)
    levels = StoreyLevels(0.0, 0.002, 2.5, top, 24.0)
    return plan_of(levels, surfels, layers_of(surfels), np.array(stations))


def roof(x0: float, y0: float, x1: float, y1: float, eaves: float, slope: float) -> F64:
    """Points of a plane that rises along y."""
    points = level(x0, y0, x1, y1, eaves)
    points[:, 2] += slope * (points[:, 1] - y0)
    return points


def test_a_roof_seen_from_outside_is_no_ceiling() -> None:
    outside = roof(-0.5, -0.5, 6.5, 4.5, 3.2, 0.6)
    for eye, expected in ([3.0, 2.0, 6.5], 0.0), ([3.0, 2.0, 3.5], 1.0):
        parts = [*room(0, 0, 6, 4), outside]
        ceiling = parts.pop(1)  # of the room only its floor and walls: the roof is all that hangs over it
        assert np.median(ceiling[:, 2]) > 2
        plan = plan_from(parts, [0] * 5 + [1], [[3.0, 2.0, 1.6], eye], 6.3)
        assert (plan.ceiling[20:80, 20:100] > 0).mean() == expected


def test_a_wall_that_a_stair_hides_in_part_reaches_the_stair() -> None:
    flight = roof(0, 0, 1, 3, 1.2, 0.5)
    x = -0.025  # the middle of the pixels beside the flight
    low = [upright((x, y), (x, y + 0.25), 0.0, 1.2 + 0.5 * y) for y in np.arange(0, 3, 0.25)]
    wall = np.concatenate([*low, upright((x, 0), (x, 3), 3.4, 4.2)])
    parts = [level(0, 0, 4, 3, 0.0), level(1, 0, 4, 3, 2.5), flight, wall]
    plan = plan_from(parts, [0] * 4, [[3.0, 1.5, 1.6]], 4.3)
    faces = [f for f in find_faces(plan) if abs(f.centre[0] - x) < 0.02 and f.normal[0] > 0.99]
    assert sum(f.length for f in faces) > 2.5


def test_the_upper_part_of_a_high_room_is_no_space_of_the_storey_above() -> None:
    plan = plan_from(room(0, 0, 6, 4), [0] * 6, [[3.0, 2.0, 1.6]], 2.7)
    assert has_floor(box(1, 1, 4, 3), plan)
    none = np.zeros_like(plan.floor)
    assert not has_floor(box(1, 1, 4, 3), replace(plan, floor=none, standing_z=np.full_like(plan.standing_z, np.nan)))
    assert has_floor(box(1, 1, 4, 3), replace(plan, floor=none, standing_z=plan.standing_z + np.float32(0.3)))


def test_a_lintel_parts_rooms_where_the_scan_was_cut_below_the_ceiling() -> None:
    cut, door = 2.3, (1.5, 2.4)
    parts: list[F64] = []
    for x0, x1 in ((0.0, 4.0), (4.1, 8.0)):
        floor, *walls = room(x0, 0, x1, 4, ceiling=None)
        inner = 4.0 if x0 == 0 else 4.1
        across = [upright((inner, 0), (inner, door[0]), 0, cut), upright((inner, door[1]), (inner, 4), 0, cut)]
        lintel = upright((inner, door[0]), (inner, door[1]), 2.1, cut)
        outer = [w for w in walls if np.ptp(w[:, 0]) > 0.2 or abs(np.median(w[:, 0]) - inner) > 0.2]
        parts += [floor, *(w[w[:, 2] < cut] for w in outer), *across, lintel]
    parts.append(level(4.0, door[0], 4.1, door[1], 0.0))
    parts.append(level(0.0, 0.5, 0.4, 3.5, 1.5))  # the underside of cabinets, all that hangs overhead
    plan = plan_from(parts, [99] * len(parts), [[np.nan] * 3], 2.5)
    assert plan.levels.ceiling is None and abs(plan.levels.top - cut) < 0.06
    assert not plan.ceiling.any()
    assert sorted(round(s.area) for s in find_spaces(plan, find_faces(plan), [])[0]) == [16, 16]


def test_the_ceiling_goes_on_over_cupboards_that_hide_the_floor() -> None:
    """A wardrobe 60 cm deep and 2 m high over a whole wall of a room 2.5 m high, beside eaves as high 40 cm away."""
    front = upright((5.4, 0), (5.4, 4), 0, 2.0)
    wall = upright((6.0, 0), (6.0, 4), 2.2, 2.5)
    rest = [upright(a, b, 0, 2.5) for a, b in (((0, 0), (6, 0)), ((0, 4), (6, 4)), ((0, 0), (0, 4)))]
    eaves = level(6.4, 0, 7.0, 4, 2.5)
    parts = [level(0, 0, 5.4, 4, 0.0), level(0, 0, 6, 4, 2.5), front, wall, *rest, eaves]
    plan = plan_from(parts, [0] * len(parts), [[3.0, 2.0, 1.6]], 2.7)
    over, outside = (plan.grid.pixel_of(np.array([[x, 2.0]]))[0] for x in (5.7, 6.7))
    assert plan.ceiling[over[1], over[0]] > 0
    assert plan.ceiling[outside[1], outside[0]] == 0


def test_the_soffit_of_a_lintel_over_nothing_is_no_ceiling() -> None:
    parts = [*room(0, 0, 6, 4, ceiling=2.5), level(6.05, 0, 6.4, 4, 2.4)]
    plan = plan_from(parts, [0] * len(parts), [[3.0, 2.0, 1.6]], 2.7)
    at = plan.grid.pixel_of(np.array([[6.2, 2.0]]))[0]
    assert plan.ceiling[at[1], at[0]] == 0


def test_a_hall_without_floor_is_a_space_where_walls_enclose_it() -> None:
    rooms = [*room(0, 0, 6, 4, ceiling=None), *room(6.1, 0, 12, 4, ceiling=None)[1:]]
    table = level(9, 1.5, 10, 2.5, 0.75)
    for parts, expected in ([*rooms, table], 2), ([*rooms[:6], table], 1):
        plan = plan_from(parts, [99] * len(parts), [[np.nan] * 3], 2.5)
        assert len([s for s in find_spaces(plan, find_faces(plan), [])[0] if has_floor(s, plan)]) == expected


def test_slivers_go_with_the_room_that_they_border_on_and_join_no_two() -> None:
    """Two rooms, of which a sliver of a few millimetres between lines that nearly coincide touches both."""
    rooms = [box(0, 0, 4, 4), box(4.1, 0, 8, 4), box(4, 0, 4.05, 0.04), box(4.05, 0, 4.1, 0.04)]
    ends = np.array([[[4, 0], [4, 0.04]], [[4.05, 0], [4.05, 0.04]], [[4.1, 0], [4.1, 0.04]]])
    edges = np.array([[0, 2], [2, 3], [3, 1]])
    bare = np.zeros(3)
    cells = Cells(np.array(rooms, object), edges, ends, bare, bare, bare > 0, np.ones(4))
    label = joined(cells, np.ones(4, bool))
    assert label[0] != label[1]
    assert set(label[2:]) <= {label[0], label[1]}


def test_a_wall_hidden_between_seen_stretches_parts_two_rooms_and_no_cupboard_from_its_room() -> None:
    ends = np.array([[[4, 0], [4, 4]]], float)
    bare = np.zeros(1)
    for east, parts in (8.0, 2), (4.6, 1):
        rooms = np.array([box(0, 0, 4, 4), box(4, 0, east, 4)], object)
        cells = Cells(rooms, np.array([[0, 1]]), ends, bare, bare, bare == 0, np.ones(2))
        assert len(np.unique(joined(cells, np.ones(2, bool), hidden=True))) == parts
        assert len(np.unique(joined(cells, np.ones(2, bool), hidden=False))) == 1
