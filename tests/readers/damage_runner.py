"""Reads every file of a folder in one process of bounded memory; a line of JSON per file says what became of it.

    python damage_runner.py FOLDER MEGABYTES SECONDS

A file that takes longer than SECONDS ends the process, as a crash in native code does: the last line names it.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
import warnings
from pathlib import Path

import numpy as np

from scan2bim.cloud.scan import Chunk, ScanHeader
from scan2bim.errors import Scan2BimError
from scan2bim.readers import read_chunks, read_headers, sample_points


def main() -> None:
    folder, megabytes, seconds = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    warm_up(folder / "good")
    resource.setrlimit(resource.RLIMIT_AS, (address_space() + (megabytes << 20), resource.RLIM_INFINITY))
    warnings.simplefilter("error")
    for path in sorted(folder.iterdir()):
        if path.is_file():
            print(json.dumps({"case": path.name}), flush=True)
            signal.setitimer(signal.ITIMER_REAL, seconds)
            result = outcome(path)
            signal.setitimer(signal.ITIMER_REAL, 0)
            print(json.dumps({"case": path.name, **result}), flush=True)


def address_space() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


def warm_up(folder: Path) -> None:
    """Reads the good files, so that libraries are loaded and compiled before memory is bounded."""
    for path in sorted(folder.iterdir()):
        if outcome(path)["kind"] != "read":
            raise SystemExit(f"{path}: {outcome(path)}")


def outcome(path: Path) -> dict[str, object]:
    try:
        kept = dropped = 0
        for header in read_headers(path):
            check(header, sample_points(header, 1000))
            for chunk in read_chunks(header, 256):
                check(header, chunk)
                kept, dropped = kept + len(chunk.xyz), dropped + chunk.dropped
    except Scan2BimError as error:
        return {"kind": "error", "type": type(error).__name__, "message": str(error)}
    except BaseException as error:
        return {"kind": "escaped", "type": type(error).__name__, "message": str(error)}
    return {"kind": "read", "points": kept, "dropped": dropped}


def check(header: ScanHeader, chunk: Chunk) -> None:
    n = len(chunk.xyz)
    parts = {"xyz": chunk.xyz, "intensity": chunk.intensity, "misses": chunk.misses, "origin": header.origin}
    if not all(part is None or np.isfinite(part).all() for part in parts.values()):
        raise AssertionError(f"not finite in {path_of(header)}")
    if chunk.xyz.shape != (n, 3) or not chunk.xyz.flags.c_contiguous or chunk.xyz.dtype != np.float32:
        raise AssertionError("xyz")
    if (chunk.rgb is not None) != header.has_colour or (chunk.intensity is not None) != header.has_intensity:
        raise AssertionError("colour or intensity unlike the header")
    if chunk.rgb is not None and chunk.rgb.dtype != np.uint8:
        raise AssertionError("rgb")
    if chunk.intensity is not None and n and not 0 <= chunk.intensity.min() <= chunk.intensity.max() <= 1:
        raise AssertionError("intensity")


def path_of(header: ScanHeader) -> str:
    return f"{header.path.name}#{header.index}"


if __name__ == "__main__":
    main()
