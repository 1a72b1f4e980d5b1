"""Jambs of a door behind its trims: where the opening in the wall itself was seen to end.

A frame narrower than the wall leaves a strip of the wall's own reveal in sight, from the side that the leaf is farther
from, and a trim laps over it. Where a lining fills the wall's depth its own reveal is seen, and the trim leaves a
strip of the lining's front free. Where the trim begins at the reveal, that is the wall's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scan2bim.openings.closed.edges import SIGMAS, Edge, Kind, edges_of, moved
from scan2bim.openings.closed.rectangles import Face, Rectangle
from scan2bim.openings.closed.trims import FARTHEST, LAP
from scan2bim.openings.door_linings import WIDEST, flush_lining
from scan2bim.openings.near_points import WallPoints

WINDOW, STEP = 0.012, 0.004
"""Width, metres, in which a reveal's points lie, and steps in which such a strip is moved."""
SKIN = 0.008
"""Distance behind either face of the wall, metres, up to which a point is the face's: thrice noise and unevenness."""
DEEP = 0.02
"""Depth, metres, over which a reveal must be seen: half of a frame's."""
GAP = 0.6
"""Share of that depth that may show nothing in one piece: the two faces of a leaf are no reveal."""
PIECE, PIECES = 0.1, 0.35
"""Length, metres, of a side's pieces, and share of them in which a reveal must be seen: a handle is in one or two."""
FOOT, ENDS = 0.15, 0.12
"""Distances, metres, from the floor and from an opening's other sides within which points say nothing of this one."""
STANDS_OUT, BEFORE = 0.004, 0.05
"""Distance before the wall, metres, between which a point lies on a trim."""
LAPS, STRIP = 0.04, 0.06
"""Farthest, metres, that a trim laps over the wall's own reveal, and that it stands back from a lining's."""
SETBACK = 0.04
"""Farthest, metres, that the trim of an open door stands back from the clear width that is known there."""
TRIM = 0.06
"""Width, metres, of a trim in which its inner edge is told from stray points."""
FEWEST = 60
"""Points that make a trim."""
DENSE = 0.4
"""Share of a trim's usual points from which on a strip belongs to it."""
LINED, LAPPED = 0.006, 0.008
"""Metres between a reveal and its trim from which on that is a lining's; and by which a trim laps over a reveal."""
SAME = 0.016
"""Metres between a step of the face and a reveal up to which they are one edge."""
F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Reveal:
    """A reveal ``place`` metres outwards from a rectangle's side, and how far outwards from there a trim begins
    (``strip``, negative where it laps over it), None where none was seen.
    """

    place: float
    strip: float | None


def opening_edges(faces: Sequence[Face], box: Rectangle, points: WallPoints, half: float) -> list[Edge | None]:
    """The edges left, right and at the head of the opening behind a rectangle, as far as they were found; ``points``
    near the wall, of which ``half`` the thickness is given. Below the ceiling only a trim as at the sides is a head.
    """
    edges = edges_of(faces, box)
    if box.whole and not (edges[2] and edges[2].is_trim and any(e and e.is_trim for e in edges[:2])):
        edges[2] = None
    found = _reveals(box, edges, points, half)
    if any(edge is not None and edge.is_trim for edge in edges):
        return _behind_trims(edges, found)
    shown = [k for k, reveal in enumerate(found) if reveal is not None]
    clear = moved(box, [None if r is None else Edge(r.place, 0.0, "reveal", True) for r in found])
    lining = flush_lining([face.image for face in faces], (clear.left, clear.right, clear.top), shown)
    return [_behind_lining(edge, reveal, lining) for edge, reveal in zip(edges, found, strict=True)]


def behind_trims(faces: Sequence[Face], box: Rectangle, points: WallPoints, half: float) -> list[Edge | None]:
    """The same of an open door, of which ``box`` is clear: only where trims lie on the wall."""
    found = edges_of(faces, box)
    edges = [e if e and e.is_trim and e.place - LAP * (e.kind == "lined") < SETBACK else None for e in found]
    return _behind_trims(edges, _reveals(box, edges, points, half))


def _behind_trims(edges: Sequence[Edge | None], found: Sequence[Reveal | None]) -> list[Edge | None]:
    """The edges behind trims, by the reveals that were seen at them.

    A lining shows on two sides at least, and on half of those where a trim begins somewhere else than at a reveal.
    """
    strips = [r.strip for r in found if r and r.strip is not None]
    shown, laps = [s for s in strips if s >= LINED], [-s for s in strips if s <= -LAPPED]
    if len(shown) >= 2 and 2 * len(shown) >= len(strips):
        lap, lined = LAP, True
    else:
        lap, lined = float(np.median(laps)) if laps else 0.0, False
    return [_behind_trim(edge, reveal, lap, lined) for edge, reveal in zip(edges, found, strict=True)]


def _behind_lining(edge: Edge | None, reveal: Reveal | None, lining: float | None) -> Edge | None:
    """The opening's edge without trims: a step of colour alone, where the ``lining`` ends that begins at a reveal, or
    the reveal itself.
    """
    if edge is None or reveal is None or (edge.kind == "step" and not edge.deeper):
        return edge
    if lining is not None and not (edge.kind == "step" and 0.0 < edge.place - reveal.place - lining < 2 * SAME):
        return Edge(reveal.place + lining, SIGMAS["step"], "step", True)
    near = edge.kind == "step" and abs(reveal.place - edge.place) < SAME
    return Edge(reveal.place, SIGMAS["reveal"], "reveal", True) if near else edge


def _behind_trim(edge: Edge | None, reveal: Reveal | None, lap: float, lined: bool) -> Edge | None:
    """The opening's edge from that of its trim and a reveal. Trims lap by ``lap`` metres over it where its own reveal
    does not show, a lining's if it is ``lined``.
    """
    if edge is None or not edge.is_trim:
        return _behind_lining(edge, reveal, None)
    if reveal is None or reveal.strip is None:
        return replace(edge, place=edge.place + lap, kind="lined") if lined and edge.kind == "trim" else edge
    if reveal.strip <= -LAPPED or (reveal.strip < LINED and lap == 0.0):
        return Edge(reveal.place, SIGMAS["reveal"], "reveal", True)
    if reveal.strip < LINED and not lined:  # mixed ranges at the trim's edge
        return Edge(reveal.place + reveal.strip + lap, SIGMAS["trim"], "trim", True)
    kind: Kind = "lined" if lined else "trim"
    return Edge(reveal.place + reveal.strip + lap * lined, SIGMAS[kind], kind, True)


def _reveals(box: Rectangle, edges: Sequence[Edge | None], points: WallPoints, half: float) -> list[Reveal | None]:
    """The reveals left, right and at the head of a rectangle, near those of its ``edges`` that were found."""
    if not any(edges):
        return [None] * len(edges)
    reach = FARTHEST + LAPS + STRIP + 2 * TRIM
    near = points.inside(box.left - reach, box.right + reach, 0.0, box.top + reach)
    return [_reveal_at(box, k, edge, near, half) for k, edge in enumerate(edges)]


def _reveal_at(box: Rectangle, side: int, edge: Edge | None, points: WallPoints, half: float) -> Reveal | None:
    """The reveal of the left (0), right or upper side of a rectangle, near ``edge`` or the trim's there."""
    if edge is None:
        return None
    trim = edge.place - LAP * (edge.kind == "lined")
    outwards, along, length = _beside(points, box, side)
    across = np.abs(points.across)
    low, high = (trim - STRIP, trim + LAPS) if edge.is_trim else (trim - WIDEST, trim + 2 * SAME)
    near = (outwards > low) & (outwards < high) & (along > 0) & (along < length)
    off_faces = near & ((across < half - SKIN) | (across > half + BEFORE))
    place = _outermost(outwards[off_faces], points.across[off_faces], along[off_faces], length, half)
    if place is None:
        return None
    before = (across > half + STANDS_OUT) & (across < half + BEFORE) & (along > 0) & (along < length)
    before &= (outwards > place - LAPS) & (outwards < place + STRIP + TRIM)
    strips = [_begins(outwards[before & (points.across * sign > 0)] - place) for sign in (1, -1)]
    known = [s for s in strips if s is not None]
    return Reveal(place, float(np.mean(known)) if known else None)


def _beside(points: WallPoints, box: Rectangle, side: int) -> tuple[F32, F32, float]:
    """Distances outwards from a side, distances along it from where it is asked, and the length on which it is."""
    if side == 2:
        return points.up - box.top, points.along - (box.left + ENDS), box.width - 2 * ENDS
    outwards = box.left - points.along if side == 0 else points.along - box.right
    return outwards, points.up - FOOT, box.top - ENDS - FOOT


def _outermost(outwards: F32, across: F32, along: F32, length: float, half: float) -> float | None:
    """The outermost strip of WINDOW in which points (n,), none of them on the wall's faces, lie over some depth all
    along a side of ``length`` metres; None where what lies there goes on before the wall, as another wall does.
    """
    if not len(outwards):
        return None
    order = np.argsort(outwards)
    t, depth, piece = outwards[order], across[order], np.floor(along[order] / PIECE).astype(np.int64)
    least = PIECES * length / PIECE
    starts = np.arange(t[-1] - WINDOW / 2, t[0], -STEP)
    bounds = np.searchsorted(t, np.stack([starts, starts + WINDOW]))
    for first, last in bounds.T:
        inside = np.abs(depth[first:last]) < half
        if inside.sum() < least or len(np.unique(piece[first:last][~inside])) >= least:
            continue
        if _over_some_depth(depth[first:last][inside], piece[first:last][inside], least):
            crowd = t[(t > t[first] - 2 * STEP) & (t < t[first] + WINDOW)]  # the strip's outer part may be empty
            return float(np.median(crowd))
    return None


def _over_some_depth(depth: F32, piece: NDArray[np.int64], least: float) -> bool:
    """Whether points lie over some depth without a wide gap, in enough pieces of the side."""
    low, high = np.percentile(depth, (10, 90))
    if high - low < DEEP or len(np.unique(piece)) < least:
        return False
    body = np.sort(depth[(depth >= low) & (depth <= high)])
    return bool(np.diff(body).max(initial=0.0) < GAP * (high - low))


def _begins(outwards: F32) -> float | None:
    """Where a trim's points (n,) begin, metres outwards; None where they are too few."""
    if len(outwards) < FEWEST:
        return None
    bins = np.arange(-LAPS, STRIP + TRIM, STEP)
    counts, _ = np.histogram(outwards, bins)
    return float(bins[np.argmax(counts > DENSE * np.percentile(counts, 80))])
