"""How far a running conversion is: the ``Reporter`` turns what stages tell it into events, a ``View`` shows those.

The reporter knows the cost of all that is planned, so that its fraction and its time left are those of the whole run.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Protocol

Progress = Callable[[float], None]
"""Takes the share of the work done, 0 to 1."""

SURE_SECONDS, SURE_SHARE = 2.0, 0.02
"""No time left is told before so much time and so much of the work have gone: it would be a guess."""


@dataclass(frozen=True, slots=True)
class Message:
    """Something worth knowing."""

    text: str


@dataclass(frozen=True, slots=True)
class Warn:
    """Something that the user should look at."""

    text: str


@dataclass(frozen=True, slots=True)
class Started:
    """A stage begins."""

    stage: str


@dataclass(frozen=True, slots=True)
class Moved:
    """How far the work is: share of the stage and of all that runs, seconds left (None: not known yet)."""

    stage: str
    fraction: float
    total: float
    seconds_left: float | None


@dataclass(frozen=True, slots=True)
class Done:
    """A stage is done after so many seconds, or (``kept``) its result was found in the work folder."""

    stage: str
    seconds: float
    kept: bool


@dataclass(frozen=True, slots=True)
class Failed:
    """The command ends with this error."""

    text: str
    exit_code: int


Event = Message | Warn | Started | Moved | Done | Failed


class View(Protocol):
    """Shows events to somebody."""

    def show(self, event: Event) -> None:
        """Show one event. ``Moved`` comes often: the view slows it down as it needs."""
        ...

    def close(self) -> None:
        """Leave the screen tidy. Events may still come."""
        ...


class Reporter:
    """Tells a view how far the work is."""

    def __init__(self, view: View, clock: Callable[[], float] = time.monotonic) -> None:
        self._view = view
        self._clock = clock
        self._costs: dict[str, float] = {}
        self._done = 0.0
        self._total = self._base = 0.0
        self._began = clock()

    def plan(self, costs: Mapping[str, float]) -> None:
        """The stages that will run, each with its expected seconds. The clock for the time left starts here.

        A later plan shares what is left of the bar, so that it never goes back.
        """
        self._costs = {name: max(cost, 1e-9) for name, cost in costs.items()}
        self._done = 0.0
        self._base = self._total
        self._began = self._clock()

    @contextlib.contextmanager
    def stage(self, name: str) -> Generator[Progress]:
        """Around the work of a stage; gives the callable that takes the share done."""
        began = self._clock()
        self._view.show(Started(name))
        self._tell(name, 0.0)
        yield lambda fraction: self._tell(name, fraction)
        self._tell(name, 1.0)
        self._done += self._costs.get(name, 0.0)
        self._view.show(Done(name, self._clock() - began, kept=False))

    def kept(self, name: str) -> None:
        """The result of the stage is there from an earlier run."""
        self._view.show(Done(name, 0.0, kept=True))

    def message(self, text: str) -> None:
        """Something worth knowing."""
        self._view.show(Message(text))

    def warning(self, text: str) -> None:
        """Something that the user should look at."""
        self._view.show(Warn(text))

    def _tell(self, name: str, fraction: float) -> None:
        fraction = min(max(fraction, 0.0), 1.0)
        whole = sum(self._costs.values())
        share = (self._done + fraction * self._costs.get(name, 0.0)) / whole if whole else 0.0
        self._total = max(self._total, min(self._base + (1 - self._base) * share, 1.0))
        self._view.show(Moved(name, fraction, self._total, self._left(min(share, 1.0))))

    def _left(self, share: float) -> float | None:
        gone = self._clock() - self._began
        return gone * (1 - share) / share if gone >= SURE_SECONDS and share >= SURE_SHARE else None


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
            return f"{count:.0f} {unit}" if count >= 9.95 or unit == "B" else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} TB"


def several(count: int, thing: str) -> str:
    """A number of things in words: 1 scan, 40 scans."""
    return f"{count:,} {thing}" + ("" if count == 1 else "s")
