"""The verification of a model against scans: orders its steps after those of a conversion, nothing more."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim.allocator import keep_chunks
from scan2bim.errors import PrecheckError, StageError
from scan2bim.logs import RunLog
from scan2bim.numbacache import ensure_numba_cache
from scan2bim.pipeline import Run, tell_headers
from scan2bim.planning import Request, StageRun
from scan2bim.progress import Reporter
from scan2bim.scans import ScanSet, gather
from scan2bim.stages import Folders, Keys, Stage
from scan2bim.workfolder import open_work

if TYPE_CHECKING:
    from scan2bim.cloud.frame import SurveyFrame
    from scan2bim.model.elements import Building
    from scan2bim.verify.build import Found
    from scan2bim.verify.result import Report

VERIFY = Stage("verify", 13, ("read",), lambda s: s.verify, 3.0, 250)
REPORT = Stage("report", 4, ("verify",), lambda s: None, 2.0, 0)


@dataclass(frozen=True, slots=True)
class VerifyRequest:
    """What is to be verified: the model, the scans and work (``scans``), the report's folder.

    transform: rigid motion (rows of 4 x 4, metres) from the model's axes to the scans' coordinates, where it is given.
    placing: "auto" tries stated coordinates first and aligns where they do not fit; "stated" never aligns; "align"
    always does. fitted: whether the placing is refined to fit the scans best. extras: of classified,
    remainder and usd.
    """

    model: Path
    scans: Request
    folder: Path
    transform: tuple[tuple[float, ...], ...] | None = None
    placing: str = "auto"
    fitted: bool = True
    extras: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Verified:
    """What a verification gave."""

    report: Report
    written: tuple[Path, ...]
    stages: tuple[StageRun, ...]
    scans: int


def verify(request: VerifyRequest, reporter: Reporter) -> Verified:
    """Compare a model with scans and write the report's folder.

    Raises UsageError, InputError, PrecheckError, StageError or ResourceError.
    """
    from scan2bim.ifcfile import open_ifc

    keep_chunks()
    ensure_numba_cache(request.scans.work / "numba")
    with RunLog() as log:
        open_ifc(request.model)
        scans = gather(request.scans.inputs, request.scans.keep_going)
        tell_headers(scans, reporter)
        with open_work(request.scans.work) as work:
            log.open(work.root / "log.txt")
            run = Run(request.scans, reporter, work)
            run.begin(scans)
            scans, frame, keys, folders = run.measure(scans)
            building = _recognised(run, scans, frame, keys, folders)
            report, written = _verified(run, request, folders, frame, building)
            run.tidy()
            return Verified(report, written, tuple(run.done), len(scans.scans))


def _recognised(run: Run, scans: ScanSet, frame: SurveyFrame, keys: Keys, folders: Folders) -> Building | None:
    """The building of the scans; none where they do not make one, as a scan of one wall does not."""
    try:
        return run.recognise(scans, frame, keys, folders)
    except (PrecheckError, StageError) as error:
        run.reporter.warning(f"Doors, windows and rooms cannot be found in these scans, only surfaces: {error}")
        return None


def _verified(
    run: Run, request: VerifyRequest, folders: Folders, frame: SurveyFrame, building: Building | None
) -> tuple[Report, tuple[Path, ...]]:
    from scan2bim.verify.build import verify_model
    from scan2bim.verify.inputs import Inputs
    from scan2bim.verify.outputs import write_report

    with run.timed(VERIFY) as progress:
        inputs = Inputs(
            model=request.model,
            scan_folders=tuple(folders.scans),
            surfel_folder=folders.surfels,
            frame=frame,
            building=building,
            transform=request.transform,
            placing=request.placing,
            fitted=request.fitted,
        )
        found = verify_model(inputs, run.settings.verify, progress)
    with run.timed(REPORT):
        others = [("deviations.usdc", partial(_write_usd, found))] if "usd" in request.extras else []
        return found.report, write_report(found, request.folder, request.extras, others)


def _write_usd(found: Found, path: Path) -> None:
    """The model's surfaces coloured by deviation."""
    from scan2bim.exporters.usd_deviations import PaintedElement, write_deviations
    from scan2bim.verify.painted import paint

    elements = [
        PaintedElement(
            p.result.guid,
            p.result.ifc_class,
            p.result.name,
            p.result.storey,
            p.result.status,
            p.corners,
            p.quads,
            p.colours,
        )
        for p in paint(found)
    ]
    write_deviations(elements, path)
