"""Fit the weights of a closed door's sides and head: ``fit_extents.py WORK=TRUTH.json ... [--halves]``.

Of each closed door the rectangles that overlap it by 0.4 or more, the four best, are starts. Of the places that a side
may move to, those up to 6 cm inside and 9 cm outside of the true one (linings and trims) are right. The weights make
these the likeliest (a conditional logit), each door counting once. Prints SIDES and HEADS for
``openings/closed/extents.py``, and which share of sides and heads is right before and after; with ``--halves`` those of
the second half of the scenes by weights of the first.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from fit_doors import walls_of
from fitting import F64
from numpy.typing import NDArray
from scipy.optimize import minimize

from scan2bim.openings.closed.extents import head_features, side_features, surroundings
from scan2bim.openings.closed.find import judged
from scan2bim.openings.closed.rectangles import Face, Rectangle, candidates
from scan2bim.openings.orthoimage import PIXEL

START, STARTS = 0.4, 4
"""Overlap with a true door from which on a rectangle is a start, and how many of them are taken."""
INSIDE, OUTSIDE = -0.06, 0.09
"""Metres from the true side, outwards positive, between which a place is right."""
RIDGE = 0.002
"""Weight of the squares of the weights, for each door."""


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """``features`` (n, k) of the places for a side, how far each is ``off`` (n,) the true one, metres outwards, and the
    one it starts from; ``door`` is its door's name.
    """

    features: F64
    off: F64
    start: float
    door: str

    @property
    def right(self) -> NDArray[np.bool_]:
        """Which places are right."""
        return (self.off > INSIDE) & (self.off < OUTSIDE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="WORK=TRUTH")
    parser.add_argument("--halves", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    found = [list(examples_of(scene)) for scene in options.scenes]
    for k, name in enumerate(("SIDES", "HEADS")):
        every = [[e[k] for e in scene] for scene in found]
        if options.halves:
            half = len(every) // 2
            first, second = ([e for scene in part for es in scene for e in es] for part in (every[:half], every[half:]))
            tell(f"{name} by the first half", second, weights_of(first))
        examples = [e for scene in every for es in scene for e in es]
        weights = weights_of(examples)
        print(name, "= np.array(", [round(float(w), 2) for w in weights], ")")
        tell(name, examples, weights)


def examples_of(scene: str) -> Iterator[tuple[list[Example], list[Example]]]:
    """The sides and the heads of each start in a scene."""
    for faces, true in walls_of(scene):
        shut = [(number, box) for number, box, state in true if state == "closed"]
        found = [judged(faces, box) for box in candidates(faces)] if shut else []
        for number, box in shut:
            starts = [d for d in found if not d.box.whole and d.box.overlap(box) > START]
            for start in sorted(starts, key=lambda d: -d.rank)[:STARTS]:
                yield _examples(faces, start.box, box, f"{scene}:{number}")


def _examples(
    faces: Sequence[Face], start: Rectangle, true: Rectangle, name: str
) -> tuple[list[Example], list[Example]]:
    around = surroundings(faces, start)
    if not around.parts:
        return [], []
    length = faces[0].image.depth.shape[1] * PIXEL - around.shift
    left = side_features(around.parts, around.box, -1, -around.shift)
    right = side_features(around.parts, around.box, 1, length)
    shift = around.shift
    sides = [
        _example(*left, true.left - shift, start.left - shift, -1, name),
        _example(*right, true.right - shift, start.right - shift, 1, name),
    ]
    head = _example(*head_features(around.parts, around.box), true.top, start.top, 1, name)
    return [e for e in sides if len(e.off)], [head] if len(head.off) else []


def _example(
    places: NDArray[np.int64], features: NDArray[np.float32], true: float, start: float, outward: int, name: str
) -> Example:
    off = (places.astype(np.float64) * PIXEL - true) * outward
    return Example(features.astype(np.float64), off, (start - true) * outward, name)


def weights_of(examples: Sequence[Example]) -> F64:
    """The weights (k,) by which right places are the likeliest."""
    some = [e for e in examples if e.right.any()]
    count = Counter(e.door for e in some)

    def loss(weights: F64) -> tuple[float, F64]:
        total, slope = RIDGE * len(count) * float(weights @ weights), 2 * RIDGE * len(count) * weights
        for e in some:
            worth = e.features @ weights
            chance = np.exp(worth - worth.max())
            right = chance * e.right
            total += (np.log(chance.sum()) - np.log(right.sum() + 1e-12)) / count[e.door]
            slope += (chance @ e.features / chance.sum() - right @ e.features / (right.sum() + 1e-12)) / count[e.door]
        return total, slope

    return np.asarray(minimize(loss, np.zeros(some[0].features.shape[1]), jac=True, method="L-BFGS-B").x)


def tell(name: str, examples: Sequence[Example], weights: F64) -> None:
    """Print which share of the starts and of what is fitted is right."""
    before = np.array([INSIDE < e.start < OUTSIDE for e in examples])
    after = np.array([e.right[np.argmax(e.features @ weights)] for e in examples])
    print(f"{name}: {len(examples)}, right before {before.mean():.3f}, after {after.mean():.3f}")


if __name__ == "__main__":
    main()
