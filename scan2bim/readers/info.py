"""What is in the scans: points, bounds, density, colour, stations, unit, and what a conversion may take."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from scan2bim.cloud.scan import F64, Chunk, ScanHeader
from scan2bim.errors import InputError
from scan2bim.readers import find_inputs, one_a_kind, read_headers, sample_points
from scan2bim.readers.formats import detect
from scan2bim.readers.points import START_SPREAD

SAMPLE = 20_000
"""Points looked at per scan: enough for a density within some ten per cent, read in some milliseconds."""
CELL = 0.25
"""Metres. Surfaces are measured in cubes of this edge: larger than the spacing of points, smaller than a room."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What a conversion may take: seconds, bytes of memory at the peak, bytes of disk in the work folder. Rough."""

    seconds: float
    memory: float
    disk: float


@dataclass(frozen=True, slots=True)
class ScanReport:
    """One scan. Bounds are in the file's common frame and unit; ``bounds_sampled`` where the file does not state them.

    density: points per square metre of surface, estimated. position: of the scanner in the common frame, None where
    unknown. stations: point source ids of a file that merges several. unit: metres per file unit where stated.
    """

    file: str
    index: int
    name: str
    format: str
    points: int
    lower: tuple[float, ...] | None
    upper: tuple[float, ...] | None
    bounds_sampled: bool
    density: float | None
    colour: bool
    intensity: bool
    position: tuple[float, ...] | None
    stations: int
    columns: int | None
    rows: int | None
    unit: float | None
    crs: str | None
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class InputReport:
    """All scans, their sums, and the problems of the files that cannot be read."""

    scans: tuple[ScanReport, ...]
    problems: tuple[str, ...]
    files: int
    points: int
    lower: tuple[float, ...] | None
    upper: tuple[float, ...] | None
    positions: int
    unit: str | None
    up: str | None
    crs: str | None
    cost: Cost | None


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Headers of all readable scans with a sample of each, and the problems of the other files."""

    headers: tuple[ScanHeader, ...]
    samples: tuple[Chunk, ...]
    problems: tuple[str, ...]


def survey(paths: Sequence[Path | str], count: int = SAMPLE) -> Survey:
    """Look into all files. Raises InputError where none can be read."""
    headers: list[ScanHeader] = []
    samples: list[Chunk] = []
    problems: list[InputError] = []
    for path in find_inputs(paths):
        try:
            found = read_headers(path)
            looks = [sample_points(header, count) for header in found]
        except InputError as error:
            problems.append(error)
            continue
        headers.extend(found)
        samples.extend(looks)
    if problems and not headers:
        raise problems[0]
    return Survey(tuple(headers), tuple(samples), tuple(str(problem) for problem in one_a_kind(problems)))


def describe(
    paths: Sequence[Path | str] | Survey,
    unit: str | None = None,
    up: str | None = None,
    metres: float | None = None,
    cost: Cost | None = None,
) -> InputReport:
    """What is in the files. ``unit``, ``up`` and ``metres`` (per file unit) as found elsewhere, else as the files say.

    ``cost`` is what a conversion may take, where it is known. Raises InputError where no file can be read.
    """
    found = paths if isinstance(paths, Survey) else survey(paths)
    scans = [_scan(header, sample, metres) for header, sample in zip(found.headers, found.samples, strict=True)]
    lower = [scan.lower for scan in scans if scan.lower]
    upper = [scan.upper for scan in scans if scan.upper]
    return InputReport(
        tuple(scans),
        found.problems,
        len({scan.file for scan in scans}) + len(found.problems),
        sum(scan.points for scan in scans),
        _plain(np.min(lower, axis=0)) if lower else None,
        _plain(np.max(upper, axis=0)) if upper else None,
        sum(scan.position is not None for scan in scans),
        unit,
        up,
        next((scan.crs for scan in scans if scan.crs), None),
        cost,
    )


def _scan(header: ScanHeader, sample: Chunk, metres: float | None) -> ScanReport:
    common = common_frame(header, sample)
    form, _ = detect(header.path)
    stated = header.lower is not None and header.upper is not None
    lower, upper = header.lower, header.upper
    if not stated and len(common):
        lower, upper = common.min(axis=0), common.max(axis=0)
    represented = min(header.points, START_SPREAD * SAMPLE) if form == "E57" else header.points
    return ScanReport(
        str(header.path),
        header.index,
        header.name,
        form,
        header.points,
        None if lower is None else _plain(lower),
        None if upper is None else _plain(upper),
        not stated,
        surface_density(common * (metres or header.unit or 1.0), represented),
        header.has_colour,
        header.has_intensity,
        None if header.pose is None else _plain(header.pose.translation),
        len(header.sources),
        header.columns,
        header.rows,
        header.unit,
        header.crs,
        header.notes,
    )


def common_frame(header: ScanHeader, chunk: Chunk) -> F64:
    """Points (n, 3) of a chunk in the file's common frame and unit."""
    points = header.origin + chunk.xyz.astype(np.float64)
    return points if header.pose is None else points @ header.pose.rotation.T + header.pose.translation


def surface_density(points: F64, represented: int) -> float | None:
    """Points per square metre: ``represented`` points over the surface that a sample (n, 3), in metres, lies on.

    The surface is the number of occupied cubes, with those that the sample missed by Chao's estimate from the cubes
    that were hit once and twice (Chao 1984).
    """
    if len(points) < 10:
        return None
    cells = np.floor((points - points.min(axis=0)) / CELL).astype(np.int64)
    _, hits = np.unique(cells, axis=0, return_counts=True)
    once, twice = int((hits == 1).sum()), int((hits == 2).sum())
    occupied = len(hits) + (once * (once - 1)) / (2 * (twice + 1))
    return represented / (occupied * CELL * CELL)


def _plain(values: F64) -> tuple[float, ...]:
    return tuple(round(float(value), 4) for value in values)


def as_json(report: InputReport) -> str:
    """The report as JSON, the same fields by the same names."""
    return json.dumps(asdict(report), indent=2, ensure_ascii=False, allow_nan=False)


def render(report: InputReport) -> str:
    """The report as a table for a person."""
    heads = ("scan", "points", "extent", "points/m2", "colour", "intensity", "station")
    rows = [heads, *(_row(scan) for scan in report.scans)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(heads))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines.insert(1, "  ".join("-" * width for width in widths))
    notes = [f"{scan.name}: {note}" for scan in report.scans for note in scan.notes]
    return "\n".join([*lines, "", *_summary(report), *notes, *(f"NOT READABLE {text}" for text in report.problems)])


def _row(scan: ScanReport) -> tuple[str, ...]:
    station = _numbers(scan.position) if scan.position else f"{scan.stations} by id" if scan.stations else "unknown"
    size = "unknown"
    if scan.lower and scan.upper:
        size = ("~ " if scan.bounds_sampled else "") + " x ".join(
            f"{high - low:.1f}" for low, high in zip(scan.lower, scan.upper, strict=True)
        )
    density = "unknown" if scan.density is None else f"~ {_rounded(scan.density):,}"
    return scan.name, f"{scan.points:,}", size, density, _yes(scan.colour), _yes(scan.intensity), station


def _summary(report: InputReport) -> list[str]:
    stations = sum(scan.stations for scan in report.scans)
    known = f"{report.positions} of {len(report.scans)} say where the scanner stood"
    if stations:
        known += f", {stations} stations are told apart by id"
    lines = [
        f"{_several(len(report.scans), 'scan')} in {_several(report.files, 'file')}, {report.points:,} points. "
        f"{known}.",
        f"Unit: {report.unit or 'not yet found'}. Up: {report.up or 'not yet found'}. "
        f"CRS: {report.crs or 'not stated'}.",
    ]
    if cost := report.cost:
        lines.append(
            f"A conversion takes about {_duration(cost.seconds)}, {cost.memory / 1e9:.1f} GB of memory and "
            f"{_gigabytes(cost.disk)} of disk."
        )
    if report.lower and report.upper:
        lines.insert(1, f"Bounds: {_numbers(report.lower)} to {_numbers(report.upper)} in the files' unit.")
    return lines


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.2f}" for value in values)


def _rounded(value: float) -> int:
    """Two significant digits."""
    digits = max(int(math.log10(max(value, 1.0))) - 1, 0)
    return int(round(value, -digits))


def _several(count: int, thing: str) -> str:
    return f"{count:,} {thing}" + ("" if count == 1 else "s")


def _yes(there: bool) -> str:
    return "yes" if there else "no"


def _gigabytes(count: float) -> str:
    """Bytes in words; small ones in megabytes."""
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{max(count / 1e6, 1):.0f} MB"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
