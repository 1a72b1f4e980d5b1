"""All scores of a model in one value, and in words."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from scan2bim.errors import UsageError
from scan2bim.evaluate.areas import BETAS, AreaMeasures
from scan2bim.evaluate.corners import BoxScores, score_boxes
from scan2bim.evaluate.faces import FaceScores, right_walls, score_faces
from scan2bim.evaluate.frames import in_frame_of
from scan2bim.evaluate.openings import (
    Detection,
    DoorScores,
    OpeningScores,
    Share,
    Value,
    asked_for,
    degrees,
    score_doors,
    score_openings,
)
from scan2bim.evaluate.reliability import Reliability, reliability
from scan2bim.evaluate.rooms import SpaceScores, StoreyScores, WallScores, score_spaces, score_storeys, score_walls
from scan2bim.truth.ifc import read_ifc
from scan2bim.truth.io import read_truth
from scan2bim.truth.values import Truth

EVALUATION_FORMAT = "scan2bim evaluation 2"
DASH = "-"


class Evaluation(Value):
    """How right a model is. Metres, square metres, radians. betas: of the doors' and windows' ``f_curve``."""

    format: str = EVALUATION_FORMAT
    model: str
    truth: str
    frame: str
    betas: tuple[float, ...] = BETAS
    doors: DoorScores
    windows: OpeningScores
    walls: WallScores
    faces: FaceScores
    boxes: BoxScores
    wall_reliability: Reliability | None
    spaces: SpaceScores
    storeys: StoreyScores


def evaluate(model: Path, truth: Path) -> Evaluation:
    """Score an IFC model against a truth's JSON or another IFC model. Raises InputError for what cannot be read."""
    true = true_of(truth)
    predicted, frame = in_frame_of(true, read_ifc(model))
    return score(predicted, true, str(model), str(truth), frame)


def true_of(path: Path) -> Truth:
    """The truth in a file, by the file's ending."""
    if path.suffix.lower() == ".json":
        return read_truth(path)
    if path.suffix.lower() == ".ifc":
        return read_ifc(path).truth
    raise UsageError(f"{path}: expected the truth as .json (from scan2bim simulate) or as .ifc.")


def score(predicted: Truth, true: Truth, model: str, truth: str, frame: str) -> Evaluation:
    """Score what a model says, in the truth's coordinates."""
    seen = [wall for wall in true.walls if wall.occlusion is None or wall.occlusion < 1.0]
    doors, found_doors = asked_for(true.doors, predicted.doors, true.openings)
    windows, found_windows = asked_for(true.windows, predicted.windows, true.openings)
    rooms = {station.room for station in true.stations} or {space.name for space in true.spaces}
    scanned = [space for space in true.spaces if space.name in rooms]
    unseen = frozenset(wall.name for wall in true.walls) - {wall.name for wall in seen}
    return Evaluation(
        model=model,
        truth=truth,
        frame=frame,
        doors=score_doors(doors, found_doors, predicted.openings),
        windows=score_openings(windows, found_windows),
        walls=score_walls(seen, predicted.walls, true.walls),
        faces=score_faces(seen, predicted.walls, scanned),
        boxes=score_boxes(true.walls, predicted.walls, true.storeys, unseen),
        wall_reliability=_wall_reliability(predicted, true),
        spaces=score_spaces(true.spaces, predicted.spaces, rooms),
        storeys=score_storeys(true.storeys, predicted.storeys),
    )


def _wall_reliability(predicted: Truth, true: Truth) -> Reliability | None:
    """Of the walls whose confidence the model states."""
    right = right_walls(predicted.walls, predicted.spaces, true.walls).tolist()
    sure = [(w.confidence, hit) for w, hit in zip(predicted.walls, right, strict=True) if w.confidence is not None]
    return reliability([c for c, _ in sure], [hit for _, hit in sure])


def in_words(found: Evaluation) -> str:
    """The evaluation as plain text."""
    lines = [f"{found.model} against {found.truth}; coordinates {found.frame}", ""]
    lines += _table(
        ["", "true", "predicted", "found", "recall", "precision", "F1"],
        [
            _detected("doors, IoU 0.5", found.doors.at_50),
            _detected("doors, IoU 0.75", found.doors.at_75),
            *([_detected("doors hidden up to 30 %", found.doors.visible)] if found.doors.visible else []),
            _detected("open doors", found.doors.open),
            _detected("closed doors", found.doors.closed),
            _detected("windows, IoU 0.5", found.windows.at_50),
            _detected("windows, IoU 0.75", found.windows.at_75),
            _detected("spaces, IoU 0.7", found.spaces.detection),
            _detected("storeys", found.storeys.detection),
        ],
    )
    lines += ["", *_areas(found), "", *_errors(found), "", *_walls(found), "", *_boxes(found)]
    lines += _reliability("walls", found.wall_reliability)
    for name, scores in (("doors", found.doors), ("windows", found.windows)):
        lines += _reliability(name, scores.reliability)
        missed = [one.name for one in scores.each if not one.found_as]
        lines += [f"{name} missed: {', '.join(missed)}"] if missed else []
        lines += [f"{name} false: {', '.join(scores.false)}"] if scores.false else []
    return "\n".join(lines)


def _areas(found: Evaluation) -> list[str]:
    """The paper's measures."""
    rows = [_measured(name, s.mean, s.f_curve) for name, s in (("doors", found.doors), ("windows", found.windows))]
    head = ["of found ones, mean", "precision", "recall", "F 1/3", "F 1", "F 3", "abs. error m2", "rel. error"]
    return _table(head, rows)


def _measured(name: str, mean: AreaMeasures | None, curve: tuple[float, ...]) -> list[str]:
    if mean is None:
        return [name, *[DASH] * 7]
    shown = [curve[0], curve[len(curve) // 2], curve[-1]]
    values = [mean.precision, mean.recall, *shown, mean.absolute_error, mean.relative_error]
    return [name, *(f"{value:.4f}" for value in values)]


def _errors(found: Evaluation) -> list[str]:
    """Sizes and places in millimetres, states, hinges, swings."""
    rows: list[list[str]] = []
    for name, scores in (("doors", found.doors), ("windows", found.windows)):
        e = scores.errors
        values = [] if e is None else [e.width, e.height, e.along, e.lower, e.upper, e.across]
        rows.append([name, *(f"{1000 * value:.0f}" for value in values), *([DASH] * 6 if e is None else [])])
    lines = _table(["median error, mm", "width", "height", "along", "lower edge", "upper edge", "across"], rows)
    doors = found.doors
    angle = degrees(doors.angle_error)
    lines.append(
        f"state right {_share(doors.state)}, hinge {_share(doors.hinge)}, swing {_share(doors.swing)}, "
        f"angle {DASH if angle is None else f'{angle:.1f} degrees off'}"
    )
    if doors.passages:
        lines.append(f"passages: {doors.passages_found} of {doors.passages} found, {doors.passages_as_doors} as doors")
    return lines


def _walls(found: Evaluation) -> list[str]:
    w, s = found.walls, found.spaces
    return [
        *_table(
            ["walls", "true", "predicted", "within 5 cm", "right", "within 10 cm", "right", "thickness off, mm"],
            [
                [
                    "",
                    str(w.true),
                    str(w.predicted),
                    *(_number(x) for x in (w.completeness_5cm, w.correctness_5cm)),
                    *(_number(x) for x in (w.completeness_10cm, w.correctness_10cm)),
                    _number(w.thickness_error, 1000, 0),
                ]
            ],
        ),
        f"faces that look into rooms: {_number(found.faces.found)} found, median "
        f"{_number(found.faces.position_error, 1000, 1)} mm off; thickness between two of them "
        f"{_number(found.faces.thickness_error, 1000, 1)} mm off",
        f"spaces: mean IoU {_number(s.mean_iou, 1, 3)}, area {_number(s.area_error, 1, 2)} m2 off, height "
        f"{_number(s.height_error, 1000, 0)} mm off; storeys {_number(found.storeys.elevation_error, 1000, 0)} mm off",
    ]


def _boxes(found: Evaluation) -> list[str]:
    """The challenge's measures."""
    boxes = found.boxes
    head = ["wall corners, CV4AEC", *(f"F1 {100 * one.within:.0f} cm" for one in boxes.space), "IoU"]
    return _table(
        head,
        [
            ["in space", *(_number(one.f1) for one in boxes.space), _number(boxes.iou)],
            ["in plan", *(_number(one.f1) for one in boxes.plan), _number(boxes.plan_iou)],
        ],
    )


def _reliability(name: str, found: Reliability | None) -> list[str]:
    if found is None:
        return []
    bins = "; ".join(
        f"{b.low:.1f}-{b.high:.1f}: {b.count} x {b.confidence:.2f}, {b.right:.2f} right" for b in found.bins
    )
    return ["", f"confidence of {name}: expected calibration error {found.expected_calibration_error:.3f} ({bins})"]


def _detected(name: str, found: Detection) -> list[str]:
    counts = [str(found.true), str(found.predicted), str(found.found)]
    return [name, *counts, _number(found.recall), _number(found.precision), _number(found.f1)]


def _share(share: Share) -> str:
    return f"{share.right} of {share.stated} stated (of {share.of})" if share.of else DASH


def _number(value: float | None, times: float = 1.0, digits: int = 2) -> str:
    return DASH if value is None else f"{value * times:.{digits}f}"


def _table(head: list[str], rows: Iterable[list[str]]) -> list[str]:
    """Lines with the first column to the left and the others to the right."""
    lines = [head, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    return [
        "  ".join([line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    ]
