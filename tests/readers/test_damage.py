"""Hundreds of damaged and odd files of every format: each ends in one of our errors, or in sound points."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from readers.damage import write_cases

FLIPS = 4
MEGABYTES = 600
"""Memory beyond what the libraries take once loaded: a count of points in a header must never be allocated."""
SECONDS = 10


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    folder = tmp_path_factory.mktemp("damage") / "cases"
    written = write_cases(folder, FLIPS)
    runner = Path(__file__).with_name("damage_runner.py")
    command = [sys.executable, str(runner), str(folder), str(MEGABYTES), str(SECONDS)]
    plain = {name: value for name, value in os.environ.items() if name != "RUST_BACKTRACE"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, f"died at {lines[-1] if lines else 'the good files'}: {done.stderr[-2000:]}"
    results = {line["case"]: line for line in lines if "kind" in line}
    assert len(results) == written
    assert "stack backtrace" not in done.stderr
    return results


def test_every_damaged_file_ends_in_our_error_or_in_sound_points(outcomes: dict[str, dict[str, str]]) -> None:
    assert len(outcomes) >= 200
    escaped = [outcome for outcome in outcomes.values() if outcome["kind"] == "escaped"]
    assert not escaped, escaped[:5]


def test_every_error_names_the_file_and_says_what_to_do(outcomes: dict[str, dict[str, str]]) -> None:
    errors = [outcome for outcome in outcomes.values() if outcome["kind"] == "error"]
    assert len(errors) > 100
    for outcome in errors:
        assert outcome["case"] in outcome["message"], outcome
        assert len(outcome["message"]) < 600 and "\n" not in outcome["message"], outcome
        assert outcome["type"] in ("DamagedFileError", "InputError"), outcome


def test_no_truncated_file_is_read_in_part(outcomes: dict[str, dict[str, str]]) -> None:
    """Lines of a text file without a count can end anywhere: only a torn line shows there."""
    for name, outcome in outcomes.items():
        if "-cut" in name and not name.endswith((".xyz", ".csv")) and name != "ascii-cutlast.pcd":
            assert outcome["kind"] == "error", outcome


def test_points_of_a_truncated_compressed_or_paged_file_are_never_trusted(outcomes: dict[str, dict[str, str]]) -> None:
    flipped = [outcome for name, outcome in outcomes.items() if name.endswith(".e57") and "-flip" in name]
    assert flipped and all(outcome["kind"] == "error" for outcome in flipped)
