"""Straight runs of plan columns, each seen from one side: grown from the clearest on, compiled."""

from __future__ import annotations

import numba as nb
import numpy as np

from scan2bim.cloud.surfels import PLAN

LOCAL_BAND = 0.018
"""Half-width, metres, of the line looked for round one column: less than half of the thinnest wall."""
SEED = 0.45
"""Share of the 5 cm steps in half a metre that a line must fill to start a face."""


@nb.njit(cache=True, nogil=True)
def local_lines(index, pixel, xy, view):  # pyright: ignore
    """Direction angle (m,) of the line through each column that most of its neighbours lie on, and how full it is (m,)
    0-1.

    A search over directions through the column itself: the other face of a thin wall, 5 to 15 cm away, would pull a fit
    by moments.
    """
    m = pixel.shape[0]
    angle = np.zeros(m)
    line = np.zeros(m)
    rows, cols = index.shape
    reach = 5
    steps = 36
    cosine = np.cos(np.arange(steps) * np.pi / steps)
    sine = np.sin(np.arange(steps) * np.pi / steps)
    filled = np.zeros(2 * reach + 1, np.uint8)
    dx = np.empty(121)
    dy = np.empty(121)
    for i in range(m):
        if index[pixel[i, 1], pixel[i, 0]] != i:
            continue
        k = 0
        for r in range(max(pixel[i, 1] - reach, 0), min(pixel[i, 1] + reach + 1, rows)):
            for c in range(max(pixel[i, 0] - reach, 0), min(pixel[i, 0] + reach + 1, cols)):
                j = index[r, c]
                if j < 0 or view[i, 0] * view[j, 0] + view[i, 1] * view[j, 1] < -0.2:
                    continue
                dx[k] = xy[j, 0] - xy[i, 0]
                dy[k] = xy[j, 1] - xy[i, 1]
                k += 1
        best = 0
        for t in range(steps):
            filled[:] = 0
            for j in range(k):
                if abs(dy[j] * cosine[t] - dx[j] * sine[t]) < LOCAL_BAND:
                    along = int(np.floor((dx[j] * cosine[t] + dy[j] * sine[t]) / PLAN + 0.5)) + reach
                    if 0 <= along < filled.size:
                        filled[along] = 1
            count = filled.sum()
            if count > best:
                best = count
                angle[i] = t * np.pi / steps
        sxx = 1e-12
        sxy = 0.0
        for j in range(k):
            u = dx[j] * np.cos(angle[i]) + dy[j] * np.sin(angle[i])
            v = dy[j] * np.cos(angle[i]) - dx[j] * np.sin(angle[i])
            if abs(v) < LOCAL_BAND:
                sxx += u * u
                sxy += u * v
        angle[i] += np.arctan(sxy / sxx)
        line[i] = best / filled.size
    return angle, line


@nb.njit(cache=True, nogil=True)
def grow(index, pixel, xy, weight, view, angle, line, band):  # pyright: ignore
    """Region number (m,) of each column, -1 where none: straight runs on one side of a wall, clearest first."""
    region = np.full(pixel.shape[0], -1, np.int64)
    queue = np.empty(pixel.shape[0], np.int64)
    used = 0
    for start in np.argsort(-(line * weight)):
        own = index[pixel[start, 1], pixel[start, 0]] == start
        if region[start] < 0 and line[start] >= SEED and own:
            _grow_from(start, used, region, queue, index, pixel, xy, weight, view, angle, line, band)
            used += 1
    return region


@nb.njit(cache=True, nogil=True)
def _grow_from(start, number, region, queue, index, pixel, xy, weight, view, angle, line, band):  # pyright: ignore
    """Give ``number`` to the columns connected to ``start`` that lie on its line, which is fitted anew as they come."""
    normal = np.array([-np.sin(angle[start]), np.cos(angle[start])])
    if normal[0] * view[start, 0] + normal[1] * view[start, 1] < 0:
        normal = -normal
    centre = xy[start].copy()
    sums = np.zeros(6)
    queue[0] = start
    region[start] = number
    head = 0
    tail = 1
    refit = 6
    while head < tail:
        i = queue[head]
        head += 1
        x = xy[i, 0] - xy[start, 0]
        y = xy[i, 1] - xy[start, 1]
        sums += weight[i] * np.array([1.0, x, y, x * x, x * y, y * y])
        if head == refit:
            refit = int(refit * 1.5)
            normal = _normal_of(sums, normal)
            centre = xy[start] + sums[1:3] / sums[0]
        for r in range(max(pixel[i, 1] - 3, 0), min(pixel[i, 1] + 4, index.shape[0])):
            for c in range(max(pixel[i, 0] - 3, 0), min(pixel[i, 0] + 4, index.shape[1])):
                j = index[r, c]
                if j >= 0 and region[j] < 0 and _fits(j, centre, normal, xy, view, angle, line, band):
                    region[j] = number
                    queue[tail] = j
                    tail += 1


@nb.njit(cache=True, nogil=True)
def _normal_of(sums, old):  # pyright: ignore
    """Unit normal of the line through points with these sums (1, x, y, xx, xy, yy), on the side of the ``old`` one."""
    a = sums[3] / sums[0] - (sums[1] / sums[0]) ** 2
    b = sums[4] / sums[0] - sums[1] * sums[2] / sums[0] ** 2
    d = sums[5] / sums[0] - (sums[2] / sums[0]) ** 2
    t = 0.5 * np.arctan2(2 * b, a - d)
    normal = np.array([-np.sin(t), np.cos(t)])
    return normal if normal[0] * old[0] + normal[1] * old[1] >= 0 else -normal


@nb.njit(cache=True, nogil=True)
def _fits(j, centre, normal, xy, view, angle, line, band):  # pyright: ignore
    """Whether column j lies on the line, is seen from its front, and runs along it as far as that can be told."""
    if abs(normal[0] * (xy[j, 0] - centre[0]) + normal[1] * (xy[j, 1] - centre[1])) > band:
        return False
    if normal[0] * view[j, 0] + normal[1] * view[j, 1] < -0.05:
        return False
    across = abs(-np.sin(angle[j]) * normal[0] + np.cos(angle[j]) * normal[1])
    return line[j] <= SEED or across >= 0.85
