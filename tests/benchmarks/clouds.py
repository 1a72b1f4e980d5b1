"""Real clouds without exact truth: what they are, and the rough truth that somebody saw in their slices."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conversion import Conversion
from document import ROOT

REAL = ROOT.parent / "shared" / "real"
SUFFIXES = (".laz", ".las", ".pcd", ".e57", ".ply")
LICENSED = {
    "hancock_offices": "GeospatialPython/hancock-point-cloud-city, MIT",
    "lobby": "visgl/loaders.gl, MIT",
    "velodyne_sweep": "PointCloudLibrary/data, BSD",
}
"""Clouds whose licence lets pictures of them be published, with their source."""
ONE_STOREY = {"recnUabphYLem9jen": 0, "recWUYvswnSG1P6Jt": 1}
"""Captures of a single storey of a building whose rough truth lists several: which one."""
KINDS = {
    "rooms": ("spaces",),
    "walls": ("walls",),
    "doors": ("doors_open", "doors_closed", "doors_unknown"),
    "windows": ("windows",),
    "openings": ("doors_open", "doors_closed", "doors_unknown", "passages"),
}
"""What a rough truth may count, by the counts of a conversion that it stands against."""
NEAR = 0.5
"""Metres between a listed place and an opening's middle: half a door, and 0.15 m for a place judged by eye."""


@dataclass(frozen=True, slots=True)
class Range:
    """How many there are, by eye: from ``least`` to ``most``."""

    least: int
    most: int

    def __str__(self) -> str:
        return str(self.least) if self.least == self.most else f"{self.least}–{self.most}"


@dataclass(frozen=True, slots=True)
class Listed:
    """Places of openings seen by eye, x and y in the file's frame, metres; ``what`` they are."""

    what: str
    places: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Rough:
    """What was counted by eye, by the names of ``KINDS`` and "storeys", and places of some openings."""

    counts: dict[str, Range]
    listed: tuple[Listed, ...]


@dataclass(frozen=True, slots=True, eq=False)
class CloudResult:
    """A converted cloud with what is known of it. found: of each list of the rough truth, how many were met."""

    conversion: Conversion
    rough: Rough
    found: tuple[tuple[Listed, int], ...]

    @property
    def name(self) -> str:
        """The cloud's name."""
        return self.conversion.name


def find_clouds(folders: list[Path], only: str | None) -> list[Path]:
    """The clouds of the folders, by name."""
    files = [path for folder in folders if folder.is_dir() for path in folder.iterdir() if path.suffix in SUFFIXES]
    return sorted((path for path in files if only in (None, path.stem)), key=lambda path: path.stem)


def rough_truth(cloud: Path, folders: list[Path]) -> Rough:
    """The rough truth of a cloud: NAME.truth.json, or the one that names the cloud's file, else an empty one."""
    for path in sorted(truth for folder in folders for truth in folder.glob("*.truth.json")):
        truth = json.loads(path.read_text(encoding="utf-8"))
        short = cloud.stem.rpartition("+")[2]
        if path.name == f"{cloud.stem}.truth.json" or short in str(truth.get("file", "")):
            return _rough(truth, ONE_STOREY.get(short))
    return Rough({}, ())


def _rough(truth: dict[str, Any], storey: int | None) -> Rough:
    storeys = truth.get("storeys")
    parts: list[dict[str, Any]] = [truth]
    counts: dict[str, Range] = {}
    if isinstance(storeys, list):
        chosen = [part for i, part in enumerate(storeys) if storey in (None, i)]
        parts += chosen
        counts["storeys"] = Range(len(chosen), len(chosen))
    elif isinstance(storeys, int):
        counts["storeys"] = Range(storeys, storeys)
    for kind in KINDS:
        ranges = [found for part in parts if (found := _range(part, kind))]
        if ranges:
            counts[kind] = Range(sum(r.least for r in ranges), sum(r.most for r in ranges))
    return Rough(counts, tuple(_lists(parts)))


def _range(part: dict[str, Any], kind: str) -> Range | None:
    for key in (f"{kind}_range", f"{kind[:-1]}_count_range", kind):
        value = part.get(key)
        if isinstance(value, list) and len(value) == 2 and all(isinstance(number, int) for number in value):
            return Range(value[0], value[1])
        if isinstance(value, int):
            return Range(value, value)
    return None


def _lists(parts: list[dict[str, Any]]) -> Iterator[Listed]:
    """Doors, openings and windows that are listed with their places, turned back into the file's frame."""
    for part in parts:
        turned = re.search(r"cos(\d+)", str(part.get("truth_frame", "")))
        angle = -math.radians(float(turned.group(1))) if turned else 0.0
        for key, what in (("doors", "doors"), ("certain_openings", "openings"), ("window_list", "windows")):
            entries = part.get(key)
            if isinstance(entries, list):
                yield Listed(what, tuple(_turn(*_place(entry), angle) for entry in entries))


def _place(entry: dict[str, float]) -> tuple[float, float]:
    return (entry["x"] if "x" in entry else (entry["x0"] + entry["x1"]) / 2), entry["y"]


def _turn(x: float, y: float, angle: float) -> tuple[float, float]:
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def judge_cloud(conversion: Conversion, rough: Rough) -> CloudResult:
    """How many of the listed openings the model has at their places."""
    if conversion.cost.code != 0:
        return CloudResult(conversion, rough, ())
    from scan2bim.model.io import load_building
    from scan2bim.model.queries import openings_of, point_on_wall

    building = load_building(conversion.model)
    shift = building.frame.shift
    middles: dict[str, list[tuple[float, float]]] = {"doors": [], "windows": [], "openings": []}
    for hosted in openings_of(building):
        opening = hosted.opening
        x, y, _ = point_on_wall(hosted.wall, opening.offset.value + opening.width.value / 2, 0.0, 0.0)
        kind = "windows" if opening.fill is not None and opening.fill.kind == "window" else "doors"
        middles[kind].append((x + shift[0], y + shift[1]))
    middles["openings"] = middles["doors"]
    return CloudResult(
        conversion, rough, tuple((one, places_met(one.places, middles[one.what])) for one in rough.listed)
    )


def places_met(places: tuple[tuple[float, float], ...], middles: list[tuple[float, float]]) -> int:
    """How many places have a middle near them, each middle counted once: the nearest pairs first."""
    pairs = sorted((math.dist(a, b), i, k) for i, a in enumerate(places) for k, b in enumerate(middles))
    used: tuple[set[int], set[int]] = (set(), set())
    for distance, i, k in pairs:
        if distance <= NEAR and i not in used[0] and k not in used[1]:
            used[0].add(i)
            used[1].add(k)
    return len(used[0])
