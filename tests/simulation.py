"""A building's USD stage in MuJoCo: what collides, what hangs on hinges, and a body that drives through it.

Reads only what the stage says (colliders, masses, joints and their limits), as any simulator would.
"""

from __future__ import annotations

import heapq
import json
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import mujoco
import numpy as np
import shapely
from pxr import Gf, Usd, UsdGeom, UsdPhysics

STEP = 0.004  # seconds
RADIUS = 0.2  # metres of the driven body
SPEED = 0.8  # metres a second
LEAD = 0.2  # metres by which its goal is at most ahead of it: so it comes to no more than 1 m/s
STANDS, SWINGS, DRIVES = 1, 2, 4  # collision groups


@dataclass
class Hinge:
    """A door leaf in the simulation; degrees."""

    name: str
    joint: int
    low: float
    high: float

    @property
    def sign(self) -> int:
        return 1 if self.high > -self.low else -1


class Simulation:
    """The stage in MuJoCo with all doors closed but that of the GlobalId ``opened``.

    robot: adds a body to drive, at x, y, z of its floor.
    """

    def __init__(self, path: Path, opened: str = "", robot: tuple[float, float, float] | None = None) -> None:
        self.stage = Usd.Stage.Open(str(path))
        set_doors(self.stage, opened)
        self.spec = mujoco.MjSpec()
        self.spec.option.timestep = STEP
        self.hinges: list[Hinge] = []
        self._angles: dict[str, float] = {}
        self._bodies = self._add_bodies()
        for prim in Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()):
            if prim.HasAPI(UsdPhysics.CollisionAPI) and not _is_level(prim):
                self._add_collider(prim)
        if robot is not None:
            body = self.spec.worldbody.add_body(name="robot", pos=(robot[0], robot[1], robot[2] + 0.8))
            for name, axis in (("x", (1, 0, 0)), ("y", (0, 1, 0))):
                body.add_joint(name=f"robot_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=(RADIUS, 0.6, 0),
                mass=30,
                contype=DRIVES,
                conaffinity=STANDS | SWINGS,
                friction=(0.05, 0, 0),
            )
        self.model = self.spec.compile()
        self.data = mujoco.MjData(self.model)
        for hinge in self.hinges:
            hinge.joint = self.model.joint(hinge.name).qposadr[0]
        self._begin()

    def _begin(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        for hinge in self.hinges:
            self.data.qpos[hinge.joint] = self._angles[hinge.name]
        mujoco.mj_forward(self.model, self.data)

    def _add_bodies(self) -> dict[str, mujoco.MjsBody]:
        """A body for each leaf, at its closed place; what is fixed belongs to the world."""
        bodies = {}
        for prim in self.stage.Traverse():
            if not prim.IsA(UsdPhysics.RevoluteJoint):
                continue
            joint = UsdPhysics.RevoluteJoint(prim)
            frame, leaf = (
                self.stage.GetPrimAtPath(rel.GetTargets()[0]) for rel in (joint.GetBody0Rel(), joint.GetBody1Rel())
            )
            assert joint.GetAxisAttr().Get() == "Z"
            place = world(frame)
            position = place.Transform(Gf.Vec3d(joint.GetLocalPos0Attr().Get()))
            rotation = place.RemoveScaleShear().ExtractRotationQuat()
            name = str(leaf.GetPath())
            body = self.spec.worldbody.add_body(name=name, pos=position, quat=(rotation.real, *rotation.imaginary))
            limits = (joint.GetLowerLimitAttr().Get(), joint.GetUpperLimitAttr().Get())
            drive = UsdPhysics.DriveAPI(prim, "angular")
            body.add_joint(
                name=name,
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=(0, 0, 1),
                range=np.radians(limits) if self.spec.compiler.degree == 0 else limits,
                limited=True,
                damping=math.degrees(drive.GetDampingAttr().Get()),
            )
            mass = UsdPhysics.MassAPI(leaf)
            body.explicitinertial = True
            body.mass, body.ipos = mass.GetMassAttr().Get(), mass.GetCenterOfMassAttr().Get()
            body.inertia = mass.GetDiagonalInertiaAttr().Get()
            turned = world(leaf).ExtractRotationMatrix() * place.ExtractRotationMatrix().GetTranspose()
            self._angles[name] = math.atan2(turned[0][1], turned[0][0])
            self.hinges.append(Hinge(name, -1, *limits))
            bodies[name] = body
        return bodies

    def _add_collider(self, prim: Usd.Prim) -> None:
        owner = next((p for p in _up(prim) if str(p.GetPath()) in self._bodies), None)
        body = self.spec.worldbody if owner is None else self._bodies[str(owner.GetPath())]
        place = world(prim) * (Gf.Matrix4d(1.0) if owner is None else world(owner).GetInverse())
        groups = {
            "contype": STANDS if owner is None else SWINGS,
            "conaffinity": SWINGS | DRIVES if owner is None else STANDS | DRIVES,
        }
        if prim.IsA(UsdGeom.Cube):
            scale = Gf.Vec3d(*(place.GetRow3(k).GetLength() for k in range(3)))
            turn = place.RemoveScaleShear().ExtractRotationQuat()
            size = [UsdGeom.Cube(prim).GetSizeAttr().Get() * length / 2 for length in scale]
            quat = (turn.real, *turn.imaginary)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=place.ExtractTranslation(), quat=quat, **groups
            )
            return
        mesh = UsdGeom.Mesh(prim)
        points = np.array([place.Transform(Gf.Vec3d(p)) for p in mesh.GetPointsAttr().Get()])
        name = str(prim.GetPath())
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        self.spec.add_mesh(name=name, uservert=points.ravel(), userface=faces)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **groups)

    def push_doors(self, torque: float = 5.0, seconds: float = 30.0) -> dict[str, float]:
        """Open all leaves by a torque, newton metres, until they rest or the time is up.

        Gives how far each came, degrees, positive for opening.
        """
        signs = {self.model.joint(h.name).dofadr[0]: h.sign for h in self.hinges}
        still = 0  # steps: a leaf that bounces off its limit is still for one only
        for _ in range(round(seconds / STEP)):
            for dof, sign in signs.items():
                self.data.qfrc_applied[dof] = sign * torque
            mujoco.mj_step(self.model, self.data)
            still = still + 1 if np.abs(self.data.qvel).max(initial=0.0) < 1e-3 else 0
            if still * STEP > 0.5:
                break
        return {h.name: math.degrees(self.data.qpos[h.joint]) * h.sign for h in self.hinges}

    def drive(self, path: np.ndarray) -> np.ndarray:
        """Lead the robot along points (n, 2) by a spring; gives where it went, (m, 2). It starts at the first."""
        places = [self.model.joint(f"robot_{axis}") for axis in "xy"]
        position, velocity = ([int(getattr(j, k)[0]) for j in places] for k in ("qposadr", "dofadr"))
        base = self.model.body("robot").pos[:2]
        self._begin()
        self.data.qpos[position] = path[0] - base
        legs = np.r_[0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
        track = []
        for step in range(round((legs[-1] / SPEED + 2.0) / STEP)):
            along = min(step * STEP * SPEED, legs[-1])
            target = [np.interp(along, legs, path[:, k]) for k in range(2)]
            away = np.array(target) - base - self.data.qpos[position]
            away *= min(1.0, LEAD / max(np.hypot(*away), 1e-9))
            self.data.qfrc_applied[velocity] = 2000 * away - 400 * self.data.qvel[velocity]
            mujoco.mj_step(self.model, self.data)
            if step % 10 == 0:
                track.append(self.data.qpos[position] + base)
        return np.array(track)


def set_doors(stage: Usd.Stage, opened: str) -> None:
    """Choose the variant closed of all doors that have states, and open of the one with this GlobalId."""
    stage.SetEditTarget(stage.GetSessionLayer())
    for path in [prim.GetPath() for prim in stage.Traverse() if "doorState" in prim.GetVariantSets().GetNames()]:
        prim = stage.GetPrimAtPath(path)
        if prim:
            state = "open" if prim.GetAttribute("ifc:GlobalId").Get() == opened else "closed"
            prim.GetVariantSets().GetVariantSet("doorState").SetVariantSelection(state)


def world(prim: Usd.Prim) -> Gf.Matrix4d:
    return UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())


def _up(prim: Usd.Prim):
    while prim:
        yield prim
        prim = prim.GetParent()


def _is_level(prim: Usd.Prim) -> bool:
    """Slabs, ceilings, roofs and stairs: MuJoCo would fill their holes, and nothing falls here."""
    return any(word in str(prim.GetPath()) for word in ("/Slabs/", "/Coverings/", "/Roofs/", "/Stairs/"))


class Rooms:
    """Ways between rooms, planned on the exported maps and graph."""

    def __init__(self, path: Path) -> None:
        self.graph = json.loads(path.read_text())
        self._folder = path.parent
        self.spaces = {space["id"]: space for space in self.graph["spaces"]}
        self.doors = {door["id"]: door for door in self.graph["doors"]}
        self.storeys = list(dict.fromkeys(space["storey"] for space in self.graph["spaces"]))

    def ways(self, storey: str) -> list[dict]:
        """The edges by doors and passages from one space of a storey to another."""
        return [
            edge
            for edge in self.graph["edges"]
            if edge["kind"] in ("door", "passage")
            and None not in edge["spaces"]
            and edge["spaces"][0] != edge["spaces"][1]
            and self.doors[edge["via"]]["storey"] == storey
        ]

    def path(self, edge: dict) -> np.ndarray | None:
        """Points (n, 2) from the middle of one room through the edge's door to the middle of the other, or None.

        Where an open leaf stands in a small room's middle, to the place nearest to it that the door leads to.
        """
        storey = self.doors[edge["via"]]["storey"]
        entry = self.graph["maps"][self.storeys.index(storey)]
        image = cv2.imread(str(self._folder / entry["image"]), cv2.IMREAD_GRAYSCALE)[::-1]
        pixel, low = entry["resolution"], np.array(entry["origin"][:2])
        door = self.doors[edge["via"]]
        shapes = [shapely.Polygon(self.spaces[s]["outline"], self.spaces[s]["holes"]) for s in edge["spaces"]]
        across = shapely.LineString([p[:2] for p in door["approach"]]).buffer(door["width"] / 2, cap_style="flat")
        room = shapely.union_all([*shapes, across.buffer(1e-3)])
        rows, columns = image.shape
        x, y = np.meshgrid(low[0] + (np.arange(columns) + 0.5) * pixel, low[1] + (np.arange(rows) + 0.5) * pixel)
        free = (image == 254) & shapely.contains_xy(room, x, y)
        for leaf in open_leaves(door):
            ends = np.round((leaf - low) / pixel - 0.5).astype(np.int32)
            blocked = cv2.line(np.zeros(free.shape, np.uint8), *ends.tolist(), 1, 2)
            free &= blocked == 0
        clear = cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, 5) * pixel
        least = RADIUS + pixel
        _, parts = cv2.connectedComponents((clear >= least).astype(np.uint8), connectivity=8)
        at = ((np.array(door["position"][:2]) - low) / pixel).astype(int)[::-1]
        reached = (parts == parts[tuple(at)]) & (clear >= least)
        cells = []
        for name, shape in zip(edge["spaces"], shapes, strict=True):
            here = np.argwhere(reached & shapely.contains_xy(shape, x, y))
            if not len(here):
                return None
            middle = (np.array(self.spaces[name]["centre"][:2]) - low)[::-1] / pixel - 0.5
            cells.append(tuple(here[np.hypot(*(here - middle).T).argmin()].tolist()))
        found = shortest(clear, cells[0], cells[1], least)
        return None if found is None else low + (found[:, ::-1] + 0.5) * pixel


def open_leaves(door: dict) -> list[np.ndarray]:
    """Hinge and free end (2, 2) of each leaf as it stands when its door is open."""
    leaves = []
    for hinge, limit in zip(door["hinges"], door["limits"], strict=True):
        foot, middle = complex(*hinge), complex(*door["position"][:2])
        along = np.exp(1j * door["yaw"])
        closed = along if ((middle - foot) * along.conjugate()).real > 0 else -along
        turned = closed * np.exp(1j * math.copysign(min(abs(limit), math.pi / 2), limit))
        tip = foot + turned * door["width"] / len(door["hinges"])
        leaves.append(np.array([[foot.real, foot.imag], [tip.real, tip.imag]]))
    return leaves


def shortest(clear: np.ndarray, start: tuple[int, int], end: tuple[int, int], least: float) -> np.ndarray | None:
    """Dijkstra over cells (n, 2) that are at least ``least`` from any obstacle, keeping to the middle of ways."""
    cost = np.full(clear.shape, np.inf)
    before: dict[tuple[int, int], tuple[int, int]] = {}
    cost[start] = 0.0
    queue = [(0.0, start)]
    while queue:
        reached, cell = heapq.heappop(queue)
        if cell == end:
            cells = [end]
            while cells[-1] != start:
                cells.append(before[cells[-1]])
            return np.array(cells[::-1], float)
        if reached > cost[cell]:
            continue
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                to = (cell[0] + dr, cell[1] + dc)
                if not (dr or dc) or clear[to] < least:
                    continue
                total = reached + math.hypot(dr, dc) * (1.0 + 0.2 / clear[to])
                if total < cost[to]:
                    cost[to] = total
                    before[to] = cell
                    heapq.heappush(queue, (total, to))
    return None
