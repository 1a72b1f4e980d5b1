"""Triangles to pixels with a depth buffer: flat shaded, with lines where surfaces meet. Parallel projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from scan2bim.geometry.meshes import Mesh, face_normals
from scan2bim.report.sheet import Floats, Image, Rgb

SUPERSAMPLING: Final = 2
"""Pixels of the buffer a pixel of the picture and axis: softens edges."""
_LIGHT: Final = np.array([0.35, -0.5, 0.79])  # towards the light, in the building's frame: from above, a little aside
_AMBIENT: Final = 0.55  # share of the colour that a face turned from the light keeps
_LINE: Final = 0.45  # share of the colour along lines

Ints = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A mesh in the building's frame with its sRGB colour; cap: that of its top where it differs."""

    mesh: Mesh
    colour: Rgb
    cap: Rgb | None = None


@dataclass(frozen=True, slots=True)
class Camera:
    """A viewer far off in the horizontal direction ``azimuth`` and the angle ``height`` above it, radians."""

    azimuth: float
    height: float

    def axes(self) -> Floats:
        """(3, 3) rows: right, up in the picture, towards the viewer."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        ch, sh = np.cos(self.height), np.sin(self.height)
        return np.array([[-s, c, 0.0], [-c * sh, -s * sh, ch], [c * ch, s * ch, sh]])


def seen_size(bodies: list[Body], camera: Camera) -> tuple[Floats, Floats]:
    """Lowest and highest picture coordinates (2,) of the bodies, metres."""
    points = np.concatenate([body.mesh.vertices for body in bodies]) @ camera.axes()[:2].T
    return points.min(axis=0), points.max(axis=0)


def render(bodies: list[Body], camera: Camera, scale: float, low: Floats, size: tuple[int, int]) -> Image:
    """The bodies as (height, width, 3) sRGB on white.

    scale: pixels a metre. low: picture coordinates (metres) of the lower left corner. size: width, height in pixels.
    """
    width, height = (pixels * SUPERSAMPLING for pixels in size)
    corners, colours, groups = _faces(bodies, camera)
    screen = corners.copy()
    screen[..., :2] = (corners[..., :2] - low) * scale * SUPERSAMPLING
    screen[..., 1] = height - screen[..., 1]
    depth = np.full((height, width), -np.inf)
    face = np.full((height, width), -1, np.int32)
    for number, triangle in enumerate(screen):
        _fill(depth, face, triangle, number)
    palette = np.vstack([colours, [255.0, 255.0, 255.0]])
    image = palette[face] * np.where(_seams(np.append(groups, -1)[face]), _LINE, 1.0)[..., None]
    small = cv2.resize(np.round(image).astype(np.uint8), size, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False)


def _faces(bodies: list[Body], camera: Camera) -> tuple[Floats, Floats, Ints]:
    """The triangles that look to the viewer: corners (t, 3, 3) in picture axes, colours (t, 3), surfaces (t,)."""
    axes = camera.axes()
    corners: list[Floats] = []
    colours: list[Floats] = []
    keys: list[Floats] = []
    for number, body in enumerate(bodies):
        normals = face_normals(body.mesh)
        front = normals @ axes[2] > 1e-9
        corners.append(body.mesh.corners[front] @ axes.T)
        colours.append(_shade(body, normals)[front])
        keys.append(np.column_stack([np.full(front.sum(), number), np.round(normals[front], 3)]))
    _, groups = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    return np.concatenate(corners), np.concatenate(colours), groups.ravel().astype(np.int32)


def _shade(body: Body, normals: Floats) -> Floats:
    """The colour (t, 3) of each triangle in the light; a cap, as a section, is not shaded."""
    light = _AMBIENT + (1 - _AMBIENT) * np.clip(normals @ _LIGHT, 0, 1)
    shaded = np.multiply(body.colour, light[:, None])
    if body.cap is None:
        return shaded
    heights = body.mesh.corners[..., 2]
    top = heights.min(axis=1) > heights.max() - 1e-6
    return np.where(top[:, None], body.cap, shaded)


def _fill(depth: Floats, face: Ints, triangle: Floats, number: int) -> None:
    """Put a triangle (3, 3: x, y in pixels, depth) into the buffers where it is nearest."""
    (x0, y0), (x1, y1) = np.floor(triangle[:, :2].min(axis=0)), np.ceil(triangle[:, :2].max(axis=0))
    left, right = max(int(x0), 0), min(int(x1) + 1, depth.shape[1])
    top, bottom = max(int(y0), 0), min(int(y1) + 1, depth.shape[0])
    a, b, c = triangle
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if left >= right or top >= bottom or area == 0:
        return
    x, y = np.arange(left, right) + 0.5, (np.arange(top, bottom) + 0.5)[:, None]
    u = ((c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0])) / area
    v = ((a[0] - c[0]) * (y - c[1]) - (a[1] - c[1]) * (x - c[0])) / area
    z = u * a[2] + v * b[2] + (1 - u - v) * c[2]
    window = (slice(top, bottom), slice(left, right))
    nearer = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > depth[window])
    depth[window][nearer] = z[nearer]
    face[window][nearer] = number


def _seams(surfaces: Ints) -> npt.NDArray[np.bool_]:
    """Where the surface to the right or below is another."""
    seams = np.zeros(surfaces.shape, bool)
    seams[:, :-1] |= surfaces[:, :-1] != surfaces[:, 1:]
    seams[:-1] |= surfaces[:-1] != surfaces[1:]
    return seams
