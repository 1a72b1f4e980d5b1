"""The work folder: results of stages, kept by a hash of all that they depend on.

    WORK/format.json            version of this layout
    WORK/lock                   held (flock) by the run that uses the folder
    WORK/tmp/STAGE-xxxx/        results in the making; what a killed run left there is removed by the next one
    WORK/stages/STAGE/KEY/      whole results, each with a manifest.json

A result is made in ``tmp``, its manifest is written last, and then the folder is renamed to its place: what stands
under ``stages`` is whole, at whatever moment a run was killed. The manifest lists the size of each file, so that a
result that lost files or their ends later (a full disk, a power cut, a tidy hand) is noticed and made again.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import secrets
import shutil
import sys
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

from scan2bim.errors import ResourceError, UsageError

FORMAT = 1
MANIFEST = "manifest.json"
HASHED_WHOLE = 2**20
"""Files up to this size (bytes) are hashed whole: a thousandth of a second."""
END_BYTES = 2**17
"""Bytes hashed at the head and at the tail of a larger file, where formats keep their headers and tables."""
SPREAD_BLOCKS = 65
BLOCK_BYTES = 2**13
"""Blocks hashed in between, evenly spread: half a megabyte in all, whatever the size of the file."""


@dataclass(frozen=True, slots=True)
class Result:
    """A whole result of a stage. ``made`` is False where it was found in the work folder."""

    key: str
    folder: Path
    made: bool


def digest(*parts: str) -> str:
    """20 hex digits (80 bits) that change with any of the parts and with where one ends and the next begins."""
    whole = hashlib.blake2b(digest_size=10)
    for part in parts:
        data = part.encode()
        whole.update(len(data).to_bytes(8, "little"))
        whole.update(data)
    return whole.hexdigest()


def file_identity(path: Path) -> str:
    """Hash of a file's name, size and content.

    A survey of 20 GB would take 20 s of CPU, and on a hard disk minutes, to be hashed whole on every start. So files
    above 1 MB are hashed at head, tail and in 65 spread blocks, and as an edit in place could miss all of them, their
    time of change (nanoseconds) counts too. The price: a big file that is copied without its time, or touched, is read
    again.
    """
    stat = path.stat()
    content = hashlib.blake2b(digest_size=16)
    with path.open("rb") as file:
        if stat.st_size <= HASHED_WHOLE:
            while block := file.read(2**20):
                content.update(block)
            return digest(path.name, str(stat.st_size), content.hexdigest())
        content.update(file.read(END_BYTES))
        span = stat.st_size - 2 * END_BYTES - BLOCK_BYTES
        for i in range(SPREAD_BLOCKS):
            file.seek(END_BYTES + span * i // (SPREAD_BLOCKS - 1))
            content.update(file.read(BLOCK_BYTES))
        file.seek(-END_BYTES, os.SEEK_END)
        content.update(file.read(END_BYTES))
    return digest(path.name, str(stat.st_size), str(stat.st_mtime_ns), content.hexdigest())


class WorkFolder:
    """An open, locked work folder. Make one with ``open_work``."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.stages = root / "stages"
        self.tmp = root / "tmp"

    def place(self, stage: str, key: str) -> Path:
        """Where the result of a stage with this key stands or would stand."""
        return self.stages / stage / key

    def find(self, stage: str, key: str) -> Result | None:
        """The kept result, if it is there and whole."""
        folder = self.place(stage, key)
        return Result(key, folder, made=False) if is_whole(folder) else None

    def make(self, stage: str, key: str, body: Callable[[Path], None]) -> Result:
        """Let ``body`` write a result into an empty temporary folder and put it in its place once it is whole."""
        temporary = self.temporary(stage)
        try:
            body(temporary)
            return self.keep(stage, key, temporary)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise

    def temporary(self, stage: str) -> Path:
        """A new, empty folder for a result in the making."""
        folder = self.tmp / f"{stage}-{secrets.token_hex(6)}"
        folder.mkdir()
        return folder

    def keep(self, stage: str, key: str, temporary: Path) -> Result:
        """Put a finished temporary folder in its place, its manifest written last."""
        files = {p.relative_to(temporary).as_posix(): p.stat().st_size for p in _files(temporary)}
        manifest = {"format": FORMAT, "stage": stage, "key": key, "files": files}
        _write_synced(temporary / MANIFEST, json.dumps(manifest, indent=1, sort_keys=True))
        place = self.place(stage, key)
        place.parent.mkdir(parents=True, exist_ok=True)
        if place.exists():  # not whole, otherwise it would have been found
            self.discard(stage, key)
        temporary.rename(place)
        return Result(key, place, made=True)

    def discard(self, stage: str, key: str) -> None:
        """Remove a result: moved away first, so that a kill in between leaves no half of it in its place."""
        place = self.place(stage, key)
        if place.exists():
            grave = self.temporary("old")
            place.rename(grave / key)
            shutil.rmtree(grave, ignore_errors=True)

    def discard_stage(self, stage: str) -> None:
        """Remove all results of a stage."""
        for place in _folders(self.stages / stage):
            self.discard(stage, place.name)

    def prune(self, keep: set[str]) -> int:
        """Remove all results whose keys are not in ``keep``. Gives how many were removed."""
        old = [p for stage in _folders(self.stages) for p in _folders(stage) if p.name not in keep]
        for folder in old:
            self.discard(folder.parent.name, folder.name)
        return len(old)


def is_whole(folder: Path) -> bool:
    """Whether the folder holds a manifest of this format, and each file that it lists in its full size."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        files: dict[str, int] = manifest["files"]
        return manifest["format"] == FORMAT and all((folder / n).stat().st_size == size for n, size in files.items())
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


@contextlib.contextmanager
def open_work(root: Path) -> Generator[WorkFolder]:
    """Make or open a work folder, lock it, and clear what a killed run left half done.

    Raises UsageError where the folder cannot be written, is no work folder, is of a newer format or is in use by
    another run, and ResourceError where the disk is full.
    """
    work = WorkFolder(root)
    with _unwritable_named(root):
        _claim(root)
        lock = _lock(root / "lock")
    try:
        with _unwritable_named(root):
            _check_format(root)
            shutil.rmtree(work.tmp, ignore_errors=True)
            work.tmp.mkdir(exist_ok=True)
            work.stages.mkdir(exist_ok=True)
        yield work
    finally:
        shutil.rmtree(work.tmp, ignore_errors=True)  # half-made results: after a full disk, its space is needed
        os.close(lock)


@contextlib.contextmanager
def _unwritable_named(root: Path) -> Generator[None]:
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise ResourceError(
                f"{root}: no space for the work folder ({reason}). Free some or pass --work DIR."
            ) from None
        advice = "Pass a folder on a disk that you may write to with --work DIR."
        raise UsageError(f"{root}: cannot be used as work folder ({reason}). {advice}") from None


def _claim(root: Path) -> None:
    """Make the folder, or make sure that it is a work folder or empty: other files are never mixed with ours."""
    root.mkdir(parents=True, exist_ok=True)
    known = {"format.json", "format.json.tmp", "lock", "tmp", "stages", "log.txt", "log.txt.1", "config.toml", "numba"}
    strange = sorted(p.name for p in root.iterdir() if p.name not in known)
    if strange and not (root / "format.json").exists():
        raise UsageError(
            f"{root}: expected an empty folder or a work folder, but it holds {strange[0]}"
            f"{' and other files' if len(strange) > 1 else ''}. Pass another folder with --work DIR."
        )


def _check_format(root: Path) -> None:
    path = root / "format.json"
    if not path.exists():
        temporary = root / "format.json.tmp"
        _write_synced(temporary, json.dumps({"scan2bim_work_folder": FORMAT}))
        temporary.replace(path)
        return
    try:
        version = json.loads(path.read_text(encoding="utf-8"))["scan2bim_work_folder"]
    except (ValueError, KeyError, TypeError):
        version = None
    if version != FORMAT:
        came = "a newer program" if isinstance(version, int) and version > FORMAT else "another program"
        raise UsageError(
            f"{root}: this work folder was made by {came} (format {version}, expected {FORMAT}). "
            "Pass another folder with --work DIR, or delete this one: all in it can be made again."
        )


def _lock(path: Path) -> int:
    """The descriptor of the locked file. The system drops the lock when the process ends, however it ends."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        _lock_descriptor(descriptor)
    except BlockingIOError:
        holder = os.read(descriptor, 100).decode(errors="replace").strip() or "another process"
        os.close(descriptor)
        raise UsageError(
            f"{path.parent}: this work folder is in use by {holder}. "
            "Wait for that run to end, or pass another folder with --work DIR."
        ) from None
    except BaseException:
        os.close(descriptor)
        raise
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"process {os.getpid()} on {_host()}".encode(), 0)
    return descriptor


if sys.platform == "win32":

    def _lock_descriptor(descriptor: int) -> None:
        import msvcrt

        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError from error
else:

    def _lock_descriptor(descriptor: int) -> None:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _host() -> str:
    import socket

    return socket.gethostname()


def _files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*") if p.is_file())


def _folders(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else []


def _write_synced(path: Path, text: str) -> None:
    """Write a small file through to the disk, so that after a power cut it never stands there empty."""
    with path.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def folder_bytes(folder: Path) -> int:
    """Size of all files below the folder, bytes."""
    total = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):
            total += path.lstat().st_size
    return total
