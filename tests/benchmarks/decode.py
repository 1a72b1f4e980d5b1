"""The yardstick: decode the points of E57 or LAZ files and throw them away. Prints points and CPU seconds as JSON.

    python decode.py FILE_OR_FOLDER ...

E57: libE57's own loop through pye57, chunks of 0.5 M points into reused buffers, the checksum of every page verified;
coordinates, invalid state, colour and intensity, all that a conversion takes. LAZ: lazrs, chunks of 0.5 M points, all
fields, as the format has no columns of its own. Only the loop counts: not starting Python, not imports.
"""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from measure import cpu_seconds

CHUNK = 500_000
E57_FIELDS = {
    **dict.fromkeys(("cartesianX", "cartesianY", "cartesianZ"), np.float64),
    "cartesianInvalidState": np.uint8,
    **dict.fromkeys(("colorRed", "colorGreen", "colorBlue"), np.uint8),
    "intensity": np.float32,
}


def main(paths: list[str]) -> int:
    """Decode all files, those of folders too, and print what it took."""
    files = list(_files(map(Path, paths)))
    kinds = {path.suffix.lower() for path in files}
    importlib.import_module("pye57.libe57" if ".e57" in kinds else "laspy")
    begin = cpu_seconds()
    points = sum(decode_e57(path) if path.suffix.lower() == ".e57" else decode_laz(path) for path in files)
    print(json.dumps({"points": points, "cpu": cpu_seconds() - begin}))
    return 0


def _files(paths: Iterator[Path] | map[Path]) -> Iterator[Path]:
    for path in paths:
        yield from sorted(p for p in path.rglob("*") if p.suffix == ".e57") if path.is_dir() else [path]


def decode_e57(path: Path) -> int:
    """Decode all scans of a file; gives the number of records."""
    lib: Any = importlib.import_module("pye57.libe57")
    image = lib.ImageFile(str(path), "r")  # without a policy libE57 verifies all checksums
    try:
        scans = image.root()["data3D"]
        return sum(_decode_scan(lib, image, scans[index]) for index in range(scans.childCount()))
    finally:
        image.close()


def _decode_scan(lib: Any, image: Any, scan: Any) -> int:
    prototype = lib.StructureNode(scan["points"].prototype())
    columns = {name: np.empty(CHUNK, kind) for name, kind in E57_FIELDS.items() if prototype.isDefined(name)}
    buffers = lib.VectorSourceDestBuffer()
    for name, values in columns.items():
        buffers.append(lib.SourceDestBuffer(image, name, values, CHUNK, True, True))
    reader = scan["points"].reader(buffers)
    count = 0
    while more := reader.read():
        count += more
    reader.close()
    return count


def decode_laz(path: Path) -> int:
    """Decode a LAZ file with lazrs in this one thread; gives the number of points."""
    laspy: Any = importlib.import_module("laspy")
    with laspy.open(str(path), laz_backend=laspy.LazBackend.Lazrs) as reader:
        return sum(len(points) for points in reader.chunk_iterator(CHUNK))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
