"""What a command costs: wall and CPU seconds, memory, exit code."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedWriter
from pathlib import Path

SAMPLING = 0.05
"""Seconds between two looks at a command's memory: stages that need most of it take seconds."""
KIBIBYTE = 1024


@dataclass(frozen=True, slots=True)
class Cost:
    """What a command took.

    seconds: wall. cpu: user and system seconds of the process and of all that it started and waited for. memory: bytes
    resident at the peak, summed over its processes (pages that they share count for each). code: exit code, negative
    where a signal ended it.
    """

    seconds: float
    cpu: float
    memory: float
    code: int


def measure(
    command: Sequence[str | Path], *, out: Path | None = None, log: Path | None = None, timeout: float = 7200.0
) -> Cost:
    """Run a command and tell what it took; its output goes to ``out``, its talk to ``log``.

    After ``timeout`` seconds its whole process group is ended.
    """
    with _sink(out) as stdout, _sink(log) as stderr:
        begin = time.monotonic()
        process = subprocess.Popen(
            list(map(str, command)), stdout=stdout, stderr=stderr, env=plain_environment(), start_new_session=True
        )
        watch = _MemoryWatch(process.pid)
        alarm = threading.Timer(timeout, os.killpg, (process.pid, signal.SIGKILL))
        alarm.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            alarm.cancel()
            watch.stop()
        process.returncode = os.waitstatus_to_exitcode(status)
        cpu = usage.ru_utime + usage.ru_stime
        # ru_maxrss is no use: it also counts what this process held when it started the command.
        return Cost(time.monotonic() - begin, cpu, watch.peak, process.returncode)


def plain_environment() -> dict[str, str]:
    """The environment as most users have it: Python keeps the modules that it compiled, and writes out at leisure."""
    ours = {"PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED", "PYTHONPROFILEIMPORTTIME"}
    return {name: value for name, value in os.environ.items() if name not in ours}


def cpu_seconds() -> float:
    """User and system seconds of this process so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def _sink(path: Path | None) -> BufferedWriter:
    return Path(os.devnull if path is None else path).open("wb")


class _MemoryWatch:
    """Looks again and again at the resident memory of a process and its descendants; only where there is /proc."""

    def __init__(self, pid: int) -> None:
        self.peak = 0.0
        self._pid = pid
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the watch."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(SAMPLING):
            sizes = [_resident(pid) for pid in _family(self._pid)]
            alone = max((most for _, most in sizes), default=0.0)
            self.peak = max(self.peak, sum(now for now, _ in sizes), alone)


def _family(pid: int) -> Iterator[int]:
    """The process and all its descendants."""
    yield pid
    try:
        found = " ".join(_read(children) for children in Path(f"/proc/{pid}/task").glob("*/children"))
    except OSError:  # the process has ended
        return
    for child in found.split():
        yield from _family(int(child))


def _resident(pid: int) -> tuple[float, float]:
    """Bytes resident now, and the most so far."""
    lines = dict(line.split(":", 1) for line in _read(Path(f"/proc/{pid}/status")).splitlines() if ":" in line)
    now, most = (float(lines.get(name, "0 kB").split()[0]) * KIBIBYTE for name in ("VmRSS", "VmHWM"))
    return now, most


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:  # the process has ended
        return ""
