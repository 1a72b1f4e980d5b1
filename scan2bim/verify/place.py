"""Where the model lies in the scans' frame: the stated coordinates that fit, else an alignment, then the fit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.ingest import ScanSummary, load_panoramas
from scan2bim.cloud.surfels import Surfels
from scan2bim.errors import PrecheckError
from scan2bim.model.elements import Building, ScanResidual
from scan2bim.verify.agreement import Sights, some_panoramas
from scan2bim.verify.faces import Plane, coarse_faces
from scan2bim.verify.ifc_model import IfcModel, MapConversion
from scan2bim.verify.inputs import Inputs
from scan2bim.verify.placing import (
    PLAUSIBLE,
    Correction,
    Method,
    Placed,
    Sample,
    Target,
    best_fit,
    explained,
    make_target,
    sample_surfels,
    scan_corrections,
)
from scan2bim.verify.reach import within_reach
from scan2bim.verify.result import Placing, ScanPlacing

F64 = NDArray[np.float64]

OFF = 0.010
"""Metres that a scan's own fit must differ from the common one for the scan to count as misplaced: registration of
terrestrial scans is better than 5 mm."""
GAIN = 0.2
"""Share of a misplaced scan's surface that its own fit must bring onto the model; a wall that was built otherwise is
less."""
VOUCHED = 1 / 3
"""Of the shift of a scan against the model, up to which it may lie off the other scans for them to vouch for it: it is
the building then that was built otherwise there."""
ALIKE = 0.9
"""Of what the best placing explains, from which on another one may be the right one."""
OTHERS_FIT = 0.6
"""Share of the scans that must fit for the others to count as misplaced; otherwise it is the building that is off."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """matrix (4, 4) from the model's anchored axes to the scans' local frame; ignored (s,) bool stations whose points
    do not count; told: the same for the report; sample and target that it was found with.
    """

    matrix: F64
    ignored: NDArray[np.bool_]
    told: Placing
    sample: Sample
    target: Target

    def local(self, points: F64) -> F64:
        """Points (n, 3) of the anchored model in the local frame."""
        return points @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def to_model(self, anchor: F64) -> F64:
        """(4, 4) from the local frame to the model's own axes."""
        back: F64 = np.linalg.inv(self.matrix).astype(np.float64)
        back[:3, 3] += anchor
        return back


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A model's planes, less the ``anchor`` (3,), and which of its elements count (e,) when it is placed."""

    planes: Sequence[Plane]
    counts: NDArray[np.bool_]
    anchor: F64

    def target(self, near: NDArray[np.bool_] | None = None) -> Target:
        """What scans are fitted to: all that counts, or only elements that are ``near`` (e,)."""
        used = self.counts if near is None else self.counts & near
        return make_target(coarse_faces([plane for plane in self.planes if used[plane.element]]), used)

    def sights(self, scan_folders: Sequence[Path]) -> Sights:
        """What tells whether a placing is right."""
        planes = [plane for plane in self.planes if self.counts[plane.element]]
        panoramas = some_panoramas(list(load_panoramas(scan_folders).values()))
        return Sights(coarse_faces(planes), planes, self.counts, panoramas)


def place_model(
    inputs: Inputs,
    model: IfcModel,
    planes: Sequence[Plane],
    anchor: F64,
    stations: F64,
    summaries: Sequence[ScanSummary],
) -> Placement:
    """Find the placing. Raises PrecheckError where model and scans do not match."""
    drawn = Drawn(planes, np.array([e.role == "compared" for e in model.elements]), anchor)
    sample = sample_surfels(Surfels.load(inputs.surfel_folder), stations)
    shift = np.array(inputs.frame.shift)
    best, rival, target = _first(inputs, model, drawn, sample, stations, shift)
    correction = best_fit(target, sample, best.matrix)
    matrix = correction.matrix @ best.matrix if inputs.fitted or best.method == "automatic" else best.matrix
    scans, ignored = _scans(target, sample, matrix, summaries, _residuals(inputs.building), len(stations))
    full = matrix.copy()
    full[:3, 3] += shift - full[:3, :3] @ anchor
    told = Placing(
        method=best.method,
        matrix=_rows(full),
        explained=round(explained(target, sample, matrix)[0], 4),
        residual=round(correction.residual if math.isfinite(correction.residual) else 0.0, 5),
        fit_shift=_vector(correction.shift),
        fit_turn=round(correction.turn, 6),
        fitted=inputs.fitted or best.method == "automatic",
        rival=rival,
        scans=scans,
        notes=(
            *_notes(best, correction, inputs),
            *_rival_note(best, rival),
            *systems_note(model.conversion, inputs.frame.crs),
        ),
    )
    return Placement(matrix, ignored, told, sample, target)


def _first(
    inputs: Inputs, model: IfcModel, drawn: Drawn, sample: Sample, stations: F64, shift: F64
) -> tuple[Placed, float | None, Target]:
    """The first placing that explains enough of the scans, the share that the next best alignment explains, and what
    of the model the scans are fitted to.
    """
    tried: list[Placed] = []
    for method, full in _stated(inputs, model):
        matrix = full.copy()
        matrix[:3, 3] = full[:3, :3] @ drawn.anchor + full[:3, 3] - shift
        near = within_reach(drawn.planes, len(model.elements), matrix, inputs.scan_folders, stations)
        if not (near & drawn.counts).any():
            continue
        target = drawn.target(near)
        placed = Placed(method, matrix, *explained(target, sample, matrix))
        if placed.method == "given" or (placed.walls >= PLAUSIBLE and inputs.placing != "align"):
            return placed, None, target
        tried.append(placed)
    aligned = ""
    if inputs.placing != "stated":
        from scan2bim.verify.align import align

        target = drawn.target()
        found = align(target, sample, inputs.building, drawn.sights(inputs.scan_folders))
        if found.placed is not None:
            return found.placed, found.rival, target
        aligned = (
            f" Aligned to them, {100 * found.walls:.0f} % are, and of what the scanners should see of the model there "
            f"they saw {100 * found.agreement:.0f} %."
        )
    best = max((p.walls for p in tried), default=0.0)
    raise PrecheckError(
        f"{inputs.model}: the model is not that of the scanned building, or lies elsewhere: at most {100 * best:.0f} % "
        f"of the scanned walls are within 5 cm of it by its stated coordinates.{aligned} Check that model and scans "
        "are of the same building, or give the model's place with --transform."
    )


def _stated(inputs: Inputs, model: IfcModel) -> list[tuple[Method, F64]]:
    """Motions from the model's axes to the scans' coordinates that somebody has stated, (4, 4)."""
    if inputs.transform is not None:
        return [("given", np.array(inputs.transform, np.float64))]
    out: list[tuple[Method, F64]] = []
    if model.conversion is not None:
        out.append(("map", model.conversion.matrix()))
    return [*out, ("identity", np.eye(4))]


def _residuals(building: Building | None) -> dict[str, ScanResidual]:
    """How well the scans fit each other, by name."""
    scans = building.scans if building else ()
    return {scan.name: scan.residual for scan in scans if scan.residual is not None}


def is_vouched_for(shift: F64, residual: ScanResidual | None) -> bool:
    """Whether a scan that lies off the model by ``shift`` (3,) lies where the other scans say."""
    if residual is None:
        return False
    offset = [value for value in residual.offset if value is not None]
    known = np.array([value is not None for value in residual.offset])
    length = float(np.linalg.norm(shift))
    # What lies off along an axis that no shared surface bears is not vouched for.
    return bool(np.linalg.norm(shift[~known]) < length / 2 and np.linalg.norm(offset) < VOUCHED * length)


def _scans(
    target: Target,
    sample: Sample,
    matrix: F64,
    summaries: Sequence[ScanSummary],
    residuals: dict[str, ScanResidual],
    stations: int,
) -> tuple[tuple[ScanPlacing, ...], NDArray[np.bool_]]:
    """Each scan's own fit, and which stations lie off the model and the other scans while most do not."""
    names = {s.station: s.name for s in summaries if s.position is not None}
    own = {n: c for n, c in scan_corrections(target, sample, matrix).items() if n in names}
    off = {n for n, c in own.items() if float(np.linalg.norm(c.shift)) > OFF and c.gain > GAIN}
    off = {n for n in off if not is_vouched_for(own[n].shift, residuals.get(names[n]))}
    if len(own) < 3 or len(off) > (1 - OTHERS_FIT) * len(own):
        off = set[int]()
    ignored = np.zeros(stations, bool)
    ignored[sorted(off)] = True
    told = tuple(
        ScanPlacing(
            name=names[n],
            shift=_vector(c.shift),
            turn=round(c.turn, 6),
            residual=round(c.residual if math.isfinite(c.residual) else 0.0, 5),
            left_out=n in off,
        )
        for n, c in own.items()
    )
    return told, ignored


def _notes(best: Placed, correction: Correction, inputs: Inputs) -> tuple[str, ...]:
    length = 1000 * float(np.linalg.norm(correction.shift))
    degrees = math.degrees(abs(correction.turn))
    if best.method == "automatic":
        return ("The model states no coordinates that fit the scans: it was aligned to them.",)
    words = f"The scans lie {length:.1f} mm and {degrees:.3f} degrees off the model as it states its coordinates"
    return (f"{words}; {'this was taken out first.' if inputs.fitted else 'this is part of the deviations.'}",)


def _rival_note(best: Placed, rival: float | None) -> tuple[str, ...]:
    """That another place fits nearly as well, as in a row of houses that are alike."""
    if rival is None or rival < ALIKE * best.explained:
        return ()
    words = f"Another place in the model explains {100 * rival:.0f} % of the scanned surface, this one "
    return (f"{words}{100 * best.explained:.0f} %: check it on the plans, or give the model's place with --transform.",)


def systems_note(conversion: MapConversion | None, scans: str | None) -> tuple[str, ...]:
    """That model and scans state different coordinate reference systems, by their EPSG codes, if they do."""
    drawn = conversion.crs if conversion else None
    codes = [re.findall(r"EPSG\W*(\d{4,6})", name or "", re.IGNORECASE) for name in (drawn, scans)]
    if not all(codes) or set(codes[0]) & set(codes[1]):
        return ()
    words = f"The model states its coordinates in {drawn}, the scans theirs in {scans}: map coordinates of one are"
    return (f"{words} not those of the other.",)


def _rows(matrix: F64) -> tuple[tuple[float, float, float, float], ...]:
    return tuple((float(r[0]), float(r[1]), float(r[2]), float(r[3])) for r in matrix)


def _vector(values: F64) -> tuple[float, float, float]:
    return (round(float(values[0]), 5), round(float(values[1]), 5), round(float(values[2]), 5))
