"""What a running conversion says, on stderr: a bar on a terminal, lines elsewhere, JSON events for programs, or nothing.

The ``Reporter`` knows how much work is planned, how far it is and how long the rest will take; a ``View`` shows it.

JSON events (one object a line), by their ``event``:
    message, warning   message
    stage_start        stage
    progress           stage, fraction (of the stage), total (of all that runs), seconds_left (or null)
    stage_done         stage, seconds, kept (true: the result was found in the work folder)
    error              message, exit_code
"""

from __future__ import annotations

import contextlib
import json
import logging
import sys
import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

Progress = Callable[[float], None]
"""Takes the share of the work done, 0 to 1."""
Mode = Literal["auto", "json", "quiet"]

LINE_SECONDS = 10.0
"""Least time between two progress lines: a log stays readable."""
EVENT_SECONDS = 0.2
"""Least time between two progress events: five a second make a smooth bar in another program."""
SURE_SECONDS, SURE_SHARE = 2.0, 0.02
"""No time left is told before so much time and so much of the work have gone: it would be a guess."""


@dataclass(frozen=True, slots=True)
class State:
    """How far the work is: share of the current stage and of all, seconds left (None: not known yet)."""

    stage: str
    fraction: float
    total: float
    seconds_left: float | None


class View(Protocol):
    """Shows what the reporter tells it."""

    def message(self, text: str) -> None:
        """Something worth knowing."""
        ...

    def warning(self, text: str) -> None:
        """Something that the user should look at."""
        ...

    def stage_start(self, stage: str) -> None:
        """A stage begins."""
        ...

    def moved(self, state: State) -> None:
        """The work has gone on; called often."""
        ...

    def stage_done(self, stage: str, seconds: float, kept: bool) -> None:
        """A stage is done, or its kept result is used."""
        ...

    def error(self, text: str, exit_code: int) -> None:
        """The command ends with this error."""
        ...

    def close(self) -> None:
        """Nothing more is told, except an error."""
        ...


class Reporter:
    """Tells a view how far the work is. ``plan`` gives the seconds (any unit) that each stage still to run may take."""

    def __init__(self, view: View, clock: Callable[[], float] = time.monotonic) -> None:
        self.view = view
        self._clock = clock
        self._shares: dict[str, float] = {}
        self._done = 0.0
        self._began = clock()

    def plan(self, shares: Mapping[str, float]) -> None:
        """What is still to run, with its expected cost. The clock for the time left starts here."""
        self._shares = {name: max(cost, 1e-9) for name, cost in shares.items()}
        self._done = 0.0
        self._began = self._clock()

    @contextlib.contextmanager
    def stage(self, name: str) -> Generator[Progress]:
        """Around the work of a stage; gives the callable that takes the share done."""
        began = self._clock()
        self.view.stage_start(name)
        self._tell(name, 0.0)
        yield lambda fraction: self._tell(name, fraction)
        self._done += self._shares.get(name, 0.0)
        self.view.stage_done(name, self._clock() - began, kept=False)

    def kept(self, name: str) -> None:
        """The result of the stage is there from an earlier run."""
        self.view.stage_done(name, 0.0, kept=True)

    def message(self, text: str) -> None:
        """Something worth knowing."""
        self.view.message(text)

    def warning(self, text: str) -> None:
        """Something that the user should look at."""
        self.view.warning(text)

    def _tell(self, name: str, fraction: float) -> None:
        fraction = min(max(fraction, 0.0), 1.0)
        whole = sum(self._shares.values())
        total = (self._done + fraction * self._shares.get(name, 0.0)) / whole if whole else fraction
        total = min(total, 1.0)
        self.view.moved(State(name, fraction, total, self._left(total)))

    def _left(self, total: float) -> float | None:
        gone = self._clock() - self._began
        return gone * (1 - total) / total if gone >= SURE_SECONDS and total >= SURE_SHARE else None


class PlainView:
    """Lines of text, for logs and pipes."""

    def __init__(self, out: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._out = out
        self._clock = clock
        self._next = 0.0

    def message(self, text: str) -> None:
        self._line(text)

    def warning(self, text: str) -> None:
        self._line(f"warning: {text}")

    def stage_start(self, stage: str) -> None:
        self._next = self._clock() + LINE_SECONDS

    def moved(self, state: State) -> None:
        if self._clock() >= self._next:
            self._next = self._clock() + LINE_SECONDS
            left = "" if state.seconds_left is None else f", {about(state.seconds_left)} left"
            self._line(f"{state.total:4.0%} {state.stage}{left}")

    def stage_done(self, stage: str, seconds: float, kept: bool) -> None:
        self._line(f"{stage}: " + ("kept from an earlier run" if kept else f"done in {about(seconds)}"))

    def error(self, text: str, exit_code: int) -> None:
        self._line(f"scan2bim: error: {text}")

    def close(self) -> None:
        pass

    def _line(self, text: str) -> None:
        write_line(self._out, text)


class QuietView(PlainView):
    """Warnings and errors only."""

    def message(self, text: str) -> None:
        pass

    def moved(self, state: State) -> None:
        pass

    def stage_done(self, stage: str, seconds: float, kept: bool) -> None:
        pass


class JsonView:
    """One JSON object a line; the module's docstring lists them."""

    def __init__(self, out: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._out = out
        self._clock = clock
        self._next = 0.0

    def message(self, text: str) -> None:
        self._event("message", message=text)

    def warning(self, text: str) -> None:
        self._event("warning", message=text)

    def stage_start(self, stage: str) -> None:
        self._next = 0.0
        self._event("stage_start", stage=stage)

    def moved(self, state: State) -> None:
        if self._clock() >= self._next or state.fraction >= 1.0:
            self._next = self._clock() + EVENT_SECONDS
            left = None if state.seconds_left is None else round(state.seconds_left, 1)
            fraction, total = round(state.fraction, 4), round(state.total, 4)
            self._event("progress", stage=state.stage, fraction=fraction, total=total, seconds_left=left)

    def stage_done(self, stage: str, seconds: float, kept: bool) -> None:
        self._event("stage_done", stage=stage, seconds=round(seconds, 3), kept=kept)

    def error(self, text: str, exit_code: int) -> None:
        self._event("error", message=text, exit_code=exit_code)

    def close(self) -> None:
        pass

    def _event(self, event: str, **values: Any) -> None:
        write_line(self._out, json.dumps({"event": event, **values}))


class TerminalView:
    """One live bar for the whole work, with the stage's name and the time left; messages scroll by above it."""

    def __init__(self, out: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

        self._console = Console(file=out, highlight=False)
        columns = (
            TextColumn("{task.description:<10}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[left]}"),
        )
        self._bar: RichProgress = Progress(*columns, console=self._console, transient=True)
        self._task: TaskID | None = None

    def message(self, text: str) -> None:
        self._print(text)

    def warning(self, text: str) -> None:
        self._print(f"warning: {text}", style="yellow")

    def stage_start(self, stage: str) -> None:
        if self._task is None:
            self._task = self._bar.add_task(stage, total=1.0, left="")
            self._bar.start()

    def moved(self, state: State) -> None:
        if self._task is not None:
            left = "" if state.seconds_left is None else f"{about(state.seconds_left)} left"
            self._bar.update(self._task, completed=state.total, description=state.stage, left=left)

    def stage_done(self, stage: str, seconds: float, kept: bool) -> None:
        self._print(f"{stage}: " + ("kept from an earlier run" if kept else f"done in {about(seconds)}"), style="dim")

    def error(self, text: str, exit_code: int) -> None:
        self.close()
        self._print(f"scan2bim: error: {text}", style="red")

    def close(self) -> None:
        self._bar.stop()

    def _print(self, text: str, style: str | None = None) -> None:
        self._console.print(text, style=style, markup=False, soft_wrap=True, emoji=False)


def make_view(mode: Mode, out: TextIO | None = None) -> View:
    """The view for this run: JSON or quiet as asked, a bar where stderr is a terminal, else lines."""
    stream = sys.stderr if out is None else out
    if mode == "json":
        return JsonView(stream)
    if mode == "quiet":
        return QuietView(stream)
    return TerminalView(stream) if stream.isatty() else PlainView(stream)


class LogToView(logging.Handler):
    """Shows log records: warnings as such, others (with --verbose) as messages. Tracebacks stay in the log file."""

    def __init__(self, view: View, level: int) -> None:
        super().__init__(level)
        self._view = view

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record."""
        text = record.getMessage()
        if record.levelno >= logging.WARNING:
            self._view.warning(text)
        else:
            self._view.message(f"{record.name.removeprefix('scan2bim.')}: {text}")


def write_line(out: TextIO, text: str) -> None:
    """Write a line. A reader of our talk that has gone away is no reason to stop the work."""
    with contextlib.suppress(BrokenPipeError, ValueError):
        out.write(text.encode(out.encoding or "utf-8", "replace").decode(out.encoding or "utf-8") + "\n")
        out.flush()


def about(seconds: float) -> str:
    """A duration in words that fit its uncertainty: 0.4 s, 12 s, 3 min, 2 h 10 min."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def size(count: float) -> str:
    """Bytes in words: 512 B, 3.4 MB, 12 GB."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 999.5:
            return f"{count:.0f} {unit}" if count >= 10 or unit == "B" else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} TB"
