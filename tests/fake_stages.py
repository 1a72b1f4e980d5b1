"""Stages and readers that do next to nothing, so that the pipeline's own doings show.

A scan is a text file of numbers, one a point; "bad" at its start makes the header unreadable, "torn" in it the points.
Each stage writes what it got from the stages before, and appends its name to the file that the environment names as
SCAN2BIM_FAKE_CALLS. SCAN2BIM_FAKE_FAIL ("STAGE=oom|disk|bug|precheck|interrupt") makes a stage fail,
SCAN2BIM_FAKE_SLEEP (seconds) makes all slow.
"""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import scan2bim.readers
from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import DamagedFileError, PrecheckError
from scan2bim.model.elements import Building, Dimension, Storey
from scan2bim.workfolder import digest


def install(put: Callable[[Any, str, Any], None]) -> None:
    """Put the fakes in place with ``put(object or dict, name, value)``."""
    for function in (find_inputs, read_headers, read_chunks, sample_points):
        put(scan2bim.readers, function.__name__, function)
    for name, functions in {
        "scan2bim.structure.frame": (find_frame,),
        "scan2bim.cloud.ingest": (ingest_scan,),
        "scan2bim.cloud.surfels": (make_surfels,),
        "scan2bim.structure.orientation": (find_lattice,),
        "scan2bim.structure.build": (find_structure,),
        "scan2bim.openings.build": (find_openings,),
        "scan2bim.assemble": (assemble_building,),
        "scan2bim.coverage.measure": (covered,),
    }.items():
        module = ModuleType(name)
        for function in functions:
            setattr(module, function.__name__, function)
        put(sys.modules, name, module)


def calls(path: Path) -> list[str]:
    """The stages called so far, and forget them."""
    names = path.read_text().split() if path.exists() else []
    path.unlink(missing_ok=True)
    return names


def called(stage: str) -> None:
    if path := os.environ.get("SCAN2BIM_FAKE_CALLS"):
        with Path(path).open("a") as file:
            file.write(f"{stage}\n")
    time.sleep(float(os.environ.get("SCAN2BIM_FAKE_SLEEP", "0")))
    name, _, how = os.environ.get("SCAN2BIM_FAKE_FAIL", "").partition("=")
    if name == stage:
        fail(how)


def fail(how: str) -> None:
    match how:
        case "oom":
            raise MemoryError
        case "disk":
            raise OSError(errno.ENOSPC, "No space left on device")
        case "precheck":
            raise PrecheckError("There is no floor. Scan the floor.")
        case "interrupt":
            raise KeyboardInterrupt
        case _:
            raise ZeroDivisionError("a bug")


def find_inputs(paths: Sequence[Path | str]) -> list[Path]:
    return [file for path in map(Path, paths) for file in (sorted(path.glob("*.fake")) if path.is_dir() else [path])]


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    text = path.read_text()
    if text.startswith("bad"):
        raise DamagedFileError(path, "expected numbers, got nonsense.", "Export it again.")
    return (ScanHeader(path, 0, path.stem, len(text.split()), np.zeros(3)),)


def read_chunks(header: ScanHeader) -> Iterator[Chunk]:
    for word in header.path.read_text().split():
        if word == "torn":
            raise DamagedFileError(header.path, "ends in the middle.", "Export it again.")
        yield Chunk(np.full((1, 3), float(word)))


def sample_points(header: ScanHeader, count: int) -> Chunk:
    if "unsampled" in header.path.read_text():
        raise DamagedFileError(header.path, "ends at once.", "Export it again.")
    return Chunk(np.ones((1, 3)))


def find_frame(headers: Sequence[ScanHeader], samples: Sequence[Chunk], settings: Any) -> SurveyFrame:
    called("survey")
    assert len(headers) == len(samples)
    return SurveyFrame(settings.metres_per_unit or 1.0, settings.up or "z", notes=("The unit was guessed.",))


def ingest_scan(
    header: ScanHeader,
    chunks: Iterator[Chunk],
    station: int,
    frame: SurveyFrame,
    folder: Path,
    settings: Any,
    progress: Callable[[float], None],
) -> None:
    called("read")
    numbers = []
    for chunk in chunks:
        numbers.append(chunk.xyz[0, 0])
        progress(len(numbers) / header.points)
    (folder / "sub").mkdir()
    (folder / "sub" / "points.bin").write_bytes(np.array(numbers).tobytes())
    (folder / "summary.txt").write_text(f"{station} {header.name} {frame.to_json()}")


def taken(folders: Sequence[Path]) -> str:
    """What the results in the folders hold."""
    files = sorted(file for folder in folders for file in folder.rglob("*") if file.is_file())
    return digest(*(file.read_bytes().hex() for file in files if file.name != "manifest.json"))


def find_lattice(scan_folders: Sequence[Path]) -> None:
    pass


def make_surfels(
    scan_folders: Sequence[Path], folder: Path, settings: Any, progress: Callable[[float], None], lattice: None
) -> None:
    called("surfels")
    for i in range(10):
        (folder / f"{i}.bin").write_text(taken(scan_folders))
        progress((i + 1) / 10)


def find_structure(
    surfel_folder: Path, scan_folders: Sequence[Path], folder: Path, settings: Any, progress: Any
) -> None:
    called("structure")
    (folder / "structure.txt").write_text(taken([surfel_folder, *scan_folders]))


def find_openings(
    structure_folder: Path,
    surfel_folder: Path,
    scan_folders: Sequence[Path],
    folder: Path,
    settings: Any,
    progress: Any,
) -> None:
    called("openings")
    (folder / "openings.txt").write_text(taken([structure_folder, surfel_folder, *scan_folders]))


def assemble_building(
    name: str,
    headers: Sequence[ScanHeader],
    frame: SurveyFrame,
    structure_folder: Path,
    openings_folder: Path,
    scan_folders: Sequence[Path],
) -> Building:
    called("model")
    storey = Storey(
        id=taken([structure_folder, openings_folder, *scan_folders]),
        name="Ground floor",
        elevation=Dimension(value=0.125, source="measured"),
    )
    return Building(id="building", name=name, storeys=(storey,), notes=(f"{len(headers)} scans",))


def covered(building: Building, surfel_folder: Path, scan_folders: Sequence[Path]) -> Building:
    taken([surfel_folder, *scan_folders])
    return building


def main() -> int:
    """The real command line with the fakes in place."""
    from scan2bim.cli import main

    def put(target: Any, name: str, value: Any) -> None:
        if isinstance(target, dict):
            target[name] = value
        else:
            setattr(target, name, value)

    install(put)
    return main()


if __name__ == "__main__":
    sys.exit(main())
