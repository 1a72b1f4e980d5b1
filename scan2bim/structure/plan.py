"""Plan of one storey as rasters: where its floor and ceiling were seen, and where vertical surfaces stand.

Pixels are the surfels' plan columns of 5 cm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from scan2bim.cloud.surfels import PLAN, Surfels
from scan2bim.geometry.raster import closed, nearest_of, opened
from scan2bim.structure.columns import FLUSH, HIGH, Columns, Grid, gather_columns, over_soffits, pixels_at
from scan2bim.structure.slants import angles_of, level_over, with_gaps
from scan2bim.structure.storeys import HEADROOM, Layers, StoreyLevels, standing_and_hanging

SOFFIT = 13
"""Pixels: a strip narrower than 65 cm that hangs lower than what is beside it is no ceiling of its own."""
DROP = 0.12
"""Metres that such a strip hangs lower where there is ceiling on both sides of it."""
STEP = 0.06
"""Metres that it hangs lower where the ceiling ends beyond it: the lintel of a window that nearly reaches the ceiling.
"""
NEAR = 4
"""Pixels: 20 cm, from a window's frame, which hangs lower still, to the soffit before it."""
SMALLEST_CEILING = 7
"""Pixels: a ceiling patch that a square of 35 cm does not fit in is a lintel, a shelf or a beam."""
THIN = 5
"""Pixels: a strip narrower than 25 cm that hangs higher than what is beside it is no ceiling but the top of a face."""
SMALLEST_ROOF = 11
"""Pixels: a patch that a square of 55 cm does not fit in, such as the edge of a step, is no roof seen from outside."""
LOWEST_CEILING = 0.5
"""Clear height, metres, from which a large surface overhead counts as ceiling; low under sloped roofs."""
ROOFED = 0.3
"""Ceiling, as a share of the floor, up to which that was not scanned: so little are shelves and lintels in a scan that
was cut below the ceiling.
"""
CUT = 99.5
"""Percentile of the heights of a storey without a ceiling that is its top: where the scan was cut."""
DEEPEST_FURNITURE = 5
"""Steps of 15 cm by which a ceiling goes on over things under which nothing was seen: across their fronts, too."""
SAME_LEVEL = 0.04
"""Difference in height, metres, from which a strip of ceiling hangs lower: the soffit of a lintel."""
CLEAR_SLOPE = 6.0
"""Slope of the blurred floor-and-ceiling mask (Sobel units of up to 48) from which a surface's front can be told from
its back.
"""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Rasters (rows along y, columns along x) of a storey, on ``grid``.

    ``floor`` and ``ceiling`` uint8 masks; ``ceiling_z`` float32 height of the ceiling over a pixel, nan where none;
    ``ceiling_xy`` (rows, columns, 2) float32 mean place of what hangs over a pixel, nan where nothing; ``overhead_z``
    float32 height of the lowest that hangs over a pixel, narrow strips and all;
    ``soffit`` uint8 mask of narrow strips at its rim that hang lower: lintels, alcoves;
    ``void`` uint8 mask of where one looks down past the floor's level, as in a stair well; ``columns`` the vertical
    surfaces; ``things`` uint8 mask of what stands well below the walls' top and can be seen from above, where no
    ceiling was scanned; ``standing_z`` float32 height of the lowest that can be stood on over a pixel, nan where none.
    """

    levels: StoreyLevels
    grid: Grid
    floor: U8
    ceiling: U8
    ceiling_z: F32
    ceiling_xy: F32
    overhead_z: F32
    soffit: U8
    void: U8
    columns: Columns
    things: U8
    standing_z: F32

    @property
    def origin(self) -> F64:
        """Lower left corner (2,), metres."""
        return self.grid.origin


def plan_of(
    levels: StoreyLevels, surfels: Surfels, layers: Layers, stations: F64, steps: Mapping[int, float] | None = None
) -> Plan:
    """Rasters of one storey. ``stations`` (s, 3) local positions by station number, nan where unknown; ``steps`` the
    angle (radians) between the pulses of stations.
    """
    height = surfels.xyz[layers.order, 2].astype(np.float64)
    here = layers.pick(np.flatnonzero((height > levels.floor - 0.3) & (height < levels.top + 0.1)))
    xyz = surfels.xyz[here.order].astype(np.float64)
    z = xyz[:, 2]
    low, high = (np.array([side(xyz[:, 0]), side(xyz[:, 1])]) for side in (np.min, np.max))
    origin = np.floor(low / PLAN - 4) * PLAN
    shape = tuple(np.ceil((high - origin) / PLAN).astype(int)[::-1] + 4)
    pixel = pixels_at(xyz, origin)
    standing, _ = standing_and_hanging(here)
    on_floor = np.flatnonzero(standing & (np.abs(z - levels.floor) < 0.08))
    eyes, angles = _eyes(surfels, here, stations), angles_of(surfels, here, steps or {})
    floor = _mask(pixels_at(with_gaps(xyz[on_floor], eyes[on_floor], angles[on_floor], origin, shape), origin), shape)
    over_floor = np.isfinite(here.below) | level_over(floor, pixel, z, here, levels.ceiling)
    hollow = (here.below > LOWEST_CEILING) & over_floor & (z < levels.top - 0.02)
    at = np.flatnonzero(hollow & (z > levels.floor + LOWEST_CEILING))
    at = at[_overhead(pixel[at], xyz[at], here.pick(at), surfels, stations, shape)]
    over = with_gaps(xyz[at], eyes[at], angles[at], origin, shape)
    ceiling, ceiling_z, soffit, found = _ceiling(pixels_at(over, origin), over, shape)
    bare = np.flatnonzero(np.isinf(here.below) & (z > levels.floor + LOWEST_CEILING) & (z < levels.top - 0.02))
    bare = bare[eyes[bare, 2] < z[bare]]
    ceiling, ceiling_z = _over_furniture(ceiling, ceiling_z, _lowest(pixel[bare], z[bare], shape))
    things = np.zeros_like(floor)
    if ceiling.sum() <= ROOFED * floor.sum():
        levels = replace(levels, ceiling=None, top=float(np.percentile(z, CUT)))
        things = _mask(pixel[standing & np.isinf(here.above) & (z < levels.top - HIGH)], shape)
        ceiling, ceiling_z, soffit = np.zeros_like(ceiling), np.full_like(ceiling_z, np.nan), np.zeros_like(soffit)
    roof = _roof_near(ceiling_z).astype(np.float64)
    grid = Grid(origin, np.where(np.isfinite(roof), roof, levels.top + FLUSH), levels.floor)
    columns = gather_columns(surfels, layers, grid, stations)
    under, over = _around_soffits(grid, soffit, ceiling_z)
    columns = _facing(over_soffits(surfels, layers, grid, under, over, columns), floor, ceiling_z)
    void = _void(floor, _mask(_deep(levels.floor, height, surfels, layers, grid, stations), shape))
    return Plan(
        levels,
        grid,
        floor,
        ceiling,
        ceiling_z,
        found[..., :2],
        found[..., 2],
        soffit,
        void,
        columns,
        things,
        _lowest(pixel[standing], z[standing], shape),
    )


def _overhead(
    pixel: I64, xyz: F64, hollow: Layers, surfels: Surfels, stations: F64, shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Which surfels with clear height under them hang overhead: those seen from below, and sloped ones unless they are
    a roof's outside.
    """
    eyes, rising = _eyes(surfels, hollow, stations), _rising(pixel, xyz[:, 2], shape)
    overhead = _from_below(hollow, xyz[:, 2], eyes[:, 2]) | _sloped(rising)
    return overhead & ~_outer_roofs(pixel, xyz, rising, eyes, shape)


def _deep(floor: float, height: F64, surfels: Surfels, layers: Layers, grid: Grid, stations: F64) -> I64:
    """Pixels (n, 2) of what one could stand on deep under a floor and with nothing between, seen from over the floor
    or from where nobody knows; ``height`` (z) in layer order.
    """
    deep = layers.pick(np.flatnonzero((height < floor - 0.35) & (height + layers.above > floor + HEADROOM)))
    standing, _ = standing_and_hanging(deep)
    deep = deep.pick(np.flatnonzero(standing & ~(_eyes(surfels, deep, stations)[:, 2] < floor)))
    pixel = grid.pixel_of(surfels.xyz[deep.order].astype(np.float64))
    return pixel[grid.contains(pixel)]


def _soffits(height: F32) -> NDArray[np.bool_]:
    """Narrow strips that hang lower than the ceiling on both sides of them: lintels over doors and windows, beams."""
    between = cv2.morphologyEx(np.where(np.isfinite(height), height, np.float32(-1e3)), cv2.MORPH_CLOSE, _square())
    return np.isfinite(height) & (between - height > DROP) & (between > -500)


def _rims(height: F32) -> NDArray[np.bool_]:
    """Narrow strips that hang lower than the ceiling beside them where it ends beyond them: lintels in window reveals,
    low ceilings of alcoves.
    """
    beside = cv2.morphologyEx(np.where(np.isfinite(height), height, np.float32(1e3)), cv2.MORPH_CLOSE, _square())
    return np.isfinite(height) & (beside - height > STEP) & (beside < 500) & ~_sloping(height)


def _square() -> NDArray[np.uint8]:
    return np.ones((SOFFIT, SOFFIT), np.uint8)


def _sloping(height: F32) -> NDArray[np.bool_]:
    """Pixels on or near ceilings that rise steadily; steps do not count."""
    slope = np.maximum(np.abs(rise(height, 0)), np.abs(rise(height, 1)))
    steady = opened(closed((slope > 0.2).astype(np.uint8), 3), 9)
    return cv2.dilate(steady, np.ones((SOFFIT, SOFFIT), np.uint8)) > 0


def rise(height: F32, axis: int) -> F32:
    """Slope of heights along an axis over 20 cm, nan where not known."""
    rise = np.full(height.shape, np.nan, np.float32)
    if axis:
        rise[:, 2:-2] = (height[:, 4:] - height[:, :-4]) / (4 * PLAN)
    else:
        rise[2:-2] = (height[4:] - height[:-4]) / (4 * PLAN)
    return rise


def _facing(columns: Columns, floor: U8, ceiling_z: F32) -> Columns:
    """Columns with ``view`` made up where no station is known: towards where more floor or ceiling was seen.

    Just before a wall's face there is floor and ceiling; just behind it, inside the wall, there is neither.
    """
    unknown = np.linalg.norm(columns.view, axis=1) < 0.1
    if not unknown.any():
        return columns
    seen = np.maximum(floor, np.isfinite(ceiling_z).astype(np.uint8)).astype(np.float32)
    blurred = cv2.boxFilter(seen, -1, (3, 3))
    slope = np.stack([cv2.Sobel(blurred, cv2.CV_32F, 1, 0, ksize=5), cv2.Sobel(blurred, cv2.CV_32F, 0, 1, ksize=5)], -1)
    at = columns.pixel[unknown]
    towards = slope[at[:, 1], at[:, 0]].astype(np.float64)
    length = np.linalg.norm(towards, axis=1, keepdims=True)
    view = columns.view.copy()
    view[unknown] = np.divide(towards, length, out=np.zeros_like(towards), where=length > CLEAR_SLOPE)
    return replace(columns, view=view)


def _void(floor: U8, deep: U8) -> U8:
    """Pixels without floor over which something was seen deeper down, as patches that a square of 55 cm fits in."""
    return opened(closed(deep & (1 - closed(floor, 9)), 9) & (1 - floor), 11)


def _eyes(surfels: Surfels, layers: Layers, stations: F64) -> F64:
    """Place (n, 3) of the station that saw each surfel (in layer order), nan where unknown."""
    places = np.append(stations, np.full((1, 3), np.nan), axis=0)
    return np.take(places, np.minimum(surfels.station[layers.order], len(stations)), axis=0)


def _from_below(layers: Layers, z: F64, eye: F64) -> NDArray[np.bool_]:
    """Surfels (in layer order) seen from below; where the station is unknown, those with clear height under them."""
    return np.where(np.isfinite(eye), eye < z, layers.below > HEADROOM - 0.3)


def _rising(pixel: I64, z: F64, shape: tuple[int, ...]) -> F32:
    """Slopes (n, 2) along x and y of the surface of surfels, nan where not known."""
    height = np.full(shape, np.nan, np.float32)
    height[pixel[:, 1], pixel[:, 0]] = z
    return np.stack([rise(height, axis)[pixel[:, 1], pixel[:, 0]] for axis in (1, 0)], 1)


def _sloped(rising: F32) -> NDArray[np.bool_]:
    """Surfels whose surface rises by 15 to 70 degrees: low parts of sloped ceilings, which a scanner sees from its own
    height.
    """
    slope = np.hypot(rising[:, 0], rising[:, 1])
    return (slope > 0.27) & (slope < 2.7)


def _outer_roofs(
    pixel: NDArray[np.int64], xyz: F64, rising: F32, eyes: F64, shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Surfels of sloped surfaces whose stations (n, 3) stood above their planes: roofs seen from outside."""
    above = _sloped(rising)
    away = eyes[above] - xyz[above]
    above[above] = away[:, 2] > (away[:, :2] * rising[above]).sum(1)
    patch = opened(closed(_mask(pixel[above], shape), 3), SMALLEST_ROOF)
    above[above] = patch[pixel[above, 1], pixel[above, 0]] > 0
    return above


def _lowest(pixel: I64, z: F64, shape: tuple[int, ...]) -> F32:
    """The least of heights z (n,) over each pixel (n, 2), nan where there is none."""
    lowest = np.full(shape, np.nan, np.float32)
    order = np.argsort(-z, kind="stable")
    lowest[pixel[order, 1], pixel[order, 0]] = z[order]
    return lowest


def _mask(pixel: NDArray[np.int64], shape: tuple[int, ...]) -> U8:
    mask = np.zeros(shape, np.uint8)
    mask[pixel[:, 1], pixel[:, 0]] = 1
    return mask


def _ceiling(pixel: NDArray[np.int64], xyz: F64, shape: tuple[int, ...]) -> tuple[U8, F32, U8, F32]:
    """Mask of ceiling patches large enough to be one, holes closed, the lowest ceiling height over each pixel, the mask
    of strips at its rim that hang lower, and the mean place (rows, columns, 3) of the lowest that hangs over a pixel.
    """
    found = np.full((*shape, 3), np.nan, np.float32)
    order = np.argsort(-xyz[:, 2], kind="stable")
    found[pixel[order, 1], pixel[order, 0]] = xyz[order]
    height = found[..., 2].copy()
    seen = np.isfinite(height)
    rim = np.zeros(shape, np.uint8)
    if seen.any():
        gapless = closed(seen.astype(np.uint8), 5) > 0
        filled = np.where(gapless, height.ravel()[nearest_of(seen)], np.float32(np.nan))
        rim = _rims(filled).astype(np.uint8)
        height[_soffits(height)] = np.nan
    mask = opened(closed(np.isfinite(height).astype(np.uint8), 5), SMALLEST_CEILING)
    height[mask == 0] = np.nan
    return mask, height, rim, found


def _over_furniture(ceiling: U8, ceiling_z: F32, bare: F32) -> tuple[U8, F32]:
    """The mask and heights of the ceiling, drawn on over what was seen from below with nothing under it (``bare``,
    heights, nan elsewhere) as far as that goes on as high: over a wardrobe as long as the wall, one sees nothing else.
    """
    level = ceiling_z.copy()
    for _ in range(DEEPEST_FURNITURE):
        beside = cv2.dilate(np.where(np.isfinite(level), level, np.float32(-np.inf)), np.ones((7, 7), np.uint8))
        new = np.isnan(level) & (np.abs(beside - bare) < SAME_LEVEL)
        if not new.any():
            break
        level[new] = bare[new]
    return np.where(np.isfinite(level), np.uint8(1), ceiling), level


def _roof_near(ceiling_z: F32) -> F32:
    """Ceiling height of the nearest pixel that has one, for every pixel; inf where there is no ceiling at all. Narrow
    strips that hang higher than what is beside them do not count: of a wall that a stair or shelf hides in part, the
    rest above.
    """
    known = np.isfinite(ceiling_z)
    if not known.any():
        return np.full(ceiling_z.shape, np.inf, np.float32)
    nearest = ceiling_z.ravel()[nearest_of(known)]
    kernel = np.ones((THIN, THIN), np.uint8)
    within = closed(known.astype(np.uint8), THIN) > 0
    lowest = cv2.erode(np.where(within, nearest, np.float32(np.inf)), kernel)
    broad = cv2.dilate(np.where(within, lowest, np.float32(-np.inf)), kernel)
    lowered = np.where(known, np.minimum(ceiling_z, broad), np.float32(np.nan))
    return lowered.ravel()[nearest_of(known)]


def _around_soffits(grid: Grid, soffit: U8, ceiling_z: F32) -> tuple[F64, F64]:
    """Height of the highest strip that hangs lower within NEAR pixels, or of the ceiling that ends columns, and of the
    nearest ceiling that is no such strip; both (rows, columns).
    """
    strips = np.where((soffit > 0) & np.isfinite(ceiling_z), ceiling_z, np.float32(-np.inf))
    highest = cv2.dilate(strips, np.ones((2 * NEAR + 1, 2 * NEAR + 1), np.uint8)).astype(np.float64)
    rimless = _roof_near(np.where(soffit > 0, np.float32(np.nan), ceiling_z)).astype(np.float64)
    return np.maximum(highest, grid.roof), rimless


def without_ceiling(plan: Plan, hidden: NDArray[np.bool_]) -> Plan:
    """The plan without its ceiling over the ``hidden`` pixels."""
    return replace(
        plan,
        ceiling=np.where(hidden, np.uint8(0), plan.ceiling),
        ceiling_z=np.where(hidden, np.float32(np.nan), plan.ceiling_z),
    )


def pixels_in(polygon: Polygon, plan: Plan) -> NDArray[np.bool_]:
    """Mask of the plan's pixels inside a polygon, holes left out."""
    mask = np.zeros(plan.floor.shape, np.uint8)
    for value, rings in ((1, [polygon.exterior]), (0, list(polygon.interiors))):
        for ring in rings:
            corners = (shapely.get_coordinates(ring) - plan.origin) / PLAN * 16
            cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], value, shift=4)
    return mask > 0
