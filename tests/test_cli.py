"""The command line: exit codes, what goes to stdout and what to stderr, and that it starts fast."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import fake_stages
import numpy as np
import pytest
from synthetic import two_rooms, write_scene

from scan2bim import __version__, cli
from scan2bim.commands.convert import default_work
from scan2bim.commands.verify import read_transform
from scan2bim.config import UNITS, FrameSettings, load_settings
from scan2bim.errors import Scan2BimError
from scan2bim.model.io import schema
from scan2bim.simulate.stations import read_stations
from scan2bim.stages import STAGES

FAKE_CLI = Path(fake_stages.__file__)
Run = Callable[..., tuple[int, str, str]]


def _ignore(number: int, handler: object) -> None:
    """Takes the place of ``signal.signal``."""


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command line in this process, with fake stages; gives exit code, stdout and stderr."""

    def put(target: Any, name: str, value: Any) -> None:
        if isinstance(target, dict):
            monkeypatch.setitem(target, name, value)
        else:
            monkeypatch.setattr(target, name, value)

    fake_stages.install(put)
    monkeypatch.setattr(signal, "signal", _ignore)

    def call(*arguments: object) -> tuple[int, str, str]:
        code = cli.main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return call


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    folder = tmp_path / "scans"
    folder.mkdir()
    for i in range(3):
        (folder / f"{i}.fake").write_text(f"{i} 2 3")
    return folder


def test_the_lists_of_the_parser_are_those_of_the_program() -> None:
    assert tuple(UNITS) == cli.UNITS
    assert tuple(stage.name for stage in STAGES) == cli.STAGES
    for axis in cli.AXES:
        assert FrameSettings.model_validate({"up": axis}).up == axis


def test_help_and_version_go_to_stdout_with_exit_code_0(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        (["--help"], "convert"),
        (["--version"], __version__),
        (["convert", "-h"], "--rerun-from"),
    ):
        with pytest.raises(SystemExit) as caught:
            cli.main(arguments)
        assert caught.value.code == 0
        assert words in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["bake"],
        ["convert"],
        ["convert", "a.e57"],
        ["convert", "-o", "a.ifc"],
        ["convert", "a.e57", "-o", "a.ifc", "--unit", "furlong"],
        ["convert", "a.e57", "-o", "a.ifc", "--up", "w"],
        ["convert", "a.e57", "-o", "a.ifc", "--jobs", "0"],
        ["convert", "a.e57", "-o", "a.ifc", "--rerun-from", "walls"],
        ["convert", "a.e57", "-o", "a.ifc", "--quiet", "--json"],
    ],
)
def test_a_wrong_command_line_ends_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments)
    assert caught.value.code == 2
    assert "usage: scan2bim" in capsys.readouterr().err


def test_schema_prints_the_models_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()


def test_convert_writes_its_outputs_tells_the_result_on_stdout_and_talks_on_stderr(
    run: Run, scans: Path, tmp_path: Path
) -> None:
    code, out, err = run("convert", scans, "-o", tmp_path / "a.json", "-o", tmp_path / "b.json")
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "a: 3 scans, 9 points"
    assert lines[2].split() == [
        "storey",
        "elevation",
        "spaces",
        "walls",
        "doors",
        "open",
        "doors",
        "closed",
        "windows",
        "passages",
    ]
    assert lines[3].split() == ["Ground", "floor", "0.12", "m", "0", "0", "0", "0", "0", "0"]
    assert "note: 3 scans" in out
    assert f"wrote {tmp_path / 'b.json'}" in out
    assert "surfels: done in" in err
    assert str(tmp_path / ".a.scan2bim-work") in err
    assert json.loads((tmp_path / "a.json").read_text())["name"] == "a"
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_json_gives_the_result_on_stdout_and_events_on_stderr(run: Run, scans: Path, tmp_path: Path) -> None:
    code, out, err = run("convert", scans, "-o", tmp_path / "a.json", "--json", "--name", "House")
    assert code == 0
    result = json.loads(out)
    assert result["building"]["name"] == "House"
    assert result["storeys"][0]["walls"] == 0
    assert result["files"][0]["path"] == str(tmp_path / "a.json")
    assert [stage["stage"] for stage in result["stages"]] == [stage.name for stage in STAGES]
    events = [json.loads(line) for line in err.splitlines()]
    assert {"message", "started", "moved", "done"} <= {event["event"] for event in events}


def test_quiet_says_nothing_on_stderr(run: Run, scans: Path, tmp_path: Path) -> None:
    code, out, err = run("convert", scans, "-o", tmp_path / "a.json", "--quiet")
    assert (code, err) == (0, "")
    assert "wrote" in out


def test_verbose_shows_the_log(run: Run, scans: Path, tmp_path: Path) -> None:
    assert "scan2bim.pipeline: surfels begins" in run("convert", scans, "-o", tmp_path / "a.json", "-v")[2]


def test_dry_run_tells_and_writes_nothing(run: Run, scans: Path, tmp_path: Path) -> None:
    code, out, _ = run("convert", scans, "-o", tmp_path / "a.json", "--dry-run")
    assert code == 0
    assert next(line for line in out.splitlines() if line.startswith("read")).split()[:3] == ["read", "3", "0"]
    assert "of memory" in out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scans"]
    code, out, _ = run("convert", scans, "-o", tmp_path / "a.json", "--dry-run", "--json")
    assert json.loads(out)["stages"][1] == {"stage": "read", "to_run": 3, "kept": 0, "seconds": pytest.approx(0.5)}


def test_coordinates_and_settings_reach_the_stages(run: Run, scans: Path, tmp_path: Path) -> None:
    config = tmp_path / "my.toml"
    config.write_text('[frame]\nunit = "ft"\nup = "y"\n')
    arguments = (
        "convert",
        scans,
        "-o",
        tmp_path / "a.json",
        "--config",
        config,
        "--up",
        "-x",
        "--work",
        tmp_path / "w",
    )
    assert run(*arguments)[0] == 0
    used = (tmp_path / "w" / "config.toml").read_text()
    assert 'unit = "ft"' in used
    assert 'up = "-x"' in used


@pytest.mark.parametrize(
    ("how", "code", "words"),
    [
        ("precheck", 4, "no floor"),
        ("bug", 5, "log.txt"),
        ("oom", 6, "Memory ran out"),
        ("disk", 6, "is full"),
        ("interrupt", 130, "run the same command again to go on"),
    ],
)
def test_each_failure_has_its_exit_code_and_one_message(
    run: Run, scans: Path, tmp_path: Path, how: str, code: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SCAN2BIM_FAKE_FAIL", f"structure={how}")
    got, out, err = run("convert", scans, "-o", tmp_path / "a.json")
    assert got == code
    assert out == ""
    assert words in err.splitlines()[-1]
    assert "Traceback" not in err
    assert not (tmp_path / "a.json").exists()
    got, _, err = run("convert", scans, "-o", tmp_path / "a.json", "--json")
    last = json.loads(err.splitlines()[-1])
    assert (last["event"], last["exit_code"]) == ("failed", code)
    assert words in last["text"]


def test_usage_and_input_errors_have_their_exit_codes(run: Run, scans: Path, tmp_path: Path) -> None:
    assert run("convert", scans, "-o", tmp_path / "a.docx")[0] == 2
    assert run("convert", scans, "-o", tmp_path / "a.json", "--config", tmp_path / "none.toml")[0] == 2
    assert run("convert", scans, "-o", tmp_path / "a.json", "--name", " ")[0] == 2
    (scans / "1.fake").write_text("bad")
    code, _, err = run("convert", scans, "-o", tmp_path / "a.json")
    assert (code, "1.fake" in err) == (3, True)
    code, out, err = run("convert", scans, "-o", tmp_path / "a.json", "--keep-going")
    assert code == 0
    assert "warning: left out:" in err
    assert "note: Left out" in out


def test_a_failure_outside_of_a_stage_leaves_its_trace_in_a_file(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("scan2bim.commands.convert.make_request", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    code, _, err = run("convert", scans, "-o", tmp_path / "a.json")
    assert code == 1
    assert "Traceback" not in err
    (trace,) = tmp_path.glob("scan2bim-error-*.txt")
    assert str(trace) in err
    assert "Traceback" in trace.read_text()


def test_a_missing_package_sends_to_the_doctor(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise ModuleNotFoundError("No module named 'numba'")

    monkeypatch.setattr("scan2bim.commands.convert.make_request", broken)
    code, _, err = run("convert", "a", "-o", "b.ifc")
    assert code == 1
    assert "scan2bim doctor" in err


@pytest.mark.parametrize(
    ("output", "work"),
    [
        ("out/house.ifc", "out/.house.scan2bim-work"),
        ("house.usda", ".house.scan2bim-work"),
        ("delivery", "delivery/.scan2bim-work"),
        ("out/house.view.png", "out/.house.scan2bim-work"),
    ],
)
def test_the_work_folder_is_hidden_at_the_first_output(output: str, work: str) -> None:
    assert default_work([Path(output), Path("elsewhere/b.ifc")]) == Path(work)


def spawn(arguments: Sequence[object], **extra: str) -> subprocess.Popen[str]:
    environment: Mapping[str, str] = {**os.environ, **extra}
    command = [sys.executable, str(FAKE_CLI), *map(str, arguments)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 -- shells ignore it in the background
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_process_ends_with_130_and_a_rerun_goes_on(scans: Path, tmp_path: Path, number: int) -> None:
    arguments = ["convert", scans, "-o", tmp_path / "a.json"]
    calls = tmp_path / "calls.txt"
    process = spawn(arguments, SCAN2BIM_FAKE_SLEEP="0.3", SCAN2BIM_FAKE_CALLS=str(calls))
    deadline = time.monotonic() + 20
    while not calls.exists() or "surfels" not in calls.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(number)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err.splitlines()[-1].startswith("scan2bim: error: interrupted. What is done is kept")
    fake_stages.calls(calls)
    process = spawn(arguments, SCAN2BIM_FAKE_CALLS=str(calls))
    assert process.communicate(timeout=20)[0]
    assert fake_stages.calls(calls) == ["surfels", "structure", "openings", "model"]


def test_a_closed_stdout_is_no_error(scans: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "scan2bim.cli", "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    err = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=20) in (0, 141)
    assert err == b""


@pytest.fixture
def clouds(tmp_path: Path) -> Path:
    """Two rooms' scans, as E57."""
    write_scene(tmp_path / "clouds", two_rooms())
    (tmp_path / "clouds" / "truth.json").unlink()
    return tmp_path / "clouds"


def test_info_tells_what_is_in_the_scans(clouds: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["info", str(clouds)]) == 0
    out = capsys.readouterr().out
    assert "2 scans in 2 files" in out
    assert "Unit: m. Up: z." in out
    assert cli.main(["info", str(clouds), "--json", "--unit", "mm", "--up", "-x"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["unit"], report["up"], len(report["scans"])) == ("mm", "-x", 2)
    assert min(report["cost"].values()) > 0


def test_info_describes_the_readable_files_and_ends_with_3_over_others(
    clouds: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (clouds / "torn.e57").write_bytes((clouds / "east.e57").read_bytes()[:5000])
    assert cli.main(["info", str(clouds)]) == 3
    out = capsys.readouterr().out
    assert "torn.e57" in out
    assert "2 scans in 3 files" in out
    assert cli.main(["info", str(clouds / "torn.e57")]) == 3
    assert "torn.e57" in capsys.readouterr().err


def test_info_of_scans_without_points_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.xyz").write_text("nan nan nan\n" * 20)
    assert cli.main(["info", str(tmp_path / "a.xyz")]) == 0
    assert "valid point" in capsys.readouterr().out


@pytest.mark.parametrize(
    "read", [read_transform, lambda path: read_stations(path, np.random.default_rng(1)), load_settings]
)
def test_a_missing_file_is_told_in_words_alone(read: Callable[[Path], object], tmp_path: Path) -> None:
    with pytest.raises(Scan2BimError) as told:
        read(tmp_path / "nothing.txt")
    assert "such" in str(told.value) and "Errno" not in str(told.value)
    assert str(told.value).count("nothing.txt") == 1
