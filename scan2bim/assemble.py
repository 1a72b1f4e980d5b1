"""The model stage: what the earlier stages found becomes the semantic model, with names, ids and evidence in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from scan2bim.assemble_linings import with_linings
from scan2bim.assemble_members import beams_of, columns_of, linear, seen_by
from scan2bim.assemble_plates import coverings_of, elevation_of, roofs_of, slabs_of, stairs_of
from scan2bim.cloud.frame import SurveyFrame
from scan2bim.cloud.ingest import ScanSummary
from scan2bim.cloud.scan import ScanHeader
from scan2bim.model.elements import (
    Building,
    Dimension,
    Door,
    Evidence,
    Frame,
    Join,
    Opening,
    Point3,
    ScanSource,
    Space,
    Storey,
    Wall,
    Window,
)
from scan2bim.model.ids import distinct, stable_id
from scan2bim.openings.shapes import OpeningShape, load_openings
from scan2bim.openings.virtual import is_virtual
from scan2bim.structure.confidence import probability
from scan2bim.structure.precision import length_sigma
from scan2bim.structure.shapes import SpaceShape, StoreyShape, StructureShape, WallShape
from scan2bim.structure.soffits import volume_under

RECESS_SIGMA, HANDLE_SIGMA = 0.003, 0.02
"""Metres: of a closed leaf's depth behind the wall's face (registration and plaster), and of a handle's height."""


def assemble_building(
    name: str,
    headers: Sequence[ScanHeader],
    frame: SurveyFrame,
    structure_folder: Path,
    openings_folder: Path,
    scan_folders: Sequence[Path],
) -> Building:
    """The semantic model. ``name`` is the building's for people; ids come from geometry and survive a rerun."""
    structure = StructureShape.load(structure_folder / "structure.json")
    structure, openings = with_linings(structure, load_openings(openings_folder / "openings.json"))
    summaries = [ScanSummary.load(f) for f in scan_folders]
    sources = _sources(headers, summaries)
    storeys = tuple(_storey(i, structure, openings, sources) for i in range(len(structure.storeys)))
    return Building(
        id=stable_id("building", name),
        name=name,
        frame=Frame(unit=frame.unit, up=frame.up, yaw=round(structure.yaw, 6), shift=frame.shift, crs=frame.crs),
        scans=tuple(sources.values()),
        storeys=storeys,
        notes=(*frame.notes, *(note for s in summaries for note in s.notes), *structure.notes),
    )


def _sources(headers: Sequence[ScanHeader], summaries: Sequence[ScanSummary]) -> dict[int, ScanSource]:
    """Scan sources by station number; several of one file where it tells them by point source ids."""
    parts: list[tuple[int, str, str, int, Point3 | None]] = []
    for header, summary in zip(headers, summaries, strict=True):
        file, name = header.path.name, summary.name
        if summary.sources:
            counted = enumerate(zip(summary.sources, summary.source_points, strict=True))
            parts += [(summary.station + k, f"{name}, source {source}", file, n, None) for k, (source, n) in counted]
        else:
            parts.append((summary.station, name, file, summary.points, summary.position))
    ids = distinct(stable_id("scan", file, name) for _, name, file, _, _ in parts)
    return {
        station: ScanSource(id=i, name=name, file=file, points=points, position=position)
        for i, (station, name, file, points, position) in zip(ids, parts, strict=True)
    }


def _storey(
    number: int, structure: StructureShape, openings: Sequence[OpeningShape], sources: dict[int, ScanSource]
) -> Storey:
    shape = structure.storeys[number]
    space_ids = distinct(stable_id("space", number, _middle(s)) for s in shape.spaces)
    wall_ids = distinct(stable_id("wall", number, *sorted((w.start, w.end))) for w in shape.walls)
    mine = [o for o in openings if o.storey == number]
    walls = tuple(
        _wall(i, wall_ids, space_ids, shape.walls, [o for o in mine if o.wall == i], number, sources)
        for i in range(len(shape.walls))
    )
    return Storey(
        id=stable_id("storey", number, round(shape.floor, 1)),
        name=f"Storey {number}",
        elevation=elevation_of(shape),
        height=_height(shape),
        walls=walls,
        spaces=tuple(_space(i, space_ids[i], s, shape, number) for i, s in enumerate(shape.spaces)),
        slabs=slabs_of(number, structure),
        coverings=tuple(c for i, s in enumerate(shape.spaces) for c in coverings_of(space_ids[i], s, number, i)),
        columns=columns_of(number, structure, sources),
        beams=beams_of(number, structure),
        roofs=roofs_of(number, structure),
        stairs=stairs_of(number, structure),
    )


def _height(shape: StoreyShape) -> Dimension | None:
    if shape.ceiling is None:
        return None
    return _length(shape.ceiling - shape.floor, None if shape.sigma is None else round(max(shape.sigma, 0.003), 4))


def _middle(space: SpaceShape) -> tuple[float, float]:
    point = space.polygon.representative_point()
    return point.x, point.y


def _space(index: int, identifier: str, shape: SpaceShape, storey: StoreyShape, number: int) -> Space:
    seen = shape.ceiling is not None
    height = (shape.ceiling if shape.ceiling is not None else storey.ceiling or storey.top) - shape.floor
    area = shape.polygon.area
    height = max(height, 0.5)
    return Space(
        id=identifier,
        name=f"{number}.{index + 1:02d}",
        confidence=round(min(0.98, 0.5 + 0.45 * max(shape.floor_share, shape.ceiling_share)), 3),
        evidence=Evidence(
            coverage=shape.ceiling_share,
            sentence=f"floor seen on {shape.floor_share:.0%} and ceiling on {shape.ceiling_share:.0%} of the area",
        ),
        outline=shape.outline,
        holes=shape.holes,
        base=shape.floor,
        height=Dimension(
            value=round(height, 4), source="measured" if seen else "assumed", sigma=0.005 if seen else None
        ),
        area=round(area, 4),
        volume=round(volume_under(shape.soffits, shape.floor) if shape.soffits else area * height, 4),
        ceiling=shape.soffits,
    )


def _wall(
    index: int,
    ids: Sequence[str],
    space_ids: Sequence[str],
    shapes: Sequence[WallShape],
    openings: Sequence[OpeningShape],
    number: int,
    sources: dict[int, ScanSource],
) -> Wall:
    shape = shapes[index]
    length = length_sigma(shape, shapes)
    measured = shape.thickness_sigma is not None
    faces = "both faces" if shape.faces == 2 else "one face"
    how = "; thickness from rays through its openings" if measured else "; thickness assumed"
    if shape.layer_of is not None:
        how = f"; a layer of {shape.layer_of:.3f} m, as the walls in its line tell; thickness assumed"
    return Wall(
        id=ids[index],
        name=f"Wall {number}.{index + 1:02d}",
        confidence=probability(shape),
        evidence=Evidence(
            points=shape.points,
            rms=shape.rms,
            coverage=shape.coverage,
            faces_seen=shape.faces,
            position_sigma=shape.position_sigma,
            length_sigma=None if length is None else round(length, 4),
            scans=seen_by(shape.stations, sources),
            sentence=f"{faces} seen on {shape.coverage:.0%} of their length, {shape.points} points, "
            f"RMS {shape.rms * 1000:.0f} mm" + ("" if shape.faces == 2 else how),
        ),
        colour=linear(shape.colour),
        start=shape.start,
        end=shape.end,
        thickness=Dimension(
            value=shape.thickness, source="measured" if measured else "assumed", sigma=shape.thickness_sigma
        ),
        base=shape.base,
        height=Dimension(
            value=round(max(shape.top - shape.base, 0.3), 4),
            source="measured" if shape.top_seen else "assumed",
            sigma=0.005 if shape.top_seen else None,
        ),
        profile=shape.profile,
        bulge=shape.bulge,
        external=None if shape.faces == 2 or shape.layer_of is not None else True,
        left_spaces=tuple(space_ids[s] for s in shape.left),
        right_spaces=tuple(space_ids[s] for s in shape.right),
        joins=tuple(
            Join.model_validate({"wall": ids[j.other], "at": j.at, "other_at": j.other_at, "kind": j.kind})
            for j in shape.joins
        ),
        openings=tuple(_opening(ids[index], o, k, index, number, sources) for k, o in enumerate(openings)),
    )


def _opening(
    wall_id: str, shape: OpeningShape, index: int, wall: int, number: int, sources: dict[int, ScanSource]
) -> Opening:
    place = f"{number}.{wall + 1:02d}.{index + 1}"
    identifier = stable_id("opening", wall_id, shape.offset + shape.width / 2, shape.sill + shape.height / 2)
    evidence = Evidence(
        points=shape.points,
        coverage=shape.looked_through,
        scans=seen_by(shape.stations, sources),
        sentence=_sentence(shape),
    )
    return Opening(
        id=identifier,
        name=f"Opening {place}",
        confidence=shape.confidence,
        evidence=evidence,
        offset=_length(shape.offset, shape.width_sigma),
        sill=_length(shape.sill, shape.height_sigma),
        width=_length(shape.width, shape.width_sigma),
        height=_length(shape.height, shape.height_sigma),
        fill=_fill(identifier, shape, place, evidence),
    )


def _length(value: float, sigma: float | None) -> Dimension:
    return Dimension(value=round(value, 4), source="assumed" if sigma is None else "measured", sigma=sigma)


def _fill(opening_id: str, shape: OpeningShape, place: str, evidence: Evidence) -> Door | Window | None:
    common = {"id": stable_id(shape.kind, opening_id), "confidence": shape.confidence, "evidence": evidence}
    if shape.kind == "door":
        return Door.model_validate(common | {"name": f"Door {place}", "state": shape.state} | _leaf(shape))
    return Window.model_validate(common | {"name": f"Window {place}"}) if shape.kind == "window" else None


def _leaf(shape: OpeningShape) -> dict[str, object]:
    """What is known of a door's leaf."""
    return {
        "angle": shape.angle,
        "hinge_side": shape.hinge,
        "swing_side": shape.swing,
        "operation": "DOUBLE_DOOR_SINGLE_SWING" if shape.leaves == 2 and shape.swing != "unknown" else "NOTDEFINED",
        "leaves": shape.leaves,
        "glazed": shape.glazed,
        "recess": None if shape.recess is None else _length(shape.recess, RECESS_SIGMA),
        "recess_side": shape.recess_side,
        "handle_height": None if shape.handle_height is None else _length(shape.handle_height, HANDLE_SIGMA),
    }


def _sentence(shape: OpeningShape) -> str:
    if shape.words:
        return ", ".join(shape.words)
    if is_virtual(shape.stations):
        parts = [f"open on {shape.looked_through:.0%} of its area as far as the cloud tells without scanner positions"]
    else:
        parts = [f"looked through on {shape.looked_through:.0%} of its area by {len(shape.stations)} scans"]
    parts.append({0: "no jamb seen", 1: "one jamb seen", 2: "both jambs seen"}[shape.jambs])
    parts.append("lintel seen" if shape.lintel else "no lintel seen")
    if shape.angle is not None:
        parts.append(f"leaf hung at the {shape.hinge} jamb, open by {math.degrees(shape.angle):.0f} degrees")
    elif shape.glazed:
        parts.append("panes seen in it, closed")
    elif shape.kind == "door":
        parts.append("no leaf seen")
    return ", ".join(parts)
