"""Tasks in processes: results, progress, failures, and no process left behind."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from scan2bim.errors import DamagedFileError, InputError, ResourceError, StageError
from scan2bim.parallel import run_in_processes

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Job:
    folder: Path
    what: str


def work(job: Job, progress: Progress) -> None:
    """Do what the job says."""
    progress(0.5)
    match job.what:
        case "torn":
            raise DamagedFileError(job.folder, "ends in the middle.", "Export it again.")
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "memory":
            raise MemoryError
        case "sleep":
            time.sleep(60)
        case "log":
            logging.getLogger("scan2bim.worker").info("worker speaks")
    (job.folder / f"{job.what}.done").write_text(str(os.getpid()))
    progress(1.0)


def run(folder: Path, *what: str, log: Path | None = None) -> dict[int, Exception | None]:
    jobs = [Job(folder, word) for word in what]
    return dict(run_in_processes(work, jobs, 2, lambda place, share: None, log=log))


def test_all_tasks_are_run_in_other_processes_and_an_error_comes_back_whole(tmp_path: Path) -> None:
    ended = run(tmp_path, "a", "torn", "b", "memory", "log", log=tmp_path / "log.txt")
    assert sorted(ended) == [0, 1, 2, 3, 4]
    assert ended[0] is ended[2] is ended[4] is None
    assert isinstance(ended[1], DamagedFileError)
    assert (ended[1].path, ended[1].problem) == (tmp_path, "ends in the middle.")
    assert isinstance(ended[3], MemoryError)
    assert (tmp_path / "a.done").read_text() != str(os.getpid())
    assert "worker speaks" in (tmp_path / "log.txt").read_text()


def test_a_killed_process_is_taken_as_lack_of_memory(tmp_path: Path) -> None:
    with pytest.raises(ResourceError, match="--jobs 1"):
        run(tmp_path, "a", "kill", "b")


def test_a_crashed_process_is_told_from_a_killed_one(tmp_path: Path) -> None:
    with pytest.raises(StageError, match="SIGSEGV"):
        run(tmp_path, "a", "crash", "b")


def test_closing_early_ends_the_processes(tmp_path: Path) -> None:
    began = time.monotonic()
    with contextlib.closing(
        run_in_processes(work, [Job(tmp_path, "a"), Job(tmp_path, "sleep")], 2, lambda place, share: None)
    ) as ended:
        next(ended)
    assert time.monotonic() - began < 20


def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(
        "import os, sys, pathlib, threading, signal, time\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_parallel import Job, work, waited\n"
        "from scan2bim.parallel import run_in_processes\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "def told(place, share):\n"
        "    if share: os.kill(os.getpid(), signal.SIGKILL)\n"
        "if __name__ == '__main__':\n"
        "    list(run_in_processes(waited, [Job(folder, 'x')] * 2, 2, told))\n"
    )
    assert subprocess.run([sys.executable, script, tmp_path], check=False).returncode == -9
    pids = [int(path.stem) for path in tmp_path.glob("*.pid")]
    assert pids
    deadline = time.monotonic() + 10
    while any(alive(pid) for pid in pids):
        assert time.monotonic() < deadline, "a worker outlives its parent"
        time.sleep(0.05)


def waited(job: Job, progress: Progress) -> None:
    (job.folder / f"{os.getpid()}.pid").touch()
    progress(0.5)
    time.sleep(60)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not (stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] == "Z")


def test_input_errors_of_all_kinds_travel() -> None:
    import pickle

    error = pickle.loads(pickle.dumps(DamagedFileError("a.e57", "is short.", "Copy it again.")))
    assert isinstance(error, InputError)
    assert str(error) == "a.e57: is short. Copy it again."
