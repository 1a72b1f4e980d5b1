"""What is seen of a run on stderr: a bar on a terminal, lines elsewhere, JSON events for programs, or warnings only.

JSON events (one object a line), by their ``event``:
    message, warning   text
    started            stage
    moved              stage, fraction (of the stage), total (of all that runs), seconds_left (or null)
    done               stage, seconds, kept (true: the result was found in the work folder)
    failed             text, exit_code
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import logging
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, TextIO

from scan2bim.progress import Done, Event, Failed, Message, Moved, Started, View, Warn, about

if TYPE_CHECKING:
    from rich.progress import TaskID

Mode = Literal["auto", "json", "quiet"]

LINE_SECONDS = 10.0
"""Least time between two progress lines: a log stays readable."""
EVENT_SECONDS = 0.2
"""Least time between two progress events: five a second make a smooth bar in another program."""


class PlainView:
    """Lines of text, for logs and pipes. ``quiet``: warnings and errors only."""

    def __init__(self, out: TextIO, quiet: bool = False, clock: Callable[[], float] = time.monotonic) -> None:
        self._out = out
        self._quiet = quiet
        self._clock = clock
        self._next = clock() + LINE_SECONDS

    def show(self, event: Event) -> None:
        """Write a line, at most one every 10 s on progress."""
        if (self._quiet and not isinstance(event, Warn | Failed)) or isinstance(event, Started):
            return
        if isinstance(event, Moved):
            if self._clock() < self._next:
                return
            self._next = self._clock() + LINE_SECONDS
        write_line(self._out, words(event))

    def close(self) -> None:
        """Nothing to tidy."""


class JsonView:
    """One JSON object a line; the module's docstring lists them."""

    def __init__(self, out: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._out = out
        self._clock = clock
        self._next = 0.0

    def show(self, event: Event) -> None:
        """Write an object, at most five a second on progress, the last of a stage always."""
        if isinstance(event, Moved):
            if self._clock() < self._next and event.fraction < 1.0:
                return
            self._next = self._clock() + EVENT_SECONDS
        name = "warning" if isinstance(event, Warn) else type(event).__name__.lower()
        values = {key: _rounded(value) for key, value in dataclasses.asdict(event).items()}
        write_line(self._out, json.dumps({"event": name, **values}))

    def close(self) -> None:
        """Nothing to tidy."""


class TerminalView:
    """One live bar for the whole run, with the stage's name and the time left; the rest scrolls by above it."""

    def __init__(self, out: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
        from rich.text import Text

        self._text = Text
        self._console = Console(file=out, highlight=False)
        stage, left = TextColumn("{task.description:<10}"), TextColumn("{task.fields[left]}")
        self._bar = Progress(stage, BarColumn(), TaskProgressColumn(), left, console=self._console, transient=True)
        self._task: TaskID | None = None

    def show(self, event: Event) -> None:
        """Move the bar, or print above it."""
        match event:
            case Started():
                self._start(event.stage)
            case Moved():
                self._move(event)
            case _:
                # As Text: brackets in file names are no markup, and the style does not colour the bar as well.
                self._console.print(self._text(words(event), style=_style(event)), soft_wrap=True)

    def close(self) -> None:
        """Take the bar away and give the cursor back."""
        self._bar.stop()

    def _start(self, stage: str) -> None:
        if self._task is None:
            self._task = self._bar.add_task(stage, total=1.0, left="")
            self._bar.start()

    def _move(self, event: Moved) -> None:
        if self._task is not None:
            left = "" if event.seconds_left is None else f"{about(event.seconds_left)} left"
            self._bar.update(self._task, completed=event.total, description=event.stage, left=left)


def _style(event: Event) -> str:
    match event:
        case Warn():
            return "yellow"
        case Failed():
            return "red"
        case Done():
            return "dim"
        case _:
            return ""


def make_view(mode: Mode, out: TextIO | None = None) -> View:
    """The view for this run: JSON or quiet as asked, a bar where stderr is a terminal, else lines."""
    stream = sys.stderr if out is None else out
    if mode == "json":
        return JsonView(stream)
    if mode == "auto" and stream.isatty():
        return TerminalView(stream)
    return PlainView(stream, quiet=mode == "quiet")


def words(event: Event) -> str:
    """The event as a line for people."""
    match event:
        case Message():
            return event.text
        case Warn():
            return f"warning: {event.text}"
        case Started():
            return f"{event.stage} ..."
        case Moved():
            left = "" if event.seconds_left is None else f", {about(event.seconds_left)} left"
            return f"{event.total:4.0%} {event.stage}{left}"
        case Done():
            return f"{event.stage}: " + (
                "kept from an earlier run" if event.kept else f"done in {about(event.seconds)}"
            )
        case Failed():
            return f"scan2bim: error: {event.text}"


class LogToView(logging.Handler):
    """Shows log records: warnings as such, others (with --verbose) as messages. Tracebacks stay in the log file."""

    def __init__(self, view: View, level: int) -> None:
        super().__init__(level)
        self._view = view

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record."""
        text = record.getMessage()
        self._view.show(Warn(text) if record.levelno >= logging.WARNING else Message(f"{record.name}: {text}"))


def write_line(out: TextIO, text: str) -> None:
    """Write a line. A reader of our talk that has gone away is no reason to stop the work."""
    encoding = out.encoding or "utf-8"
    with contextlib.suppress(BrokenPipeError, ValueError):
        out.write(text.encode(encoding, "replace").decode(encoding) + "\n")
        out.flush()


def _rounded(value: object) -> object:
    return round(value, 4) if isinstance(value, float) else value
