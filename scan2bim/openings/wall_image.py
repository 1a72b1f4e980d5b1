"""The image of a wall: for each pixel, whether its face was seen there, something behind the face, or a station looked
through.

The paper's image I (section IV.B) of data, centroids and no-data, with pixels of 2.5 cm instead of voxels of 20 cm. A
window's panes return some pulses, mirror a few and let most pass; but in all of the window, frame, pane and reveals,
the wall's face itself is missing. So what was *behind* the face, seen from the room before it, counts beside the
*centroids* (voxel label Opening), where the panorama of a station shows that its rays went on behind the wall, or never
came back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.panorama import Panorama, cube_cell
from scan2bim.openings.holes import holes
from scan2bim.openings.near_points import WallPoints
from scan2bim.openings.virtual import is_virtual
from scan2bim.openings.within import stretch_bounds, within
from scan2bim.structure.shapes import WallShape

PIXEL = 0.025
"""Edge of a pixel, metres: half of the narrowest strip of wall between two windows."""
ASKED = 2
"""Pixels along an edge of the squares for which stations are asked: 5 cm, their panorama's cells are no finer."""
REACH = 12.0
"""Stations farther than this, metres, are not asked: their panorama's cells are too coarse for a jamb."""
SKIN = 0.03
"""Points up to this far behind a face, metres, lie on it: noise and plaster; leaves and frames stand back more."""
THIN = 0.15
"""Share of a wall's thickness that SKIN may take: points on the reveals of thin walls are not all on a face."""
PROUD = 0.035
"""Points up to this far before a face, metres, lie on it: trims and skirting boards; curtains hang farther off."""
BEFORE = 0.06
"""Points up to this far before a face, metres, are kept: fronts of window boards."""
BEHIND = 0.08
"""Metres behind a wall's face to which a ray must go on to tell that the face is not there: beyond plaster, skirting
boards and the error of a panorama's cell seen at a slant."""
NEAREST = 0.35
"""Stations nearer to a wall, metres, are not asked where nothing came back: from so near nothing does."""
LEAST_OUT = 10
"""Squares of ASKED pixels through which a station in a wall's body must look out on each side."""
PAST, WIDEST = 0.02, 3.0
"""Share of its distance by which such a station sees past a place, and metres to the farthest jamb of its opening."""
STEEPEST = 5.0
"""Slant (1 / cosine) beyond which a station is not asked."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
Looked = tuple[NDArray[np.uint8], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_], dict[int, NDArray[np.bool_]]]
Box = tuple[float, float, float, float]
"""Left, right, bottom, top in metres, along the wall from its start and up from its base."""


@dataclass(frozen=True, slots=True, eq=False)
class WallImage:
    """Rasters (rows bottom up from the base, columns along the axis from its start) and the points they are made of.

    ``faces`` (2, r, c) points on the left and on the right face, ``behind`` (2, r, c) seen from there behind it;
    ``through`` (r, c) how many stations looked through, ``lookers`` where each of them did; ``entered`` (2, r, c)
    whether a ray from that side, of a station that is not made up, went on behind the face; ``lost`` (r, c) where
    stations looked through by pulses alone that never came back, in scans that do not record them; ``blank`` (r, c)
    whether a station that is made up has a free view of it and nothing was scanned there nor behind it. ``along``,
    ``up`` (n,) metres; ``depth`` (n,) metres behind the face on whose side the point was seen, ``on_face`` (n,) whether
    it lies on that, ``side`` (n,) 0 for the left and 1 for the right one; ``bounds`` as of ``stretch_bounds``.
    ``face`` (r, c) where points lie on either face, ``told`` where anything was seen of the wall, or through it.
    """

    faces: NDArray[np.int32]
    behind: NDArray[np.int32]
    through: NDArray[np.uint8]
    entered: NDArray[np.bool_]
    blank: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    lookers: dict[int, NDArray[np.bool_]]
    along: F32
    up: F32
    depth: F32
    on_face: NDArray[np.bool_]
    side: NDArray[np.int8]
    bounds: F32 = field(init=False)
    face: NDArray[np.bool_] = field(init=False)
    told: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        face, behind, entered = self.faces.any(0), self.behind.any(0), self.entered.any(0)
        object.__setattr__(self, "bounds", stretch_bounds(self.along, self.up))
        object.__setattr__(self, "face", face)
        object.__setattr__(self, "told", face | behind | entered | (self.through > 0) | self.blank)

    def rows_within(self, left: float, right: float, bottom: float, top: float) -> NDArray[np.int64]:
        """Numbers of the points inside a box."""
        return np.asarray(within(self.along, self.up, self.bounds, np.array([left, right, bottom, top], np.float32)))


def wall_image(wall: WallShape, points: WallPoints, panoramas: Mapping[int, Panorama], stations: F64) -> WallImage:
    """Image of one wall from the ``points`` near it and the ``panoramas`` of stations within REACH.

    ``stations`` (s, 3) positions by number, nan where unknown.
    """
    length = wall.length
    shape = (max(1, int(np.ceil((wall.top - wall.base) / PIXEL))), max(1, int(np.ceil(length / PIXEL))))
    half, skin = np.float32(wall.thickness / 2), np.float32(min(SKIN, THIN * wall.thickness))
    here = np.float32(0.0 if wall.left and wall.right else 1.0 if wall.left else -1.0)
    seen = (points.along, points.across, points.up, points.station, _side(wall, stations), here)
    known = here if wall.thickness_sigma is None else np.float32(0.0)
    found = _classified(*seen, known, half, skin, shape)
    if here != 0 and known == 0 and _misplaced(found[0][int(here > 0)], found[1][int(here > 0)]):
        found = _classified(*seen, here, half, skin, shape)
    return WallImage(*found[:2], *_looked(wall, shape, panoramas), *found[2:])


def _misplaced(face: NDArray[np.int32], behind: NDArray[np.int32]) -> bool:
    """Whether an outer face is not where an outer wall's thickness, told by jambs, puts it: most that was seen from
    there (r, c) lies behind it.
    """
    return bool(np.count_nonzero(face) < np.count_nonzero(behind))


def answered(image: WallImage) -> WallImage:
    """The image without what is known by lost pulses alone."""
    if not image.lost.any():
        return image
    return replace(image, through=np.where(image.lost, 0, image.through), lost=np.zeros_like(image.lost))


def part(raster: NDArray[Any], left: float, right: float, bottom: float, top: float) -> NDArray[Any]:
    """Pixels of a raster (r, c) of a wall's image within a box."""
    rows = slice(max(0, round(bottom / PIXEL)), max(0, round(top / PIXEL)))
    return raster[rows, max(0, round(left / PIXEL)) : max(0, round(right / PIXEL))]


def _side(wall: WallShape, stations: F64) -> F32:
    """1 for each station left of the wall, -1 right of it, 0 within it or where its position is unknown."""
    _, place = wall.locate(stations[:, :2])
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(place) > wall.thickness / 2, np.sign(place), 0.0).astype(np.float32)


@nb.njit(cache=True, nogil=True)
def _classified(along, across, up, station, sides, here, known, half, skin, shape):  # pyright: ignore
    """Rasters (2, r, c) of the points on the faces and behind them; and of the points not far before their face: along,
    up, depth behind it, whether they lie on it, and its side (n,).

    A point belongs to the face that its station looked at; where that is unknown to the one ``here``, or if that is 0
    to the one on whose side it lies. Where only one face is ``known`` (1 left, -1 right, 0 both), since the thickness
    is assumed, those of the other are left out: nobody knows where it is.
    """
    faces, behind = np.zeros((2, *shape), np.int32), np.zeros((2, *shape), np.int32)
    n = len(along)
    kept_along, kept_up, depths = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.float32)
    flags, right = np.empty(n, np.bool_), np.empty(n, np.int8)
    pixel = np.float32(PIXEL)
    used = 0
    for i in range(n):
        sign = sides[station[i]]
        if sign == 0:
            sign = here if here != 0 else np.sign(across[i])
        if known * sign < 0:
            continue
        depth = half - sign * across[i]
        if not depth > -BEFORE:
            continue
        on_face, side = -PROUD < depth < skin, 1 if sign < 0 else 0
        kept_along[used], kept_up[used], depths[used] = along[i], up[i], depth
        flags[used], right[used] = on_face, side
        used += 1
        r, c = int(np.floor(up[i] / pixel)), int(np.floor(along[i] / pixel))
        if 0 <= r < shape[0] and 0 <= c < shape[1]:
            if on_face:
                faces[side, r, c] += 1
            elif depth > 0:
                behind[side, r, c] += 1
    return faces, behind, kept_along[:used], kept_up[:used], depths[:used], flags[:used], right[:used]


def _looked(wall: WallShape, shape: tuple[int, int], panoramas: Mapping[int, Panorama]) -> Looked:
    """As ``_through``, stretch by stretch of a curved wall."""
    if not wall.bulge:
        return _through(wall, shape, panoramas)
    through, both = np.zeros(shape, np.uint8), np.zeros((2, *shape), np.bool_)
    blank, lost = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    lookers: dict[int, NDArray[np.bool_]] = {}
    for low, high, flat in wall.flat_parts():
        cols = slice(round(low / PIXEL), min(shape[1], round(high / PIXEL) + 1))
        found = _through(flat, shape, panoramas)
        for whole, piece in zip((through, both, blank, lost), found[:4], strict=True):
            whole[..., cols] = piece[..., cols]
        for number, looked in found[4].items():
            lookers.setdefault(number, np.zeros(shape, np.bool_))[:, cols] = looked[:, cols]
    return through, both, blank, lost, lookers


def _through(wall: WallShape, shape: tuple[int, int], panoramas: Mapping[int, Panorama]) -> Looked:
    """How many stations looked through the wall (r, c), whether any from each side looked behind its face (2, r, c),
    where one that is made up sees nothing at all through an outer wall (r, c), where only pulses that never came back
    went through one, and where each looked through.
    """
    start, end = np.array(wall.start), np.array(wall.end)
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    normal = np.array([-direction[1], direction[0]])
    coarse = ((shape[0] + ASKED - 1) // ASKED, (shape[1] + ASKED - 1) // ASKED)
    rows, cols = np.mgrid[0 : coarse[0], 0 : coarse[1]]
    step = ASKED * PIXEL
    xy = start + (cols.ravel()[:, None] + 0.5) * step * direction
    points = np.column_stack([xy, wall.base + (rows.ravel() + 0.5) * step]).astype(np.float32)
    through, entered = np.zeros(coarse, np.uint8), np.zeros((2, *coarse), np.bool_)
    blank, answered = np.zeros(coarse, np.bool_), np.zeros(coarse, np.bool_)
    lookers: dict[int, NDArray[np.bool_]] = {}
    outer = not (wall.left and wall.right)
    half = wall.thickness / 2
    for number, panorama in panoramas.items():
        if not wall.base - 0.5 < panorama.position[2] < wall.top + 0.5:
            continue
        away = float((panorama.position[:2] - start) @ normal)
        place, reach = panorama.position.astype(np.float32), max(abs(away), 0.02)
        middle = float((panorama.position[:2] - start) @ direction)
        ends = (middle - reach * STEEPEST) / step, (middle + reach * STEEPEST) / step + 1
        here = slice(*(min(max(int(end), 0), coarse[1]) for end in ends))
        near = np.ascontiguousarray(points.reshape(*coarse, 3)[:, here]).reshape(-1, 3)
        seen = panorama.ranges, np.float32(1.0 + (half + 0.05) / reach), np.float32(reach * STEEPEST)
        looked = np.zeros(coarse, np.bool_)
        looked[:, here] = _looked_through(near, place, *seen, outer).reshape(coarse[0], -1)
        before = abs(away) - half
        if before < 0.0:
            looked |= _round_about(points, panorama, normal, away, half, outer).reshape(coarse)
            entered |= looked
        answered |= looked
        if outer and before > NEAREST and here.stop > here.start and not is_virtual((number,)):
            looked[:, here] |= holes(panorama, start, direction, wall.base, here, coarse[0], step)
        through += looked
        if looked.any():
            lookers[number] = _fine(looked, shape)
        if is_virtual((number,)):
            nothing = _sees_nothing(near, place, panorama.ranges, np.float32(reach * STEEPEST))
            blank[:, here] |= outer & nothing.reshape(coarse[0], -1)
        elif before > BEHIND:
            face = near + np.append(np.sign(away) * half * normal, 0.0).astype(np.float32)
            seen = panorama.ranges, np.float32(1.0 + BEHIND / before), np.float32(before * STEEPEST)
            entered[int(away < 0)][:, here] |= _looked_through(face, place, *seen, outer).reshape(coarse[0], -1)
    both = np.stack([_fine(side, shape) for side in entered])
    lost = (through > 0) & ~answered
    return _fine(through, shape), both, _fine(blank, shape), _fine(lost, shape), lookers


def _round_about(
    points: F32, panorama: Panorama, normal: F64, away: float, half: float, outer: bool
) -> NDArray[np.bool_]:
    """Which of the ``points`` (n, 3) on the middle of a wall a station sees that stands in its body, if it looks out of
    it on both sides: then it stands in an opening, and may see more of that than others past a leaf that stands open.
    """
    place = panorama.position.astype(np.float32)
    for side in (1.0, -1.0):
        before = half - side * away
        face = points + np.append(side * half * normal, 0.0).astype(np.float32)
        seen = panorama.ranges, np.float32(1.0 + BEHIND / before), np.float32(before * STEEPEST)
        if _looked_through(face, place, *seen, outer).sum() < LEAST_OUT:
            return np.zeros(len(points), np.bool_)
    return _looked_through(points, place, panorama.ranges, np.float32(1.0 + PAST), np.float32(WIDEST), False)


@nb.njit(cache=True, nogil=True)
def _looked_through(points, position, ranges, beyond, farthest, misses):  # pyright: ignore
    """Whether the ray towards each of ``points`` (n, 3) went on to more than ``beyond`` times its distance; not asked
    beyond ``farthest`` metres in plan. With ``misses``, a pulse that did not return went on.
    """
    out = np.zeros(points.shape[0], np.bool_)
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        dz = points[i, 2] - position[2]
        if dx * dx + dy * dy > farthest * farthest:
            continue
        f, a, b = cube_cell(dx, dy, dz, edge)
        r = ranges[f, a, b]
        if r > 0.0:
            out[i] = r > beyond * np.sqrt(dx * dx + dy * dy + dz * dz)
        elif r < 0.0:
            out[i] = misses
    return out


@nb.njit(cache=True, nogil=True)
def _sees_nothing(points, position, ranges, farthest):  # pyright: ignore
    """Whether nothing lies towards each of ``points`` (n, 3); not asked beyond ``farthest`` metres in plan."""
    out = np.zeros(points.shape[0], np.bool_)
    edge = ranges.shape[1]
    for i in range(points.shape[0]):
        dx = points[i, 0] - position[0]
        dy = points[i, 1] - position[1]
        if dx * dx + dy * dy <= farthest * farthest:
            f, a, b = cube_cell(dx, dy, points[i, 2] - position[2], edge)
            out[i] = ranges[f, a, b] == 0.0
    return out


def _fine(raster: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
    return raster.repeat(ASKED, 0).repeat(ASKED, 1)[: shape[0], : shape[1]]
