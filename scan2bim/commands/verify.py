"""``scan2bim verify``: a model against scans."""

from __future__ import annotations

import json
import re
import sys
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from scan2bim.cli import FAILING
from scan2bim.commands.convert import talking, tell_work
from scan2bim.commands.verify_summary import verified_json, verified_text
from scan2bim.config import UNITS, load_settings
from scan2bim.errors import UsageError, reason
from scan2bim.planning import Request
from scan2bim.progress import Reporter
from scan2bim.verification import VerifyRequest, verify
from scan2bim.verify.result import Report
from scan2bim.views import write_line

LOA_LIMITS = {20: 0.050, 30: 0.015, 40: 0.005, 50: 0.001}
"""Metres up to which a band of the USIBD Level of Accuracy specification reaches."""
MOST = 0.15
"""Largest tolerance, metres: surfaces farther away are not taken for the drawn one."""
FAILS: dict[str, Callable[[Report], bool]] = {
    "out-of-tolerance": lambda r: any(e.status == "out_of_tolerance" for e in r.elements),
    "missing": lambda r: any(e.status == "missing" for e in r.elements),
    "occluded": lambda r: any(e.status == "occluded" for e in r.elements),
    "not-enough-data": lambda r: any(e.status == "not_enough_data" for e in r.elements),
    "additions": lambda r: any(a.guess != "object" for a in r.additions),
    "misplaced-scans": lambda r: any(s.left_out for s in r.placing.scans),
}


def run(options: Namespace) -> int:
    """Verify; 1 where --fail-on asks for it."""
    fails = fail_on(options.fail_on)
    request = make_request(options)
    with talking(options) as view:
        outcome = verify(request, Reporter(view))
        tell_work(request.scans.work, view)
    met = [name for name in fails if FAILS[name](outcome.report)]
    text = json.dumps(verified_json(outcome, met)) if options.json else verified_text(outcome, met)
    write_line(sys.stdout, text)
    return 1 if met else 0


def make_request(options: Namespace) -> VerifyRequest:
    """The request that the options stand for. Raises UsageError."""
    folder = Path(options.output)
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: expected a folder for the report, but it is a file. Pass another to -o.")
    frame = {key: value for key in ("unit", "up") if (value := getattr(options, key)) is not None}
    limits: dict[str, object] = {}
    if options.tolerance is not None:
        limits["tolerance"] = length(options.tolerance)
    elif options.loa is not None:
        limits["tolerance"] = LOA_LIMITS[options.loa]
    settings = load_settings(
        Path(options.config) if options.config else None, {"frame": frame, **({"verify": limits} if limits else {})}
    )
    scans = Request(
        inputs=tuple(Path(path) for path in options.paths),
        outputs=(),
        work=Path(options.work) if options.work else folder / ".scan2bim-work",
        name=Path(options.model).stem,
        settings=settings,
        keep_going=options.keep_going,
        rerun_from=options.rerun_from,
        jobs=options.jobs,
    )
    return VerifyRequest(
        model=Path(options.model),
        scans=scans,
        folder=folder,
        transform=None if options.transform is None else read_transform(Path(options.transform)),
        placing=options.placing,
        fitted=not options.no_fit,
        extras=tuple(options.also),
    )


def length(text: str) -> float:
    """Metres of a text such as ``15mm``. Raises UsageError."""
    match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+)\s*([a-z-]*)\s*", text.lower())
    if match is None or (match[2] or "m") not in UNITS:
        raise UsageError(f"--tolerance: expected a length such as 15mm, 2cm or 0.6in, got {text!r}.")
    metres = float(match[1]) * UNITS[match[2] or "m"]
    if not 0 < metres <= MOST:
        raise UsageError(f"--tolerance: expected more than 0 and at most {1000 * MOST:.0f} mm, got {text!r}.")
    return metres


def read_transform(path: Path) -> tuple[tuple[float, ...], ...]:
    """The rows (4) of a rigid motion in a text file. Raises UsageError."""
    try:
        numbers = [float(word) for word in re.split(r"[\s,;]+", path.read_text(encoding="utf-8").strip()) if word]
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: expected a text file with 16 numbers ({reason(error)}).") from None
    if len(numbers) != 16:
        raise UsageError(f"{path}: expected 16 numbers, the rows of a 4 x 4 matrix, got {len(numbers)}.")
    rows = tuple(tuple(numbers[4 * i : 4 * i + 4]) for i in range(4))
    if not _is_rigid(rows):
        raise UsageError(f"{path}: expected a rigid motion (rotation and shift in metres, last row 0 0 0 1).")
    return rows


def _is_rigid(rows: tuple[tuple[float, ...], ...]) -> bool:
    products = [sum(rows[i][k] * rows[j][k] for k in range(3)) for i in range(3) for j in range(3)]
    square = all(abs(p - (1.0 if n % 4 == 0 else 0.0)) < 1e-4 for n, p in enumerate(products))
    a, b, c = rows[0], rows[1], rows[2]
    det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    return square and det > 0 and rows[3] == (0.0, 0.0, 0.0, 1.0)


def fail_on(text: str | None) -> tuple[str, ...]:
    """The names given to --fail-on. Raises UsageError for unknown ones."""
    names = tuple(name.strip().replace("_", "-") for name in (text or "").split(",") if name.strip())
    unknown = [name for name in names if name not in FAILS]
    if unknown:
        raise UsageError(f"--fail-on: unknown {unknown[0]!r}. Expected some of {', '.join(FAILING)}.")
    return names
