"""GLB (binary glTF 2.0), for browsers and viewers: a node an element, y up, metres.

Node names are the elements' names; ``extras`` carry class and GlobalId, as in IFC and USD. Doors stand as scanned, each
leaf a node on its hinge. The same model gives the same bytes.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scan2bim import __version__
from scan2bim.geometry.meshes import Mesh, face_normals
from scan2bim.model.bodies import Piece, Solid, storey_solids
from scan2bim.model.colours import colour_of, to_linear, to_srgb
from scan2bim.model.elements import Building, Colour, Element, Storey
from scan2bim.model.ids import ifc_guid

GLASS_OPACITY: Final = 0.35
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _ARRAY_BUFFER = 5126, 34962
_HALF = math.sqrt(0.5)
_CLASSES: Final = {"Storey": "BuildingStorey", "RoofPlane": "Roof"}


def export(building: Building, path: Path) -> tuple[str, ...]:
    """Write the building as ``path`` and say what was left out. Raises OSError."""
    writer = _Writer()
    storeys = [writer.storey(storey) for storey in building.storeys]
    root = writer.node(name=building.name, children=storeys, rotation=[-_HALF, 0.0, 0.0, _HALF], extras=_extras(building))
    path.write_bytes(writer.finish(root))
    spaces = sum(len(storey.spaces) for storey in building.storeys)
    return (f"{spaces} spaces: this form shows bodies only.",) if spaces else ()


class _Writer:
    """Collects what the file holds."""

    def __init__(self) -> None:
        self._nodes: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._materials: dict[str, int] = {}
        self._material_list: list[dict[str, Any]] = []
        self._bytes = bytearray()

    def node(self, **fields: Any) -> int:
        """A node with the fields that have content; its number."""
        self._nodes.append({key: value for key, value in fields.items() if value not in ([], None)})
        return len(self._nodes) - 1

    def storey(self, storey: Storey) -> int:
        """A node for a storey with all its elements below it."""
        children = [self._solid(solid) for solid in storey_solids(storey)]
        return self.node(name=storey.name, children=children, extras=_extras(storey))

    def finish(self, root: int) -> bytes:
        """The file's bytes."""
        content = {
            "asset": {"version": "2.0", "generator": f"scan2bim {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [root]}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": self._material_list,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._bytes)}] if self._bytes else [],
        }
        filled = {key: value for key, value in content.items() if value != []}
        text = json.dumps(filled, separators=(",", ":"), ensure_ascii=False).encode()
        chunks = [(_JSON, text + b" " * (-len(text) % 4))]
        if self._bytes:
            chunks.append((_BIN, bytes(self._bytes)))
        body = b"".join(struct.pack("<II", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<III", _MAGIC, 2, 12 + len(body)) + body

    def _solid(self, solid: Solid) -> int:
        colour, extras = colour_of(solid.element), _extras(solid.element)
        children = [self._piece(solid, piece, colour) for piece in solid.pieces]
        return self.node(name=solid.element.name, children=children, extras=extras)

    def _piece(self, solid: Solid, piece: Piece, colour: Colour) -> int:
        primitive = {"attributes": self._attributes(piece.mesh), "material": self._material(colour, glass=piece.glass)}
        self._meshes.append({"name": solid.element.name, "primitives": [primitive]})
        half = piece.angle / 2
        rotation = [0.0, 0.0, math.sin(half), math.cos(half)] if piece.angle else None
        place = list(piece.place) if any(piece.place) else None
        return self.node(mesh=len(self._meshes) - 1, translation=place, rotation=rotation)

    def _attributes(self, mesh: Mesh) -> dict[str, int]:
        """Triangles of their own corners, so that each is flat."""
        corners = mesh.corners.reshape(-1, 3).astype(np.float32)
        normals = np.repeat(face_normals(mesh), 3, axis=0).astype(np.float32)
        return {"POSITION": self._accessor(corners, bounds=True), "NORMAL": self._accessor(normals, bounds=False)}

    def _accessor(self, rows: npt.NDArray[np.float32], *, bounds: bool) -> int:
        data = rows.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._bytes), "byteLength": len(data), "target": _ARRAY_BUFFER}
        self._bytes += data
        self._views.append(view)
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _FLOAT,
            "count": len(rows),
            "type": "VEC3",
        }
        if bounds:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def _material(self, colour: Colour, *, glass: bool) -> int:
        srgb = to_srgb(colour)
        name = "Colour_{:02X}{:02X}{:02X}".format(*srgb) + ("_glass" if glass else "")
        if name not in self._materials:
            self._materials[name] = len(self._material_list)
            factor = [*(round(channel, 6) for channel in to_linear(srgb)), GLASS_OPACITY if glass else 1.0]
            surface = {"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": 0.1 if glass else 0.9}
            blend = {"alphaMode": "BLEND", "doubleSided": True} if glass else {}
            self._material_list.append({"name": name, "pbrMetallicRoughness": surface, **blend})
        return self._materials[name]


def _extras(thing: Building | Storey | Element) -> dict[str, str]:
    name = type(thing).__name__
    return {"ifcClass": f"Ifc{_CLASSES.get(name, name)}", "GlobalId": ifc_guid(thing.id)}
