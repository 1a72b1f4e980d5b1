"""A house with a round front and a curved partition, scanned virtually and modelled: arcs with doors and windows."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from scan2bim.check.run import check_file
from scan2bim.cli import main
from scan2bim.exporters.ifc import export
from scan2bim.geometry.arcs import Arc
from scan2bim.model.elements import Building, Dimension, Door, Join, Opening, Point2, Slab, Space, Storey, Wall, Window
from scan2bim.model.io import load_building

HEIGHT, FRONT, PART = 2.7, 0.5774, -0.25
OUTER = ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0))


def measured(value: float) -> Dimension:
    return Dimension(value=value, source="measured")


def opening(key: str, offset: float, sill: float, width: float, height: float, door: bool) -> Opening:
    kind = Door if door else Window
    return Opening(
        id=f"o{key}", name=key, confidence=1.0, offset=measured(offset), sill=measured(sill), width=measured(width),
        height=measured(height), fill=kind(id=f"f{key}", name=key, confidence=1.0),
    )  # fmt: skip


def wall(
    key: str, start: Point2, end: Point2, thickness: float, joins: tuple[tuple[str, str, str], ...], bulge: float = 0.0,
    openings: tuple[Opening, ...] = (),
) -> Wall:  # fmt: skip
    return Wall(
        id=key, name=key, confidence=1.0, start=start, end=end, thickness=measured(thickness), base=0.0,
        height=measured(HEIGHT), bulge=bulge, openings=openings,
        joins=tuple(
            Join.model_validate({"wall": w, "at": a, "other_at": o, "kind": "T" if o == "path" else "L"})
            for w, a, o in joins
        ),
    )  # fmt: skip


def beside(made: Wall, left: float) -> NDArray[np.float64]:
    """Corners (n, 2) of a line beside a curved wall that runs northwards."""
    arc = Arc(math.dist(made.start, made.end), made.bulge)
    flat = arc.place(np.linspace(0.0, arc.length, 60), np.full(60, left))
    return np.array(made.start) + np.column_stack([-flat[:, 1], flat[:, 0]])


def house() -> Building:
    """8 x 6 m to the axes, its east wall round, a partition of 12 cm curved, a door in that and two windows."""
    a, b, c, d = OUTER
    windows = opening("w1", 2.2, 0.9, 1.6, 1.3, False), opening("w2", 5.2, 0.9, 1.2, 1.3, False)
    walls = (
        wall("south", a, b, 0.3, (("east", "end", "start"), ("west", "start", "end"))),
        wall("east", b, c, 0.3, (("south", "start", "end"), ("north", "end", "start")), FRONT, windows),
        wall("north", c, d, 0.3, (("east", "start", "end"), ("west", "end", "start"))),
        wall("west", d, a, 0.3, (("north", "start", "end"), ("south", "end", "start"))),
        wall("part", (3.2, 0.0), (3.2, 6.0), 0.12, (("south", "start", "path"), ("north", "end", "path")), PART,
             (opening("d", 3.2, 0.0, 0.9, 2.05, True),)),
    )  # fmt: skip
    inside = shapely.box(0.15, 0.15, 20.0, 5.85)
    east = shapely.Polygon([*beside(walls[1], 0.15), (0.15, 6.0), (0.15, 0.0)]).intersection(inside)
    parts = (
        east.intersection(shapely.Polygon([*beside(walls[4], 0.06), (-1.0, 6.0), (-1.0, 0.0)])),
        east.intersection(shapely.Polygon([*beside(walls[4], -0.06), (20.0, 6.0), (20.0, 0.0)])),
    )
    spaces = tuple(
        Space(
            id=f"s{i}", name=f"s{i}", confidence=1.0, base=0.0, height=measured(HEIGHT), area=p.area,
            outline=tuple((float(x), float(y)) for x, y in shapely.get_coordinates(p)[:-1]), volume=p.area * HEIGHT,
        )
        for i, p in enumerate(shapely.orient_polygons(np.array(parts)))
    )  # fmt: skip
    plate = ((-1.0, -1.0), (13.0, -1.0), (13.0, 7.0), (-1.0, 7.0))
    slabs = tuple(
        Slab(id=k, name=k, confidence=1.0, outline=plate, top=measured(z), thickness=measured(0.2))
        for k, z in (("floor", 0.0), ("roof", HEIGHT + 0.2))
    )
    storey = Storey(id="1", name="1", elevation=measured(0.0), walls=walls, spaces=spaces, slabs=slabs)
    return Building(id="b", name="b", storeys=(storey,))


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Storey, Path]:
    folder = tmp_path_factory.mktemp("curved")
    export(house(), folder / "house.ifc")
    scans, out = folder / "scans", folder / "out.json"
    assert main(["simulate", str(folder / "house.ifc"), "-o", str(scans), "--resolution", "0.4", "--quiet"]) == 0
    arguments = [str(scans), "-o", str(out), "-o", str(folder / "out.ifc"), "--work", str(folder / "w"), "--quiet"]
    assert main(["convert", *arguments]) == 0
    (storey,) = load_building(out).storeys
    return storey, folder / "out.ifc"


def test_round_walls_are_single_arcs_with_their_thickness(found: tuple[Storey, Path]) -> None:
    storey, _ = found
    assert len(storey.walls) == 5
    front, part = sorted((w for w in storey.walls if w.bulge), key=lambda w: -w.thickness.value)
    assert abs(front.bulge) == pytest.approx(FRONT, abs=0.01)
    assert abs(part.bulge) == pytest.approx(-PART, abs=0.01)
    assert part.thickness.source == "measured"
    assert part.thickness.value == pytest.approx(0.12, abs=0.005)
    for made, true in ((front, OUTER[1:3]), (part, ((3.2, 0.0), (3.2, 6.0)))):
        ends = np.array(sorted((made.start, made.end), key=lambda p: p[1]))
        assert np.abs(ends - np.array(true)).max() < 0.03


def test_spaces_follow_the_round_walls(found: tuple[Storey, Path]) -> None:
    storey, _ = found
    true = [shapely.Polygon(s.outline) for s in house().storeys[0].spaces]
    for space in storey.spaces:
        own = shapely.Polygon(space.outline)
        assert max(own.intersection(t).area / own.union(t).area for t in true) > 0.985


def test_openings_lie_along_the_arcs(found: tuple[Storey, Path]) -> None:
    storey, _ = found
    front, part = sorted((w for w in storey.walls if w.bulge), key=lambda w: -w.thickness.value)
    (door,) = part.openings
    assert isinstance(door.fill, Door)
    assert door.width.value == pytest.approx(0.9, abs=0.06)
    length = Arc(6.0, PART).length
    middles = [door.offset.value + 0.45, length - door.offset.value - 0.45]
    assert min(abs(m - 3.65) for m in middles) < 0.06
    assert sorted(o.width.value for o in front.openings) == pytest.approx([1.2, 1.6], abs=0.1)


def test_the_file_is_sound(found: tuple[Storey, Path]) -> None:
    assert not check_file(found[1]).findings
