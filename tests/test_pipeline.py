"""The pipeline with fake stages: what runs, what is kept, what a failure leaves."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import fake_stages
import pytest
from pydantic import Field, create_model

from scan2bim.config import load_settings
from scan2bim.errors import InputError, PrecheckError, ResourceError, Scan2BimError, StageError, UsageError
from scan2bim.model.io import dump_building
from scan2bim.pipeline import Outcome, convert
from scan2bim.planning import Request, plan
from scan2bim.progress import Done, Event, Message, Moved, Reporter, Warn
from scan2bim.stages import STAGES
from scan2bim.workfolder import open_work

LATER = ["surfels", "structure", "openings", "model"]


class Listener:
    """A view that keeps what it is shown."""

    def __init__(self) -> None:
        self.events: list[Event] = []

    def show(self, event: Event) -> None:
        self.events.append(event)

    def close(self) -> None:
        pass

    def of(self, kind: type) -> list[Any]:
        return [event for event in self.events if isinstance(event, kind)]


class Site:
    """A folder with three scans, and the count of stage calls."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log = folder / "calls.txt"
        self.view = Listener()
        self.request = Request((folder / "scans",), (folder / "out" / "a.json",), folder / "work", "a", jobs=1)
        for i in range(3):
            self.scan(i, f"{i}.5 2 3")

    def scan(self, i: int, text: str) -> None:
        path = self.folder / "scans" / f"{i}.fake"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)

    def convert(self, **changes: Any) -> Outcome:
        self.view = Listener()
        return convert(replace(self.request, **changes), Reporter(self.view))

    def calls(self, **changes: Any) -> list[str]:
        self.convert(**changes)
        return fake_stages.calls(self.log)

    def fails(self, kind: type[Scan2BimError], **changes: Any) -> str:
        with pytest.raises(kind) as caught:
            self.convert(**changes)
        return str(caught.value)

    def output(self) -> bytes:
        return (self.folder / "out" / "a.json").read_bytes()


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    def put(target: Any, name: str, value: Any) -> None:
        if isinstance(target, dict):
            monkeypatch.setitem(target, name, value)
        else:
            monkeypatch.setattr(target, name, value)

    fake_stages.install(put)
    monkeypatch.setenv("SCAN2BIM_FAKE_CALLS", str(tmp_path / "calls.txt"))
    return Site(tmp_path)


@pytest.fixture
def break_stage(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    return lambda how: monkeypatch.setenv("SCAN2BIM_FAKE_FAIL", how)


def test_a_first_run_does_every_stage_once_and_reads_each_scan(site: Site) -> None:
    assert site.calls() == ["survey", "read", "read", "read", *LATER]
    assert json.loads(site.output())["notes"] == ["3 scans"]


def test_a_second_run_does_nothing_again_and_writes_the_same_bytes(site: Site) -> None:
    site.convert()
    first = site.output()
    fake_stages.calls(site.log)
    (site.folder / "out" / "a.json").unlink()
    assert site.calls() == []
    assert site.output() == first
    assert [(run.name, run.made, run.kept) for run in site.convert().stages] == [
        ("survey", 0, 1),
        ("read", 0, 3),
        *((name, 0, 1) for name in LATER),
        ("export", 1, 0),
    ]


def test_a_changed_setting_runs_only_what_depends_on_it(site: Site) -> None:
    site.calls()
    unit = load_settings(None, {"frame": {"unit": "mm"}})
    assert site.calls(settings=unit) == ["survey", "read", "read", "read", *LATER]
    same_frame = load_settings(None, {"frame": {"unit": "mm", "up": "z"}})
    assert site.calls(settings=same_frame) == ["survey"], "the frame is the same, so all the rest is kept"
    sections = {stage.name: stage.settings for stage in STAGES}
    for i, name in enumerate(["surfels", "structure", "openings"]):
        section = sections[name](same_frame)
        assert section is not None
        kind = create_model("Changed", __base__=type(section), more=(int, Field(1, description="A number.")))
        changed = same_frame.model_copy(update={name: kind()})
        assert site.calls(settings=changed) == LATER[i:]
        site.calls(settings=same_frame)


def test_a_changed_scan_is_read_again_and_the_others_are_not(site: Site) -> None:
    site.calls()
    site.scan(1, "7 8 9")
    assert site.calls() == ["survey", "read", *LATER]


def test_a_scan_more_at_the_end_is_the_only_one_read(site: Site) -> None:
    site.calls()
    site.scan(9, "1 2")
    assert site.calls() == ["survey", "read", *LATER]


def test_another_name_or_output_runs_only_what_carries_it(site: Site) -> None:
    site.calls()
    assert site.calls(name="b") == ["model"]
    assert site.calls(name="b", outputs=(site.folder / "c.json",)) == []


def test_results_of_other_settings_are_pruned_after_success(site: Site) -> None:
    site.convert()
    site.convert(settings=load_settings(None, {"frame": {"unit": "mm"}}))
    kept = {p.parent.name: len(list(p.parent.iterdir())) for p in (site.folder / "work" / "stages").glob("*/*")}
    assert kept == {"survey": 1, "read": 3, **dict.fromkeys(LATER, 1)}


@pytest.mark.parametrize("stage", [stage.name for stage in STAGES])
def test_rerun_from_runs_that_stage_and_all_later_ones(site: Site, stage: str) -> None:
    first = site.calls()
    text = site.output()
    expected = first[first.index(stage) :] if stage in first else []
    assert site.calls(rerun_from=stage) == expected
    assert site.output() == text


def test_rerun_from_an_unknown_stage_is_refused(site: Site) -> None:
    assert "'walls'. Expected one of survey, read" in site.fails(UsageError, rerun_from="walls")


@pytest.mark.parametrize("stage", ["survey", "read", *LATER])
def test_a_failed_run_goes_on_where_it_was(site: Site, stage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    site.convert(work=site.folder / "other")
    undisturbed = site.output()
    everything = fake_stages.calls(site.log)
    monkeypatch.setenv("SCAN2BIM_FAKE_FAIL", f"{stage}=bug")
    site.fails(StageError)
    before = fake_stages.calls(site.log)
    monkeypatch.delenv("SCAN2BIM_FAKE_FAIL")
    assert before[:-1] + site.calls() == everything
    assert site.output() == undisturbed


def test_a_bug_in_a_stage_is_one_message_with_the_log_that_holds_the_trace(
    site: Site, break_stage: Callable[[str], None]
) -> None:
    break_stage("structure=bug")
    text = site.fails(StageError)
    log = site.folder / "work" / "log.txt"
    assert "'structure' failed (ZeroDivisionError: a bug)" in text
    assert str(log) in text
    assert "Traceback" in log.read_text()
    assert not (site.folder / "work" / "tmp").exists()


@pytest.mark.parametrize(
    ("how", "kind"), [("oom", ResourceError), ("disk", ResourceError), ("precheck", PrecheckError)]
)
@pytest.mark.parametrize("stage", ["survey", "read", "surfels", "model"])
def test_memory_disk_and_precheck_failures_have_their_own_errors(
    site: Site, stage: str, how: str, kind: type[Scan2BimError], break_stage: Callable[[str], None]
) -> None:
    break_stage(f"{stage}={how}")
    text = site.fails(kind)
    assert text
    assert "Traceback" not in text


def test_one_bad_header_stops_before_any_work(site: Site) -> None:
    site.scan(1, "bad")
    text = site.fails(InputError)
    assert "1.fake: expected numbers" in text
    assert "--keep-going" in text
    assert fake_stages.calls(site.log) == []
    assert not (site.folder / "work").exists()


def test_all_bad_headers_are_named_at_once(site: Site) -> None:
    site.scan(0, "bad")
    site.scan(2, "bad")
    text = site.fails(InputError)
    assert text.startswith("2 of 3 files")
    assert "0.fake" in text
    assert "2.fake" in text


def test_keep_going_leaves_a_bad_header_out_and_says_so(site: Site) -> None:
    site.scan(1, "bad")
    outcome = site.convert(keep_going=True)
    assert (outcome.scans, len(outcome.skipped)) == (2, 1)
    assert any("1.fake" in event.text for event in site.view.of(Warn))
    assert any("1.fake" in note for note in json.loads(site.output())["notes"])


@pytest.mark.parametrize("word", ["torn", "unsampled"])
def test_keep_going_leaves_a_scan_out_whose_points_cannot_be_read(site: Site, word: str) -> None:
    site.scan(1, f"1 2 {word} 3")
    assert "--keep-going" in site.fails(InputError)
    fake_stages.calls(site.log)
    outcome = site.convert(keep_going=True)
    assert (outcome.scans, len(outcome.skipped)) == (2, 1)
    first = site.output()
    assert json.loads(first)["notes"][0] == "2 scans"
    fake_stages.calls(site.log)
    calls = site.calls(keep_going=True)
    assert set(calls) <= {"read", "survey"}, "only what was left out is tried again"
    assert site.output() == first


def test_where_no_scan_is_left_keep_going_fails_too(site: Site) -> None:
    for i in range(3):
        site.scan(i, "bad")
    assert "No file is left" in site.fails(InputError, keep_going=True)
    for i in range(3):
        site.scan(i, "1 torn")
    site.fails(InputError, keep_going=True)


def test_a_bad_output_is_refused_before_any_work(site: Site) -> None:
    site.fails(UsageError, outputs=(site.folder / "a.docx",))
    assert not (site.folder / "work").exists()


def test_a_work_folder_in_use_is_refused(site: Site) -> None:
    with open_work(site.folder / "work"):
        assert "in use by process" in site.fails(UsageError)


def test_progress_rises_to_one_over_the_whole_run(site: Site) -> None:
    site.convert()
    totals = [event.total for event in site.view.of(Moved)]
    assert totals == sorted(totals)
    assert totals[-1] == pytest.approx(1.0)
    assert [event.stage for event in site.view.of(Done)] == ["survey", "read", *LATER, "export"]
    assert any(event.text == "The unit was guessed." for event in site.view.of(Message))


def test_a_plan_tells_what_would_run_and_writes_nothing(site: Site) -> None:
    first = plan(site.request)
    assert not (site.folder / "work").exists()
    assert [(run.name, run.made) for run in first.stages] == [
        ("survey", 1),
        ("read", 3),
        *((name, 1) for name in LATER),
        ("export", 1),
    ]
    assert min(first.needs.seconds, first.needs.memory, first.needs.disk, first.free_disk) > 0
    site.convert()
    second = plan(site.request)
    assert [run.name for run in second.stages if run.made] == ["export"]
    again = plan(replace(site.request, rerun_from="structure"))
    assert [run.name for run in again.stages if run.made] == ["structure", "openings", "model", "export"]


def test_the_settings_used_stand_in_the_work_folder(site: Site) -> None:
    settings = load_settings(None, {"frame": {"unit": "ft"}})
    site.convert(settings=settings)
    assert load_settings(site.folder / "work" / "config.toml") == settings


def test_the_log_tells_the_stages_and_their_times(site: Site) -> None:
    site.convert()
    log = (site.folder / "work" / "log.txt").read_text()
    assert "surfels done in" in log
    assert "of CPU" in log


def test_identifiers_are_kept_from_an_earlier_model_which_is_read_before_any_work(site: Site) -> None:
    earlier = site.convert().building.model_copy(update={"id": "from-before"})
    model = site.folder / "before.json"
    model.write_text(dump_building(earlier))
    assert site.convert(ids_from=model).building.id == "from-before"
    fake_stages.calls(site.log)
    model.write_text("{")
    (site.folder / "scans" / "0.fake").write_text("9.5 2 3")
    assert "before.json" in site.fails(InputError, ids_from=model)
    assert fake_stages.calls(site.log) == []
