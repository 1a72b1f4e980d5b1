"""``scan2bim simulate``: virtual laser scans of an IFC model."""

from __future__ import annotations

import json
import math
import sys
from argparse import Namespace
from pathlib import Path

from scan2bim.simulate.appearance import Camera
from scan2bim.simulate.effects import Glass
from scan2bim.simulate.job import Wanted, simulate
from scan2bim.simulate.scanner import ScannerSpec
from scan2bim.views import write_line

MIRRORED = 0.08
"""Of what a pane returns, as much again is mirrored."""


def run(options: Namespace) -> int:
    """Write scans and their truth."""
    wanted = Wanted(
        stations=None if options.stations is None else Path(options.stations),
        doors=options.doors,
        clutter=options.clutter,
        seed=options.seed,
        scanner=scanner(options),
    )

    def tell(text: str) -> None:
        if not options.quiet:
            print(text, file=sys.stderr, flush=True)

    done = simulate(Path(options.model), Path(options.output), wanted, tell)
    found = {
        "scans": len(done.truth.stations),
        "points": done.points,
        "spaces": len(done.truth.spaces),
        "doors": len(done.truth.doors),
        "doors_closed": sum(door.state == "closed" for door in done.truth.doors),
        "windows": len(done.truth.windows),
    }
    if options.json:
        write_line(sys.stdout, json.dumps({**found, "files": [str(f) for f in done.files], "notes": list(done.notes)}))
        return 0
    lines = [f"{found['scans']} scans, {done.points:,} points in {options.output}"]
    lines.append(
        f"to be found: {found['spaces']} spaces, {found['doors']} doors ({found['doors_closed']} closed), "
        f"{found['windows']} windows; all in {done.files[-1]}"
    )
    write_line(sys.stdout, "\n".join([*lines, *(f"note: {note}" for note in done.notes)]))
    return 0


def scanner(options: Namespace) -> ScannerSpec:
    """The scanner that the options describe."""
    light = options.lighting
    return ScannerSpec(
        step=math.radians(options.resolution),
        noise=options.noise / 1000.0,
        registration=options.registration / 1000.0,
        # With each millimetre some 0.003 degrees: another millimetre at 20 m.
        registration_turn=math.radians(0.003) * options.registration,
        growth=1.0,
        mixed=options.mixed_pixels,
        dropout=options.dropout if options.dropout > 0.0 else None,
        glass=Glass(returned=options.glass, mirrored=MIRRORED * options.glass),
        camera=Camera(exposure=0.8 * light, tint=0.25 * light, lighting=light, drift=0.4 * light, noise=4.0),
    )
