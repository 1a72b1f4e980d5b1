"""How thick a wall is of which scans saw one face: rays that leave through its openings tell where its other face lies.

Behind a window's edge, the wall's face goes on. A ray that passes through the opening aslant crosses that edge some way
behind the face. In the wall it ends there, on the reveal; beyond the outer face nothing stops it. So the depth at which
rays begin to go on is the wall's thickness, though nobody stood outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama
from scan2bim.structure.axes import Axis

PIXEL = 0.025
"""Pixels of a wall's face, metres."""
DEEP, BIN = 0.8, 0.01
"""Depth behind the face up to which crossings are counted, and their bins, metres."""
ON_FACE = 0.025
"""Distance, metres, within which a ray that ends near the face's plane ends on it."""
THROUGH = 0.05
"""Depth, metres, from which on a ray entered an opening or a recess."""
SHORT, LONG = 0.03, 0.05
"""Metres before and behind the crossing between which a ray ends on the reveal: less is a frame, more is outside."""
SLOPE = 0.15
"""Least share of a ray's way that leads into the wall."""
BEFORE = 0.3
"""Least distance, metres, of stations before the face."""
COARSE = 0.025
"""Depth, metres, that a ray may cross the edge sooner or later for the width of its panorama's cells."""
FEWEST = 15
"""Rays that must end on reveals, and that must go on, to know a thickness from both sides."""
STRAY = 0.04
"""Share of rays that a pane mirrors or that meet something else: they contradict any thickness."""
MOST_WRONG = 0.2
"""Share of rays that may contradict every thickness: more do where the edges of what is solid are not openings'."""
LOOSE = 0.08
"""Metres between the least and the greatest thickness that agree with the rays, from which on it is not measured."""
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Crossings:
    """Rays (k,) by the depth, in bins of BIN metres, at which they cross an opening's edge: those that ``ended`` there
    and those that ``passed``.
    """

    ended: F64
    passed: F64

    def joined(self, other: Crossings) -> Crossings:
        """Those of both."""
        return Crossings(self.ended + other.ended, self.passed + other.passed)

    def bounds(self) -> tuple[float, float]:
        """Least and greatest thickness (metres; 0 and inf where nothing bounds it) that fewest rays contradict."""
        if self.ended.sum() + self.passed.sum() < FEWEST:
            return 0.0, np.inf
        wrong = np.append(0.0, np.cumsum(self.passed)) + np.append(np.cumsum(self.ended[::-1])[::-1], 0.0)
        if wrong.min() > MOST_WRONG * (self.ended.sum() + self.passed.sum()):
            return 0.0, np.inf
        slack = max(2.0, 3.0 * wrong.min() ** 0.5, STRAY * min(self.ended.sum(), self.passed.sum()))
        fit = np.flatnonzero(wrong <= wrong.min() + slack)
        best = int(np.argmin(wrong))
        first = max((k for k in range(best) if k not in fit), default=-1) + 1
        last = min((k for k in range(best, len(wrong)) if k not in fit), default=len(wrong)) - 1
        low = first * BIN if self.ended.sum() >= FEWEST else 0.0
        return low, last * BIN if self.passed[last:].sum() >= FEWEST else np.inf

    def thickness(self) -> tuple[float, float] | None:
        """Thickness and its standard deviation, metres; None where rays do not bound it from both sides."""
        low, high = self.bounds()
        if not 0.0 < low <= high < low + LOOSE:
            return None
        return (low + high) / 2, float(np.hypot((high - low) / 12**0.5, BIN))


def crossings_of(axis: Axis, base: float, top: float, panoramas: Sequence[Panorama]) -> Crossings:
    """Rays of stations before it through the openings of a straight wall of which one face was seen, between the
    heights ``base`` and ``top`` (z).
    """
    none = np.zeros(round(DEEP / BIN))
    outward = -axis.normal if axis.left else axis.normal
    start = axis.start + axis.inset
    sizes = np.array([axis.length, base, top])
    near = [p for p in panoramas if float((p.position[:2] - start) @ outward) < -BEFORE]
    shape = max(1, int(axis.length / PIXEL)), max(1, int((top - base) / PIXEL))
    on_face, through = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for panorama in near:
        frame = np.append(panorama.cube(np.array([start, axis.direction, outward])), sizes)
        _look(panorama.ranges, panorama.cube(panorama.position[None])[0], frame, on_face, through)
    solid = _crowd(on_face) > _crowd(through)
    counts = np.zeros((2, len(none)))
    for panorama in near:
        frame = np.append(panorama.cube(np.array([start, axis.direction, outward])), sizes)
        _cross(panorama.ranges, panorama.cube(panorama.position[None])[0], frame, solid, counts)
    return Crossings(counts[0], counts[1])


def _crowd(rays: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rays in the 3 x 3 pixels round each."""
    return cv2.boxFilter(rays, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).astype(np.float32)


@nb.njit(cache=True, nogil=True, inline="always")
def _ray(face, row, col, edge):  # pyright: ignore
    """Unit direction of a panorama's cell."""
    u, v = (2 * row + 1) / edge - 1, (2 * col + 1) / edge - 1
    sign = 1.0 - 2.0 * (face % 2)
    m = 1.0 / np.sqrt(1 + u * u + v * v)
    if face < 2:
        return sign * m, u * m, v * m
    if face < 4:
        return u * m, sign * m, v * m
    return u * m, v * m, sign * m


@nb.njit(cache=True, nogil=True)
def _look(ranges, position, frame, on_face, through):  # pyright: ignore
    """Count, by pixels of the face, rays that end on it and rays that go on through its plane."""
    edge = ranges.shape[1]
    px, py = position[0] - frame[0], position[1] - frame[1]
    along, depth, up = px * frame[2] + py * frame[3], px * frame[4] + py * frame[5], position[2] - frame[7]
    for face in range(6):
        for row in range(edge):
            for col in range(edge):
                reach = ranges[face, row, col]
                if reach <= 0.0:
                    continue
                x, y, z = _ray(face, row, col, edge)
                into = x * frame[4] + y * frame[5]
                if into < SLOPE or depth + into * reach < -ON_FACE:
                    continue
                way = -depth / into
                i = int(np.floor((along + way * (x * frame[2] + y * frame[3])) / PIXEL))
                j = int(np.floor((up + way * z) / PIXEL))
                if 0 <= i < on_face.shape[0] and 0 <= j < on_face.shape[1]:
                    if depth + into * reach < ON_FACE:
                        on_face[i, j] += 1
                    elif depth + into * reach > THROUGH:
                        through[i, j] += 1


@nb.njit(cache=True, nogil=True)
def _cross(ranges, position, frame, solid, counts):  # pyright: ignore
    """Count, by depth, the rays through openings that end where they come behind the solid face, and that go on.

    A cell keeps its nearest range, so that the face seems to go on half a cell beyond its edge.
    """
    edge = ranges.shape[1]
    px, py = position[0] - frame[0], position[1] - frame[1]
    along, depth, up = px * frame[2] + py * frame[3], px * frame[4] + py * frame[5], position[2] - frame[7]
    for face in range(6):
        for row in range(edge):
            for col in range(edge):
                reach = ranges[face, row, col]
                if reach <= 0.0:
                    continue
                x, y, z = _ray(face, row, col, edge)
                into = x * frame[4] + y * frame[5]
                if into < SLOPE or depth + into * reach < THROUGH:
                    continue
                slope_a, slope_z = (x * frame[2] + y * frame[3]) / into, z / into
                slope = np.sqrt(slope_a**2 + slope_z**2)
                late = -depth / into / edge / max(slope, 1e-6)
                if late > COARSE:
                    continue
                a, b = along - depth * slope_a, up - depth * slope_z
                i, j = int(np.floor(a / PIXEL)), int(np.floor(b / PIXEL))
                if not (0 <= i < solid.shape[0] and 0 <= j < solid.shape[1]) or solid[i, j]:
                    continue
                for step in range(counts.shape[1]):
                    d = step * BIN
                    i, j = int(np.floor((a + d * slope_a) / PIXEL)), int(np.floor((b + d * slope_z) / PIXEL))
                    if not (0 <= i < solid.shape[0] and 0 <= j < solid.shape[1]):
                        break
                    if solid[i, j]:
                        at = d + late
                        end = depth + into * reach
                        k = int(at / BIN)
                        if end > at - SHORT and k < counts.shape[1]:
                            counts[1 if end > at + LONG else 0, k] += 1
                        break
