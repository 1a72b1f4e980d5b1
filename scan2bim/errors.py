"""The errors that scan2bim raises on purpose, each with the exit code that it ends a command with.

Scan2BimError                     1  anything below
├── UsageError                    2  an option or an output name that cannot be understood
├── InputError                    3  a file that cannot be read
│   ├── ClosedFormatError            a vendor's closed format: the message says how to export it
│   └── DamagedFileError             truncated, corrupt, mislabelled or empty
├── PrecheckError                 4  readable input that cannot make a building
├── StageError                    5  a stage of the pipeline failed; what was done is kept
└── ResourceError                 6  out of memory or disk

A message says what was expected, what came, in which file, and what to do next.
"""

from __future__ import annotations

from pathlib import Path


class Scan2BimError(Exception):
    """Root of all errors raised on purpose."""

    exit_code = 1


class UsageError(Scan2BimError):
    """An option, a path or an output name that cannot be understood."""

    exit_code = 2


class InputError(Scan2BimError):
    """A file that cannot be read. Names the file, the problem and what to do."""

    exit_code = 3

    def __init__(self, path: Path | str, problem: str, advice: str = "") -> None:
        self.path = Path(path)
        self.problem = problem
        self.advice = advice
        super().__init__(f"{path}: {problem}" + (f" {advice}" if advice else ""))

    def __reduce__(self) -> tuple[type[InputError], tuple[Path, str, str]]:
        """Rebuild from its parts, so that the error travels whole from a reading process."""
        return type(self), (self.path, self.problem, self.advice)


class ClosedFormatError(InputError):
    """A vendor's closed format."""


class DamagedFileError(InputError):
    """A file that is truncated, corrupt, empty or not what its name says."""


class PrecheckError(Scan2BimError):
    """Readable input from which no building can be made."""

    exit_code = 4


class StageError(Scan2BimError):
    """A stage of the pipeline failed. What was finished before stays in the work folder."""

    exit_code = 5


class ResourceError(Scan2BimError):
    """Out of memory or disk."""

    exit_code = 6


def reason(error: Exception) -> str:
    """Why a file cannot be used, in the system's words, without its number and without the path once more."""
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)
