"""Failures that a stage did not foresee, as errors that say what to do."""

from __future__ import annotations

import contextlib
import errno
import logging
from collections.abc import Generator
from pathlib import Path

from scan2bim.errors import ResourceError, Scan2BimError, StageError

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def guarded(stage: str, work: Path) -> Generator[None]:
    """Turn what a stage did not foresee into an error that says what to do; the traceback goes to the log."""
    try:
        yield
    except Scan2BimError:
        raise
    except MemoryError as error:
        _log.info("out of memory", exc_info=error)
        raise ResourceError(
            f"Memory ran out in the stage {stage!r}. What is done is kept in {work}. "
            "Close other programs or pass --jobs 1, then run the same command again."
        ) from error
    except Exception as error:
        _log.info("stage %s failed", stage, exc_info=error)
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise ResourceError(
                f"The disk of {work} is full ({error.strerror}) in the stage {stage!r}. What is done is kept. "
                "Free some space, then run the same command again."
            ) from error
        raise StageError(
            f"The stage {stage!r} failed ({type(error).__name__}: {error}). What was done before is kept. "
            f"Please report this with the log: {work / 'log.txt'}"
        ) from error
