"""Which exporters there are, and the writing of their files: each appears whole or not at all."""

from __future__ import annotations

import errno
import inspect
import logging
import os
import re
import shutil
import unicodedata
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scan2bim.errors import ResourceError, Scan2BimError, StageError, UsageError
from scan2bim.exporters.parts import replace_parts

if TYPE_CHECKING:
    from scan2bim.config import ExportSettings
    from scan2bim.model.elements import Building
    from scan2bim.model.points import PointSource
    from scan2bim.model.voxels import VoxelSource

Export = Callable[["Building", Path, "_Extras"], tuple[str, ...]]

GROUP: Final = "scan2bim.exporters"
OWN_PACKAGE: Final = "scan2bim"
_FULL: Final = (errno.ENOSPC, errno.EDQUOT)
_MAX_STEM: Final = 100  # bytes of a file name, well below the 255 of common file systems
_NO_SPACE: Final = 16 * 1024  # bytes: a disk with less has just been filled
_MAX_REASON: Final = 300  # characters of a library's message that are passed on
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Written:
    """A file that was written: its path, its size in bytes with its parts, and what was left out, in words."""

    path: Path
    size: int
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Extras:
    """What an exporter gets besides the model if its function has a parameter of that name."""

    settings: ExportSettings
    points: PointSource | None
    voxels: VoxelSource | None


@dataclass(frozen=True, slots=True)
class _Job:
    path: Path
    export: Export


def known_suffixes() -> tuple[str, ...]:
    """The suffixes, each with its dot, that an installed exporter claims. Nothing is imported."""
    return tuple(f".{name}" for name in sorted(_entry_points()))


def suffix_of(path: Path) -> str:
    """The longest known suffix that the file's name ends in, as ``.view.png`` before ``.png``; "" for none."""
    name = path.name.lower()
    return max((s for s in known_suffixes() if name.endswith(s) and name != s), key=len, default="")


def check_targets(targets: Sequence[Path]) -> None:
    """Look, before the long work, whether all targets could be written. Nothing is made or changed.

    Raises UsageError for no target, an unknown suffix, an exporter that cannot be imported, a folder in a file's place,
    a file named twice, or a folder that cannot be made or written.
    """
    _plan_jobs(targets, "building")


def _plan_jobs(targets: Sequence[Path], stem: str) -> list[_Job]:
    if not targets:
        raise UsageError(f"No output was named. Expected -o with a folder or a file ending in {_known()}.")
    jobs = [job for target in targets for job in _jobs(target, stem)]
    paths = [job.path.absolute() for job in jobs]
    repeated = sorted({str(path) for path in paths if paths.count(path) > 1})
    if repeated:
        raise UsageError(f"The output {', '.join(repeated)} is named more than once. Name each file once.")
    for folder in sorted({path.parent for path in paths}):
        _check_folder(folder)
    return jobs


def write_outputs(
    building: Building,
    targets: Sequence[Path],
    settings: ExportSettings | None = None,
    points: PointSource | None = None,
    voxels: VoxelSource | None = None,
) -> tuple[Written, ...]:
    """Write the building to each target: a file with a known suffix, or a folder, which gets all formats.

    points: reads the scans once more, for the exporters that want them; voxels: labels the storeys' voxels, likewise.
    Files in a folder are named after the building. Each file is written in a hidden folder beside its place, flushed to
    disk and then moved there. When an exporter fails the other files are still written and a StageError names the
    failures; when the disk is full a ResourceError comes at once. Raises UsageError as check_targets does.
    """
    from scan2bim.config import ExportSettings

    extras = _Extras(settings or ExportSettings(), points, voxels)
    jobs = _plan_jobs(targets, safe_file_stem(building.name))
    written: list[Written] = []
    failures: list[str] = []
    for job in jobs:
        try:
            written.append(_write_whole(building, job, extras))
        except ResourceError:
            raise
        except Scan2BimError as error:
            failures.append(str(error))
    if failures:
        kept = ", ".join(str(item.path) for item in written) or "none"
        raise StageError(f"{' '.join(failures)} Files that were written and are whole: {kept}.")
    return tuple(written)


def safe_file_stem(name: str) -> str:
    """A file name without suffix for any display name: no separators, control or reserved characters, never empty."""
    plain = unicodedata.normalize("NFC", name)
    plain = re.sub(r'[\x00-\x1f\x7f<>:"/\\|?*]+', "_", plain).strip(" ._")
    return plain.encode()[:_MAX_STEM].decode(errors="ignore").strip(" ._") or "building"


@cache
def _entry_points() -> dict[str, metadata.EntryPoint]:
    """Entry point by suffix; where two packages claim one suffix, ours wins, then the first by package name.

    Looked up once a process: all installed packages are searched for them.
    """
    found: dict[str, metadata.EntryPoint] = {}
    points = list(metadata.entry_points(group=GROUP))
    if len({_suffix(point) for point in points}) < len(points):  # else not even the packages' names must be read
        points.sort(key=_precedence)
    for point in points:
        name = _suffix(point)
        if found.setdefault(name, point).value != point.value:
            _warn(f"{point.value} of package {_owner(point)} is not used: .{name} has an exporter already.")
    return found


def _suffix(point: metadata.EntryPoint) -> str:
    return point.name.lower().lstrip(".")


@cache
def _warn(text: str) -> None:
    """Say it once a process."""
    _log.warning("%s", text)


def _owner(point: metadata.EntryPoint) -> str:
    return point.dist.name if point.dist is not None else "?"


def _precedence(point: metadata.EntryPoint) -> tuple[bool, str, str]:
    return _owner(point) != OWN_PACKAGE, _owner(point), point.name


def _known() -> str:
    return ", ".join(known_suffixes()) or "(no exporter is installed: install scan2bim again with pip)"


def _load(point: metadata.EntryPoint) -> Export:
    """The entry point's export function. A third party's module may fail in any way: UsageError says how."""
    try:
        export = point.load().export
        wanted = [field.name for field in fields(_Extras) if field.name in inspect.signature(export).parameters]
    except Exception as error:
        reason = _shorten(f"{type(error).__name__}: {error}")
        raise UsageError(
            f"The exporter for .{point.name} ({point.value} of package {_owner(point)}) cannot be loaded ({reason}). "
            "Update or remove that package, or choose another format."
        ) from error
    return lambda building, path, extras: export(building, path, **{name: getattr(extras, name) for name in wanted})


def _is_folder(target: Path) -> bool:
    """Whether the target means a folder: it is one, or it has no suffix."""
    return not suffix_of(target) and (target.is_dir() or not target.suffix)


def _plan_paths(target: Path, stem: str) -> list[Path]:
    if _is_folder(target):
        return [target / f"{stem}.{name}" for name in sorted(_entry_points())]
    if not suffix_of(target):
        raise UsageError(
            f"{target}: the format {target.suffix!r} is not known. Expected a folder or a file ending in {_known()}."
        )
    if target.is_dir():
        raise UsageError(
            f"{target}: a folder of this name is there, where a file is to be written. Choose another name."
        )
    return [target]


def _jobs(target: Path, stem: str) -> list[_Job]:
    """What is to be written for a target.

    In a folder an exporter that cannot be loaded is left out with a warning, and one that is ``ONLY_BY_NAME`` without.
    """
    points = _entry_points()
    jobs: list[_Job] = []
    for path in _plan_paths(target, stem):
        try:
            point = points[suffix_of(path)[1:]]
            export = _load(point)
            if path == target or not getattr(point.load(), "ONLY_BY_NAME", False):
                jobs.append(_Job(path, export))
        except UsageError as error:
            if path == target:
                raise
            _warn(str(error))
    return jobs


def _check_folder(folder: Path) -> None:
    """See that the folder, or else the nearest one above it that is there, is a folder that can be written in."""
    there = next((path for path in (folder, *folder.parents) if path.exists()), folder)
    if not there.is_dir():
        raise UsageError(f"{there}: is a file, where a folder for the outputs is needed. Choose another place.")
    if not os.access(there, os.W_OK | os.X_OK):
        raise UsageError(f"{there}: cannot write in this folder. Choose another place or change its permissions.")


def _os_problem(error: OSError, what: str) -> Scan2BimError:
    reason = error.strerror or str(error)
    if error.errno in _FULL:
        return ResourceError(f"{what}: {reason}. Free some disk space or choose another place, then run again.")
    return UsageError(f"{what}: {reason}. Choose another place or change its permissions.")


def _write_whole(building: Building, job: _Job, extras: _Extras) -> Written:
    """Write one file, and the folders of its parts where it has some, beside its place, flush them, move them there."""
    try:
        job.path.parent.mkdir(parents=True, exist_ok=True)
        with _hidden_folder(job.path) as folder:
            draft = folder / job.path.name
            notes = _export_draft(building, job, draft, extras)
            files = [file for file in folder.rglob("*") if file.is_file()]
            for file in files:
                _flush(file)
            size = sum(file.stat().st_size for file in files)
            for part in sorted(folder.iterdir()):  # the named file last: it is there only with all that it needs
                if part != draft:
                    replace_parts(part, job.path.parent / part.name)
            draft.replace(job.path)
            _flush(job.path.parent)
    except OSError as error:
        raise _os_problem(error, f"{job.path}: cannot be written") from error
    return Written(job.path, size, notes)


def _export_draft(building: Building, job: _Job, draft: Path, extras: _Extras) -> tuple[str, ...]:
    """Run the exporter; whatever it raises becomes an error of ours, or an OSError that the caller words.

    The traceback of what nobody foresaw goes to the log.
    """
    try:
        return tuple(job.export(building, draft, extras))
    except MemoryError as error:
        raise ResourceError(f"{job.path}: memory ran out while writing. Close other programs and run again.") from error
    except Exception as error:
        if _free_bytes(draft.parent) < _NO_SPACE:  # libraries that write by themselves hide a full disk
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) from error
        if isinstance(error, Scan2BimError | OSError):
            raise
        _log.info("%s: the exporter failed", job.path, exc_info=error)
        reason = _shorten(str(error)) or "no reason given"
        raise StageError(f"{job.path}: the exporter failed ({type(error).__name__}: {reason}).") from error


def _shorten(text: str) -> str:
    """One line of a message of any length."""
    line = " ".join(text.split())
    return line if len(line) <= _MAX_REASON else f"{line[:_MAX_REASON]}..."


def _free_bytes(folder: Path) -> int:
    return shutil.disk_usage(folder).free


@contextmanager
def _hidden_folder(path: Path) -> Generator[Path]:
    """A folder beside ``path`` for the draft, so that the draft has its final name; gone afterwards.

    It carries the process's number: what a killed run left is removed by the next.
    """
    _sweep(path)
    folder = path.parent / f".{path.name}.{os.getpid()}.part"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _sweep(path: Path) -> None:
    for old in path.parent.iterdir():
        match = re.fullmatch(re.escape(f".{path.name}.") + r"(\d+)\.part", old.name)
        if match and not _is_running(int(match[1])):
            shutil.rmtree(old, ignore_errors=True)


def _is_running(process: int) -> bool:
    """Whether a process of this number runs. Where that cannot be asked harmlessly (Windows), True."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def _flush(path: Path) -> None:
    """Flush a file, or a folder's list of names, to disk. Folders cannot be opened for that on all systems."""
    if path.is_dir() and os.name != "posix":
        return
    handle = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)
