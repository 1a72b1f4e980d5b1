"""``scan2bim convert``: scans to building model files."""

from __future__ import annotations

import contextlib
import json
import logging
import signal
import sys
from argparse import Namespace
from collections.abc import Generator, Sequence
from pathlib import Path
from types import FrameType

from scan2bim.commands.summary import outcome_json, outcome_text, plan_json, plan_text
from scan2bim.config import load_settings
from scan2bim.errors import UsageError
from scan2bim.exporters.registry import suffix_of
from scan2bim.pipeline import convert
from scan2bim.planning import Request, plan
from scan2bim.progress import Message, Reporter, View, size
from scan2bim.views import LogToView, Mode, make_view, write_line
from scan2bim.workfolder import folder_bytes

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
"""What of the log is shown with no, one and two -v."""


def run(options: Namespace) -> int:
    """Convert, or with --dry-run tell what would be done."""
    request = make_request(options)
    if options.dry_run:
        planned = plan(request)
        write_line(sys.stdout, json.dumps(plan_json(planned, request)) if options.json else plan_text(planned, request))
        return 0
    with talking(options) as view:
        outcome = convert(request, Reporter(view))
        tell_work(request.work, view)
    write_line(sys.stdout, json.dumps(outcome_json(outcome, request)) if options.json else outcome_text(outcome))
    return 0


@contextlib.contextmanager
def talking(options: Namespace) -> Generator[View]:
    """Around a run: what shows its progress and its log, as the options want it; an end from outside as Ctrl-C."""
    signal.signal(signal.SIGTERM, _interrupt)
    mode: Mode = "json" if options.json else "quiet" if options.quiet else "auto"
    view = make_view(mode)
    handler = LogToView(view, LEVELS[min(options.verbose, len(LEVELS) - 1)])
    logging.getLogger("scan2bim").addHandler(handler)
    try:
        yield view
    finally:
        view.close()
        logging.getLogger("scan2bim").removeHandler(handler)


def tell_work(work: Path, view: View) -> None:
    """Say where results are kept, and how much of them."""
    view.show(Message(f"work folder: {work} keeps {size(folder_bytes(work))} for the next run"))


def make_request(options: Namespace) -> Request:
    """The request that the options stand for. Raises UsageError."""
    outputs = tuple(Path(output) for output in options.output)
    frame = {key: value for key in ("unit", "up") if (value := getattr(options, key)) is not None}
    export = {} if options.ifc_version is None else {"ifc_version": options.ifc_version}
    settings = load_settings(Path(options.config) if options.config else None, {"frame": frame, "export": export})
    return Request(
        inputs=tuple(Path(path) for path in options.paths),
        outputs=outputs,
        work=Path(options.work) if options.work else default_work(outputs),
        name=_name(options.name, outputs),
        settings=settings,
        keep_going=options.keep_going,
        rerun_from=options.rerun_from,
        jobs=options.jobs,
        debug_images=Path(options.debug_images) if options.debug_images else None,
        ids_from=Path(options.ids_from) if options.ids_from else None,
    )


def default_work(outputs: Sequence[Path]) -> Path:
    """A hidden folder in the first output if that is a folder, else beside it.

    It is near the output, where there is room and the user may write; hidden, so that a folder of scans that is
    converted in place does not read it as scans; and one for each output name, so that two conversions in a folder do
    not share it.
    """
    first = outputs[0]
    if first.is_dir() or not first.suffix:
        return first / ".scan2bim-work"
    return first.parent / f".{_stem(first)}.scan2bim-work"


def _name(given: str | None, outputs: Sequence[Path]) -> str:
    if given is not None and not given.strip():
        raise UsageError("--name: expected a name, got an empty one.")
    first = outputs[0]
    return given or (first.resolve().name if first.is_dir() or not first.suffix else _stem(first)) or "building"


def _stem(path: Path) -> str:
    """The file's name without its known suffix: ``house`` of both ``house.png`` and ``house.view.png``."""
    return path.name[: -len(suffix)] if (suffix := suffix_of(path)) else path.stem


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
