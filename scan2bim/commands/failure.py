"""How a command that fails ends: one message on stderr and an exit code, never a stack trace."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
import traceback
from argparse import Namespace
from pathlib import Path

from scan2bim.errors import Scan2BimError
from scan2bim.progress import Failed
from scan2bim.views import make_view

INTERRUPTED = 130
CLOSED_PIPE = 141


def tell(error: BaseException, options: Namespace) -> int:
    """Say what happened and give the exit code."""
    if isinstance(error, SystemExit):
        raise error
    if isinstance(error, BrokenPipeError):
        # Whoever read our output has closed it: point stdout elsewhere, so that the last flush is silent too.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CLOSED_PIPE
    text, code = _words(error, options.command == "convert")
    wants_json = options.command == "convert" and options.json
    view = make_view("json" if wants_json else "auto")
    view.show(Failed(text, code))
    view.close()
    return code


def _words(error: BaseException, converting: bool) -> tuple[str, int]:
    if isinstance(error, Scan2BimError):
        return str(error), error.exit_code
    if isinstance(error, KeyboardInterrupt):
        kept = " What is done is kept: run the same command again to go on." if converting else ""
        return f"interrupted.{kept}", INTERRUPTED
    if isinstance(error, MemoryError):
        return "memory ran out. Close other programs and run again.", 6
    if isinstance(error, OSError) and error.strerror:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        place = error.filename or "the system said"
        return f"{place}: {error.strerror}." + (" Free some space and run again." if full else ""), 6 if full else 1
    if isinstance(error, ImportError):
        return f"a part of the installation cannot be loaded ({error}). Run: scan2bim doctor", 1
    return f"{type(error).__name__}: {error}. Please report this with the file {_keep_trace(error)}", 1


def _keep_trace(error: BaseException) -> Path:
    handle, name = tempfile.mkstemp(prefix="scan2bim-error-", suffix=".txt")
    with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as file:
        file.writelines(traceback.format_exception(error))
    return Path(name)
