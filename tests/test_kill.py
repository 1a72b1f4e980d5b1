"""A conversion that is killed at any moment goes on where it was and ends in the same bytes."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import fake_stages
import pytest
from synthetic import write_scene

from scan2bim.simulate.scenes import two_rooms

KILLS = 20
GRACE = 60.0
"""Seconds after which a run counts as hung."""


@dataclass(frozen=True)
class Conversion:
    """A command line that converts ``inputs`` into ``out``, and what it takes undisturbed."""

    command: tuple[str, ...]
    out: Path
    extra: Mapping[str, str]

    def start(self) -> subprocess.Popen[bytes]:
        # Modules are compiled once for all runs, even where the environment forbids that: it is half of a small run.
        compiled = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(self.out.parent / "compiled")}
        environment = {**os.environ, **compiled, **self.extra}
        return subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment)

    def finish(self) -> float:
        """Run to the end; gives the seconds."""
        began = time.monotonic()
        process = self.start()
        _, err = process.communicate(timeout=GRACE)
        assert process.returncode == 0, err.decode()
        return time.monotonic() - began

    def killed_after(self, seconds: float) -> bool:
        """Kill a run after so many seconds. False where it was done before."""
        process = self.start()
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
        _, err = process.communicate(timeout=GRACE)
        assert process.returncode in (0, -9), err.decode()
        return process.returncode == -9

    def files(self) -> dict[str, bytes]:
        """All files that a user sees."""
        names = (p.relative_to(self.out) for p in sorted(self.out.rglob("*")) if p.is_file())
        return {n.as_posix(): (self.out / n).read_bytes() for n in names if not n.parts[0].startswith(".")}

    def wipe(self) -> None:
        shutil.rmtree(self.out, ignore_errors=True)


def kill_and_compare(conversion: Conversion, kills: int, chance: random.Random) -> None:
    """Kill at random moments of the run, going on each time with what was left; compare whenever a run gets done."""
    conversion.finish()
    undisturbed = conversion.files()
    assert undisturbed
    conversion.wipe()
    whole = conversion.finish()
    assert conversion.files() == undisturbed
    conversion.wipe()
    done = 0
    for _ in range(20 * kills):
        if conversion.killed_after(chance.uniform(0, whole)):
            done += 1
            for name, content in conversion.files().items():
                assert content == undisturbed[name], f"{name} stands half written after a kill"
        else:
            assert conversion.files() == undisturbed
            conversion.wipe()
        if done >= kills:
            break
    assert done == kills
    conversion.finish()
    assert conversion.files() == undisturbed


def scans(folder: Path, texts: Sequence[str]) -> Path:
    folder.mkdir()
    for i, text in enumerate(texts):
        (folder / f"{i}.fake").write_text(text)
    return folder


@pytest.mark.slow
def test_fake_stages_killed_at_random_moments_end_in_the_same_bytes(tmp_path: Path) -> None:
    inputs = scans(tmp_path / "scans", ["1 2 3", "4 5", "6 7 8 9"])
    out = tmp_path / "out"
    command = (sys.executable, fake_stages.__file__, "convert", str(inputs), "-o", str(out / "a.json"))
    kill_and_compare(Conversion(command, out, {"SCAN2BIM_FAKE_SLEEP": "0.03"}), KILLS // 2, random.Random(7))


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "kills"), [(1, KILLS), (2, 2)])
def test_a_real_conversion_killed_at_random_moments_ends_in_the_same_bytes(
    tmp_path: Path, jobs: int, kills: int
) -> None:
    write_scene(tmp_path / "scans", two_rooms())
    out = tmp_path / "out"
    outputs = [argument for name in ("a.json", "a.ifc") for argument in ("-o", str(out / name))]
    command = (sys.executable, "-m", "scan2bim.cli", "convert", str(tmp_path / "scans"), "--jobs", str(jobs), *outputs)
    kill_and_compare(Conversion(command, out, {}), kills, random.Random(11))
