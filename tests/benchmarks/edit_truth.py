"""What the scans of a simulated scene show, told from its labelled points and not by the program that is tested."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.hanging import OPENED, Hanging, difference

F64 = NDArray[np.float64]
VOXEL = 0.05
"""Edge of the voxels that seen surface is counted in, metres."""
CELL = 0.10
"""Edge of the cells of a rectangle that rays or points are counted in, metres."""
NEAR = 0.02
"""Metres from a rectangle within which points lie on it."""
BEHIND = 0.1
"""Metres behind a rectangle from which on a ray went through it."""
PLY_TYPES = {"double": "<f8", "float": "<f4", "uchar": "u1", "ushort": "<u2", "int": "<i4"}


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A scene's points (n, 3) less ``origin`` (3,), the element (n,) that each lies on as place in ``guids`` and its
    scan (n,), the stations' positions (s, 3) less the origin, and the truth.
    """

    origin: F64
    points: NDArray[np.float32]
    element: NDArray[np.int16]
    scan: NDArray[np.uint16]
    guids: tuple[str, ...]
    stations: F64
    truth: dict[str, Any]

    def area(self, guid: str) -> float:
        """Square metres of an element that the scans show, by voxels."""
        if guid not in self.guids:
            return 0.0
        mine = self.points[self.element == self.guids.index(guid)]
        return len(np.unique(np.floor(mine / VOXEL).astype(np.int32), axis=0)) * VOXEL**2

    def plan_area(self, guid: str) -> float:
        """The same in plan: of what stands upright only the thickness counts."""
        if guid not in self.guids:
            return 0.0
        mine = self.points[self.element == self.guids.index(guid)][:, :2]
        return len(np.unique(np.floor(mine / VOXEL).astype(np.int32), axis=0)) * VOXEL**2

    def is_seen_opening(self, guid: str) -> bool:
        """Whether a door or window can be seen, by the truth."""
        fills = [*self.truth["doors"], *self.truth["windows"]]
        return any(f["guid"] == guid and f["observable"] for f in fills)

    def hung_otherwise(self, drawn: dict[str, Hanging]) -> set[str]:
        """Doors whose leaf the scans show open, hung otherwise than ``drawn`` (by GlobalId)."""
        doors = [d for d in self.truth["doors"] if d["observable"] and d["state"] == "open" and d["guid"] in drawn]
        return {
            d["guid"] for d in doors if d["angle"] >= math.degrees(OPENED) and difference(drawn[d["guid"]], _hung(d))
        }

    def crossed(self, rectangle: F64, behind: float = BEHIND) -> float:
        """Share of the cells of a rectangle (corner and two edges, (3, 3)) that rays to points more than ``behind``
        metres behind it went through.
        """
        corner, u, v = rectangle[0] - self.origin, rectangle[1], rectangle[2]
        normal = np.cross(u, v)
        normal /= np.linalg.norm(normal)
        shape = _shape(u, v)
        hit = np.zeros(shape, bool)
        for number, station in enumerate(self.stations):
            height = float((station - corner) @ normal)
            if abs(height) < NEAR:
                continue
            ends = self.points[self.scan == number]
            beyond = -np.sign(height) * ((ends - corner.astype(np.float32)) @ normal.astype(np.float32))
            ends = ends[beyond > behind].astype(np.float64)
            share = abs(height) / (abs(height) + beyond[beyond > behind])
            place = station + (ends - station) * share[:, None] - corner
            _mark(place, u, v, hit)
        return float(hit.mean())

    def reached(self, rectangle: F64) -> float:
        """Share of the cells of a rectangle that rays came to: they end on it or go on."""
        return self.crossed(rectangle, -NEAR)

    def covered(self, rectangle: F64) -> float:
        """Share of the cells of a rectangle that points lie on."""
        corner, u, v = rectangle[0] - self.origin, rectangle[1], rectangle[2]
        normal = np.cross(u, v)
        normal /= np.linalg.norm(normal)
        offset = self.points - corner.astype(np.float32)
        near = offset[np.abs(offset @ normal.astype(np.float32)) < NEAR]
        hit = np.zeros(_shape(u, v), bool)
        _mark(near.astype(np.float64), u, v, hit)
        return float(hit.mean())


def _hung(door: dict[str, Any]) -> Hanging:
    """As the truth tells it: corners from u0 to u1, hinge at one of them."""
    along = np.array(door["corners"][1][:2]) - np.array(door["corners"][0][:2])
    along /= np.linalg.norm(along)
    return Hanging(along if door["hinge"] == "u1" else -along, np.array(door["opens_to"]))


def _shape(u: F64, v: F64) -> tuple[int, int]:
    return max(1, round(float(np.linalg.norm(u)) / CELL)), max(1, round(float(np.linalg.norm(v)) / CELL))


def _mark(place: F64, u: F64, v: F64, hit: NDArray[np.bool_]) -> None:
    """The cells of a rectangle in which places (k, 3) from its corner lie."""
    a, b = place @ u / float(u @ u), place @ v / float(v @ v)
    inside = (a >= 0) & (a < 1) & (b >= 0) & (b < 1)
    hit[(a[inside] * hit.shape[0]).astype(int), (b[inside] * hit.shape[1]).astype(int)] = True


def load_seen(scene: Path) -> Seen:
    """From labels.npz, ply/merged.ply and truth.json of a scene."""
    with np.load(scene / "labels.npz") as labels:
        element, scan, ghost, guids = (labels[k] for k in ("element", "scan", "ghost", "guid"))
    xyz = read_ply(scene / "ply" / "merged.ply")
    origin = np.round(xyz.mean(axis=0))
    truth = json.loads((scene / "truth.json").read_text(encoding="utf-8"))
    return Seen(
        origin=origin,
        points=(xyz - origin).astype(np.float32)[~ghost],
        element=element[~ghost],
        scan=scan[~ghost],
        guids=tuple(str(g) for g in guids),
        stations=np.array([s["pos"] for s in truth["stations"]]) - origin,
        truth=truth,
    )


def load_truth(scene: Path) -> Seen:
    """The truth of a scene alone, without points."""
    truth = json.loads((scene / "truth.json").read_text(encoding="utf-8"))
    none = np.zeros(0, np.int16)
    stations = np.array([s["pos"] for s in truth["stations"]])
    return Seen(np.zeros(3), np.zeros((0, 3), np.float32), none, none.astype(np.uint16), (), stations, truth)


def read_ply(path: Path) -> F64:
    """Coordinates (n, 3) of a binary little-endian PLY file of points alone."""
    with path.open("rb") as file:
        count, fields = 0, []
        for line in iter(file.readline, b""):
            words = line.decode().split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[0] == "property":
                fields.append((words[2], PLY_TYPES[words[1]]))
            elif words[0] == "end_header":
                break
        records = np.fromfile(file, np.dtype(fields), count)
    return np.column_stack([records["x"], records["y"], records["z"]]).astype(np.float64)
