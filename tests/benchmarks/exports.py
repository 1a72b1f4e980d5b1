"""Export models in every version of IFC and form of USD, judge the files, and write the section "exports" of
docs/results.md.

    ./run exports MODEL.json | SCENES_DIR ... [--large 1000 --large 10000] [--no-docs]
                  [--rules DIR --python PYTHON] [--modules DIR] [--assets CMD] [--simready CMD] [--indoorgml XSD]

MODEL.json: models as ``scan2bim convert -o model.json`` writes them. SCENES_DIR: a folder of scenes, each with its
scans in ``e57``, which are converted first. The other options name judges that are not installed with the tests
(``export_files.Judges``); columns of those that are not named stay empty. --large: walls of a made-up building, with
half as many openings, to time the export alone.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from document import ROOT, table, write_section
from export_files import Exported, Judges, write_all
from export_judges import IFC_COLUMNS, USD_COLUMNS, clean, path_of

from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Building, Dimension, Opening, Storey, Wall
from scan2bim.model.io import load_building

OUT = ROOT / "out" / "exports"
INTRODUCTION = """\
## Exports

`./run exports`. Errors: of `ifcopenshell.validate --rules`, schema and rules. IDS: specifications of
`schemas/delivery.ids` that are not met. Rules: errors and warnings of buildingSMART's validation rules; "cannot run"
names a rule at which their program ends by itself (see [formats.md](formats.md)). Kernels: greatest difference of a
wall's net volume between OpenCASCADE, CGAL and the stated quantity; web-ifc: between that engine and the stated one.
Check: findings of `scan2bim check` in all three versions."""
USD_INTRODUCTION = """\
USD validators: issues of all that come with USD, over usda, usdc and usdz and the four states of the doors. Asset
validator: of omniverse-asset-validator. SimReady: doors' assets without a missed feature of the profile
Robotics-Prop. Doors open: leaves on hinges that a push of 5 N m opens to their limit, in MuJoCo; ways: those from room
to room that a body of 0.4 m drives along through the open door. IndoorGML: errors by its schema. Rerun alike: files
that a second run writes byte by byte: IFC, USD, maps, JSON."""


def large_building(count: int) -> Building:
    """Walls in rows of 100, every other with an opening."""

    def measured(value: float) -> Dimension:
        return Dimension(value=value, source="measured", sigma=0.002)

    walls: list[Wall] = []
    for i in range(count):
        x, y = i % 100 * 6.0, i // 100 * 5.0
        hole = Opening(
            id=f"opening-{i}", name=f"Opening {i}", confidence=0.9, offset=measured(1.0), sill=measured(0.0),
            width=measured(0.9), height=measured(2.1),
        )  # fmt: skip
        walls.append(
            Wall(
                id=f"wall-{i}", name=f"Wall {i}", confidence=0.9, start=(x, y), end=(x + 5.0, y),
                thickness=measured(0.1 + 0.01 * (i % 30)), base=0.0, height=measured(2.6),
                openings=(hole,) if i % 2 else (),
            )
        )  # fmt: skip
    storey = Storey(id="storey", name="Storey", elevation=measured(0.0), walls=tuple(walls))
    return Building(id="large", name="Large", storeys=(storey,))


def seconds(count: int) -> float:
    """CPU seconds of the export of so many walls."""
    building = large_building(count)
    with TemporaryDirectory() as folder:
        before = time.process_time()
        export(building, Path(folder) / "large.ifc")
        return time.process_time() - before


def models_of(paths: list[Path]) -> Iterator[Path]:
    """The models that were named, and those of the scenes of a folder."""
    for path in paths:
        if path.is_file():
            yield path
        for scene in sorted(path.glob("*/e57")) if path.is_dir() else ():
            model = OUT / f"{scene.parent.name}.json"
            model.parent.mkdir(parents=True, exist_ok=True)
            command = [sys.executable, "-m", "scan2bim.cli", "convert", scene, "-o", model, "--quiet"]
            work = OUT / f"{scene.parent.name}.work"
            subprocess.run([*command, "--work", work, "--name", scene.parent.name], check=True, stdout=sys.stderr)
            yield model


def judged(model: Path, judges: Judges) -> dict[str, str]:
    """Every column of a model."""
    folder = OUT / model.stem
    shutil.rmtree(folder, ignore_errors=True)
    building = load_building(model)
    write_all(building, folder)
    files = Exported(building, folder, judges)
    cells: dict[str, str] = {}
    for name, column in (IFC_COLUMNS | USD_COLUMNS).items():
        cells[name] = column(files)
        print(model.stem, name, cells[name], file=sys.stderr, flush=True)
    return cells


def options_of(arguments: list[str] | None) -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", type=path_of, metavar="MODEL.json | SCENES_DIR")
    parser.add_argument("--large", type=int, action="append", default=[], help="walls of a made-up building to time")
    parser.add_argument("--no-docs", action="store_true", help="print only")
    for name, words in (
        ("rules", "folder of buildingSMART's ifc-gherkin-rules"),
        ("python", "Python of an environment with what the rules need"),
        ("modules", "node_modules with web-ifc"),
        ("assets", "the command omni_asset_validate"),
        ("simready", "the command simready-validate"),
        ("indoorgml", "the schema indoorgmlcore.xsd"),
    ):
        parser.add_argument(f"--{name}", type=path_of, help=words)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a file has errors."""
    options = options_of(arguments)
    judges = Judges(options.rules, options.python, options.modules, options.assets, options.simready, options.indoorgml)
    cells = {model.stem: judged(model, judges) for model in models_of(options.models)}
    parts = [INTRODUCTION]
    for columns, words in ((IFC_COLUMNS, ""), (USD_COLUMNS, USD_INTRODUCTION)):
        rows = [[name, *(found[column] for column in columns)] for name, found in cells.items()]
        parts += [words, table(["model", *columns], rows)] if rows else []
    if options.large:
        timed = [[str(n), str(n // 2), f"{seconds(n):.1f}"] for n in options.large]
        parts += ["The export of rows of walls to IFC4 alone:", table(["walls", "openings", "CPU s"], timed)]
    text = "\n\n".join(part for part in parts if part)
    if not options.no_docs:
        write_section("exports", text)
    print(text)
    return int(not all(clean(found) for found in cells.values()))


if __name__ == "__main__":
    sys.exit(main())
