"""Scenes scanned and taken the whole way in memory: ``from modelled import modelled``.

The stages' own functions are called, one after the other, as a conversion does; nothing of the scenes' truth goes in.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from synthetic import FINE, Scanned, scanned

from scan2bim.assemble import assemble_building
from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.ingest import ScanSummary, ingest_scan
from scan2bim.cloud.panorama import Panorama
from scan2bim.cloud.scan import Chunk, Pose, ScanHeader
from scan2bim.cloud.scene import Scene as ScannedScene
from scan2bim.cloud.scene import load_scene
from scan2bim.cloud.surfels import make_surfels
from scan2bim.config import FrameSettings, OpeningSettings, ReadSettings, StructureSettings, SurfelSettings
from scan2bim.coverage.measure import with_coverage
from scan2bim.model.elements import Building
from scan2bim.openings.build import find_openings
from scan2bim.openings.shapes import OpeningShape, load_openings
from scan2bim.simulate.scanner import ScannerSpec, Sweep
from scan2bim.simulate.scene import Scene
from scan2bim.structure.build import find_structure
from scan2bim.structure.frame import find_frame
from scan2bim.structure.orientation import find_lattice
from scan2bim.structure.shapes import StructureShape, WallShape

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A scan as a reader gives it, in one chunk."""

    header: ScanHeader
    chunk: Chunk


@dataclass(frozen=True, slots=True, eq=False)
class Modelled:
    """What the stages found. ``shift`` (3,) local coordinates are scan coordinates less it."""

    frame: SurveyFrame
    summaries: tuple[ScanSummary, ...]
    cloud: ScannedScene
    structure: StructureShape
    openings: tuple[OpeningShape, ...]
    building: Building

    @property
    def shift(self) -> F64:
        return np.array(self.frame.shift)

    @property
    def walls(self) -> tuple[WallShape, ...]:
        """Of all storeys, lowest first."""
        return tuple(wall for storey in self.structure.storeys for wall in storey.walls)

    @property
    def spaces(self) -> list[Polygon]:
        """Of all storeys, lowest first."""
        return [space.polygon for storey in self.structure.storeys for space in storey.spaces]


def scan_of(sweep: Sweep) -> Scan:
    """A sweep as an E57 reader gives it: in the scanner's frame, with its pose and its misses."""
    header = ScanHeader(
        Path(f"{sweep.name}.e57"), 0, sweep.name, len(sweep.xyz) + len(sweep.miss_directions), np.zeros(3),
        Pose(sweep.rotation, sweep.translation), has_colour=True, columns=int(sweep.column.max()) + 1,
    )  # fmt: skip
    misses = sweep.miss_directions.astype(np.float32)
    return Scan(header, Chunk(sweep.xyz, sweep.rgb, sweep.intensity, None, misses))


def merged_scan(points: F64, rgb: NDArray[np.uint8] | None = None, name: str = "merged.laz") -> Scan:
    """Points (n, 3) in scan coordinates as a reader gives a merged cloud: without pose."""
    header = ScanHeader(Path(name), 0, Path(name).stem, len(points), points[0].copy(), has_colour=rgb is not None)
    return Scan(header, Chunk(points - points[0], rgb))


def model_of(scans: Sequence[Scan], settings: FrameSettings | None = None) -> Modelled:
    """Take scans the whole way. Their order gives the station numbers."""
    headers = [scan.header for scan in scans]
    frame = find_frame(headers, [_sample(scan.chunk) for scan in scans], settings or FrameSettings())
    with TemporaryDirectory() as name:
        folder = Path(name)
        parts = [folder / f"scan{i}" for i in range(len(scans))]
        for i, (scan, part) in enumerate(zip(scans, parts, strict=True)):
            part.mkdir()
            ingest_scan(scan.header, iter([scan.chunk]), i, frame, part, ReadSettings(), _silent)
        make_surfels(parts, folder, SurfelSettings(), _silent, find_lattice(parts))
        find_structure(folder, parts, folder, StructureSettings(), _silent)
        find_openings(folder, folder, parts, folder, OpeningSettings(), _silent)
        cloud = load_scene(folder, parts)
        kept = {number: Panorama(p.position, p.ranges) for number, p in cloud.panoramas.items()}
        cloud = dataclasses.replace(cloud, panoramas=kept)  # the files go
        building = assemble_building("test", headers, frame, folder, folder, parts)
        return Modelled(
            frame,
            tuple(ScanSummary.load(part) for part in parts),
            cloud,
            StructureShape.load(folder / "structure.json"),
            load_openings(folder / "openings.json"),
            with_coverage(building, cloud, parts),
        )


@cache
def modelled(scene: Scene, spec: ScannerSpec = FINE, seed: int = 0) -> Modelled:
    """The scene scanned from all its stations and taken the whole way; kept, since several tests look at the same."""
    return model_of([scan_of(sweep) for sweep in scanned(scene, spec, seed).sweeps])


def _sample(chunk: Chunk) -> Chunk:
    """As the survey samples: every so many points of the whole scan."""
    return dataclasses.replace(chunk, xyz=chunk.xyz[:: max(1, len(chunk.xyz) // 20_000)], rgb=None, intensity=None)


def _silent(fraction: float) -> None:
    assert 0.0 <= fraction <= 1.0


def overlap(a: Polygon, b: Polygon) -> float:
    """Intersection over union of two areas."""
    return float(a.intersection(b).area / a.union(b).area)


def true_spaces(result: Scanned, shift: F64 | None = None) -> dict[str, Polygon]:
    """The rooms by name, in the local frame with this shift."""
    off = np.zeros(2) if shift is None else shift[:2]
    return {
        s.name: Polygon(np.array(s.outline) - off, [np.array(h) - off for h in s.holes]) for s in result.truth.spaces
    }


def rectangle_of(opening: OpeningShape, model: Modelled) -> F64:
    """Lower start, lower end, upper end, upper start corner in scan coordinates (4, 3)."""
    wall = model.structure.storeys[opening.storey].walls[opening.wall]
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    low, high = wall.base + opening.sill, wall.base + opening.sill + opening.height
    near, far = start + along * opening.offset, start + along * (opening.offset + opening.width)
    return np.array([[*near, low], [*far, low], [*far, high], [*near, high]]) + model.shift


def rectangle_overlap(true: F64, found: F64, across: float = 0.1) -> float:
    """Intersection over union of two upright rectangles (4, 3), seen squarely on the first; 0 if further apart."""
    along = (true[1] - true[0]) / np.linalg.norm(true[1] - true[0])
    offset = found - true[0]
    if np.abs(offset[:, :2] @ np.array([-along[1], along[0]])).max() > across:
        return 0.0
    flat = [np.column_stack([(r - true[0]) @ along, r[:, 2]]) for r in (true, found)]
    a, b = (shapely.box(*r.min(0), *r.max(0)) for r in flat)
    return float(a.intersection(b).area / a.union(b).area)
