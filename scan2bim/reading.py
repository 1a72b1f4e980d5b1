"""Reading the scans, each into its own folder, in this process or in several."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Generator, Sequence
from pathlib import Path

from scan2bim.errors import InputError
from scan2bim.parallel import run_in_processes
from scan2bim.progress import Progress
from scan2bim.stages import ReadTask, run_read

_log = logging.getLogger(__name__)

PRELOAD = ("scan2bim.stages", "scan2bim.readers", "scan2bim.cloud.ingest")
"""What every reading process needs, beside the readers of the formats that were met."""


def read_all(
    tasks: Sequence[ReadTask], jobs: int, progress: Progress, log: Path
) -> Generator[tuple[int, InputError | None]]:
    """Read all scans; give the place of each as it ends, with the error of an unreadable one or None.

    Raises any other error at once.
    """
    total = _Total([max(task.scan.header.points, 1) for task in tasks], progress)
    jobs = min(jobs, len(tasks))
    if jobs > 1:
        readers = sorted(name for name in sys.modules if name.startswith("scan2bim.readers."))
        ended = run_in_processes(run_read, tasks, jobs, total.tell, preload=(*PRELOAD, *readers), log=log)
    else:
        ended = _in_this_process(tasks, total)
    with contextlib.closing(ended):
        for place, error in ended:
            if error is not None and not isinstance(error, InputError):
                raise error
            total.tell(place, 1.0)
            yield place, error


def _in_this_process(tasks: Sequence[ReadTask], total: _Total) -> Generator[tuple[int, Exception | None]]:
    for i, task in enumerate(tasks):
        _log.info("reading %s scan %d", task.scan.header.path, task.scan.header.index)
        try:
            run_read(task, lambda fraction, i=i: total.tell(i, fraction))
        except InputError as error:
            yield i, error
        else:
            yield i, None


class _Total:
    """The progress of several tasks as one, each by its weight."""

    def __init__(self, weights: list[int], progress: Progress) -> None:
        self._weights = weights
        self._shares = [0.0] * len(weights)
        self._progress = progress

    def tell(self, place: int, fraction: float) -> None:
        """The share done of one task."""
        self._shares[place] = fraction
        done = sum(w * s for w, s in zip(self._weights, self._shares, strict=True))
        self._progress(done / sum(self._weights))
