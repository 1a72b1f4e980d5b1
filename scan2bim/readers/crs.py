"""Coordinate reference systems: their name and linear unit from WKT or GeoTIFF keys, without a projection library."""

from __future__ import annotations

import re

FOOT = 0.3048
SURVEY_FOOT = 1200 / 3937
_UNIT_CODES = {9001: 1.0, 9002: FOOT, 9003: SURVEY_FOOT}
"""EPSG codes of linear units, metres each."""
_NAME = re.compile(r'^\s*\w+\s*[\[(]\s*"([^"]*)"')
_AUTHORITY = re.compile(r'(?:AUTHORITY|ID)\s*[\[(]\s*"(\w+)"\s*,\s*"?(\w+)"?\s*[\])]')
_UNIT = re.compile(r'\b(?:LENGTHUNIT|UNIT)\s*[\[(]\s*"([^"]*)"\s*,\s*([0-9.eE+-]+)')
_PROJECTED = re.compile(r"PROJCS|PROJCRS|PROJECTEDCRS|ENGCRS|LOCAL_CS|ENGINEERINGCRS")


def crs_name(wkt: str) -> str:
    """Name of a CRS given as WKT, with its code where it has one; other text is given back shortened."""
    text = wkt.replace("\0", " ").strip()
    found = _NAME.match(text)
    if found is None:
        return " ".join(text.split())[:120]
    projected = _PROJECTED.search(text)
    named = _NAME.match(text[projected.start() :]) if projected else None
    code = _code(text, projected.start()) if projected else _code(text, 0)
    name = (named or found).group(1)
    return f"{name} ({code})" if code else name


def _code(text: str, start: int) -> str:
    """The authority's code of the bracket that opens at ``start``: the last one directly inside it."""
    codes = [(match.start(), f"{match[1]}:{match[2]}") for match in _AUTHORITY.finditer(text, start)]
    opened = [position for position, _ in codes if _depth(text, start, position) == 1]
    return next((code for position, code in codes if opened and position == opened[-1]), "")


def _depth(text: str, start: int, end: int) -> int:
    part = text[start:end]
    return part.count("[") + part.count("(") - part.count("]") - part.count(")")


def wkt_unit(wkt: str) -> float | None:
    """Metres per unit of a projected or local CRS given as WKT, None where it states none or is in degrees."""
    projected = _PROJECTED.search(wkt)
    if projected is None:
        return None
    lengths = [match for match in _UNIT.finditer(wkt, projected.start()) if "deg" not in match[1].lower()]
    inside = [
        match
        for match in lengths
        if _depth(wkt, projected.start(), match.start()) >= 1 and "radian" not in match[1].lower()
    ]
    return _plausible(float(inside[-1][2])) if inside else None


def _plausible(unit: float) -> float | None:
    return unit if 1e-4 < unit < 10 else None


def geotiff_crs(keys: dict[int, int], citation: str) -> tuple[str | None, float | None]:
    """Name and unit from GeoTIFF keys (id to value) and their citation."""
    code = keys.get(3072, keys.get(2048, 0))
    name = citation.split("|", maxsplit=1)[0].strip() or None
    if 0 < code < 32767:
        name = f"{name} (EPSG:{code})" if name else f"EPSG:{code}"
    return name, _UNIT_CODES.get(keys.get(3076, 0))
