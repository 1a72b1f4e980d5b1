"""Make the paper's simulated experiments: ``python samples/make_experiments.py FOLDER [--only office|hall|sweep] ...``.

office: 5 rooms, 6 doors, 9 windows; hall: 18 closed doors; sweep: 44 rooms with 0 to 50 % of a wall hidden. Each
variant gets a folder with one E57 file per station and ``truth.json``. The same seeds give the same scenes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scan2bim.simulate.cases import CASES, case
from scan2bim.simulate.e57 import write_e57
from scan2bim.simulate.effects import World
from scan2bim.simulate.hall import hall
from scan2bim.simulate.mesh import build_mesh
from scan2bim.simulate.office import office
from scan2bim.simulate.scanner import cast
from scan2bim.simulate.scene import Scene
from scan2bim.simulate.truth import truth_of
from scan2bim.simulate.variation import scanner
from scan2bim.simulate.visibility import with_occlusion
from scan2bim.truth.io import write_truth

KINDS: dict[str, Callable[[int], Scene]] = {"office": office, "hall": hall, "sweep": case}
STEP = 0.2
"""Degrees between rays: 17 mm at 5 m. Terrestrial scanners reach a fifth of it."""


def make(kind: str, seed: int, folder: Path, step: float = STEP) -> Path:
    """One variant in a folder of its own, made whole or not at all; kept where it is there already."""
    place = folder / f"{kind}_{seed:02d}"
    if (place / "truth.json").exists():
        return place
    place.mkdir(parents=True, exist_ok=True)
    scene = KINDS[kind](seed)
    world = World(build_mesh(scene))
    spec = scanner(step, np.random.default_rng([seed, len(kind)]))
    for station in scene.stations:
        write_e57(place / f"{station.name}.e57", [cast(scene, station, spec, seed, world)])
    write_truth(place / "truth.json", with_occlusion(truth_of(scene), scene, world))
    return place


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=sorted(KINDS), action="append", help="just this kind; may be given again")
    parser.add_argument("--variants", type=int, default=10, help="of office and hall (default 10)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first variant (default 1)")
    parser.add_argument("--step", type=float, default=STEP, help=f"degrees between rays (default {STEP})")
    options = parser.parse_args()
    for kind in options.only or KINDS:
        seeds = range(CASES) if kind == "sweep" else range(options.first, options.first + options.variants)
        for seed in seeds:
            print(make(kind, seed, options.folder, options.step), flush=True)


if __name__ == "__main__":
    main()
