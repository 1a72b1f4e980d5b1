"""The stages of a conversion: what each needs, which settings it uses, what it costs, and the call that does its work.

Raise a stage's ``version`` with every change of its code that changes its results: kept ones are then made again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import BaseModel

from scan2bim.config import Settings
from scan2bim.errors import InputError, UsageError
from scan2bim.progress import Progress
from scan2bim.scans import Scan, ScanSet
from scan2bim.workfolder import digest

if TYPE_CHECKING:
    from scan2bim.cloud.frame import SurveyFrame
    from scan2bim.model.elements import Building

SAMPLE_TOTAL = 100_000
SAMPLE_LEAST, SAMPLE_MOST = 1_000, 20_000
"""Points sampled for the frame: in all, and of one scan. Enough to see floors at 1 % of the extent, quick to read."""


@dataclass(frozen=True, slots=True)
class Stage:
    """An entry of the table.

    version: of its results. needs: stages whose results it takes. settings: the section that it uses. seconds and
    nanoseconds: its rough CPU cost, fixed and for each point of the input, for the progress bar and the estimates; what
    a point costs to read hangs on its format and stands in ``estimate``.
    """

    name: str
    version: int
    needs: tuple[str, ...]
    settings: Callable[[Settings], BaseModel | None]
    seconds: float
    nanoseconds: float


SURVEY = Stage("survey", 6, (), lambda s: s.frame, 0.2, 0)
READ = Stage("read", 7, ("survey",), lambda s: s.read, 0.5, 0)
SURFELS = Stage("surfels", 10, ("read",), lambda s: s.surfels, 0.1, 25)
STRUCTURE = Stage("structure", 80, ("surfels", "read"), lambda s: s.structure, 0.5, 80)
OPENINGS = Stage("openings", 76, ("structure", "surfels", "read"), lambda s: s.openings, 0.7, 150)
MODEL = Stage("model", 27, ("survey", "structure", "openings", "surfels", "read"), lambda s: None, 0.2, 20)
EXPORT = Stage("export", 4, ("model",), lambda s: None, 0.5, 25)

STAGES = (SURVEY, READ, SURFELS, STRUCTURE, OPENINGS, MODEL, EXPORT)


def stages_from(name: str) -> tuple[Stage, ...]:
    """The named stage and those after it. Raises UsageError for an unknown name."""
    names = [stage.name for stage in STAGES]
    if name not in names:
        raise UsageError(f"unknown stage {name!r}. Expected one of {', '.join(names)}.")
    return STAGES[names.index(name) :]


def survey_key(settings: Settings, scans: ScanSet) -> str:
    """Key of the survey's result."""
    return _key(SURVEY, settings, *(scan.identity for scan in scans.scans))


@dataclass(frozen=True, slots=True)
class Keys:
    """Keys of the results of all stages after the survey, by stage; reading has one for each scan."""

    by_stage: Mapping[str, tuple[str, ...]]

    def all_of(self, stage: Stage) -> tuple[str, ...]:
        """The keys of a stage."""
        return self.by_stage[stage.name]

    def of(self, stage: Stage) -> str:
        """The one key of a stage that has one."""
        return self.by_stage[stage.name][0]


def later_keys(settings: Settings, scans: ScanSet, name: str, frame: SurveyFrame) -> Keys:
    """Keys of what follows the survey.

    They hang on the survey's outcome and not on its key: one more scan, or a unit given that would have been found,
    leaves the other scans' results as they are, as long as the frame stays the same. Only the model carries its notes.
    """
    keys: dict[str, tuple[str, ...]] = {SURVEY.name: (digest(replace(frame, notes=()).to_json()),)}
    keys[READ.name] = tuple(
        _key(READ, settings, *keys[SURVEY.name], scan.identity, str(scan.station)) for scan in scans.scans
    )
    for stage in (SURFELS, STRUCTURE, OPENINGS, MODEL):
        extra = (name, *frame.notes, *scans.notes, *(str(s.header.path) for s in scans.scans)) if stage is MODEL else ()
        keys[stage.name] = (_key(stage, settings, *(key for need in stage.needs for key in keys[need]), *extra),)
    return Keys(keys)


def _key(stage: Stage, settings: Settings, *inputs: str) -> str:
    section = stage.settings(settings)
    return digest(stage.name, str(stage.version), "" if section is None else section.model_dump_json(), *inputs)


def run_survey(
    scans: ScanSet, settings: Settings, progress: Progress, lost: Callable[[int, InputError], None]
) -> SurveyFrame:
    """Sample every scan and find the frame. A scan that cannot be sampled goes to ``lost``, which may raise."""
    from scan2bim.readers import sample_points
    from scan2bim.structure.frame import find_frame

    count = min(max(SAMPLE_TOTAL // max(len(scans.scans), 1), SAMPLE_LEAST), SAMPLE_MOST)
    headers, samples = [], []
    for i, scan in enumerate(scans.scans):
        try:
            samples.append(sample_points(scan.header, count))
            headers.append(scan.header)
        except InputError as error:
            lost(i, error)
        progress((i + 1) / (len(scans.scans) + 1))
    return find_frame(headers, samples, settings.frame)


@dataclass(frozen=True, slots=True, eq=False)
class ReadTask:
    """Reading one scan: small enough to travel to another process."""

    scan: Scan
    frame: str
    folder: Path
    settings: Settings


def run_read(task: ReadTask, progress: Progress) -> None:
    """Read one scan into the task's folder, in this process."""
    from scan2bim.allocator import keep_chunks
    from scan2bim.cloud.frame import SurveyFrame
    from scan2bim.cloud.ingest import ingest_scan
    from scan2bim.numbaload import load_without_compiler
    from scan2bim.readers import read_chunks

    keep_chunks()
    load_without_compiler()
    header, frame = task.scan.header, SurveyFrame.from_json(task.frame)
    ingest_scan(header, read_chunks(header), task.scan.station, frame, task.folder, task.settings.read, progress)


@dataclass(frozen=True, slots=True)
class Folders:
    """Where the results of the stages lie, as far as they are done."""

    scans: Sequence[Path]
    surfels: Path = Path()
    structure: Path = Path()
    openings: Path = Path()


def run_surfels(folders: Folders, folder: Path, settings: Settings, progress: Progress) -> None:
    """Merge the scans' tiles to surfels, in voxels along the building's walls."""
    from scan2bim.cloud.surfels import make_surfels
    from scan2bim.structure.orientation import find_lattice

    make_surfels(folders.scans, folder, settings.surfels, progress, find_lattice(folders.scans))


def run_structure(folders: Folders, folder: Path, settings: Settings, progress: Progress) -> None:
    """Find storeys, faces, spaces, walls and slabs."""
    from scan2bim.structure.build import find_structure

    find_structure(folders.surfels, folders.scans, folder, settings.structure, progress)


def run_openings(folders: Folders, folder: Path, settings: Settings, progress: Progress) -> None:
    """Find doors, windows and passages in the walls."""
    from scan2bim.openings.build import find_openings

    find_openings(folders.structure, folders.surfels, folders.scans, folder, settings.openings, progress)


def run_debug_images(folders: Folders, pictures: Path, settings: Settings, progress: Progress) -> None:
    """Write pictures of how openings are found on each wall."""
    from scan2bim.openings.build import draw_openings

    draw_openings(folders.structure, folders.surfels, folders.scans, pictures, settings.openings, progress)


def run_model(name: str, scans: ScanSet, frame: SurveyFrame, folders: Folders) -> Building:
    """Assemble the building and note on it what was left out."""
    from scan2bim.assemble import assemble_building
    from scan2bim.coverage.measure import covered

    headers = [scan.header for scan in scans.scans]
    building = assemble_building(name, headers, frame, folders.structure, folders.openings, folders.scans)
    building = covered(building, folders.surfels, folders.scans)
    return building.model_copy(update={"notes": (*building.notes, *scans.notes)})
