"""Types of doors and windows with their geometry: lining, leaf or panes, symbol in plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from scan2bim.exporters.ifc_bonsai import bonsai_set
from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity, Shared
from scan2bim.exporters.ifc_properties import ENUMERATED, Value
from scan2bim.exporters.ifc_shapes import axes, rectangle_through, representation
from scan2bim.model.colours import to_srgb
from scan2bim.model.elements import Colour

DOOR_OPERATIONS = (
    "SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT", "DOUBLE_DOOR_SINGLE_SWING",
    "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_LEFT", "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_RIGHT",
    "DOUBLE_SWING_LEFT", "DOUBLE_SWING_RIGHT", "DOUBLE_DOOR_DOUBLE_SWING", "SLIDING_TO_LEFT", "SLIDING_TO_RIGHT",
    "DOUBLE_DOOR_SLIDING", "FOLDING_TO_LEFT", "FOLDING_TO_RIGHT", "DOUBLE_DOOR_FOLDING", "REVOLVING", "ROLLINGUP",
    "SWING_FIXED_LEFT", "SWING_FIXED_RIGHT", "NOTDEFINED",
)  # fmt: skip
WINDOW_PARTITIONINGS = (
    "SINGLE_PANEL", "DOUBLE_PANEL_VERTICAL", "DOUBLE_PANEL_HORIZONTAL", "TRIPLE_PANEL_VERTICAL",
    "TRIPLE_PANEL_BOTTOM", "TRIPLE_PANEL_TOP", "TRIPLE_PANEL_LEFT", "TRIPLE_PANEL_RIGHT", "TRIPLE_PANEL_HORIZONTAL",
    "NOTDEFINED",
)  # fmt: skip

_DRAWN_DOORS = (
    "SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT", "DOUBLE_SWING_LEFT", "DOUBLE_SWING_RIGHT", "DOUBLE_DOOR_SINGLE_SWING",
    "DOUBLE_DOOR_DOUBLE_SWING", "SLIDING_TO_LEFT", "SLIDING_TO_RIGHT", "DOUBLE_DOOR_SLIDING",
)  # fmt: skip
"""Operations that the library draws; the others are drawn as one leaf or two, without a symbol in plan."""

_PANEL_OPERATION = {"DOUBLE_SWING": "DOUBLE_ACTING", "SLIDING": "SLIDING", "FOLDING": "FOLDING", "SWING": "SWINGING"}

HANDLE_ROOM = 1.2
"""Metres. The library puts handles at 1 m: lower doors get a plain leaf."""

LINING = 0.05
"""Metres. Thickness of linings across the opening, where this is at least six times as wide."""

FRAMES = 1.2
"""What one sees of a window's lining and of the frame in it, in thicknesses of the lining, as they are drawn here."""

PANE = 0.0101
"""Metres. The library's panes are 10 mm thick: what is not thicker is glass."""


@dataclass(frozen=True, slots=True)
class Form:
    """What makes a type of door or window: whole millimetres, operation or partitioning, colour.

    depth: of lining or frame across the wall. inset: of the leaf's front behind the lining's. lining: its thickness in
    the wall's plane, of a window with the frame in it; threshold: its height; 0 where not measured. leaves: 2 where the
    operation does not tell.
    """

    kind: str
    width: int
    height: int
    depth: int
    leaf: int
    use: str
    colour: Colour
    inset: int = 0
    lining: int = 0
    threshold: int = 0
    leaves: int = 0

    @property
    def key(self) -> str:
        """The same for the same form; colours count as they are shown."""
        colour = "#{:02x}{:02x}{:02x}".format(*to_srgb(self.colour))
        measured = (("inset", self.inset), ("lining", self.lining), ("threshold", self.threshold), ("of", self.leaves))
        more = "".join(f" {name} {value}" for name, value in measured if value)
        return f"{self.kind} {self.width}x{self.height}x{self.depth} leaf {self.leaf} {self.use} {colour}{more}"


def door_type(draft: Draft, form: Form) -> Shared:
    """A new door type of this form, kept under its key."""
    width, height, depth = form.width / 1000, form.height / 1000, form.depth / 1000
    leaf = min(form.leaf / 1000, 0.6 * depth)
    lining = min(form.lining / 1000 or LINING, width / 6)
    drawn = form.use if form.use in _DRAWN_DOORS else _nearest(form.use, form.leaves)
    drawing = _door_lining(form, (height, depth), leaf, lining)
    representations = _door_shapes(draft, form, drawn, (width, height), leaf, drawing)
    draft.styles.paint(representations[0].Items, form.colour)
    panel = {"PanelDepth": leaf, "PanelOperation": _panel_operation(form.use), "PanelPosition": "MIDDLE"}
    properties = _lining_sets(draft, "Door", form, lining, panel | {"PanelWidth": 1.0})
    if height >= HANDLE_ROOM and drawn == form.use:
        properties.append(
            bonsai_set(draft, "Door", form.key, drawn, (width, height), drawing, {"PanelDepth": leaf})
        )
    return _keep(draft, "IfcDoorType", "DOOR", form, representations, properties, OperationType=form.use)


def window_type(draft: Draft, form: Form) -> Shared:
    """A new window type of this form, kept under its key."""
    from ifcopenshell.api.geometry import add_window_representation

    width, height, depth = form.width / 1000, form.height / 1000, form.depth / 1000
    seen = form.lining / 1000 / FRAMES if form.lining else LINING
    lining = min(seen, min(width, height) / 8)
    frame = {"FrameDepth": depth / 2, "FrameThickness": 0.7 * lining}
    drawing = _window_lining(width, height, depth, lining, form.use)
    use, panels = "SINGLE_PANEL" if form.use == "NOTDEFINED" else form.use, [dict(frame), dict(frame), dict(frame)]
    make = _partial(
        draft,
        add_window_representation,
        overall_width=width,
        overall_height=height,
        partition_type=use,
        lining_properties=drawing,
        panel_properties=panels,
    )
    body, symbol = make(draft.contexts.body), make(draft.contexts.symbol)
    panes = [item for item in body.Items if item.Depth <= PANE]
    draft.styles.glaze(panes)
    draft.styles.paint([item for item in body.Items if item.Depth > PANE], form.colour)
    panel = {"OperationType": "NOTDEFINED", "PanelPosition": "MIDDLE"} | frame
    properties = _lining_sets(draft, "Window", form, lining, panel)
    properties.append(bonsai_set(draft, "Window", form.key, use, (width, height), drawing, panels))
    return _keep(draft, "IfcWindowType", "WINDOW", form, [body, symbol], properties, PartitioningType=form.use)


def _door_shapes(
    draft: Draft, form: Form, drawn: str, size: tuple[float, float], leaf: float, lining: dict[str, float]
) -> list[Entity]:
    from ifcopenshell.api.geometry import add_door_representation

    width, height = size
    if height < HANDLE_ROOM:
        plain = rectangle_through(draft.ifc, width, height, leaf)
        return [representation(draft.ifc, draft.contexts.body, "SweptSolid", [plain])]
    make = _partial(
        draft,
        add_door_representation,
        overall_width=width,
        overall_height=height,
        operation_type=drawn,
        lining_properties=lining,
        panel_properties={"PanelDepth": leaf},
    )
    body = make(draft.contexts.body)
    return [body, make(draft.contexts.symbol)] if form.use in _DRAWN_DOORS else [body]


def _door_lining(form: Form, size: tuple[float, float], leaf: float, lining: float) -> dict[str, float]:
    """Lining and threshold as the library draws them; size: height and depth, metres."""
    height, depth = size
    return {
        "LiningDepth": depth,
        "LiningThickness": lining,
        "LiningOffset": 0.0,
        "LiningToPanelOffsetX": lining / 2,
        "LiningToPanelOffsetY": depth - leaf - form.inset / 1000,
        "CasingThickness": 0.0,
        "ThresholdThickness": min(form.threshold / 1000, height / 4),
        "ThresholdDepth": depth,
    }


def _window_lining(width: float, height: float, depth: float, lining: float, use: str) -> dict[str, float]:
    """The frame in the middle of the lining, mullions and transoms at equal distances."""
    parts = 3 if use in ("TRIPLE_PANEL_VERTICAL", "TRIPLE_PANEL_HORIZONTAL") else 2
    return {
        "LiningDepth": depth,
        "LiningThickness": lining,
        "LiningOffset": 0.0,
        "LiningToPanelOffsetX": lining / 2,
        "LiningToPanelOffsetY": -depth / 4,
        "MullionThickness": lining,
        "FirstMullionOffset": width / parts,
        "SecondMullionOffset": 2 * width / parts,
        "TransomThickness": lining,
        "FirstTransomOffset": height / parts,
        "SecondTransomOffset": 2 * height / parts,
    }


def _partial(draft: Draft, function: Callable[..., Any], **values: Any) -> Callable[[Entity], Entity]:
    """The library's drawing function with all but its context."""

    def make(context: Entity) -> Entity:
        return function(draft.ifc.file, context=context, unit_scale=1.0, **values)

    return make


def _nearest(operation: str, leaves: int) -> str:
    if operation.startswith("DOUBLE_DOOR") or leaves == 2:
        return "DOUBLE_DOOR_SINGLE_SWING"
    return "SINGLE_SWING_RIGHT" if operation.endswith("RIGHT") else "SINGLE_SWING_LEFT"


def _panel_operation(operation: str) -> str:
    return next((made for word, made in _PANEL_OPERATION.items() if word in operation), "NOTDEFINED")


def _lining_sets(draft: Draft, kind: str, form: Form, lining: float, panel: dict[str, Any]) -> list[Entity]:
    """IFC's own lining and panel entities, in 4.3 property sets; lengths of nothing are left out, as it demands."""
    ifc = draft.ifc
    sizes = {"LiningDepth": form.depth / 1000, "LiningThickness": lining}
    if form.threshold and kind == "Door":
        sizes |= {"ThresholdDepth": form.depth / 1000, "ThresholdThickness": form.threshold / 1000}
    if ifc.dialect.new:
        lengths: dict[str, Value | None] = {name: ("IfcPositiveLengthMeasure", size) for name, size in sizes.items()}
        lengths["LiningThickness"] = ("IfcNonNegativeLengthMeasure", lining)
        if "ThresholdThickness" in sizes:
            lengths["ThresholdThickness"] = ("IfcNonNegativeLengthMeasure", sizes["ThresholdThickness"])
        return [
            draft.properties.definition(f"lining of {form.key}", f"Pset_{kind}LiningProperties", lengths),
            draft.properties.definition(f"panel of {form.key}", f"Pset_{kind}PanelProperties", _panel_values(panel)),
        ]
    return [
        ifc.root(f"Ifc{kind}LiningProperties", f"lining of {form.key}", "Lining", **sizes),
        ifc.root(f"Ifc{kind}PanelProperties", f"panel of {form.key}", "Panel", **panel),
    ]


def _panel_values(panel: dict[str, Any]) -> dict[str, Value | None]:
    """A panel's sizes and words as properties; a word that the property set does not know is left out."""
    made: dict[str, Value | None] = {}
    for name, value in panel.items():
        if isinstance(value, str):
            made[name] = None if (name, value) == ("OperationType", "NOTDEFINED") else (ENUMERATED, value)
        elif name == "PanelWidth":
            made[name] = ("IfcNormalisedRatioMeasure", value)
        else:
            made[name] = ("IfcPositiveLengthMeasure", value)
    return made


def _keep(
    draft: Draft,
    ifc_class: str,
    kind: str,
    form: Form,
    representations: list[Entity],
    properties: list[Entity],
    **values: Any,
) -> Shared:
    ifc = draft.ifc
    maps = [ifc.add("IfcRepresentationMap", axes(ifc, (0.0, 0.0, 0.0)), made) for made in representations]
    entity = ifc.root(
        ifc_class,
        f"type {form.key}",
        f"{form.kind.capitalize()} {form.width} x {form.height} mm",
        HasPropertySets=properties,
        RepresentationMaps=maps,
        PredefinedType=kind,
        ParameterTakesPrecedence=False,
        **values,
    )
    return draft.types.keep(form.key, entity)
