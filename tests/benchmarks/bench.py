"""The bench's scenes: made where they are missing, scored by the bench's own scorer."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench_truth import bench_truth
from conversion import Conversion
from document import ROOT

from scan2bim.evaluate.frames import in_frame_of
from scan2bim.evaluate.report import Evaluation
from scan2bim.evaluate.report import score as evaluate
from scan2bim.truth.ifc import read_ifc

BENCH = ROOT.parent / "shared" / "bench"
SCENES = ROOT / "out" / "bench"
SCANS = {"e57": "e57", "laz": "laz/merged.laz", "ply": "ply/merged.ply"}
"""What is converted of a scene's folder, by the choice of --scans."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneScore:
    """A converted scene, what the scorer says of it, and what our own measures say against the same truth, None where
    nothing was written. points: records in the scans.
    """

    conversion: Conversion
    points: int
    score: dict[str, Any]
    own: Evaluation | None

    def value(self, *keys: str) -> float | None:
        """A number of the score by its place; None where there is none."""
        found: Any = self.score
        for key in keys:
            found = found.get(key) if isinstance(found, dict) else None
        return None if found is None else float(found)

    @property
    def open_doors(self) -> OpenDoors:
        """How well open doors were found."""
        doors = self.score["doors"]
        return OpenDoors(doors["open"]["found"], doors["open"]["truth"], len(doors["false"]))


@dataclass(frozen=True, slots=True)
class OpenDoors:
    """Open doors found, those there are, and predicted doors that are none.

    Precision is found / (found + false): a predicted door that is a closed one is neither right nor wrong here.
    """

    found: int
    truth: int
    false: int

    @property
    def recall(self) -> float | None:
        """Share of the open doors that were found."""
        return self.found / self.truth if self.truth else None

    @property
    def precision(self) -> float | None:
        """Share of right ones among the predicted doors that are no closed ones."""
        return self.found / (self.found + self.false) if self.found + self.false else None

    @property
    def f1(self) -> float | None:
        """2 found / (2 found + missed + false); None where there are no open doors."""
        return 2 * self.found / (self.found + self.truth + self.false) if self.truth else None


def find_scenes(bench: Path, scenes: Path, only: str | None) -> list[Path]:
    """The scenes' folders; those that are missing are made first, where the bench is there. Exits in words."""
    if not (bench / "score.py").is_file():
        print(
            f"No bench in {bench}: scenes are left out. Name its folder (the one with score.py) with --bench DIR.",
            file=sys.stderr,
        )
        return []
    names = [name for name in scene_names(bench) if only in (None, name)]
    for name in names:
        if not (scenes / name / "truth.json").exists():
            _make(bench, scenes, name)
    return [scenes / name for name in names if (scenes / name / "truth.json").exists()]


def scene_names(bench: Path) -> list[str]:
    """The names of the scenes that the bench can make."""
    code = "import json, make_scenes; print(json.dumps(list(make_scenes.SCENES)))"
    done = subprocess.run([sys.executable, "-B", "-c", code], cwd=bench, capture_output=True, check=True, text=True)
    return list(json.loads(done.stdout))


def _make(bench: Path, scenes: Path, name: str) -> None:
    print(f"making {name} in {scenes}: takes minutes", file=sys.stderr)
    scenes.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-B", str(bench / "make_scenes.py"), str(bench / "models"), str(scenes), name]
    subprocess.run(command, check=True, stdout=sys.stderr)


def score(bench: Path, scene: Path, conversion: Conversion) -> SceneScore:
    """Score the IFC that was written; one that was not written scores 0."""
    path = conversion.ifc.with_suffix(".score.json")
    command = [sys.executable, "-B", str(bench / "score.py"), str(conversion.ifc), str(scene), "--json", str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    conversion.ifc.with_suffix(".score.txt").write_text(done.stdout, encoding="utf-8")
    truth = json.loads((scene / "truth.json").read_text(encoding="utf-8"))
    return SceneScore(
        conversion, int(truth["points"]), json.loads(path.read_text(encoding="utf-8")), _own(scene, conversion)
    )


def _own(scene: Path, conversion: Conversion) -> Evaluation | None:
    if not conversion.ifc.is_file():
        return None
    true = bench_truth(scene / "truth.json")
    predicted, frame = in_frame_of(true, read_ifc(conversion.ifc))
    return evaluate(predicted, true, conversion.ifc.name, scene.name, frame)
