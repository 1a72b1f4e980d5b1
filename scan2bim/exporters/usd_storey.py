"""A storey as a layer of its own, in its own frame: z from its floor."""

from __future__ import annotations

from pathlib import Path
from typing import Final, TypeAlias

from pxr import Gf, Kind, Sdf, Usd, UsdGeom

from scan2bim.exporters.usd_assets import STATE, Assets, add_state
from scan2bim.exporters.usd_physics import add_wall_blocks, collide
from scan2bim.exporters.usd_prims import (
    define_group,
    define_guide,
    define_mesh,
    define_xform,
    describe,
    free_path,
    new_stage,
    write_fields,
)
from scan2bim.geometry.meshes import Mesh, move_mesh
from scan2bim.model.colours import colour_of
from scan2bim.model.elements import (
    Area,
    Beam,
    Column,
    Covering,
    Door,
    Element,
    Opening,
    RoofPlane,
    Slab,
    Space,
    Stair,
    Storey,
    Wall,
    Window,
)
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import point_on_wall
from scan2bim.model.shapes import (
    area_body,
    door_leaves,
    flight_bodies,
    lining_body,
    opening_angle,
    roof_body,
    upright_body,
    void_body,
    wall_angle,
    wall_bodies,
    wall_forms,
)
from scan2bim.model.swing import Obstacles

_CLASSES: Final[dict[type[Element], tuple[str, str]]] = {
    Space: ("Spaces", "IfcSpace"),
    Slab: ("Slabs", "IfcSlab"),
    Covering: ("Coverings", "IfcCovering"),
    Column: ("Columns", "IfcColumn"),
    Beam: ("Beams", "IfcBeam"),
    Stair: ("Stairs", "IfcStair"),
    RoofPlane: ("Roofs", "IfcRoof"),
}
_Plain: TypeAlias = Area | Space | Column | Beam | Stair | RoofPlane


class StoreyLayer:
    """Writes a storey to a file; ``notes`` tell afterwards what was left out.

    assets: those of the building, and the path that leads from the storey's layer to their folder. instances: whether
    windows are to share their prims, which saves memory, but is not understood by all readers.
    """

    def __init__(self, path: Path, name: str, storey: Storey, assets: Assets, *, instances: bool) -> None:
        self._root = Sdf.Path(f"/{name}")
        self._stage = new_stage(str(path), self._root, Kind.Tokens.group)
        self._storey = storey
        self._floor = storey.elevation.value
        self._assets = assets
        self._instances = instances
        self._obstacles = Obstacles(storey)
        self._leafless: list[str] = []
        self.notes: list[str] = []

    def write(self) -> None:
        """Define all prims and save the layer."""
        describe(self._stage.GetDefaultPrim(), self._storey, "IfcBuildingStorey")
        self._add_walls()
        storey = self._storey
        elements: tuple[_Plain, ...] = (*storey.spaces, *storey.slabs, *storey.coverings, *storey.columns)
        for element in (*elements, *storey.beams, *storey.stairs, *storey.roofs):
            self._add_element(element)
        if self._leafless:
            names = ", ".join(self._leafless)
            self.notes.append(f"{storey.name}: no leaf, since hinge, swing or angle is not known: {names}.")
        self._stage.Save()

    def extent(self) -> tuple[Gf.Vec3f, ...]:
        """Extents of what the layer holds, by purpose, for whoever has not loaded it."""
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [*UsdGeom.Imageable.GetOrderedPurposeTokens()])
        hint = UsdGeom.ModelAPI(self._stage.GetDefaultPrim()).ComputeExtentsHint(cache)
        return tuple(hint)

    def _add_walls(self) -> None:
        bodies, forms = wall_bodies(self._storey), wall_forms(self._storey)
        for wall in self._storey.walls:
            path = free_path(self._stage, define_group(self._stage, self._root, "Walls"), "Wall", wall.id)
            place = (*wall.start, wall.base - self._floor)
            prim = define_xform(self._stage, path, place, wall_angle(wall), Kind.Tokens.component)
            describe(prim, wall, "IfcWall")
            self._add_body(path, bodies[wall.id], wall, collides=False)
            add_wall_blocks(self._stage, path, forms[wall.id])
            for opening in wall.openings:
                self._add_opening(path, wall, opening)

    def _add_opening(self, host: Sdf.Path, wall: Wall, opening: Opening) -> None:
        """The prim of an opening or niche, or of what fills it."""
        thing = opening.fill or opening
        kind = type(thing).__name__
        path = free_path(self._stage, define_group(self._stage, self._root, f"{kind}s"), kind, thing.id)
        x, y, z = point_on_wall(wall, opening.offset.value, 0.0, opening.sill.value)
        place = (x, y, z - self._floor)
        prim = define_xform(self._stage, path, place, opening_angle(wall, opening), Kind.Tokens.component)
        describe(prim, thing, f"Ifc{kind}" if opening.fill else "IfcOpeningElement")
        prim.CreateRelationship("s2b:host", custom=True).SetTargets([host])
        if opening.fill is None:
            define_guide(self._stage, path.AppendChild("void"), void_body(wall, opening), colour_of(thing))
            return
        write_fields(prim, opening, "s2b:opening")
        guid = prim.CreateAttribute(
            "ifc:openingGlobalId", Sdf.ValueTypeNames.String, custom=True, variability=Sdf.VariabilityUniform
        )
        guid.Set(ifc_guid(opening.id))
        self._refer(prim, wall, opening)

    def _refer(self, prim: Usd.Prim, wall: Wall, opening: Opening) -> None:
        """Let the prim be one of its type's, its leaves as they were found; a door of which no part is known, a void."""
        leaves = door_leaves(wall, opening)
        if isinstance(opening.fill, Door) and not leaves:
            self._leafless.append(opening.fill.name)
            if not len(lining_body(wall, opening).triangles):
                void = prim.GetPath().AppendChild("void")
                define_guide(self._stage, void, void_body(wall, opening), colour_of(opening.fill))
                return
        asset = self._assets.of(wall, opening, lambda leaf: self._obstacles.swing_limit(wall, opening, leaf))
        prim.GetReferences().AddReference(f"./assets/{asset.path}")
        if isinstance(opening.fill, Window):
            prim.SetInstanceable(self._instances)
        if not isinstance(opening.fill, Door):
            return
        angles = {name: leaf.angle for name, leaf in zip(asset.leaves, leaves, strict=True) if leaf.turn}
        if angles:
            add_state(prim, "as_scanned", angles)
            prim.GetVariantSets().GetVariantSet(STATE).SetVariantSelection("as_scanned")

    def _add_element(self, element: _Plain) -> None:
        group, ifc_class = _CLASSES[type(element)]
        kind = type(element).__name__
        path = free_path(self._stage, define_group(self._stage, self._root, group), kind, element.id)
        describe(define_xform(self._stage, path, kind=Kind.Tokens.component), element, ifc_class)
        self._add_body(path, move_mesh(_body(element), 0.0, (0.0, 0.0, -self._floor)), element)
        if isinstance(element, Stair):
            self._say_steps(element)

    def _say_steps(self, stair: Stair) -> None:
        if not stair.flights:
            self.notes.append(f"{stair.name}: only its envelope, as a guide, since its steps are not known.")
        elif any(flight.risers is None for flight in stair.flights):
            self.notes.append(f"{stair.name}: steps of a usual height, since they were not counted.")

    def _add_body(self, parent: Sdf.Path, body: Mesh, element: Element, *, collides: bool = True) -> None:
        if not len(body.triangles):
            self.notes.append(f"{element.name}: no shape, since it has no extent.")
            return
        path = parent.AppendChild("body")
        if isinstance(element, Space) or (isinstance(element, Stair) and not element.flights):
            define_guide(self._stage, path, body, colour_of(element))
            return
        prim = define_mesh(self._stage, path, body, colour_of(element))
        if collides:
            collide(prim, "none")


def _body(element: _Plain) -> Mesh:
    """The element's mesh in the building's frame."""
    match element:
        case Area():
            return area_body(element)
        case RoofPlane():
            return roof_body(element)
        case Stair() if element.flights:
            return flight_bodies(element)
        case _:
            return upright_body(element)
