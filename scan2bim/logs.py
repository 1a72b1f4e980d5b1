"""The log of a run: in the work folder once that is open, in memory until then.

Tracebacks go here, never to the screen.
"""

from __future__ import annotations

import logging
import logging.handlers
from pathlib import Path
from types import TracebackType

FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
MOST_BYTES = 5_000_000
"""A log that is longer is put aside as log.txt.1 (and the one before it dropped)."""
BUFFERED = 10_000
"""Records kept until the work folder is open."""


class RunLog:
    """Around a run: takes all records of level INFO, ours also of level DEBUG, and Python's warnings."""

    def __init__(self) -> None:
        self._memory = logging.handlers.MemoryHandler(BUFFERED, flushLevel=logging.CRITICAL + 1, flushOnClose=False)
        self._file: logging.Handler | None = None

    def __enter__(self) -> RunLog:
        logging.captureWarnings(True)
        logging.getLogger().setLevel(logging.INFO)
        logging.getLogger("scan2bim").setLevel(logging.DEBUG)
        logging.getLogger().addHandler(self._memory)
        return self

    def open(self, path: Path) -> None:
        """From here on into the file, what was kept in memory first."""
        self._file = logging.handlers.RotatingFileHandler(path, maxBytes=MOST_BYTES, backupCount=1, encoding="utf-8")
        self._file.setFormatter(logging.Formatter(FORMAT))
        self._memory.setTarget(self._file)
        self._memory.flush()
        logging.getLogger().addHandler(self._file)
        logging.getLogger().removeHandler(self._memory)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        logging.captureWarnings(False)
        logging.getLogger().removeHandler(self._memory)
        self._memory.close()
        if self._file is not None:
            logging.getLogger().removeHandler(self._file)
            self._file.close()
