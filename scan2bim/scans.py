"""The scans of a conversion: their headers, their identities, and those that had to be left out."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.workfolder import digest, file_identity

if TYPE_CHECKING:
    from scan2bim.cloud.scan import ScanHeader

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A scan to convert: its header, the number of its first station, and a hash of its content."""

    header: ScanHeader
    station: int
    identity: str


@dataclass(frozen=True, slots=True, eq=False)
class ScanSet:
    """The scans to convert, and what was left out: one sentence for each file or scan."""

    scans: tuple[Scan, ...]
    skipped: tuple[str, ...] = ()

    @property
    def points(self) -> int:
        """Records of all scans."""
        return sum(scan.header.points for scan in self.scans)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the building's model says of the scans that were left out."""
        return tuple(f"Left out, so parts of the building may be missing: {text}" for text in self.skipped)

    def without(self, lost: dict[int, InputError]) -> ScanSet:
        """Less the scans at these places. Raises the first error where none is left."""
        left = tuple(scan for i, scan in enumerate(self.scans) if i not in lost)
        if lost and not left:
            raise next(iter(lost.values()))
        return replace(self, scans=left, skipped=(*self.skipped, *(str(lost[i]) for i in sorted(lost))))


def gather(paths: Sequence[Path | str], keep_going: bool) -> ScanSet:
    """Read the headers of all files before any work begins.

    Raises InputError that names every file that cannot be read; with ``keep_going`` only where none can.
    """
    from scan2bim.numbaload import load_without_compiler
    from scan2bim.readers import find_inputs, one_a_kind

    load_without_compiler()
    files = find_inputs(paths)
    scans: list[Scan] = []
    failed: list[InputError] = []
    station = 0
    for path in files:
        try:
            headers = _headers(path)
            identity = _identity(path)
        except InputError as error:
            failed.append(error)
            continue
        for header in headers:
            scans.append(Scan(header, station, digest(identity, str(header.index))))
            station += max(1, len(header.sources))
    if failed and (not keep_going or not scans):
        raise _all_in_one(failed, len(files))
    return ScanSet(tuple(scans), tuple(str(error) for error in one_a_kind(failed)))


def _headers(path: Path) -> tuple[ScanHeader, ...]:
    from scan2bim.readers import read_headers

    try:
        return tuple(read_headers(path))
    except (InputError, MemoryError):
        raise
    except Exception as error:
        raise unreadable(path, error) from error


def unreadable(path: Path, error: Exception) -> InputError:
    """The input error for a failure that no reader foresaw; its traceback goes to the log."""
    _log.info("reading %s failed", path, exc_info=error)
    reason = error.strerror if isinstance(error, OSError) and error.strerror else f"{type(error).__name__}: {error}"
    return DamagedFileError(path, f"cannot be read ({reason}).", "Check that it opens elsewhere, or export it again.")


def _identity(path: Path) -> str:
    try:
        return file_identity(path)
    except OSError as error:
        raise unreadable(path, error) from error


def _all_in_one(failed: Sequence[InputError], files: int) -> InputError:
    """One error that names every unreadable file."""
    from scan2bim.readers import one_a_kind

    if files == 1:
        return failed[0]
    advice = "Repair or remove them, or pass --keep-going to convert the others."
    if len(failed) == files:
        advice = "No file is left to convert."
    if len(failed) == 1:
        first = failed[0]
        return type(first)(
            first.path, first.problem, f"{first.advice} Or pass --keep-going to convert the others.".strip()
        )
    names = "\n  ".join(str(error) for error in one_a_kind(failed))
    return InputError(f"{len(failed)} of {files} files", f"cannot be read. {advice}\n  {names}")
