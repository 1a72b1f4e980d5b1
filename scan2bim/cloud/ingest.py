"""The read stage for one scan: its points into tiles, what it saw into a panorama, its summary into a small file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba as nb
import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.panorama import Panorama, add_hits, add_misses, edge_for
from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.cloud.tiles import SAMPLE, TileWriter
from scan2bim.config import ReadSettings

PANORAMA = "panorama.npy"
"""Name of the file with a scan's panorama."""
SPARSE, ENOUGH = 8, 60_000
"""The sample of a scan holds one point in SPARSE, or more where those are fewer than ENOUGH."""
MOST_LAYERED = 0.3
"""Share of points that lie behind each other as seen from the scan's pose, above which the pose is not where they were
scanned from. Scans have a few percent (edges, panes), merged clouds more than half."""
MERGED = (
    "its points lie behind each other as seen from its pose, as in a merged cloud; the position is taken as unknown."
)
Progress = Callable[[float], None]
Number = TypeVar("Number", bound=np.number[Any])


@dataclass(frozen=True, slots=True)
class ScanSummary:
    """What the read stage found in a scan: points kept and dropped, local bounds, position of the scanner, None where
    unknown.

    ``station`` is the number of its first station. Where the file tells several by point source ids, ``sources`` are
    those, their stations follow in that order, and ``source_points`` are the points of each. ``notes`` are for people.
    """

    station: int
    name: str
    points: int
    dropped: int
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    position: tuple[float, float, float] | None
    has_colour: bool
    sources: tuple[int, ...] = ()
    source_points: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @staticmethod
    def load(folder: Path) -> ScanSummary:
        """Of the scan whose results lie in ``folder``."""
        return _summaries().validate_json((folder / "summary.json").read_bytes())


@cache
def _summaries() -> TypeAdapter[ScanSummary]:
    return TypeAdapter(ScanSummary)


def load_panoramas(scan_folders: Sequence[Path]) -> dict[int, Panorama]:
    """By station number, those of scans with a known position."""
    summaries = [(ScanSummary.load(folder), folder / PANORAMA) for folder in scan_folders]
    return {summary.station: Panorama.load(path) for summary, path in summaries if summary.position is not None}


def load_stations(scan_folders: Sequence[Path]) -> NDArray[np.float64]:
    """Positions (s, 3) by station number, nan where unknown."""
    return stations_of([ScanSummary.load(f) for f in scan_folders])


def stations_of(summaries: Sequence[ScanSummary]) -> NDArray[np.float64]:
    """Positions (s, 3) by station number, nan where unknown, of scans that were read."""
    last = max((s.station + len(s.sources) for s in summaries), default=0)
    stations = np.full((last + 1, 3), np.nan)
    for summary in summaries:
        if summary.position is not None:
            stations[summary.station] = summary.position
    return stations


def ingest_scan(
    header: ScanHeader,
    chunks: Iterator[Chunk],
    station: int,
    frame: SurveyFrame,
    folder: Path,
    settings: ReadSettings,
    progress: Progress,
) -> None:
    """Read one scan once, in chunks, into ``folder``: points.bin, runs.npy, the same of some points in a folder
    below, summary.json and, with a pose, panorama.npy.
    """
    matrix, offset = frame.of_scan(header)
    position = None if header.pose is None else frame.position_of(header)
    ranges = _empty_ranges(header, settings) if position is not None else None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    kept = dropped = layered = 0
    per_source = np.zeros(len(header.sources), np.int64)
    step = max(1, min(SPARSE, header.points // ENOUGH))
    (folder / SAMPLE).mkdir()
    with TileWriter(folder, header.path) as writer, TileWriter(folder / SAMPLE, header.path) as sample:
        for chunk in chunks:
            local, bounds = _transform(chunk.xyz, matrix, offset)
            dropped += chunk.dropped
            kept += len(local)
            if len(local):
                low, high = np.minimum(low, bounds[0]), np.maximum(high, bounds[1])
                order = source_order(chunk, header)
                per_source += np.bincount(order, minlength=len(per_source))[: len(per_source)]
                rgb, grey, stations = _colour(chunk), _grey(chunk), (order + station).astype(np.uint16)
                writer.add(local, rgb, grey, stations)
                sample.add(_some(local, step), _some(rgb, step), _some(grey, step), _some(stations, step))
                if ranges is not None and position is not None:
                    layered += add_hits(local, position.astype(np.float32), ranges)
            if ranges is not None and chunk.misses is not None:
                add_misses((chunk.misses @ matrix.T.astype(np.float32)).astype(np.float32), ranges)
            progress(min(1.0, (kept + dropped) / max(header.points, 1)))
    notes: tuple[str, ...] = ()
    if position is not None and layered > MOST_LAYERED * kept:
        notes = (f"{header.path.name}, {header.name}: {MERGED}",)
        position = None
    if ranges is not None and position is not None:
        Panorama(position, ranges).save(folder / PANORAMA)
    summary = ScanSummary(
        station,
        header.name,
        kept,
        dropped,
        _three(low),
        _three(high),
        None if position is None else _three(position),
        header.has_colour,
        header.sources,
        tuple(int(n) for n in per_source),
        notes,
    )
    (folder / "summary.json").write_bytes(_summaries().dump_json(summary))


def _three(values: NDArray[np.float64]) -> tuple[float, float, float]:
    finite = np.where(np.isfinite(values), values, 0.0)
    return (round(float(finite[0]), 6), round(float(finite[1]), 6), round(float(finite[2]), 6))


def _empty_ranges(header: ScanHeader, settings: ReadSettings) -> NDArray[np.float32]:
    step = 2 * np.pi / header.columns if header.columns else np.sqrt(4 * np.pi / max(header.points, 1))
    edge = edge_for(max(step, np.sqrt(2 * np.pi / max(header.points, 1))), settings.panorama_edge)
    return np.zeros((6, edge, edge), np.float32)


def _some(values: NDArray[Number], step: int) -> NDArray[Number]:
    """Every ``step``-th row."""
    return np.ascontiguousarray(values[::step])


def _colour(chunk: Chunk) -> NDArray[np.uint8]:
    if chunk.rgb is not None:
        return chunk.rgb
    return np.repeat(_grey(chunk)[:, None], 3, axis=1)


def _grey(chunk: Chunk) -> NDArray[np.uint8]:
    if chunk.intensity is None:
        return np.full(len(chunk.xyz), 128, np.uint8)
    return (np.clip(chunk.intensity, 0, 1) * np.float32(255)).astype(np.uint8)


def source_order(chunk: Chunk, header: ScanHeader) -> NDArray[np.int64]:
    """Which of the header's sources each point (n,) is of, by place; 0 where the file tells no sources or an unlisted
    one.
    """
    if chunk.source is None or not header.sources:
        return np.zeros(len(chunk.xyz), np.int64)
    known = np.array(header.sources)
    place = np.minimum(np.searchsorted(known, chunk.source), len(known) - 1)
    return np.where(known[place] == chunk.source, place, 0)


@nb.njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def _transform(xyz, matrix, offset):  # pyright: ignore
    """``matrix @ p + offset`` for each point, as (n, 3) float32, and the bounds (2, 3) of the result."""
    out = np.empty(xyz.shape, np.float32)
    bounds = np.empty((2, 3))
    bounds[0] = np.inf
    bounds[1] = -np.inf
    for k in range(3):
        a = matrix[k, 0]
        b = matrix[k, 1]
        c = matrix[k, 2]
        d = offset[k]
        low = np.float32(np.inf)
        high = np.float32(-np.inf)
        for i in range(np.uint64(xyz.shape[0])):
            value = np.float32(a * xyz[i, 0] + b * xyz[i, 1] + c * xyz[i, 2] + d)
            out[i, k] = value
            low = value if value < low else low
            high = value if value > high else high
        bounds[0, k] = low
        bounds[1, k] = high
    return out, bounds
