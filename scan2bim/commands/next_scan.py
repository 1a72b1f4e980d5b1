"""``scan2bim next-scan``: where further stations would see most of what is missing."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from pathlib import Path

from scan2bim.commands.convert import default_work, talking, tell_work
from scan2bim.commands.summary import table
from scan2bim.config import load_settings
from scan2bim.errors import UsageError
from scan2bim.model.survey_plan import Proposal, SurveyPlan
from scan2bim.planning import Request
from scan2bim.progress import Reporter
from scan2bim.surveying import SurveyRequest, check_outputs, is_work_folder, plan_survey
from scan2bim.views import write_line

NAMED = 3
"""Of what a station would see, as many are named in the table."""


def run(options: Namespace) -> int:
    """Propose stations."""
    request = make_request(options)
    with talking(options) as view:
        plan = plan_survey(request, Reporter(view))
        if not request.kept:
            tell_work(request.scans.work, view)
    if options.json:
        data = plan.model_dump(mode="json", exclude={"missing", "missing_floor"})
        write_line(sys.stdout, json.dumps(data | {"files": [str(path) for path in request.outputs]}))
    else:
        write_line(sys.stdout, "\n".join([*plan_lines(plan), *(f"wrote {path}" for path in request.outputs)]))
    return 0


def make_request(options: Namespace) -> SurveyRequest:
    """The request that the options stand for. Raises UsageError."""
    outputs = tuple(Path(output) for output in options.output)
    check_outputs(outputs)
    inputs = tuple(Path(path) for path in options.paths)
    kept = _kept_work(inputs[0]) if len(inputs) == 1 else None
    frame = {key: value for key in ("unit", "up") if (value := getattr(options, key)) is not None}
    scans = Request(
        inputs=inputs,
        outputs=(),
        work=kept or (Path(options.work) if options.work else default_work(outputs)),
        name=outputs[0].stem,
        settings=load_settings(Path(options.config) if options.config else None, {"frame": frame}),
        keep_going=options.keep_going,
        rerun_from=options.rerun_from,
        jobs=options.jobs,
    )
    return SurveyRequest(scans, options.count, outputs, kept is not None)


def _kept_work(path: Path) -> Path | None:
    """The work folder that a path is, or beside a model's file the one that it was made in; None for scans."""
    if is_work_folder(path):
        return path
    if path.suffix.lower() != ".json":
        return None
    beside = default_work((path,))
    if is_work_folder(beside):
        return beside
    raise UsageError(
        f"{path}: a model does not hold what stood in the scanners' way, and its work folder {beside} is not there. "
        "Give the work folder of the conversion, or the scans."
    )


def plan_lines(plan: SurveyPlan) -> list[str]:
    """The proposals as a table, in words."""
    lines = [f"{plan.building}: {plan.seen:.0%} of the faces inside were seen"]
    if not plan.proposals:
        return [*lines, "No place was found from which a further station would see a square metre more."]
    rows = [["station", "x", "y", "z", "storey", "gain", "would see"]]
    for proposal in plan.proposals:
        place = (f"{value:.2f}" for value in proposal.position)
        rows.append([str(proposal.number), *place, proposal.storey_name, f"{proposal.gain:.1f} m2", _seen(proposal)])
    lines += ["", *table(rows, left=(0, 4, 6)), "", f"about {plan.expected:.0%} with them"]
    return [*lines, *(f"note: {note}" for note in plan.notes)]


def _seen(proposal: Proposal) -> str:
    parts = [f"{sight.words} {sight.area:.1f} m2" for sight in proposal.sees[:NAMED]]
    more = len(proposal.sees) - NAMED
    text = ", ".join(parts) + (f" and {more} more" if more > 0 else "")
    return text if proposal.behind is None else f"behind {proposal.behind} (closed): {text}"
