"""Make the sample flat again: ``python samples/make_flat.py [FOLDER]``.

Writes one E57 file per station with pose, rows and columns, colour, intensity and misses, and ``truth.json``. The same
machine and libraries give the same bytes.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from scan2bim.simulate.e57 import write_e57
from scan2bim.simulate.scanner import ScannerSpec, cast_all
from scan2bim.simulate.scenes import rotated_flat
from scan2bim.simulate.truth import truth_of
from scan2bim.truth.io import write_truth

SPEC = ScannerSpec(
    step=math.radians(0.9),  # some 66,000 rays a station: seven stations stay below 6 MB
    noise=0.002,  # of a usual phase scanner on white walls at 5 m
    registration=0.0015,  # of a usual target-based registration indoors
    registration_turn=math.radians(0.01),
)
SEED = 7


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    scene = rotated_flat()
    for sweep in cast_all(scene, SPEC, SEED):
        write_e57(folder / f"{sweep.name}.e57", [sweep])
    write_truth(folder / "truth.json", truth_of(scene))
    total = sum(path.stat().st_size for path in folder.iterdir())
    print(f"{len(scene.stations)} stations, {total / 1e6:.1f} MB in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "flat")
