"""What is asked of a conversion, and what it would run: which results are there, what the rest may take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim.cloud.frame import SurveyFrame
from scan2bim.config import UNITS, Settings
from scan2bim.errors import PrecheckError
from scan2bim.estimate import Estimate, choose_jobs, free_disk, memory_and_disk, read_seconds, stage_seconds
from scan2bim.numbacache import ensure_numba_cache
from scan2bim.scans import Scan, ScanSet, gather
from scan2bim.stages import EXPORT, READ, STAGES, SURVEY, later_keys, stages_from, survey_key
from scan2bim.workfolder import WorkFolder

if TYPE_CHECKING:
    from scan2bim.model.elements import Building
    from scan2bim.readers.info import InputReport


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be converted, to what, and how."""

    inputs: tuple[Path, ...]
    outputs: tuple[Path, ...]
    work: Path
    name: str
    settings: Settings = field(default_factory=Settings)
    keep_going: bool = False
    rerun_from: str | None = None
    jobs: int | None = None
    debug_images: Path | None = None
    ids_from: Path | None = None


@dataclass(frozen=True, slots=True)
class StageRun:
    """A stage of this run: parts (scans in reading, else 1) that were made and that were kept from before, seconds."""

    name: str
    made: int
    kept: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run would do: the stages with parts to make, kept parts and expected seconds, and what it takes."""

    stages: tuple[StageRun, ...]
    scans: int
    points: int
    skipped: tuple[str, ...]
    needs: Estimate
    free_disk: float


def plan(request: Request) -> Plan:
    """What ``convert`` would run, and what it may take. Nothing is written.

    Raises what ``convert`` would raise before its work.
    """
    ensure_numba_cache()
    scans = checked_inputs(request)
    jobs = choose_jobs(request.jobs, scans)
    work = WorkFolder(request.work)
    stages = planned(request, scans, work, kept_frame(request, scans, work), jobs)
    memory, disk = memory_and_disk(scans, jobs)
    needs = Estimate(sum(stage.seconds for stage in stages), memory, disk)
    return Plan(stages, len(scans.scans), scans.points, scans.skipped, needs, free_disk(request.work))


def look(paths: Sequence[Path], settings: Settings) -> tuple[InputReport, tuple[str, ...]]:
    """What is in the files, with unit and up axis as a conversion would find them, and how those were found, in words.

    Raises InputError where no file can be read.
    """
    ensure_numba_cache()
    from scan2bim.readers.info import Cost, describe, survey
    from scan2bim.structure.frame import find_frame

    found = survey(paths)
    scans = ScanSet(tuple(Scan(header, i, "") for i, header in enumerate(found.headers)))
    jobs = choose_jobs(None, scans)
    seconds = SURVEY.seconds + read_seconds(scans.scans, jobs)
    seconds += sum(stage_seconds(stage, scans.points) for stage in STAGES[2:])
    cost = Cost(seconds, *memory_and_disk(scans, jobs))
    try:
        frame = find_frame(found.headers, found.samples, settings.frame)
    except PrecheckError as error:
        return describe(found, cost=cost), (str(error),)
    name = next((name for name, metres in UNITS.items() if abs(metres / frame.unit - 1) < 1e-9), f"{frame.unit:g} m")
    return describe(found, unit=name, up=frame.up, metres=frame.unit, cost=cost), frame.notes


def checked_inputs(request: Request) -> ScanSet:
    """All that can be refused is refused before any work begins."""
    from scan2bim.exporters.registry import check_targets

    if request.rerun_from is not None:
        stages_from(request.rerun_from)
    check_targets(request.outputs)
    earlier_model(request)
    return gather(request.inputs, request.keep_going)


def earlier_model(request: Request) -> Building | None:
    """The model that identifiers are to be kept from, if one was named. Raises InputError."""
    from scan2bim.model.io import load_building

    return None if request.ids_from is None else load_building(request.ids_from)


def kept_frame(request: Request, scans: ScanSet, work: WorkFolder) -> SurveyFrame | None:
    """The frame that an earlier run with the same scans and settings has found, None where there is none."""
    if request.rerun_from == SURVEY.name:
        return None
    result = work.find(SURVEY.name, survey_key(request.settings, scans))
    return SurveyFrame.from_json((result.folder / "frame.json").read_text(encoding="utf-8")) if result else None


def planned(
    request: Request, scans: ScanSet, work: WorkFolder, frame: SurveyFrame | None, jobs: int
) -> tuple[StageRun, ...]:
    """The stages with how many parts would be made and kept, and the expected seconds.

    Without a frame it is not known what of the rest is kept, so all counts as to be made.
    """
    again = {stage.name for stage in stages_from(request.rerun_from)} if request.rerun_from else set[str]()
    keys = later_keys(request.settings, scans, request.name, frame).by_stage if frame else {}
    found = _found(keys, work, again)
    stages = [StageRun(SURVEY.name, 0, 1, 0.0) if frame else StageRun(SURVEY.name, 1, 0, SURVEY.seconds)]
    todo = [scan for i, scan in enumerate(scans.scans) if not (frame and found[READ.name][i])]
    seconds = read_seconds(todo, min(jobs, len(todo))) if todo else 0.0
    stages.append(StageRun(READ.name, len(todo), len(scans.scans) - len(todo), seconds))
    for stage in STAGES[2:]:
        kept = bool(frame) and stage is not EXPORT and found[stage.name][0]
        seconds = 0.0 if kept else stage_seconds(stage, scans.points)
        stages.append(StageRun(stage.name, int(not kept), int(kept), seconds))
    return tuple(stages)


def _found(keys: Mapping[str, tuple[str, ...]], work: WorkFolder, again: set[str]) -> Mapping[str, list[bool]]:
    return {
        name: [name not in again and work.find(name, key) is not None for key in of_stage]
        for name, of_stage in keys.items()
    }
