"""A thinner wall that comes out of both ends of a thick one goes on within it; what lies before it is a lining."""

from __future__ import annotations

from dataclasses import replace

import pytest
import shapely

from scan2bim.assemble_linings import with_linings
from scan2bim.openings.shapes import OpeningShape
from scan2bim.structure.shapes import JoinShape, SpaceShape, StoreyShape, StructureShape, WallShape

ROOM, HALL = 0, 1


def wall(x: tuple[float, float], y: tuple[float, float], *joins: JoinShape) -> WallShape:
    """A wall of measured thickness along x, between two lower and upper faces y, the room on its left."""
    middle = (y[0] + y[1]) / 2
    return WallShape(
        (x[0], middle), (x[1], middle), round(y[1] - y[0], 4), 0.002, 0.0, 2.6, True, (ROOM,), (HALL,), 0.002, 900, 1.0,
        2, (0,), (200, 200, 200), joins,
    )  # fmt: skip


def across(x: float, y: tuple[float, float], *joins: JoinShape) -> WallShape:
    """A wall of 12 cm across x."""
    return replace(wall((0.0, 1.0), (-0.06, 0.06), *joins), start=(x, y[0]), end=(x, y[1]))


def space(y: tuple[float, float]) -> SpaceShape:
    return SpaceShape(((-9.0, y[0]), (14.0, y[0]), (14.0, y[1]), (-9.0, y[1])), (), 0.0, 2.6, 1.0, 1.0)


def storey(*walls: WallShape) -> StoreyShape:
    return StoreyShape(0.0, 0.003, 2.6, 2.6, (space((0.3, 4.0)), space((-4.0, 0.0))), walls)


def parted(*storeys: StoreyShape, openings: tuple[OpeningShape, ...] = ()) -> tuple[WallShape, ...]:
    """The walls of the first storey."""
    return with_linings(StructureShape(storeys, 0.0), openings)[0].storeys[0].walls


def opening(storey: int, number: int) -> OpeningShape:
    return OpeningShape(
        storey, number, "door", "open", 1.0, 0.0, 0.9, 2.0, 0.01, 0.01, 1.0, 2, True, 40, (0,), 0.9
    )  # fmt: skip


LEFT, RIGHT = wall((-4.0, 0.0), (0.0, 0.2)), wall((5.0, 9.0), (0.0, 0.2))
FURRED = wall((0.0, 5.0), (0.0, 0.3))


def test_a_wall_goes_on_behind_the_lining_before_it() -> None:
    walls = parted(storey(FURRED, LEFT, RIGHT))
    assert len(walls) == 4
    core, lining = walls[0], walls[3]
    assert (core.thickness, lining.thickness) == (pytest.approx(0.2), pytest.approx(0.1))
    assert [core.start, core.end] == [pytest.approx((0.0, 0.1)), pytest.approx((5.0, 0.1))]
    assert {lining.start, lining.end} == {(0.0, 0.25), (5.0, 0.25)}
    assert core.thickness_sigma is None
    assert lining.thickness_sigma is None
    assert (core.left, core.right) == ((), (HALL,))
    assert (lining.left, lining.right) == ((ROOM,), ())


def test_what_crosses_a_lining_parts_it() -> None:
    partition = across(2.0, (0.15, 4.0), JoinShape(0, "start", "path", "T"))
    walls = parted(storey(FURRED, LEFT, RIGHT, partition))
    linings = walls[4:]
    assert [round(w.length, 3) for w in linings] == [1.94, 2.94]
    bodies = [shapely.buffer(w.line, w.thickness / 2, cap_style="flat") for w in walls]
    assert walls[3].start == pytest.approx((2.0, 0.1))
    for lining in bodies[4:]:
        assert all(lining.intersection(body).area < 1e-6 for body in bodies[:4])


def test_openings_stay_in_place_where_the_start_of_their_wall_is_moved() -> None:
    partition = across(2.0, (0.15, 4.0), JoinShape(0, "start", "path", "T"))
    shape, openings = with_linings(
        StructureShape((storey(FURRED, LEFT, RIGHT, partition),), 0.0), (opening(0, 3), opening(0, 1))
    )
    assert shape.storeys[0].walls[3].start[1] + openings[0].offset == pytest.approx(1.15)
    assert openings[1].offset == 1.0


@pytest.mark.parametrize(
    "walls",
    [
        (FURRED, LEFT),
        (FURRED, LEFT, wall((5.0, 9.0), (0.0, 0.24))),
        (FURRED, LEFT, wall((5.0, 9.0), (0.05, 0.25))),
        (wall((0.0, 5.0), (0.0, 0.24)), LEFT, RIGHT),
        (wall((0.0, 5.0), (0.0, 0.6)), LEFT, RIGHT),
        (wall((0.0, 2.0), (0.0, 0.3)), LEFT, wall((2.0, 9.0), (0.0, 0.2))),
        (replace(FURRED, faces=1, thickness_sigma=None), LEFT, RIGHT),
    ],
    ids=["one end", "another thickness", "another line", "a panel", "a shaft", "a pier", "one face"],
)
def test_walls_are_left_as_they_are(walls: tuple[WallShape, ...]) -> None:
    assert parted(storey(*walls)) == walls


def test_a_wall_with_an_opening_is_left_as_it_is() -> None:
    walls = (FURRED, LEFT, RIGHT)
    assert parted(storey(*walls), openings=(opening(0, 0),)) == walls


def test_a_wall_under_a_lined_one_with_the_same_faces_is_lined() -> None:
    above = storey(FURRED, LEFT, RIGHT)
    walls = parted(storey(wall((4.0, 1.0), (0.0, 0.3))), above)
    assert [w.thickness for w in walls] == [pytest.approx(0.2), pytest.approx(0.1)]
    assert walls[1].start[1] == pytest.approx(0.25)
    assert len(parted(storey(wall((1.0, 4.0), (0.0, 0.34))), above)) == 1


def test_a_wall_round_the_corner_of_a_lined_one_is_lined_where_a_partition_is_flush() -> None:
    corner = replace(across(9.0, (0.1, 4.0), JoinShape(2, "start", "end", "L")), thickness=0.3)
    flush = replace(across(9.09, (4.1, 7.0)), thickness=0.12)
    walls = parted(storey(FURRED, LEFT, RIGHT, corner, flush))
    assert len(walls) == 6, "not joined to the lined wall itself"
    joined = replace(corner, joins=(JoinShape(0, "start", "end", "L"),), start=(5.0, 0.15), end=(5.0, 4.0))
    beside = replace(flush, start=(5.09, 4.1), end=(5.09, 7.0))
    walls = parted(storey(FURRED, LEFT, RIGHT, joined, beside))
    assert walls[3].thickness == pytest.approx(0.2)
    assert walls[3].start == pytest.approx((4.95, 0.1))
    assert walls[-1].start[0] == pytest.approx(5.1)
