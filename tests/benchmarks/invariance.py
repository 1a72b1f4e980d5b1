"""Convert scenes as they are, turned, moved, thinned, in another order and merged, and compare the walls.

    ./run invariance [--scenes DIR] [--only NAME] [--kept]

DIR holds a folder for each scene with its scans in e57/. The changed scans are made in out/invariance, one at a time,
and removed. With --only nothing is written to docs: the table goes to the terminal, and is kept. With --kept nothing is
converted: the section is written from what was kept of each scene.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pye57
import shapely
from bench import SCENES
from conversion import convert, warm_up
from document import ROOT, table, write_section
from laspy import LasData, LasHeader
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from scan2bim.model.elements import Building
from scan2bim.model.io import load_building

F64 = NDArray[np.float64]
OUT = ROOT / "out" / "invariance"
SAME = 0.01
"""Metres within which ends, axes and thicknesses are the same."""
SAME_SPACE = 0.97
"""Overlap (intersection over union) from which on two spaces are the same."""
STEP = 0.05
"""Metres between the places on axes that are compared."""
YAW = math.radians(37.0)
OFFSET = np.array([412_345.6, 5_678_901.2, 123.4])
"""Metres: like UTM coordinates."""
REAL = ("cartesianX", "cartesianY", "cartesianZ", "intensity")
"""Fields that are no whole numbers."""
QUARTER = 4
SEED = 5
INTRODUCTION = f"""\
## The same building, scanned otherwise

`./run invariance` converts each scene as it is, then turned by {math.degrees(YAW):.0f} degrees, moved by UTM-like
offsets, with a random quarter of its points, with its stations in reverse order, and merged into one file without
stations. All models are brought back into the frame of the first. *same*: walls with both ends and the thickness within
10 mm; *length*: share of the axes' length, of the model that has less, within 10 mm of an axis of the other of the same
thickness; *spaces same*: with an overlap of at least {SAME_SPACE}.

Turned, moved and reordered scans tell the same, so that what differs there is the method's fault. A quarter of the
points tells less of what few rays met, and a merged cloud neither from which side a wall was seen nor what was looked
through: glass fronts, window fronts and leaves before walls are told from that."""


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """A scan's raw records by field, and its pose (3, 3), (3,)."""

    name: str
    records: dict[str, F64]
    rotation: F64
    translation: F64

    def hits(self) -> NDArray[np.bool_]:
        """Which records (n,) are points and no misses."""
        return self.records.get("cartesianInvalidState", np.zeros(len(self.records["cartesianX"]))) == 0

    def world(self) -> F64:
        """Points (k, 3) in scan coordinates."""
        points = np.column_stack([self.records[f"cartesian{axis}"] for axis in "XYZ"])[self.hits()]
        return points @ self.rotation.T + self.translation


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Walls of a model in scan coordinates: ends (n, 2, 2), thickness and base (n,); outlines of its spaces with the
    heights of their floors.
    """

    ends: F64
    thickness: F64
    base: F64
    spaces: tuple[tuple[shapely.Polygon, float], ...]


@dataclass(frozen=True, slots=True)
class Agreement:
    """Of two models: walls of each, how many are the same, the length that is; spaces of each, how many are."""

    walls: tuple[int, int]
    same: int
    length: float
    spaces: tuple[int, int]
    same_spaces: int


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """How scans are changed: what writes them to a folder, and the turn (radians) and shift of the whole building."""

    name: str
    write: Callable[[Iterable[Station], Path], None]
    yaw: float = 0.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a conversion failed."""
    options = parse(arguments)
    scenes = [p for p in sorted(options.scenes.iterdir()) if (p / "e57").is_dir() and options.only in (None, p.name)]
    if not scenes:
        print(
            f"No scenes in {options.scenes}: expected NAME/e57/*.e57. Name their folder with --scenes.", file=sys.stderr
        )
        return 2
    warm_up()
    rows: list[list[str]] = []
    for scene in scenes:
        kept = OUT / f"{scene.name}_rows.json"
        if not options.kept:
            OUT.mkdir(parents=True, exist_ok=True)
            kept.write_text(json.dumps(_rows(scene)), encoding="utf-8")
        if not kept.exists():
            print(f"{kept} is missing. Make it: ./run invariance --only {scene.name}", file=sys.stderr)
            return 2
        rows += json.loads(kept.read_text(encoding="utf-8"))
    failed = sum("–" in row for row in rows)
    rows.append(["aim", "", "", "", "all", "1.00", "", "", "all"])
    head = ["scene", "change", "walls", "then", "same", "length", "spaces", "then", "same"]
    text = f"{INTRODUCTION}\n\n{table(head, rows)}"
    if options.only is None:
        write_section("invariance", text)
    print(text)
    return int(failed > 0)


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=Path, default=SCENES, help="where the scenes lie (default out/bench)")
    parser.add_argument("--only", help="just the scene of this name")
    parser.add_argument("--kept", action="store_true", help="convert nothing; write what was kept of each scene")
    return parser.parse_args(arguments)


def _rows(scene: Path) -> list[list[str]]:
    files = sorted((scene / "e57").glob("*.e57"))
    base = _plan_of(f"{scene.name}_base", scene / "e57")
    rows: list[list[str]] = []
    for variant in VARIANTS:
        folder = OUT / f"{scene.name}_scans"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        variant.write((station_of(path) for path in files), folder)
        other = _plan_of(f"{scene.name}_changed", folder)
        shutil.rmtree(folder)
        if base is None or other is None:
            rows.append([scene.name, variant.name, *["–"] * 7])
            continue
        a = agreement(base, brought_back(other, variant.yaw, np.array(variant.shift)))
        counts = [str(a.walls[0]), str(a.walls[1]), str(a.same), f"{a.length:.2f}"]
        rows.append([scene.name, variant.name, *counts, str(a.spaces[0]), str(a.spaces[1]), str(a.same_spaces)])
        print(" | ".join(rows[-1]), file=sys.stderr, flush=True)
    return rows


def _plan_of(name: str, scans: Path) -> Plan | None:
    done = convert(name, scans, OUT)
    shutil.rmtree(done.work, ignore_errors=True)
    if done.cost.code != 0:
        print(f"{name}: exit {done.cost.code} {done.complaint}", file=sys.stderr, flush=True)
        return None
    return plan_of(load_building(done.model))


def plan_of(building: Building) -> Plan:
    """The walls and spaces of a model in scan coordinates."""
    shift = np.array(building.frame.shift)
    walls = [wall for storey in building.storeys for wall in storey.walls]
    spaces = [space for storey in building.storeys for space in storey.spaces]
    return Plan(
        np.array([(w.start, w.end) for w in walls]).reshape(-1, 2, 2) + shift[:2],
        np.array([w.thickness.value for w in walls]),
        np.array([w.base for w in walls]) + shift[2],
        tuple((shapely.Polygon(np.array(s.outline) + shift[:2]), s.base + shift[2]) for s in spaces),
    )


def brought_back(plan: Plan, yaw: float, shift: F64) -> Plan:
    """The plan less a shift, then turned back about the origin."""
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, -s], [s, c]])

    def back(points: F64) -> F64:
        return (points - shift[:2]) @ turn

    spaces = tuple((shapely.transform(polygon, back), floor - shift[2]) for polygon, floor in plan.spaces)
    return Plan(back(plan.ends), plan.thickness, plan.base - shift[2], spaces)


def agreement(one: Plan, other: Plan) -> Agreement:
    """How alike two models are."""
    off = np.minimum(
        np.abs(one.ends[:, None] - other.ends).max(axis=(2, 3)),
        np.abs(one.ends[:, None] - other.ends[:, ::-1]).max(axis=(2, 3)),
    )
    off = np.maximum(off, np.abs(one.thickness[:, None] - other.thickness))
    off = np.maximum(off, np.abs(one.base[:, None] - other.base))
    rows, columns = linear_sum_assignment(off > SAME)
    return Agreement(
        (len(one.ends), len(other.ends)),
        int((off[rows, columns] <= SAME).sum()),
        min(_length_met(one, other), _length_met(other, one)),
        (len(one.spaces), len(other.spaces)),
        _same_spaces(one, other),
    )


def _length_met(one: Plan, other: Plan) -> float:
    """Share of the length of one's axes within ``SAME`` of the other's, at the same height and as thick."""
    met = total = 0
    for (start, end), thickness, base in zip(one.ends, one.thickness, one.base, strict=True):
        alike = (np.abs(other.thickness - thickness) <= SAME) & (np.abs(other.base - base) <= SAME)
        line = shapely.LineString([start, end])
        points = shapely.line_interpolate_point(line, np.arange(STEP / 2, line.length, STEP))
        lines = shapely.multilinestrings(shapely.linestrings(other.ends[alike]))
        met += int((np.nan_to_num(shapely.distance(points, lines), nan=np.inf) <= SAME).sum())
        total += len(points)
    return met / max(total, 1)


def _same_spaces(one: Plan, other: Plan) -> int:
    met = 0
    for polygon, floor in one.spaces:
        near = [p for p, z in other.spaces if abs(z - floor) <= SAME]
        met += any(polygon.intersection(p).area >= SAME_SPACE * polygon.union(p).area for p in near)
    return met


def station_of(path: Path) -> Station:
    """The one scan of an E57 file."""
    file = pye57.E57(str(path))
    header = file.get_header(0)
    records = {key: np.asarray(values, np.float64) for key, values in file.read_scan_raw(0).items()}
    rotation = Rotation.from_quat(np.roll(header.rotation, -1)).as_matrix()
    station = Station(path.stem, records, rotation, np.asarray(header.translation))
    file.close()
    return station


def write_station(station: Station, path: Path) -> None:
    """Write a scan with its pose."""
    file = pye57.E57(str(path), mode="w")
    quaternion = np.roll(Rotation.from_matrix(station.rotation).as_quat(), 1)
    whole = [key for key in station.records if key not in REAL]
    records = station.records | {key: station.records[key].astype(int) for key in whole}
    file.write_scan_raw(records, name=station.name, rotation=quaternion, translation=station.translation)
    file.close()


def _turned(stations: Iterable[Station], folder: Path) -> None:
    turn = Rotation.from_euler("z", YAW).as_matrix()
    for s in stations:
        moved = Station(s.name, s.records, turn @ s.rotation, turn @ s.translation)
        write_station(moved, folder / f"{s.name}.e57")


def _moved(stations: Iterable[Station], folder: Path) -> None:
    for s in stations:
        write_station(Station(s.name, s.records, s.rotation, s.translation + OFFSET), folder / f"{s.name}.e57")


def _thinned(stations: Iterable[Station], folder: Path) -> None:
    random = np.random.default_rng(SEED)
    for s in stations:
        kept = np.sort(random.permutation(len(s.records["cartesianX"]))[::QUARTER])
        records = {key: values[kept] for key, values in s.records.items()}
        write_station(Station(s.name, records, s.rotation, s.translation), folder / f"{s.name}.e57")


def _reversed(stations: Iterable[Station], folder: Path) -> None:
    every = list(stations)
    for number, s in enumerate(reversed(every)):
        write_station(s, folder / f"scan_{number:03d}.e57")


def _merged(stations: Iterable[Station], folder: Path) -> None:
    every = list(stations)
    points = np.concatenate([s.world() for s in every])
    header = LasHeader(version="1.4", point_format=7)
    header.scales, header.offsets = np.full(3, 1e-4), np.floor(points.min(axis=0))
    las = LasData(header)
    las.x, las.y, las.z = points.T
    for name in ("red", "green", "blue"):
        values = np.concatenate([s.records[f"color{name.capitalize()}"][s.hits()] for s in every])
        las[name] = values.astype(np.uint16) * 257
    las.write(str(folder / "merged.las"))


VARIANTS: Sequence[Variant] = (
    Variant("turned", _turned, yaw=YAW),
    Variant("moved", _moved, shift=(float(OFFSET[0]), float(OFFSET[1]), float(OFFSET[2]))),
    Variant("a quarter", _thinned),
    Variant("reverse order", _reversed),
    Variant("merged", _merged),
)


if __name__ == "__main__":
    sys.exit(main())
