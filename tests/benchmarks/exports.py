"""Export models in every version of IFC, judge the files, and write the section "exports" of docs/results.md.

    ./run exports MODEL.json [MODEL.json ...] [--large 1000 --large 10000] [--no-docs]

MODEL.json: models as ``scan2bim convert -o model.json`` writes them. Each column is a function of a model and its
written file, so that other formats add theirs to ``COLUMNS``. --large: walls of a made-up building, with half as many
openings, to time the export alone.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from document import table, write_section

from scan2bim.check.run import check_file
from scan2bim.config import ExportSettings
from scan2bim.exporters.ifc import export
from scan2bim.model.elements import Building, Dimension, Opening, Storey, Wall
from scan2bim.model.io import load_building

VERSIONS = ("IFC4", "IFC4X3_ADD2", "IFC2X3")
INTRODUCTION = """\
## Exports

`./run exports`. Errors: of `ifcopenshell.validate --rules`, schema and rules. Kernels: greatest difference of a wall's
net volume between OpenCASCADE, CGAL and the stated quantity. Check: findings of `scan2bim check` (walls that overlap
and spaces in walls are faults of the model, which the file shows as they are). Rerun: byte-identical."""

Column = Callable[[Building, Path], str]


def errors_of(version: str) -> Column:
    """A column: how many errors the validator finds in a version."""

    def column(building: Building, folder: Path) -> str:
        import ifcopenshell
        import ifcopenshell.validate

        path = folder / f"{version}.ifc"
        export(building, path, ExportSettings(ifc_version=version))
        log = ifcopenshell.validate.json_logger()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            ifcopenshell.validate.validate(ifcopenshell.open(str(path)), log, express_rules=True)
        return str(len(log.statements))

    return column


def kernels(building: Building, folder: Path) -> str:
    """Greatest difference of net volumes, per cent."""
    import ifcopenshell
    import ifcopenshell.geom
    import ifcopenshell.util.element as util
    import ifcopenshell.util.shape

    path = folder / "kernels.ifc"
    export(building, path)
    file = ifcopenshell.open(str(path))
    settings = ifcopenshell.geom.settings()
    worst = 0.0
    for wall in file.by_type("IfcWall"):
        volumes = [util.get_pset(wall, "Qto_WallBaseQuantities", "NetVolume")]
        for kernel in ("opencascade", "cgal"):
            shape = ifcopenshell.geom.create_shape(settings, wall, geometry_library=kernel)
            volumes.append(ifcopenshell.util.shape.get_volume(shape.geometry))
        worst = max(worst, (max(volumes) - min(volumes)) / max(*volumes, 1e-09))
    return f"{100 * worst:.3f} %"


def check(building: Building, folder: Path) -> str:
    """Findings of our own checker."""
    path = folder / "check.ifc"
    export(building, path)
    found = check_file(path).findings
    kinds = sorted({f.check for f in found})
    return f"{len(found)}" + (f" ({', '.join(kinds)})" if kinds else "")


def rerun(building: Building, folder: Path) -> str:
    """Whether two runs write the same bytes."""
    export(building, folder / "a.ifc")
    export(building, folder / "b.ifc")
    return "yes" if (folder / "a.ifc").read_bytes() == (folder / "b.ifc").read_bytes() else "NO"


COLUMNS: dict[str, Column] = {
    **{f"{version} errors": errors_of(version) for version in VERSIONS},
    "kernels": kernels,
    "check": check,
    "rerun": rerun,
}


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


def main(arguments: list[str] | None = None) -> int:
    """Do it all; 1 where a file has errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", type=Path, metavar="MODEL.json")
    parser.add_argument("--large", type=int, action="append", default=[], help="walls of a made-up building to time")
    parser.add_argument("--no-docs", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    rows: list[list[str]] = []
    for model in options.models:
        building = load_building(model)
        with TemporaryDirectory() as folder:
            rows.append([model.stem, *(column(building, Path(folder)) for column in COLUMNS.values())])
        print(rows[-1], file=sys.stderr, flush=True)
    parts = [INTRODUCTION]
    if rows:
        parts.append(table(["model", *COLUMNS], rows))
    if options.large:
        timed = [[str(n), str(n // 2), f"{seconds(n):.1f}"] for n in options.large]
        parts.append(table(["walls", "openings", "CPU s"], timed))
    text = "\n\n".join(parts)
    if not options.no_docs:
        write_section("exports", text)
    print(text)
    return int(any(cell != "0" for row in rows for cell in row[1 : 1 + len(VERSIONS)]))


if __name__ == "__main__":
    sys.exit(main())
