"""Where to scan next: from scans, which are converted as far as is needed, or from the work folder of a conversion."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim.allocator import keep_chunks
from scan2bim.errors import UsageError
from scan2bim.logs import RunLog
from scan2bim.numbacache import ensure_numba_cache
from scan2bim.pipeline import Run, tell_headers
from scan2bim.planning import Request
from scan2bim.progress import Reporter
from scan2bim.scans import gather
from scan2bim.stages import MODEL, READ, SURFELS, Folders, Stage
from scan2bim.workfolder import is_whole, open_work

if TYPE_CHECKING:
    from scan2bim.model.elements import Building
    from scan2bim.model.survey_plan import SurveyPlan

PLANNING = Stage("next scan", 1, ("model",), lambda s: None, 3.0, 20)
SUFFIXES = (".json", ".png", ".svg")


@dataclass(frozen=True, slots=True)
class SurveyRequest:
    """The conversion whose scans are looked at, how many proposals are wanted, and the files to write.

    kept: whether ``scans.work`` holds a conversion and no scans are read.
    """

    scans: Request
    count: int
    outputs: tuple[Path, ...]
    kept: bool


def is_work_folder(path: Path) -> bool:
    """Whether a folder is the work folder of a conversion."""
    return (path / "format.json").is_file() and (path / "stages").is_dir()


def plan_survey(request: SurveyRequest, reporter: Reporter) -> SurveyPlan:
    """Propose stations and write the outputs.

    Raises UsageError, InputError, PrecheckError, StageError or ResourceError.
    """
    keep_chunks()
    ensure_numba_cache(request.scans.work / "numba")
    from scan2bim.cloud.scene import load_scene
    from scan2bim.coverage.next_scan import plan_scans

    with RunLog() as log, open_work(request.scans.work) as work:
        log.open(work.root / "log.txt")
        run = Run(request.scans, reporter, work)
        if request.kept:
            building, folders = kept_results(work.root)
        else:
            scans = gather(request.scans.inputs, request.scans.keep_going)
            tell_headers(scans, reporter)
            run.begin(scans)
            scans, frame, keys, folders = run.measure(scans)
            building = run.recognise(scans, frame, keys, folders)
        with run.timed(PLANNING):
            plan = plan_scans(building, load_scene(folders.surfels, folders.scans), request.count)
            for path in request.outputs:
                _write(path, building, plan)
        if not request.kept:
            run.tidy()
        return plan


def kept_results(work: Path) -> tuple[Building, Folders]:
    """The building of a work folder, and the results that it was made from.

    Raises UsageError where they are not whole.
    """
    from scan2bim.model.io import load_building

    models, surfels, reads = (
        [p for p in sorted((work / "stages" / stage.name).glob("*")) if is_whole(p)] for stage in (MODEL, SURFELS, READ)
    )
    if len(models) != 1 or len(surfels) != 1 or not reads:
        raise UsageError(
            f"{work}: expected the results of one whole conversion, but there are {len(models)} models, {len(surfels)} "
            f"merged clouds and {len(reads)} scans. Give the scans themselves: what is kept is used."
        )
    building = load_building(models[0] / "model.json")
    numbered = sorted(reads, key=lambda p: int(json.loads((p / "summary.json").read_text(encoding="utf-8"))["station"]))
    return building, Folders(numbered, surfels=surfels[0])


def check_outputs(outputs: tuple[Path, ...]) -> None:
    """Raises UsageError for a file of another kind, or a place that cannot be written."""
    for path in outputs:
        if path.suffix.lower() not in SUFFIXES or path.is_dir():
            raise UsageError(f"{path}: expected a file ending in {', '.join(SUFFIXES)}.")


def _write(path: Path, building: Building, plan: SurveyPlan) -> None:
    """Write a file, whole or not at all. Raises UsageError where that cannot be."""
    from scan2bim.report.raster import encode_png, sheet_image
    from scan2bim.report.survey_sheet import survey_sheet
    from scan2bim.report.svg import sheet_svg

    match path.suffix.lower():
        case ".json":
            data = (plan.model_dump_json(indent=1) + "\n").encode()
        case ".svg":
            data = sheet_svg(survey_sheet(building, plan)).encode()
        case _:
            data = encode_png(sheet_image(survey_sheet(building, plan)))
    temporary = path.with_name(f".unfinished.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(data)
        temporary.replace(path)
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror}). Choose another place.") from error
    finally:
        temporary.unlink(missing_ok=True)
