"""Points that no element explains, grouped into regions with a box and a guess of what they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scan2bim.geometry.graphs import connected_parts
from scan2bim.geometry.space_index import SpaceIndex
from scan2bim.verify.compare import Owned
from scan2bim.verify.ifc_model import ModelStorey
from scan2bim.verify.leaves import Doorway, is_leaf
from scan2bim.verify.moved import Body
from scan2bim.verify.patches import Gap, main_direction
from scan2bim.verify.result import Addition
from scan2bim.verify.upright import upright_parts

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

EDGE = 0.10
"""Edge of the voxels that unexplained points are gathered in, metres."""
LEAST_POINTS = 3
"""Points of a voxel that counts: fewer are strays and mixed pixels."""
LEAST_VOXELS = 30
"""Voxels of a group that is told: 0.3 m2 of surface."""
MOST = 200
"""Groups that are told, the largest."""
MARGIN = 0.5
"""Metres round the model's box beyond which points are of the surroundings."""
BITS = 21
BELOW = 0.1
"""Metres under a storey's elevation from which on points are its own: floors are drawn with and without finish."""
REACHES = 0.16
"""Metres under a ceiling within which the middles of the topmost voxels of walls and columns lie: half a voxel, what
the ceiling takes, and a shadow gap. Wardrobes end farther under it."""
ROUND = 0.25
"""Metres in plan within which a ceiling is looked for: its places lie 20 cm apart, and more under slopes."""
NEAREST = 6
"""Places of a ceiling that are looked at over each column of voxels."""
REACHING = 0.5
"""Share of a wall's or column's plan that must reach so far up: open leaves and cupboards reach it with strays alone,
and what stands before a wall hides some of it."""
BESIDE, BEFORE = 0.5, 0.4
"""Metres beside a window and before its wall within which curtains hang."""
HANGING = 0.8
"""Share of a group that must hang there for it to be one."""
LEVEL = 0.2
"""Share of a curtain that hangs before the window itself: a low window in a high room."""
LONGEST = 3.0
"""Metres up to which furniture, leaves and curtains stand as straight as walls; of longer ones any part that reaches
up will do."""
OVER = 0.3
"""Metres in plan within which a place of a ceiling lies over a voxel."""
COVERED = 0.5
"""Share of a slab under ceilings or roofs."""
Guess = Literal["wall", "slab", "column", "object"]


class Unexplained:
    """Gathers the points that no element explains; a sink of ``compare_points``. Grows with their surface only."""

    def __init__(self) -> None:
        self._keys: list[I64] = []
        self._counts: list[I64] = []

    def __call__(self, owned: Owned) -> None:
        """Take a run's points."""
        left = owned.owner == -2
        if not left.any():
            return
        place = np.floor(owned.xyz(left) / EDGE).astype(np.int64) + (1 << (BITS - 1))
        keys, counts = np.unique((place[:, 0] << 2 * BITS) | (place[:, 1] << BITS) | place[:, 2], return_counts=True)
        self._keys.append(keys)
        self._counts.append(counts)
        if len(self._keys) > 200:
            merged = self.voxels()
            self._keys, self._counts = [merged[0]], [merged[1]]

    def voxels(self) -> tuple[I64, I64]:
        """Keys (k,) sorted and counts (k,) of all voxels."""
        if not self._keys:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        keys, place = np.unique(np.concatenate(self._keys), return_inverse=True)
        counts = np.bincount(place.ravel(), weights=np.concatenate(self._counts))
        return keys, counts.astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What tells built things from furniture: ``box`` (2, 3) of the model, ``ceilings`` (n, 3), places on surfaces that
    look down, which walls reach and furniture seldom does, the ``windows``, before which curtains hang, and the
    ``doors``, whose leaves stand open; all in the local frame; so are the ``moved`` elements, whose surface is no
    addition. storeys: in the model's axes.
    """

    box: F64
    ceilings: F64
    windows: tuple[Gap, ...]
    storeys: tuple[ModelStorey, ...]
    moved: tuple[Body, ...] = ()
    doors: tuple[Doorway, ...] = ()


def find_additions(unexplained: Unexplained, around: Surroundings, to_model: F64) -> tuple[Addition, ...]:
    """Groups within the model's box, the largest first."""
    box, storeys = around.box, around.storeys
    keys, counts = unexplained.voxels()
    place = np.column_stack([keys >> 2 * BITS, (keys >> BITS) & (2**BITS - 1), keys & (2**BITS - 1)])
    middle: F64 = ((place - (1 << (BITS - 1)) + 0.5) * EDGE).astype(np.float64)
    keep = (counts >= LEAST_POINTS) & (middle > box[0] - MARGIN).all(axis=1) & (middle < box[1] + MARGIN).all(axis=1)
    keys, counts, middle = keys[keep], counts[keep], middle[keep]
    label, walls = _labels(keys, middle, storeys, to_model)
    sizes = np.bincount(label, minlength=1)
    out: list[Addition] = []
    for which in np.argsort(-sizes)[:MOST]:
        if sizes[which] < LEAST_VOXELS:
            break
        mine = label == which
        place = middle[mine]
        if any(body.holds(place) for body in around.moved):
            continue
        guess = _guess(place, bool(which < walls), around)
        out.append(_addition(len(out) + 1, place, guess, int(counts[mine].sum()), storeys, to_model))
    return tuple(out)


def _labels(keys: I64, middle: F64, storeys: Sequence[ModelStorey], to_model: F64) -> tuple[I64, int]:
    """Group (k,) of each voxel, storey by storey, the upright straight ones first, and how many these are."""
    height = middle @ to_model[2, :3] + to_model[2, 3]
    level = np.searchsorted([s.elevation - BELOW for s in storeys], height)
    label = np.full(len(keys), -1, np.int64)
    walls = 0
    for storey in np.unique(level):
        here = np.flatnonzero(level == storey)
        upright = upright_parts(middle[here], EDGE)
        label[here[upright >= 0]] = walls + upright[upright >= 0]
        walls += int(upright.max(initial=-1)) + 1
    rest = np.flatnonzero(label < 0)
    label[rest] = walls + _groups(keys[rest])
    return label, walls


def _groups(keys: I64) -> I64:
    """Number of the connected group of each voxel (k,), neighbours in all 26 directions."""
    rows: list[I64] = []
    cols: list[I64] = []
    ahead = [step for step in product((-1, 0, 1), repeat=3) if step > (0, 0, 0)]
    steps = [(x << 2 * BITS) + (y << BITS) + z for x, y, z in ahead]
    for step in steps:
        at = np.minimum(np.searchsorted(keys, keys + step), max(len(keys) - 1, 0))
        hit = np.flatnonzero(keys[at] == keys + step) if len(keys) else np.zeros(0, np.int64)
        rows.append(hit)
        cols.append(at[hit])
    return connected_parts(len(keys), np.column_stack([np.concatenate(rows), np.concatenate(cols)]))


def _addition(
    number: int, middle: F64, guess: Guess, points: int, storeys: Sequence[ModelStorey], to_model: F64
) -> Addition:
    length, width, height = _sizes(middle)
    own = middle @ to_model[:3, :3].T + to_model[:3, 3]
    lower, upper = own.min(axis=0) - EDGE / 2, own.max(axis=0) + EDGE / 2
    article = "an" if guess == "object" else "a"
    return Addition(
        id=f"region-{number}",
        guess=guess,
        storey=storey_at(storeys, (lower[2] + upper[2]) / 2),
        lower=_vector(lower),
        upper=_vector(upper),
        points=points,
        area=round(len(middle) * EDGE**2, 2),
        sentence=f"{length:.1f} x {width:.1f} x {height:.1f} m that no element explains; it may be {article} {guess}.",
    )


def storey_at(storeys: Sequence[ModelStorey], height: float) -> str:
    """Name of the storey, of those in order, whose floor is the next under a height, metres in the model's axes."""
    below = [s.name for s in storeys if s.elevation <= height]
    return below[-1] if below else ""


def _sizes(middle: F64) -> tuple[float, float, float]:
    """Length, width and height of the upright box round voxels (k, 3)."""
    plan = middle[:, :2] - middle[:, :2].mean(axis=0)
    along = main_direction(plan)
    sides = (plan @ along, plan @ [-along[1], along[0]], middle[:, 2])
    length, width, height = (float(np.ptp(s)) + EDGE for s in sides)
    return length, width, height


def _guess(middle: F64, upright: bool, around: Surroundings) -> Guess:
    """By the box: a wall is upright, long and thin, a column tall and narrow, both reach a ceiling; a slab is level and
    thin and lies under one, as the ground outside does not.
    """
    length, width, height = _sizes(middle)
    if height <= 0.3 and min(length, width) >= 1.2 and len(middle) >= 0.5 * length * width / EDGE**2:
        return "slab" if _covered(middle, around.ceilings) > COVERED else "object"
    wall = upright and length >= 0.9 and width <= 0.45
    column = height >= 1.8 and width >= 0.1 and length <= 0.9
    least = REACHING if length < LONGEST else 0.0
    if not (wall or column) or _reaching(middle, around.ceilings) <= least:
        return "object"
    if _hangs(middle, around.windows) or is_leaf(middle, around.doors):
        return "object"
    return "wall" if wall else "column"


def _reaching(middle: F64, ceilings: F64) -> float:
    """Share of the plan of voxels (k, 3) in which they end right under a ceiling."""
    low, high = middle.min(axis=0) - ROUND, middle.max(axis=0) + ROUND
    near = ceilings[((ceilings[:, :2] > low[:2]) & (ceilings[:, :2] < high[:2])).all(axis=1)]
    if not len(near):
        return 0.0
    pixels, column = np.unique(np.floor(middle[:, :2] / EDGE).astype(np.int64), axis=0, return_inverse=True)
    top = np.full(len(pixels), -np.inf)
    np.maximum.at(top, column.ravel(), middle[:, 2])
    place = SpaceIndex(near[:, :2]).nearest((pixels + 0.5) * EDGE, NEAREST, ROUND)
    over = np.append(near[:, 2], np.inf)[place] - top[:, None]
    return float(((over > -EDGE) & (over < REACHES)).any(axis=1).mean())


def _hangs(middle: F64, windows: Sequence[Gap]) -> bool:
    """Whether voxels (k, 3) hang before a window, as curtains do."""
    for gap in windows:
        offset = middle - gap.middle
        across = offset[:, :2] @ gap.across
        inside = (np.abs(offset[:, :2] @ gap.along) < gap.width / 2 + BESIDE) & (across > gap.low - BEFORE)
        inside &= across < gap.high + BEFORE
        level = np.abs(offset[:, 2]) < gap.height / 2
        if float(inside.mean()) > HANGING and float(level.mean()) > LEVEL:
            return True
    return False


def _covered(middle: F64, ceilings: F64) -> float:
    """Share of voxels (k, 3) over which a ceiling lies."""
    over = ceilings[ceilings[:, 2] > middle[:, 2].max() + 1.5]
    if not len(over):
        return 0.0
    return float((SpaceIndex(over[:, :2]).nearest(middle[:, :2], 1, OVER) >= 0).mean())


def _vector(values: F64) -> tuple[float, float, float]:
    return (round(float(values[0]), 3), round(float(values[1]), 3), round(float(values[2]), 3))
