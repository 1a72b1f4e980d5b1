"""Convert the bench's scenes and real clouds, score them, draw them, and write docs/results.md.

    ./run results [--bench DIR] [--scenes DIR] [--real DIR ...] [--scans e57|laz|ply] [--only NAME]

The scenes are made in --scenes where they are missing. With --only nothing is written to docs: the table goes to the
terminal. All models, logs, scores and pictures stay in out/results.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from bench import BENCH, SCANS, SCENES, SceneScore, find_scenes, score
from cloud_tables import cloud_pages, cloud_tables
from clouds import LICENSED, REAL, CloudResult, find_clouds, judge_cloud, rough_truth
from conversion import OUT, Conversion, convert, warm_up
from document import ROOT, write_section
from scene_tables import scene_tables

IMAGES = ROOT / "docs" / "img"
INTRODUCTION = """\
## How right

`{command}`, on the bench's scenes and on real clouds. Pictures are shown of real clouds whose licence allows it; those
of the scenes and of the other clouds stay in `out/results/img`."""


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a conversion of a scene failed."""
    options = parse(arguments)
    folders = [REAL, *options.real]
    scenes = find_scenes(options.bench, options.scenes, options.only)
    clouds = find_clouds(folders, options.only)
    if not scenes and not clouds:
        print("Nothing to convert. Name scenes with --bench, clouds with --real; see --help.", file=sys.stderr)
        return 2
    warm_up(clouds)
    scores = [_scene(options.bench, scene, options.scans) for scene in scenes]
    results = [_cloud(cloud, folders) for cloud in clouds]
    pictures = {r.name: _published(r) for r in results if options.only is None}
    text = _text(scores, results, pictures, options.scans)
    if options.only is None:
        write_section("results", text)
    print(text)
    return int(any(s.conversion.cost.code != 0 for s in scores))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", type=Path, default=BENCH, help="folder of the bench, with score.py")
    parser.add_argument(
        "--scenes", type=Path, default=SCENES, help="where its scenes lie or are made (default out/bench)"
    )
    parser.add_argument("--real", type=Path, nargs="+", default=[], help="further folders of real clouds")
    parser.add_argument("--scans", choices=SCANS, default="e57", help="which files of a scene (default e57)")
    parser.add_argument("--only", help="just the scene or cloud of this name")
    options = parser.parse_args(arguments)
    for name in ("bench", "scenes"):
        setattr(options, name, getattr(options, name).resolve())
    return options


def _scene(bench: Path, scene: Path, scans: str) -> SceneScore:
    done = convert(scene.name, scene / SCANS[scans])
    result = score(bench, scene, done)
    _finish(done)
    return result


def _cloud(cloud: Path, folders: list[Path]) -> CloudResult:
    done = convert(cloud.stem, cloud)
    result = judge_cloud(done, rough_truth(cloud, folders))
    _finish(done)
    return result


def _finish(done: Conversion) -> None:
    """Draw it, drop its work folder, which is large, and say so."""
    if done.cost.code == 0:
        from pictures import draw_pictures

        draw_pictures(done, OUT / "img")
    shutil.rmtree(done.work, ignore_errors=True)
    print(
        f"{done.name}: exit {done.cost.code}, {done.cost.cpu:.1f} CPU s {done.complaint}", file=sys.stderr, flush=True
    )


def _published(result: CloudResult) -> list[Path]:
    """The pictures of a cloud, copied to docs where its licence allows."""
    made = sorted((OUT / "img").glob(f"{result.name}_*.png")) if result.conversion.cost.code == 0 else []
    if result.name not in LICENSED:
        return []
    IMAGES.mkdir(parents=True, exist_ok=True)
    for old in IMAGES.glob(f"{result.name}_*.png"):
        old.unlink()
    return [Path(shutil.copy(path, IMAGES)) for path in made]


def _text(scores: list[SceneScore], results: list[CloudResult], pictures: dict[str, list[Path]], scans: str) -> str:
    command = "./run results" if scans == "e57" else f"./run results --scans {scans}"
    parts = [INTRODUCTION.format(command=command)]
    if scores:
        parts.append(scene_tables(scores, scans))
    if results:
        parts += ["## Real clouds", cloud_tables(results), cloud_pages(results, pictures)]
    return "\n\n".join(parts)


if __name__ == "__main__":
    sys.exit(main())
