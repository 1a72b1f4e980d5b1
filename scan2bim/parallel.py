"""Running tasks in processes: one task a scan, results in folders, so that nothing big travels between processes."""

from __future__ import annotations

import contextlib
import importlib
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, TypeVar

from scan2bim.errors import ResourceError, Scan2BimError, StageError
from scan2bim.progress import Progress

Task = TypeVar("Task")
Run = Callable[[Task, Progress], None]

POLL_SECONDS = 0.2
"""How often the progress of the processes is looked at."""

_shares: Any = None
"""In a worker: the shared array with the share done of each task."""


def run_in_processes(
    run: Run[Task],
    tasks: Sequence[Task],
    jobs: int,
    told: Callable[[int, float], None],
    *,
    preload: Sequence[str] = (),
    log: Path | None = None,
) -> Generator[tuple[int, Exception | None]]:
    """Run the tasks in ``jobs`` processes; give the place of each as it ends, with its error or None.

    ``run`` and the tasks must be picklable. ``told`` gets place and share done of tasks under way. ``preload`` names
    the modules that every process needs. Raises ResourceError where a process is killed by the system, which is what
    happens when memory runs out, StageError where one crashes. Closing the generator early ends the processes.
    """
    context = _context(preload)
    shares: Any = context.Array("d", len(tasks), lock=False)
    with _pool(jobs, context, (shares, log)) as pool:
        places = {pool.submit(_work, run, task, i): i for i, task in enumerate(tasks)}
        processes = multiprocessing.active_children()
        while places:
            ended, _ = wait(places, timeout=POLL_SECONDS, return_when=FIRST_COMPLETED)
            for place in places.values():
                told(place, shares[place])
            for future in sorted(ended, key=lambda future: places[future]):
                yield places.pop(future), _outcome(future, processes)


def _context(preload: Sequence[str]) -> BaseContext:
    """Processes forked from a clean server that has done the imports once (it saves 1 s of CPU each), else fresh ones.

    Never forked from this process: its threads (numba's, BLAS's) would be left behind in any state.
    """
    if sys.platform == "win32" or "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    return context


@contextlib.contextmanager
def _pool(jobs: int, context: BaseContext, arguments: tuple[Any, ...]) -> Generator[ProcessPoolExecutor]:
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=arguments)
    try:
        yield pool
    except BaseException:
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        _stop_server()


def _stop_server() -> None:
    """End the server that the processes were forked from and wait for it: its CPU time and theirs then count as ours.

    Python offers this under a private name only; without it the server would end with this process, uncounted.
    """
    server = getattr(importlib.import_module("multiprocessing.forkserver"), "_forkserver", None)
    stop = getattr(server, "_stop", None)
    if stop is not None:
        stop()


def _outcome(future: Future[None], processes: Sequence[BaseProcess]) -> Exception | None:
    try:
        future.result()
    except BrokenProcessPool as error:
        raise _death(processes) from error
    except Exception as error:
        return error
    return None


def _death(processes: Sequence[BaseProcess]) -> Scan2BimError:
    """Why a process ended: it crashed in native code, or the system killed it."""
    for process in processes:
        process.join(timeout=5)
    crashes = {-code for code in (process.exitcode for process in processes) if code is not None and code < 0}
    crashes -= {signal.SIGTERM}  # the others, ended after the first had died
    if crashes and signal.SIGKILL not in crashes:
        name = signal.Signals(min(crashes)).name
        return StageError(
            f"A reading process crashed ({name}), most likely over a damaged file. What is read already is kept. "
            "Run again with --jobs 1 -v to see at which file it happens, and export that file again."
        )
    return ResourceError(
        "A reading process was killed by the system, most likely because memory ran out. What is read already is kept. "
        f"Run again with fewer processes than {len(processes)} (--jobs 1 needs least memory)."
    )


def _begin(shares: Any, log: Path | None) -> None:
    """Set a worker up: Ctrl-C is the parent's, talk goes to the log, and no worker outlives the parent."""
    global _shares  # noqa: PLW0603 - set once in each worker
    _shares = shares
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if log is not None:
        logging.captureWarnings(True)
        logging.basicConfig(filename=log, level=logging.INFO, format="%(asctime)s %(process)d %(name)s %(message)s")
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    """A parent that is killed cannot tell its workers, and they would wait for tasks for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


def _work(run: Run[Task], task: Task, place: int) -> None:
    def progress(fraction: float) -> None:
        _shares[place] = fraction

    run(task, progress)
