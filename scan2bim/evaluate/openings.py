"""Doors and windows: detection, sizes and places, states, hinges and swings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict

from scan2bim.evaluate.areas import AreaMeasures, area_measures, f_curve, mean_measures
from scan2bim.evaluate.matching import Pair, overlap, pair
from scan2bim.evaluate.reliability import Reliability, reliability
from scan2bim.truth.values import DoorTruth, OpeningTruth

RIGHT = 0.5
"""IoU from which on an opening counts as found."""
EXACT = 0.75
UNSEEN = 0.75
"""Hidden share of the outline from which on nobody is asked to find an opening."""
INSIDE = 0.5
"""Share of a predicted opening that lies in something that is neither right nor wrong from which on it is that."""
VISIBLE = 0.30
"""Hidden share of the outline up to which the paper's method asks for a door to be found."""


class Value(BaseModel):
    """Frozen."""

    model_config = ConfigDict(frozen=True)


class Detection(Value):
    """Found of the true ones, and right of the predicted ones. None where there is nothing to divide by."""

    found: int
    true: int
    right: int
    predicted: int

    @property
    def recall(self) -> float | None:
        """Found over true."""
        return self.found / self.true if self.true else None

    @property
    def precision(self) -> float | None:
        """Right over predicted."""
        return self.right / self.predicted if self.predicted else None

    @property
    def f1(self) -> float | None:
        """Harmonic mean of both."""
        whole = self.true + self.predicted
        return (self.found + self.right) / whole if whole else None


class Errors(Value):
    """Medians over the found openings of absolute differences, metres: of width, height, place along the wall, lower
    and upper edge, and of the middle of the wall across it.
    """

    width: float
    height: float
    along: float
    lower: float
    upper: float
    across: float


class Share(Value):
    """How many of those that were stated are right, and of how many one could have been stated."""

    right: int
    stated: int
    of: int


class FoundOpening(Value):
    """One true opening: what it is, and how well it was found."""

    name: str
    wall: str
    state: str
    occlusion: float | None
    found_as: str
    iou: float
    measures: AreaMeasures | None
    width_error: float | None = None
    height_error: float | None = None


class OpeningScores(Value):
    """All of one kind. at_50, at_75: by IoU; visible: of those with at most 30 % of their outline hidden."""

    at_50: Detection
    at_75: Detection
    visible: Detection | None
    mean: AreaMeasures | None
    f_curve: tuple[float, ...]
    errors: Errors | None
    reliability: Reliability | None
    each: tuple[FoundOpening, ...]
    false: tuple[str, ...]


class DoorScores(OpeningScores):
    """Doors also by state; ``passages_as_doors`` are neither right nor wrong."""

    open: Detection
    closed: Detection
    state: Share
    angle_error: float | None
    hinge: Share
    swing: Share
    passages: int
    passages_as_doors: int
    passages_found: int


T = TypeVar("T", bound=OpeningTruth)
P = TypeVar("P", bound=OpeningTruth)


def asked_for(
    true: Sequence[T], predicted: Sequence[P], neither: Sequence[OpeningTruth] = ()
) -> tuple[list[T], list[P]]:
    """The true openings that can be asked for, and the predicted ones that count.

    Those count neither way that are true but nearly unseen, or lie in ``neither``: openings that nothing fills,
    curtain walls.
    """
    seen = [one for one in true if one.occlusion is None or one.occlusion < UNSEEN]
    unseen = [one for one in true if one.occlusion is not None and one.occlusion >= UNSEEN]
    taken = {p.predicted for p in pair(seen, predicted, RIGHT)}
    left = [i for i in range(len(predicted)) if i not in taken]
    out = {left[p.predicted] for p in pair(unseen, [predicted[i] for i in left], RIGHT)}
    out |= {i for i in left if any(_lies_in(predicted[i], one) for one in neither)}
    return seen, [one for i, one in enumerate(predicted) if i not in out]


def _lies_in(one: OpeningTruth, other: OpeningTruth) -> bool:
    shared = overlap(other, one)
    return shared is not None and shared.hit >= INSIDE * shared.predicted


def score_openings(true: Sequence[OpeningTruth], predicted: Sequence[OpeningTruth]) -> OpeningScores:
    """Windows, or openings of any kind."""
    pairs = pair(true, predicted, RIGHT)
    matched = {p.predicted for p in pairs}
    measures = [area_measures(p.overlap) for p in pairs]
    sure = [(one.confidence, i in matched) for i, one in enumerate(predicted) if one.confidence is not None]
    return OpeningScores(
        at_50=_detection(true, predicted, pairs),
        at_75=_detection(true, predicted, pair(true, predicted, EXACT)),
        visible=_visible(true, predicted, pairs),
        mean=mean_measures(measures),
        f_curve=f_curve(measures),
        errors=_errors(true, pairs),
        reliability=reliability([c for c, _ in sure], [hit for _, hit in sure]),
        each=tuple(_each(one, i, predicted, pairs) for i, one in enumerate(true)),
        false=tuple(one.name for i, one in enumerate(predicted) if i not in matched),
    )


def score_doors(
    true: Sequence[DoorTruth], predicted: Sequence[DoorTruth], unfilled: Sequence[OpeningTruth]
) -> DoorScores:
    """Doors; ``unfilled`` are the predicted openings that nothing fills: what passages are to be found as."""
    passages = [door for door in true if door.state == "passage"]
    doors = [door for door in true if door.state != "passage"]
    taken = {p.predicted for p in pair(doors, predicted, RIGHT)}
    rest = [i for i in range(len(predicted)) if i not in taken]
    through = {rest[p.predicted] for p in pair(passages, [predicted[i] for i in rest], RIGHT)}
    counted = [one for i, one in enumerate(predicted) if i not in through]
    pairs = pair(doors, counted, RIGHT)
    base = score_openings(doors, counted)
    angles = [abs(a - b) for p in pairs if (a := doors[p.true].angle) and (b := counted[p.predicted].angle) is not None]
    return DoorScores(
        **{name: getattr(base, name) for name in OpeningScores.model_fields},
        open=_of_state(doors, counted, pairs, ("open", "ajar")),
        closed=_of_state(doors, counted, pairs, ("closed",)),
        state=_share(pairs, doors, counted, _state_right),
        angle_error=float(np.median(angles)) if angles else None,
        hinge=_share(pairs, doors, counted, _hinge_right),
        swing=_share(pairs, doors, counted, _swing_right),
        passages=len(passages),
        passages_as_doors=len(through),
        passages_found=len(pair(passages, unfilled, RIGHT)),
    )


def _detection(true: Sequence[OpeningTruth], predicted: Sequence[OpeningTruth], pairs: list[Pair]) -> Detection:
    return Detection(found=len(pairs), true=len(true), right=len(pairs), predicted=len(predicted))


def _visible(true: Sequence[OpeningTruth], predicted: Sequence[OpeningTruth], pairs: list[Pair]) -> Detection | None:
    """Only those hidden little; predictions of the others count neither way. None where the truth does not say."""
    if all(one.occlusion is None for one in true):
        return None
    wanted = {i for i, one in enumerate(true) if one.occlusion is not None and one.occlusion <= VISIBLE}
    found = sum(p.true in wanted for p in pairs)
    others = len(pairs) - found
    return Detection(found=found, true=len(wanted), right=found, predicted=len(predicted) - others)


def _of_state(
    true: Sequence[DoorTruth], predicted: Sequence[DoorTruth], pairs: list[Pair], states: tuple[str, ...]
) -> Detection:
    """Recall over the true doors in these states; precision over the predicted ones said to be in them."""
    matched = {p.predicted for p in pairs}
    said = [i for i, one in enumerate(predicted) if one.state in states]
    return Detection(
        found=sum(true[p.true].state in states for p in pairs),
        true=sum(one.state in states for one in true),
        right=sum(i in matched for i in said),
        predicted=len(said),
    )


def _errors(true: Sequence[OpeningTruth], pairs: list[Pair]) -> Errors | None:
    if not pairs:
        return None
    rows: list[tuple[float, ...]] = []
    for p in pairs:
        t, o = true[p.true], p.overlap
        low, high = t.corners[0][2], t.corners[2][2]
        shift = (o.x0 + o.x1 - t.width) / 2
        rows.append((o.x1 - o.x0 - t.width, o.z1 - o.z0 - (high - low), shift, o.z0 - low, o.z1 - high, o.off))
    width, height, along, lower, upper, across = np.median(np.abs(np.array(rows)), axis=0).tolist()
    return Errors(width=width, height=height, along=along, lower=lower, upper=upper, across=across)


def _each(one: OpeningTruth, number: int, predicted: Sequence[OpeningTruth], pairs: list[Pair]) -> FoundOpening:
    mine = next((p for p in pairs if p.true == number), None)
    state = one.state if isinstance(one, DoorTruth) else ""
    if mine is None:
        return FoundOpening(
            name=one.name, wall=one.wall, state=state, occlusion=one.occlusion, found_as="", iou=0.0, measures=None
        )
    o = mine.overlap
    return FoundOpening(
        name=one.name,
        wall=one.wall,
        state=state,
        occlusion=one.occlusion,
        found_as=predicted[mine.predicted].name,
        iou=o.iou,
        measures=area_measures(o),
        width_error=o.x1 - o.x0 - one.width,
        height_error=o.z1 - o.z0 - one.height,
    )


Judge = Callable[[DoorTruth, DoorTruth, bool], bool | None]


def _share(pairs: list[Pair], true: Sequence[DoorTruth], predicted: Sequence[DoorTruth], judge: Judge) -> Share:
    """judge: whether the predicted door is right, where True means that both run the same way; None: not stated."""
    # What the truth itself does not know, judged against itself, gives None.
    asked = [p for p in pairs if judge(true[p.true], true[p.true], True) is not None]
    found = [judge(true[p.true], predicted[p.predicted], p.overlap.same_way) for p in asked]
    stated = [right for right in found if right is not None]
    return Share(right=sum(stated), stated=len(stated), of=len(asked))


def _state_right(true: DoorTruth, predicted: DoorTruth, same_way: bool) -> bool | None:
    """Closed or not; ajar and open are one, since where the one ends and the other starts is a convention."""
    del same_way
    if "unknown" in (true.state, predicted.state):
        return None
    return (true.state == "closed") == (predicted.state == "closed")


def _hinge_right(true: DoorTruth, predicted: DoorTruth, same_way: bool) -> bool | None:
    if "unknown" in (true.hinge, predicted.hinge):
        return None
    turned = {"start": "end", "end": "start", "both": "both"}
    return (predicted.hinge if same_way else turned[predicted.hinge]) == true.hinge


def _swing_right(true: DoorTruth, predicted: DoorTruth, same_way: bool) -> bool | None:
    if "unknown" in (true.swing, predicted.swing):
        return None
    turned = {"left": "right", "right": "left", "both": "both"}
    return (predicted.swing if same_way else turned[predicted.swing]) == true.swing


def degrees(angle: float | None) -> float | None:
    """Radians in degrees."""
    return None if angle is None else math.degrees(angle)
