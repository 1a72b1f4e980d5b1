"""Pictures of a model over its scan: a plan of each storey, a view; small PNG files."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from conversion import Conversion

from scan2bim.cloud.surfels import Surfels
from scan2bim.model.elements import Storey
from scan2bim.model.io import load_building
from scan2bim.model.shapes import wall_footprints
from scan2bim.report.plan import PlanBackground, draw_plan
from scan2bim.report.sheet import Image
from scan2bim.report.view3d import draw_view
from scan2bim.stages import SURFELS
from scan2bim.workfolder import WorkFolder, is_whole

PIXEL = 0.03
"""Metres, below the surfels' 5 cm: their mean positions are finer than their voxels."""
LOW_SLICE = (0.9, 1.4)
"""Metres above the floor: over tables and sills, below heads, so that doors and windows are gaps."""
HIGH_SLICE = (0.6, 0.15)
"""Metres below the ceiling: over furniture and heads, so that walls run through over doors."""
UPRIGHT = 0.01
"""Metres: least standard deviation of z in a surfel (10 cm tall) on an upright surface; filled evenly it is 0.03."""
FEW = 3
"""Points of a surfel below which its spread tells nothing."""
USUAL_HEIGHT = 2.5
"""Metres, of a storey whose ceiling was not seen."""
MARGIN = 1.0
"""Metres of the scan round the model's surfels that matter: far outliers would make huge pictures."""
HEADROOM = 0.5
"""Metres of the scan shown above the model in the picture: more would lie under the title."""
LIMIT = 290_000
"""Bytes of a picture in the repository."""
WIDEST = 1600
"""Pixels: as wide as a page shows on a large screen."""


def draw_pictures(conversion: Conversion, folder: Path) -> list[Path]:
    """Write NAME_0.png, NAME_1.png ... for the storeys from below and NAME_view.png; gives their paths."""
    building = load_building(conversion.model)
    surfels = Surfels.load(_surfel_folder(conversion.work))
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob(f"{conversion.name}_*.png"):
        old.unlink()
    made: list[Path] = []
    for number, storey in enumerate(building.storeys):
        image = draw_plan(storey, building, background=scan_slice(surfels, storey))
        made.append(_write(image, folder / f"{conversion.name}_{number}.png"))
    made.append(_write(draw_view(building), folder / f"{conversion.name}_view.png"))
    return made


def scan_slice(surfels: Surfels, storey: Storey) -> PlanBackground | None:
    """The scan at two heights: dark at chest height, pale below the ceiling. None where there is nothing."""
    floor = storey.elevation.value
    ceiling = floor + (storey.height.value if storey.height is not None else USUAL_HEIGHT)
    z = surfels.xyz[:, 2]
    low = (z > floor + LOW_SLICE[0]) & (z < floor + LOW_SLICE[1])
    high = (z > ceiling - HIGH_SLICE[0]) & (z < ceiling - HIGH_SLICE[1])
    high &= (surfels.spread > UPRIGHT) | (surfels.count < FEW)  # no soffits and beams
    points = surfels.xyz[low | high][:, :2].astype(np.float64)
    if len(points) == 0:
        return None
    begin, end = np.percentile(points, 0.5, axis=0) - MARGIN, np.percentile(points, 99.5, axis=0) + MARGIN
    end[1] = min(end[1], max(begin[1] + PIXEL, _top(storey) + HEADROOM))
    size = tuple(int(n) for n in np.ceil((end - begin) / PIXEL)[::-1])
    counts = np.maximum(8 * _histogram(surfels.xyz[low], begin, size), _histogram(surfels.xyz[high], begin, size) > 0)
    return PlanBackground(counts, (float(begin[0]), float(begin[1])), PIXEL)


def _top(storey: Storey) -> float:
    """The greatest y of the storey's walls and spaces, metres."""
    rings = [*wall_footprints(storey).values(), *(space.outline for space in storey.spaces)]
    return max((y for ring in rings for _, y in ring), default=np.inf)


def _histogram(
    xyz: npt.NDArray[np.float32], begin: npt.NDArray[np.float64], size: tuple[int, ...]
) -> npt.NDArray[np.int64]:
    """Surfels in each pixel, (rows, columns)."""
    cells = np.floor((xyz[:, :2] - begin) / PIXEL).astype(np.int64)
    inside = ((cells >= 0) & (cells < np.array(size[::-1]))).all(axis=1)
    flat = cells[inside, 1] * size[1] + cells[inside, 0]
    return np.bincount(flat, minlength=size[0] * size[1]).reshape(size)


def _surfel_folder(work: Path) -> Path:
    """The one result of the surfel stage in a work folder that one run has made."""
    folders = [path for path in (WorkFolder(work).stages / SURFELS.name).iterdir() if is_whole(path)]
    if len(folders) != 1:
        raise ValueError(f"{work}: expected one result of {SURFELS.name}, found {len(folders)}")
    return folders[0]


def _write(image: Image, path: Path) -> Path:
    path.write_bytes(small_png(image))
    return path


def small_png(image: Image) -> bytes:
    """A PNG of at most ``LIMIT`` bytes: as wide as useful, then fewer colours, then fewer pixels."""
    scale = min(1.0, WIDEST / image.shape[1])
    while True:
        part = image if scale == 1.0 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        for bits in (8, 5, 4):
            step = 1 << (8 - bits)
            coarse = np.minimum(np.round(part / step) * step, 255).astype(np.uint8)
            _, data = cv2.imencode(".png", coarse[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
            if len(data) <= LIMIT:
                return data.tobytes()
        scale *= 0.85
