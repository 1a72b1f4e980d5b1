"""Virtual laser scans of an IFC model: the work of ``scan2bim simulate``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scan2bim.errors import PrecheckError, UsageError
from scan2bim.geometry.raycasting import load_open3d
from scan2bim.simulate.areas import Area, areas_of
from scan2bim.simulate.e57 import write_e57
from scan2bim.simulate.effects import World
from scan2bim.simulate.ifc_doors import Doors, hang_doors, is_closed
from scan2bim.simulate.ifc_mesh import hangs, joined, patches_of, solid_patches
from scan2bim.simulate.ifc_sights import furnish, with_occlusion
from scan2bim.simulate.mesh import Patches, gather
from scan2bim.simulate.parts import Patch
from scan2bim.simulate.scanner import ScannerSpec, sweep_from
from scan2bim.simulate.scene import Placement, Station, turn
from scan2bim.simulate.stations import area_at, place_stations, read_stations
from scan2bim.truth.ifc import HostedOpening, IfcReading, read_ifc
from scan2bim.truth.io import write_truth
from scan2bim.truth.values import DoorTruth, StationTruth, Truth

TRUTH = "truth.json"
SPACE = 3.0
"""Metres round the model's bounds in which a given station must lie: farther off, its units are others."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What to simulate. clutter: share of the rooms' walls that furniture and people are to hide."""

    stations: Path | None = None
    doors: Doors = "as-modelled"
    clutter: float = 0.0
    seed: int = 0
    scanner: ScannerSpec = field(default_factory=ScannerSpec)


@dataclass(frozen=True, slots=True)
class Done:
    """Files written, points in them, and what is to be found in them."""

    files: tuple[Path, ...]
    points: int
    truth: Truth
    notes: tuple[str, ...]


def simulate(model: Path, folder: Path, wanted: Wanted, tell: Callable[[str], None]) -> Done:
    """Scan a model and write an E57 file per station and the truth. ``tell`` hears what is being done.

    Raises InputError for a model or list of stations that cannot be read, PrecheckError for a model in which nothing
    can be scanned, UsageError for a folder that holds something already, MissingLibraryError without open3d.
    """
    load_open3d()
    _check_folder(folder)
    rng = np.random.default_rng([wanted.seed, 4])
    tell(f"reading {model}")
    reading = read_ifc(model)
    bare = solid_patches(reading, doors=False)
    if not len(bare):
        raise PrecheckError(f"{model}: expected building elements with shapes, found none that a ray could meet.")
    world = World(bare)
    patches, doors, notes = _with_doors(reading, bare, world, wanted.doors, rng)
    world = World(patches)
    areas = areas_of(reading.truth.spaces, reading.truth.storeys, world)
    stations = _stations(model, wanted, areas, world, rng)
    tell(f"{len(patches)} surfaces, {len(areas)} rooms, {len(stations)} stations")
    if wanted.clutter > 0.0:
        eyes = np.array([s.position for s in stations], dtype=np.float64)
        pieces, hidden = furnish(areas, eyes, world, doors, wanted.clutter, rng)
        world = World(joined([patches, gather(pieces, Placement())]))
        notes.append(f"furniture and people hide {hidden:.0%} of the walls")
    truth = _truth(reading, doors, areas, stations, world)
    folder.mkdir(parents=True, exist_ok=True)
    files, points = list[Path](), 0
    for number, station in enumerate(stations):
        path = folder / f"{station.name}.e57"
        points += _scan(world, station, wanted, number, path)
        files.append(path)
        tell(f"wrote {path} ({number + 1} of {len(stations)})")
    write_truth(folder / TRUTH, truth)
    return Done((*files, folder / TRUTH), points, truth, tuple(notes))


def _check_folder(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: expected a folder for the scans, but this is a file.")
    if folder.is_dir() and (any(folder.glob("*.e57")) or (folder / TRUTH).exists()):
        raise UsageError(f"{folder} holds scans already, which would be mixed with the new ones. Name another folder.")


def _with_doors(
    reading: IfcReading, bare: Patches, world: World, state: Doors, rng: np.random.Generator
) -> tuple[Patches, list[DoorTruth], list[str]]:
    """The model's surfaces with its doors as wanted, and what is to be found of the doors."""
    named = {door.name: door for door in reading.truth.doors}
    pairs = zip(_doors(reading), reading.truth.doors, strict=True)
    hung = [(one, door) for one, door in pairs if hangs(one)]
    if state == "as-modelled":
        whole = solid_patches(reading, doors=True)
        meshes = {e.id(): patches_of(m, e) for e, m in reading.model.meshes([o.fill for o, _ in hung], voids=False)}
        for one, door in hung:
            own = meshes.get(one.fill.id()) if one.fill is not None else None
            closed = own is not None and is_closed(one, own)
            named[door.name] = door.model_copy(update={"state": "closed" if closed else "open"})
        return whole, list(named.values()), []
    made = hang_doors(hung, world, state, rng)
    named.update((door.truth.name, door.truth) for door in made)
    leaves: list[Patch] = [patch for door in made for patch in door.patches]
    stuck = sum(door.truth.state == "closed" for door in made) if state == "open" else 0
    notes = [f"{stuck} doors stay closed: their leaves would touch something"] if stuck else []
    return joined([bare, gather(leaves, Placement())]), list(named.values()), notes


def _doors(reading: IfcReading) -> list[HostedOpening]:
    return [one for one in reading.hosted if one.fill is not None and one.fill.is_a("IfcDoor")]


def _stations(model: Path, wanted: Wanted, areas: list[Area], world: World, rng: np.random.Generator) -> list[Station]:
    if wanted.stations is None:
        return place_stations(areas, world, rng)
    found = read_stations(wanted.stations, rng)
    corners = np.concatenate([world.patches.origin, world.patches.origin + world.patches.u])
    low, high = corners.min(axis=0) - SPACE, corners.max(axis=0) + SPACE
    for station in found:
        if not ((np.array(station.position) >= low) & (np.array(station.position) <= high)).all():
            bounds = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
            raise PrecheckError(
                f"{wanted.stations}: station {station.name} at {station.position} lies outside {model} ({bounds}, "
                "metres). Give positions in metres in the model's own coordinates."
            )
    return found


def _truth(
    reading: IfcReading, doors: list[DoorTruth], areas: list[Area], stations: list[Station], world: World
) -> Truth:
    def room(station: Station) -> str:
        area = area_at(station.position, areas)
        return "" if area is None else area.name

    plain = reading.truth
    inhabited = {area.storey for area in areas}
    truth = plain.model_copy(
        update={
            "doors": tuple(doors),
            "storeys": tuple(s for s in plain.storeys if s.name in inhabited) or plain.storeys,
            "stations": tuple(StationTruth(name=s.name, position=s.position, room=room(s)) for s in stations),
        }
    )
    names = [door.name for door in plain.doors] + [window.name for window in plain.windows]
    windows = [one for one in reading.hosted if one.fill is not None and one.fill.is_a("IfcWindow")]
    hosts = [*_doors(reading), *windows]
    thicknesses = {name: one.strip.thickness for name, one in zip(names, hosts, strict=True)}
    return with_occlusion(truth, thicknesses, areas, world)


def _scan(world: World, station: Station, wanted: Wanted, number: int, path: Path) -> int:
    rng = np.random.default_rng([wanted.seed, number])
    viewpoint = np.array(station.position, dtype=np.float64)
    sweep = sweep_from(world, station.name, viewpoint, turn(station.heading), wanted.scanner, rng)
    if not len(sweep.xyz):
        raise PrecheckError(f"station {station.name} at {station.position} sees nothing. Give another position.")
    part = path.with_name(path.name + ".part")
    write_e57(part, [sweep])
    part.replace(path)
    return len(sweep.xyz)
