"""The frame of an IFC file: project, units, contexts, site, building, storeys, georeference, header."""

from __future__ import annotations

from scan2bim import __version__
from scan2bim.exporters.ifc_draft import Draft, Level, aggregate
from scan2bim.exporters.ifc_file import Contexts, Entity, IfcFile
from scan2bim.exporters.ifc_georeference import georeference, old_georeference
from scan2bim.exporters.ifc_properties import Value, dimensions, text
from scan2bim.exporters.ifc_shapes import axes, placement
from scan2bim.model.coverage import coverage_of, scan_offset
from scan2bim.model.elements import Building, Storey

TIME_STAMP = "1970-01-01T00:00:00"
"""The header's time. The model knows no time and the clock would make equal files differ."""

_VIEWS = {"IFC2X3": "CoordinationView_V2.0", "IFC4": "DesignTransferView_V1.0", "IFC4X3_ADD2": "DesignTransferView"}

PRECISION = 1e-5
"""Metres within which points count as equal."""


def project(ifc: IfcFile, building: Building) -> tuple[Entity, Contexts]:
    """The project in metres, with its contexts."""
    model = _context(ifc, "Model", 3)
    plan = _context(ifc, "Plan", 2)
    entity = ifc.root(
        "IfcProject",
        f"project of {building.id}",
        building.name,
        RepresentationContexts=(model, plan),
        UnitsInContext=ifc.add("IfcUnitAssignment", _units(ifc)),
    )
    contexts = Contexts(
        model=model,
        body=_subcontext(ifc, model, "Body", "MODEL_VIEW"),
        axis=_subcontext(ifc, plan, "Axis", "GRAPH_VIEW"),
        footprint=_subcontext(ifc, plan, "FootPrint", "MODEL_VIEW"),
        symbol=_subcontext(ifc, plan, "FootPrint", "PLAN_VIEW"),
    )
    georeference(ifc, building.frame, (model, plan))
    return entity, contexts


def _units(ifc: IfcFile) -> list[Entity]:
    kinds = {
        "LENGTHUNIT": "METRE",
        "AREAUNIT": "SQUARE_METRE",
        "VOLUMEUNIT": "CUBIC_METRE",
        "PLANEANGLEUNIT": "RADIAN",
    }
    return [ifc.file.create_entity("IfcSIUnit", UnitType=kind, Name=name) for kind, name in kinds.items()]


def _context(ifc: IfcFile, kind: str, dimension: int) -> Entity:
    origin = axes(ifc, (0.0, 0.0, 0.0))
    return ifc.add("IfcGeometricRepresentationContext", None, kind, dimension, PRECISION, origin, None)


def _subcontext(ifc: IfcFile, parent: Entity, identifier: str, view: str) -> Entity:
    return ifc.file.create_entity(
        "IfcGeometricRepresentationSubContext",
        ContextIdentifier=identifier,
        ContextType=parent.ContextType,
        ParentContext=parent,
        TargetView=view,
    )


def spatial_structure(draft: Draft, project: Entity, building: Building) -> list[Level]:
    """Site, building and storeys below the project; the storeys in the model's order."""
    ifc = draft.ifc
    site = _spatial(ifc, "IfcSite", f"site of {building.id}", "Site", placement(ifc, None, (0.0, 0.0, 0.0)))
    house = _spatial(
        ifc, "IfcBuilding", building.id, building.name, placement(ifc, site.ObjectPlacement, (0.0, 0.0, 0.0))
    )
    levels = [_level(draft, house, storey) for storey in building.storeys]
    aggregate(ifc, project, [site])
    aggregate(ifc, site, [house])
    aggregate(ifc, house, [level.entity for level in levels])
    _building_properties(draft, house, building)
    old_georeference(draft, site, building.frame)
    return levels


def _spatial(ifc: IfcFile, ifc_class: str, key: str, name: str, place: Entity) -> Entity:
    return ifc.root(ifc_class, key, name, ObjectPlacement=place, CompositionType="ELEMENT")


def _level(draft: Draft, house: Entity, storey: Storey) -> Level:
    elevation = storey.elevation.value
    place = placement(draft.ifc, house.ObjectPlacement, (0.0, 0.0, elevation))
    entity = _spatial(draft.ifc, "IfcBuildingStorey", storey.id, storey.name, place)
    if not draft.ifc.dialect.new:  # 4.3 has the placement alone
        entity.Elevation = elevation
    draft.properties.custom(entity, "S2B_Evidence", dimensions(storey))
    height = None if storey.height is None else storey.height.value
    net = sum(space.area for space in storey.spaces) or None
    draft.properties.quantities(entity, "Qto_BuildingStoreyBaseQuantities", {"NetHeigtht": height, "NetFloorArea": net})
    return Level(entity, elevation)


def _building_properties(draft: Draft, house: Entity, building: Building) -> None:
    """How the coordinates came about, which scans the model was made from, and what its makers want to have said."""
    frame = building.frame
    values: dict[str, Value | None] = {
        "MetresPerFileUnit": ("IfcReal", frame.unit),
        "UpAxis": ("IfcLabel", frame.up),
        "MainDirection": ("IfcPlaneAngleMeasure", frame.yaw),
        "Shift": ("IfcLengthMeasure", frame.shift),
        "CoordinateReferenceSystem": text(frame.crs),
    }
    draft.properties.custom(house, "S2B_Frame", values)
    scans: dict[str, Value | None] = {}
    for number, scan in enumerate(building.scans, 1):
        where = "" if scan.position is None else " at ({:.3f}, {:.3f}, {:.3f})".format(*scan.position)
        if (off := scan_offset(scan)) is not None:
            where += f", {1000 * off:.1f} mm off the other scans"
        scans[f"Scan{number:03d}"] = ("IfcText", f"{scan.name}: {scan.points} points, {scan.file}{where}")
    draft.properties.custom(house, "S2B_Scans", scans)
    draft.properties.custom(house, "S2B_Coverage", _coverage(building))
    notes: dict[str, Value | None] = {f"Note{i:03d}": ("IfcText", note) for i, note in enumerate(building.notes, 1)}
    draft.properties.custom(house, "S2B_Notes", notes)
    count = "IfcCountMeasure" if draft.ifc.dialect.new else "IfcInteger"
    draft.properties.common(house, "Pset_BuildingCommon", {"NumberOfStoreys": (count, len(building.storeys))})


def _coverage(building: Building) -> dict[str, Value | None]:
    """How much of the faces that bound spaces the scans saw, in all and by kind; nothing where it is not known."""
    found = coverage_of(building)
    if found is None:
        return {}
    out: dict[str, Value | None] = {}
    for name, part in (("", found.total), ("Walls", found.walls), ("Floors", found.floors), ("Ceilings", found.ceilings)):
        out[f"{name}Area"] = ("IfcAreaMeasure", round(part.area, 2))
        for share in ("seen", "occluded", "unseen"):
            value = min(1.0, round(float(getattr(part, share)), 4))
            out[f"{name}{share.capitalize()}"] = ("IfcNormalisedRatioMeasure", value)
    return out


def header(ifc: IfcFile, building: Building) -> None:
    """The file's header, made from the model alone."""
    head = ifc.file.header
    head.file_description.description = (f"ViewDefinition [{_VIEWS[ifc.dialect.version]}]",)
    head.file_name.name = f"{building.name}.ifc"
    head.file_name.time_stamp = TIME_STAMP
    head.file_name.author = ("scan2bim",)
    head.file_name.organization = ("scan2bim",)
    head.file_name.preprocessor_version = f"scan2bim {__version__}"
    head.file_name.originating_system = f"scan2bim - scan2bim - {__version__}"
    head.file_name.authorization = "none"
