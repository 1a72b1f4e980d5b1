"""What is told of a run: shares of the whole, time left, and each view's form."""

from __future__ import annotations

import io
import json
import logging

import pytest

from scan2bim.progress import Done, Event, Failed, Message, Moved, Reporter, Started, Warn, about, size
from scan2bim.views import JsonView, LogToView, PlainView, TerminalView, make_view


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Keeper:
    def __init__(self) -> None:
        self.events: list[Event] = []

    def show(self, event: Event) -> None:
        self.events.append(event)

    def close(self) -> None:
        pass


def test_the_total_weighs_stages_by_their_cost_and_the_time_left_follows() -> None:
    clock, view = Clock(), Keeper()
    reporter = Reporter(view, clock)
    reporter.plan({"read": 30, "walls": 10})
    with reporter.stage("read") as progress:
        clock.now = 5
        progress(0.5)
        assert view.events[-1] == Moved("read", 0.5, 0.375, pytest.approx(5 * 0.625 / 0.375))
        clock.now = 10
    with reporter.stage("walls") as progress:
        clock.now = 12
        progress(1.0)
    last = [event for event in view.events if isinstance(event, Moved)][-1]
    assert (last.total, last.seconds_left) == (1.0, 0.0)
    assert view.events[-1] == Done("walls", 2, kept=False)


def test_no_time_left_is_told_before_it_is_known() -> None:
    clock, view = Clock(), Keeper()
    reporter = Reporter(view, clock)
    reporter.plan({"read": 1})
    with reporter.stage("read") as progress:
        clock.now = 1.0
        progress(0.5)
        clock.now = 100.0
        progress(0.001)
    assert {event.seconds_left for event in view.events if isinstance(event, Moved)} == {None, 0.0}


def test_a_stage_that_tells_nonsense_cannot_leave_the_bar() -> None:
    view = Keeper()
    reporter = Reporter(view)
    reporter.plan({"read": 1})
    with reporter.stage("read") as progress:
        for fraction in (-1, 7, 0.5):
            progress(fraction)
    totals = [event.total for event in view.events if isinstance(event, Moved)]
    assert totals == sorted(totals)
    assert 0 <= min(totals) <= max(totals) <= 1


def test_plain_lines_are_few() -> None:
    clock, out = Clock(), io.StringIO()
    view = PlainView(out, clock=clock)
    for second in range(100):
        clock.now = second
        view.show(Moved("read", second / 100, second / 100, 100.0 - second))
    view.show(Done("read", 100, kept=False))
    lines = out.getvalue().splitlines()
    assert lines[0] == " 10% read, 2 min left"
    assert lines[-1] == "read: done in 2 min"
    assert len(lines) == 10


def test_quiet_shows_warnings_and_errors_only() -> None:
    out = io.StringIO()
    view = PlainView(out, quiet=True)
    for event in (
        Message("m"),
        Started("s"),
        Moved("s", 0, 0, None),
        Done("s", 1, kept=True),
        Warn("w"),
        Failed("f", 3),
    ):
        view.show(event)
    assert out.getvalue() == "warning: w\nscan2bim: error: f\n"


def test_json_events_are_objects_with_their_names() -> None:
    clock, out = Clock(), io.StringIO()
    view = JsonView(out, clock=clock)
    for event in (Message("m"), Warn("w"), Started("s"), Moved("s", 0.1, 0.05, 7.123456), Moved("s", 0.2, 0.1, None)):
        view.show(event)
    for event in (Moved("s", 1.0, 0.5, None), Done("s", 1.5, kept=False), Failed("f", 3)):
        view.show(event)
    events = [json.loads(line) for line in out.getvalue().splitlines()]
    assert [event["event"] for event in events] == ["message", "warning", "started", "moved", "moved", "done", "failed"]
    assert events[3] == {"event": "moved", "stage": "s", "fraction": 0.1, "total": 0.05, "seconds_left": 7.1235}
    assert events[-1] == {"event": "failed", "text": "f", "exit_code": 3}


def test_the_terminal_view_prints_above_its_bar_and_marks_nothing_up() -> None:
    out = io.StringIO()
    view = TerminalView(out)
    for event in (Started("read"), Moved("read", 0.5, 0.25, 3.0), Warn("file [a] is bad"), Done("read", 2, kept=False)):
        view.show(event)
    view.close()
    view.show(Failed("no [b]room[/b]", 6))
    assert "warning: file [a] is bad" in out.getvalue()
    assert "no [b]room[/b]" in out.getvalue()


def test_a_pipe_gets_lines_and_a_terminal_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    out = io.StringIO()
    assert isinstance(make_view("auto", out), PlainView)
    assert isinstance(make_view("json", out), JsonView)
    monkeypatch.setattr(out, "isatty", lambda: True)
    assert isinstance(make_view("auto", out), TerminalView)
    assert isinstance(make_view("quiet", out), PlainView)


def test_log_records_are_shown_without_their_traces() -> None:
    view = Keeper()
    logger = logging.getLogger("scan2bim.test_progress")
    logger.addHandler(LogToView(view, logging.INFO))
    logger.setLevel(logging.INFO)
    try:
        raise ZeroDivisionError
    except ZeroDivisionError:
        logger.warning("it broke", exc_info=True)
    logger.info("it goes on")
    assert view.events == [Warn("it broke"), Message("scan2bim.test_progress: it goes on")]


def test_a_closed_pipe_does_not_stop_the_work() -> None:
    out = io.StringIO()
    out.close()
    PlainView(out).show(Message("anyone?"))


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.44, "0.4 s"), (12.3, "12 s"), (89, "89 s"), (100, "2 min"), (7800, "2 h 10 min")]
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert about(seconds) == words


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 B"), (999, "999 B"), (3400, "3.4 kB"), (12_000_000, "12 MB"), (2e12, "2.0 TB")]
)
def test_sizes_in_words(count: float, words: str) -> None:
    assert size(count) == words
