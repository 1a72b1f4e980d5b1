"""The conversion from scans to building model files: orders the stages and keeps their results, nothing more."""

from __future__ import annotations

import contextlib
import logging
import platform
import shutil
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim import __version__
from scan2bim.allocator import keep_chunks
from scan2bim.cloud.frame import SurveyFrame
from scan2bim.config import Settings, settings_toml
from scan2bim.errors import InputError
from scan2bim.estimate import choose_jobs, free_disk, memory_and_disk
from scan2bim.guard import guarded
from scan2bim.logs import RunLog
from scan2bim.numbacache import ensure_numba_cache
from scan2bim.planning import Request, StageRun, checked_inputs, earlier_model, kept_frame, planned
from scan2bim.progress import Progress, Reporter, several, size
from scan2bim.reading import read_all
from scan2bim.scan_points import local_points
from scan2bim.scan_voxels import labelled_voxels
from scan2bim.scans import Scan, ScanSet
from scan2bim.stages import (
    EXPORT,
    MODEL,
    OPENINGS,
    READ,
    STRUCTURE,
    SURFELS,
    SURVEY,
    Folders,
    Keys,
    ReadTask,
    Stage,
    later_keys,
    run_debug_images,
    run_model,
    run_openings,
    run_structure,
    run_surfels,
    run_survey,
    stages_from,
    survey_key,
)
from scan2bim.workfolder import WorkFolder, open_work

if TYPE_CHECKING:
    from scan2bim.exporters.registry import Written
    from scan2bim.model.elements import Building

_log = logging.getLogger(__name__)

DRAWING = "debug images"
Body = Callable[[Folders, Path, Settings, Progress], None]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What a conversion gave."""

    building: Building
    written: tuple[Written, ...]
    stages: tuple[StageRun, ...]
    scans: int
    points: int
    skipped: tuple[str, ...]


def convert(request: Request, reporter: Reporter) -> Outcome:
    """Convert scans to building files; what an earlier run with the same input and settings has done is kept.

    Raises UsageError, InputError, PrecheckError, StageError or ResourceError.
    """
    from scan2bim.exporters.registry import write_outputs

    keep_chunks()
    ensure_numba_cache(request.work / "numba")
    with RunLog() as log:
        scans = checked_inputs(request)
        earlier = earlier_model(request)
        tell_headers(scans, reporter)
        with open_work(request.work) as work:
            log.open(work.root / "log.txt")
            run = Run(request, reporter, work)
            run.begin(scans)
            scans, frame, keys, folders = run.measure(scans)
            building = named_as(run.recognise(scans, frame, keys, folders), earlier)
            with run.timed(EXPORT):
                points = partial(local_points, scans, frame)
                voxels = partial(labelled_voxels, folders)
                written = write_outputs(building, request.outputs, request.settings.export, points, voxels)
            run.tidy()
            return Outcome(building, written, tuple(run.done), len(scans.scans), scans.points, scans.skipped)


def named_as(building: Building, earlier: Building | None) -> Building:
    """The building with the identifiers of an earlier model, where there is one."""
    from scan2bim.model.kept_ids import with_ids_of

    return building if earlier is None else with_ids_of(building, earlier)


def tell_headers(scans: ScanSet, reporter: Reporter) -> None:
    """What was left out, and what the readers remark of the files."""
    for text in scans.skipped:
        reporter.warning(f"left out: {text}")
    for scan in scans.scans:
        for note in scan.header.notes:
            reporter.warning(f"{scan.header.path}: {note}")


class Run:
    """One run: gives each stage its kept result, or lets it make a new one."""

    def __init__(self, request: Request, reporter: Reporter, work: WorkFolder) -> None:
        self.request = request
        self.settings = request.settings
        self.reporter = reporter
        self.work = work
        self.jobs = 1
        self.done: list[StageRun] = []
        self._used: set[str] = set()

    def begin(self, scans: ScanSet) -> None:
        """Drop what is to run again, keep the settings beside the results, and tell what is to be done."""
        _log.info("scan2bim %s, Python %s, %s", __version__, platform.python_version(), platform.platform())
        _log.info("%d scans, %d points, settings %s", len(scans.scans), scans.points, self.settings.model_dump_json())
        if self.request.rerun_from is not None:
            for stage in stages_from(self.request.rerun_from):
                self.work.discard_stage(stage.name)
        with guarded("begin", self.work.root):
            (self.work.root / "config.toml").write_text(settings_toml(self.settings), encoding="utf-8")
        self.reporter.message(
            f"{several(len(scans.scans), 'scan')}, {several(scans.points, 'point')}; work folder {self.work.root}"
        )
        self.jobs = choose_jobs(self.request.jobs, scans)
        _, disk = memory_and_disk(scans, self.jobs)
        if disk > (free := free_disk(self.work.root)):
            text = f"{size(free)} are free, but the work may take {size(disk)}. --work DIR takes another disk."
            self.reporter.warning(f"{self.work.root}: {text}")
        self._replan(scans, None)

    def measure(self, scans: ScanSet) -> tuple[ScanSet, SurveyFrame, Keys, Folders]:
        """The scans, read and merged to surfels: their frame, the keys of what follows, and the results' folders."""
        scans, frame = self.survey(scans)
        scans, folders = self.read(scans, frame)
        keys = later_keys(self.settings, scans, self.request.name, frame)
        return scans, frame, keys, replace(folders, surfels=self.stage(SURFELS, keys, run_surfels, folders))

    def recognise(self, scans: ScanSet, frame: SurveyFrame, keys: Keys, folders: Folders) -> Building:
        """The building that the measured scans show."""
        folders = replace(folders, structure=self.stage(STRUCTURE, keys, run_structure, folders))
        folders = replace(folders, openings=self.stage(OPENINGS, keys, run_openings, folders))
        if self.request.debug_images is not None:
            with guarded(DRAWING, self.work.root), self.reporter.stage(DRAWING) as progress:
                run_debug_images(folders, self.request.debug_images, self.settings, progress)
        return self.model(scans, frame, keys, folders)

    def survey(self, scans: ScanSet) -> tuple[ScanSet, SurveyFrame]:
        """The frame of all scans; scans that cannot be sampled are left out, if that is allowed."""
        result = self.work.find(SURVEY.name, survey_key(self.settings, scans))
        if result is None:
            lost: dict[int, InputError] = {}
            with self.timed(SURVEY) as progress:
                frame = run_survey(scans, self.settings, progress, lambda i, error: self._lose(lost, i, error, scans))
                scans = scans.without(lost)
                text = frame.to_json()
                key = survey_key(self.settings, scans)
                result = self.work.make(SURVEY.name, key, lambda folder: _write(folder / "frame.json", text))
        else:
            self._kept(SURVEY)
        self._used.add(result.key)
        frame = SurveyFrame.from_json((result.folder / "frame.json").read_text(encoding="utf-8"))
        for note in frame.notes:
            self.reporter.message(note)
        self._replan(scans, frame)
        return scans, frame

    def read(self, scans: ScanSet, frame: SurveyFrame) -> tuple[ScanSet, Folders]:
        """The folder of each scan, those not read yet read now; unreadable scans are left out, if that is allowed."""
        keys = later_keys(self.settings, scans, self.request.name, frame).all_of(READ)
        found = {i: result.folder for i, key in enumerate(keys) if (result := self.work.find(READ.name, key))}
        todo = [i for i in range(len(keys)) if i not in found]
        lost: dict[int, InputError] = {}
        if todo:
            with self.timed(READ, kept=len(found), parts=len(todo)) as progress:
                tasks = [self._read_task(scans.scans[i], frame) for i in todo]
                for place, error in read_all(tasks, self.jobs, progress, self.work.root / "log.txt"):
                    i, folder = todo[place], tasks[place].folder
                    if error is None:
                        found[i] = self.work.keep(READ.name, keys[i], folder).folder
                    else:
                        shutil.rmtree(folder, ignore_errors=True)
                        self._lose(lost, i, error, scans)
                scans = scans.without(lost)
        else:
            self._kept(READ, len(found))
        self._used.update(keys)
        return scans, Folders([found[i] for i in sorted(found)])

    def _read_task(self, scan: Scan, frame: SurveyFrame) -> ReadTask:
        return ReadTask(scan, frame.to_json(), self.work.temporary(READ.name), self.settings)

    def stage(self, stage: Stage, keys: Keys, body: Body, folders: Folders) -> Path:
        """The folder of a stage with one result."""
        key = keys.of(stage)
        self._used.add(key)
        if result := self.work.find(stage.name, key):
            self._kept(stage)
            return result.folder
        with self.timed(stage) as progress:
            return self.work.make(stage.name, key, lambda folder: body(folders, folder, self.settings, progress)).folder

    def model(self, scans: ScanSet, frame: SurveyFrame, keys: Keys, folders: Folders) -> Building:
        """The building; always as read back from the work folder, so that a run that goes on gives the same files."""
        from scan2bim.model.io import dump_building, load_building

        key = keys.of(MODEL)
        self._used.add(key)
        result = self.work.find(MODEL.name, key)
        if result is None:
            with self.timed(MODEL):
                text = dump_building(run_model(self.request.name, scans, frame, folders))
                result = self.work.make(MODEL.name, key, lambda folder: _write(folder / "model.json", text))
        else:
            self._kept(MODEL)
        return load_building(result.folder / "model.json")

    def tidy(self) -> None:
        """Remove results of other inputs and settings: the work folder stays as small as one run needs."""
        removed = self.work.prune(self._used)
        _log.info("done; %d old results removed", removed)

    @contextlib.contextmanager
    def timed(self, stage: Stage, kept: int = 0, parts: int = 1) -> Generator[Progress]:
        """Around the work of a stage: progress, log, and errors that say what to do."""
        _log.info("%s begins", stage.name)
        wall, cpu = time.monotonic(), time.process_time()
        with guarded(stage.name, self.work.root), self.reporter.stage(stage.name) as progress:
            yield progress
        seconds = time.monotonic() - wall
        _log.info("%s done in %.2f s, %.2f s of CPU", stage.name, seconds, time.process_time() - cpu)
        self.done.append(StageRun(stage.name, parts, kept, seconds))

    def _kept(self, stage: Stage, parts: int = 1) -> None:
        _log.info("%s kept", stage.name)
        self.reporter.kept(stage.name)
        self.done.append(StageRun(stage.name, 0, parts, 0.0))

    def _lose(self, lost: dict[int, InputError], place: int, error: InputError, scans: ScanSet) -> None:
        """Leave a scan out, or stop where that was not asked for."""
        if not self.request.keep_going:
            raise _with_keep_going(error) if len(scans.scans) > 1 else error
        lost[place] = error
        self.reporter.warning(f"left out: {error}")

    def _replan(self, scans: ScanSet, frame: SurveyFrame | None) -> None:
        frame = frame or kept_frame(self.request, scans, self.work)
        stages = planned(self.request, scans, self.work, frame, self.jobs)
        self.reporter.plan({s.name: s.seconds for s in stages if s.made and not self._is_done(s.name)})

    def _is_done(self, name: str) -> bool:
        return any(run.name == name for run in self.done)


def _with_keep_going(error: InputError) -> InputError:
    return type(error)(error.path, error.problem, f"{error.advice} Or pass --keep-going to leave it out.".strip())


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
