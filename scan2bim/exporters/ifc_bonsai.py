"""What Bonsai keeps of its own doors and windows, so that these types are edited there as if drawn there."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any, Final

from scan2bim.exporters.ifc_draft import Draft
from scan2bim.exporters.ifc_file import Entity

_DEFAULTS: Final[Mapping[str, Mapping[str, float]]] = {
    "Door": {"TransomThickness": 0.0, "TransomOffset": 1.525, "CasingDepth": 0.005, "ThresholdOffset": 0.0},
    "Window": {},
}
"""What the library draws with where it is told nothing else; Bonsai has defaults of its own. Metres."""
_PANEL: Final = {"PanelWidth": 1.0, "FrameDepth": 0.035, "FrameThickness": 0.035}


def bonsai_set(
    draft: Draft, kind: str, key: str, use: str, size: tuple[float, float], lining: Mapping[str, float], panel: Any
) -> Entity:
    """The property set of a type that the library drew: its drawing's parameters as JSON.

    kind: Door or Window; use: as the library calls it. size: width and height, metres. panel: a mapping, of a window
    a list of them.
    """
    data: dict[str, Any] = {
        f"{kind.lower()}_type": use,
        "overall_height": size[1],
        "overall_width": size[0],
        "lining_properties": _snake({**_DEFAULTS[kind], **lining}),
        "panel_properties": (
            _snake({name: [part[name] for part in panel] for name in panel[0]})
            if isinstance(panel, list)
            else _snake({**_PANEL, **panel})
        ),
    }
    text = json.dumps(data, sort_keys=True)
    return draft.properties.definition(f"Bonsai's data of {key}", f"BBIM_{kind}", {"Data": ("IfcText", text)})


def _snake(values: Mapping[str, Any]) -> dict[str, Any]:
    """Names as Bonsai has them: LiningToPanelOffsetX is lining_to_panel_offset_x there."""
    named = {re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower(): value for name, value in values.items()}
    return {{"panel_width": "panel_width_ratio"}.get(name, name): value for name, value in named.items()}
