"""The command line: names and options only. What a command does, and imports, is in ``scan2bim.commands``."""

from __future__ import annotations

import argparse
import atexit
import gc
import os
import sys
from collections.abc import Callable, Sequence

from scan2bim import __version__

UNITS = ("m", "dm", "cm", "mm", "km", "in", "ft", "us-ft")
AXES = ("x", "y", "z", "-x", "-y", "-z")
DOORS = ("as-modelled", "mixed", "closed", "open")
STAGES = ("survey", "read", "surfels", "structure", "openings", "model", "export")
IFC_VERSIONS = ("IFC2X3", "IFC4", "IFC4X3_ADD2")
CONVERT = """\
Convert scans to building model files. What an earlier run has done is kept in a
work folder: a run that was stopped goes on where it was, and after a changed
setting only what depends on it runs again."""
INFO = """\
Tell what is in the scans: points, extent, density, colour, stations, unit, up axis, and
what a conversion would take."""
CHECK = """\
Check the integrity of an IFC file: what is legal by the schema and cannot be so in a
building. Exit code 1 where something was found."""
SIMULATE = """\
Scan an IFC model virtually: an E57 file with its pose for each station, and truth.json
with what is to be found in them. For planning scans and for testing what reads them."""
EVALUATE = """\
Score any tool's IFC model against a truth: detection of doors and windows, overlap of
areas, sizes, states, hinges, reliability of the confidences; walls, spaces and storeys."""
VERIFY = """\
Compare a model (any IFC) with scans: what was not built as drawn, by how much,
and what could not be seen. The report's folder gets report.html, report.json,
findings.bcf and a copy of the model with the results."""
NEXT_SCAN = """\
Propose where further stations would see most of what is missing: faces that were not
seen, and floor of which nothing is known. PATH: the scans, the work folder of their
conversion, or the .json model beside it."""
FAILING = ("out-of-tolerance", "missing", "occluded", "not-enough-data", "additions", "misplaced-scans")
EXIT_CODES = """exit codes:
  0 done   1 other error   2 usage   3 unreadable input   4 input that cannot make a building
  5 a stage failed   6 out of memory or disk   130 interrupted"""


NEW_OBJECTS = 20_000
"""Objects made before Python looks for circles of them: what is made is mostly kept, and 700 would cost a 30th of the
time."""


def run() -> None:
    """``main`` as a program: its memory is left to the system at the end, since taking down all that was loaded piece
    by piece costs a third of a second.
    """
    gc.set_threshold(NEW_OBJECTS)
    code = main()
    vars(atexit)["_run_exitfuncs"]()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(code)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; gives the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    options = build_parser().parse_args(_joined(arguments))
    # Small matrices only: threads of the linear algebra would spin and wait. Set before numpy is loaded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        import importlib

        command = importlib.import_module(f"scan2bim.commands.{options.command.replace('-', '_')}")
        code = int(command.run(options))
        sys.stdout.flush()
    except BaseException as error:
        from scan2bim.commands.failure import tell

        return tell(error, options)
    return code


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = argparse.ArgumentParser(
        prog="scan2bim",
        description="Laser scans of a building's inside to IFC and USD building models with evidence.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"scan2bim {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, short: str, description: str) -> argparse.ArgumentParser:
        return commands.add_parser(
            name,
            help=short,
            description=description,
            epilog=EXIT_CODES,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )

    _add_convert(command("convert", "scans to building model files", CONVERT))
    _add_verify(command("verify", "a model against scans: what was not built as drawn", VERIFY))
    _add_next_scan(command("next-scan", "where to scan next", NEXT_SCAN))
    info = command("info", "what is in the scans", INFO)
    _add_paths(info)
    _add_frame(info)
    info.add_argument("--json", action="store_true", help="the report as JSON on stdout")
    _add_simulate(command("simulate", "virtual scans of an IFC model", SIMULATE))
    _add_evaluate(command("evaluate", "how right a building model is", EVALUATE))
    doctor = command("doctor", "check the installation", "Check the installation.")
    doctor.add_argument("--json", action="store_true", help="the report as JSON on stdout")
    check = command("check", "faults of an IFC file that validators do not see", CHECK)
    check.add_argument("path", metavar="FILE.ifc", help="the IFC file, of any program")
    check.add_argument("--json", action="store_true", help="the findings as JSON on stdout")
    schema = command("schema", "print a JSON Schema", "Print the JSON Schema of the model's .json files.")
    schema.add_argument("of", nargs="?", choices=("model", "report"), default="model", help="report: of report.json")
    return parser


def _add_convert(convert: argparse.ArgumentParser) -> None:
    _add_paths(convert)
    convert.add_argument(
        "-o",
        "--output",
        action="append",
        required=True,
        metavar="OUT",
        help="file to write (model: .ifc .usda .usdc .usdz .json .glb; plan: .svg .png .pdf .dxf; picture: .view.png; "
        "quantities: .xlsx .csv; robots: .nav.json; points: .laz .las; voxels: .voxels.npz .voxels.png) or folder "
        "(all but points and voxels); may be given again",
    )
    convert.add_argument("--debug-images", metavar="DIR", help="write pictures of how openings are found on each wall")
    convert.add_argument("--dry-run", action="store_true", help="only tell what would run, and what it may take")
    convert.add_argument(
        "--ids-from",
        metavar="MODEL.json",
        help="an earlier model of the same building: what still stands there keeps its identifiers",
    )
    convert.add_argument("--ifc-version", choices=IFC_VERSIONS, help="version of .ifc files (default: IFC4)")
    convert.add_argument("--name", metavar="NAME", help="name of the building (default: that of the first output)")
    _add_work(convert)
    _add_frame(convert)
    _add_talk(convert)


def _add_verify(verify: argparse.ArgumentParser) -> None:
    verify.add_argument("model", metavar="MODEL.ifc", help="the model, IFC 2x3, 4 or 4x3")
    _add_paths(verify)
    verify.add_argument("-o", "--output", required=True, metavar="DIR", help="folder of the report")
    limits = verify.add_argument_group("tolerance (per class: [verify] classes in --config)")
    limit = limits.add_mutually_exclusive_group()
    limit.add_argument("--tolerance", metavar="LENGTH", help="such as 15mm, 2cm or 0.6in (default: 15mm)")
    limit.add_argument("--loa", type=int, choices=(20, 30, 40, 50), help="20: 50 mm, 30: 15 mm, 40: 5 mm, 50: 1 mm")
    limits.add_argument(
        "--fail-on",
        metavar="WHAT[,WHAT]",
        help=f"exit code 1 if there is any: {', '.join(FAILING)}",
    )
    place = verify.add_argument_group("placing")
    place.add_argument(
        "--transform",
        metavar="FILE",
        help="text file with 16 numbers, the rows of the rigid motion from the model (metres) to the scans (metres)",
    )
    place.add_argument(
        "--placing",
        choices=("auto", "stated", "align"),
        default="auto",
        help="auto: by stated coordinates, aligned where these do not fit; stated: never aligned; align: always",
    )
    place.add_argument("--no-fit", action="store_true", help="compare as placed, without the final best fit")
    verify.add_argument(
        "--also",
        action="append",
        default=[],
        choices=("classified", "remainder", "usd"),
        help="further output, may be repeated: classified: all points with class and element (LAZ); remainder: the "
        "points that no element explains (LAZ); usd: the model's surfaces coloured by deviation",
    )
    _add_work(verify)
    _add_frame(verify)
    _add_talk(verify)


def _add_next_scan(parser: argparse.ArgumentParser) -> None:
    _add_paths(parser)
    parser.add_argument(
        "-o",
        "--output",
        action="append",
        required=True,
        metavar="OUT",
        help="file to write: .json, or plan as .png or .svg; may be given again",
    )
    parser.add_argument("--count", type=_positive, default=3, metavar="N", help="stations, at most (default 3)")
    _add_work(parser)
    _add_frame(parser)
    _add_talk(parser)


def _add_talk(parser: argparse.ArgumentParser) -> None:
    talk = parser.add_argument_group("talk (on stderr; the result goes to stdout)")
    talk_modes = talk.add_mutually_exclusive_group()
    talk_modes.add_argument("--quiet", action="store_true", help="warnings and errors only")
    talk_modes.add_argument("--json", action="store_true", help="result as JSON, progress as one JSON object a line")
    talk.add_argument("-v", "--verbose", action="count", default=0, help="more (-vv: all) of what goes to the log")


def _add_simulate(simulate: argparse.ArgumentParser) -> None:
    simulate.add_argument("model", metavar="MODEL.ifc", help="the model: IFC2X3, IFC4 or IFC4X3")
    simulate.add_argument("-o", "--output", required=True, metavar="DIR", help="new folder for the scans")
    simulate.add_argument("--stations", metavar="FILE.csv", help="columns x, y, z, name; default: placed room by room")
    scanner = simulate.add_argument_group("scanner")
    for name, default, least, most, text in (
        ("resolution", 0.2, 0.02, 5.0, "degrees between rays"),
        ("noise", 2.0, 0.0, 100.0, "of ranges, millimetres, one standard deviation"),
        ("registration", 1.0, 0.0, 1000.0, "error of the poses, millimetres, one standard deviation"),
        ("mixed-pixels", 0.2, 0.0, 1.0, "share of the rays beside an edge that end between near and far"),
        ("glass", 0.25, 0.0, 1.0, "share of the rays that a pane met straight on sends back; the others pass"),
        ("dropout", 0.002, 0.0, 0.9, "share of rays that do not return; more from dark and slanting surfaces"),
        ("lighting", 0.06, 0.0, 1.0, "variation of light through the building and from station to station"),
    ):
        kind = _between(least, most)
        scanner.add_argument(f"--{name}", type=kind, default=default, metavar="X", help=f"{text} (default {default})")
    building = simulate.add_argument_group("building")
    building.add_argument("--doors", choices=DOORS, default=DOORS[0], help="states of the doors (default as-modelled)")
    building.add_argument(
        "--clutter",
        type=_between(0.0, 0.8),
        default=0.0,
        metavar="SHARE",
        help="share of the walls that furniture and people hide (default 0: the model's own only)",
    )
    simulate.add_argument(
        "--seed", type=_whole, default=0, metavar="N", help="of all that is drawn by chance (default 0)"
    )
    simulate.add_argument("--quiet", action="store_true", help="no progress")
    simulate.add_argument("--json", action="store_true", help="the result as JSON on stdout")


def _add_evaluate(evaluate: argparse.ArgumentParser) -> None:
    evaluate.add_argument("model", metavar="MODEL.ifc", help="the model to score: IFC2X3, IFC4 or IFC4X3")
    evaluate.add_argument("truth", metavar="TRUTH", help="truth.json of scan2bim simulate, or an IFC model")
    evaluate.add_argument("--json", action="store_true", help="all scores as JSON on stdout")


def _add_work(convert: argparse.ArgumentParser) -> None:
    work = convert.add_argument_group("work")
    work.add_argument("--config", metavar="FILE", help="settings (TOML); the work folder's config.toml shows all")
    work.add_argument("--work", metavar="DIR", help="work folder (default: hidden, beside the first output)")
    work.add_argument("--rerun-from", choices=STAGES, metavar="STAGE", help=f"run again from: {', '.join(STAGES)}")
    work.add_argument("--keep-going", action="store_true", help="leave unreadable scans out instead of stopping")
    work.add_argument("--jobs", type=_positive, metavar="N", help="processes that read (default: by cores and input)")


def _add_paths(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", nargs="+", metavar="PATH", help="scan file, folder or quoted pattern ('scans/*.e57')")


def _add_frame(parser: argparse.ArgumentParser) -> None:
    frame = parser.add_argument_group("coordinates (default: found in the scans)")
    frame.add_argument("--unit", choices=UNITS, help="unit of the scans' coordinates")
    frame.add_argument("--up", choices=AXES, help="axis of the scans that points up")


def _between(least: float, most: float) -> Callable[[str], float]:
    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"expected a number from {least:g} to {most:g}, got {text!r}")
        return value

    return number


def _whole(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 up, got {text!r}")
    return int(text)


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number from 1 up, got {text!r}")
    return int(text)


def _joined(arguments: Sequence[str]) -> list[str]:
    """``--up -z`` as ``--up=-z``, which argparse would take for an unknown option."""
    out: list[str] = []
    for argument in arguments:
        if out and out[-1] == "--up" and argument in AXES:
            out[-1] = f"--up={argument}"
        else:
            out.append(argument)
    return out


if __name__ == "__main__":
    run()
