"""XYZ, TXT, CSV, ASC: one point a line, with or without a line of names, columns found by name or by their values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np

from scan2bim.cloud.scan import F64, Chunk, ScanHeader
from scan2bim.errors import DamagedFileError
from scan2bim.readers.lines import BLOCK, Columns, Span, TextScaling, look, read_rows, sample_rows, to_chunk
from scan2bim.readers.points import choose_origin, no_points, read_exactly, stamp

_LOOK = 4096
"""Rows looked at for the columns' meaning."""
_MOST_COLUMNS = 64
_COUNTED = 256 << 20
"""Bytes. In larger files the number of points is estimated from the lines' mean length, not counted."""
_ROLES: dict[str, str] = {
    **dict.fromkeys(("x", "easting", "east", "e", "rechtswert", "coordx", "xcoordinate", "pointx"), "x"),
    **dict.fromkeys(("y", "northing", "north", "n", "hochwert", "coordy", "ycoordinate", "pointy"), "y"),
    **dict.fromkeys(("z", "height", "elevation", "h", "hoehe", "coordz", "zcoordinate", "pointz"), "z"),
    **dict.fromkeys(("r", "red", "rf", "diffusered", "colorred", "colourred"), "r"),
    **dict.fromkeys(("g", "green", "gf", "diffusegreen", "colorgreen", "colourgreen"), "g"),
    **dict.fromkeys(("b", "blue", "bf", "diffuseblue", "colorblue", "colourblue"), "b"),
    **dict.fromkeys(("i", "intensity", "scalarintensity", "reflectance", "amplitude", "scalarfield"), "i"),
}
"""Names of columns, lower case without signs, and their meaning."""


def read_headers(path: Path) -> tuple[ScanHeader, ...]:
    """The header of the file's one cloud. Raises DamagedFileError where its lines are no points."""
    columns, span, scaling, notes = _look(*stamp(path))
    return (
        ScanHeader(
            path,
            0,
            path.stem,
            span.rows or 0,
            scaling.origin,
            has_colour=columns.rgb is not None,
            has_intensity=columns.intensity is not None,
            notes=notes,
        ),
    )


def read_chunks(header: ScanHeader, chunk_points: int) -> Iterator[Chunk]:
    """The points of the file."""
    columns, span, scaling, _ = _look(*stamp(header.path))
    for rows in read_rows(header.path, Span(span.start, span.end, None), columns, chunk_points):
        yield to_chunk(rows, columns, scaling)


def sample_points(header: ScanHeader, count: int) -> Chunk:
    """Points from stretches spread over the file."""
    columns, span, scaling, _ = _look(*stamp(header.path))
    return to_chunk(sample_rows(header.path, span, columns, count), columns, scaling)


@lru_cache(maxsize=256)
def _look(path: Path, size: int, changed: int) -> tuple[Columns, Span, TextScaling, tuple[str, ...]]:
    del changed
    head = read_exactly(path, 1 << 16)
    start, names, lines = _first_lines(head, size <= len(head))
    if not lines:
        raise no_points(path, "text")
    columns, note = find_columns(path, names, lines)
    span = Span(start, size, None)
    rows = sample_rows(path, span, columns, _LOOK)
    if len(rows) == 0:
        raise DamagedFileError(
            path, f"no line of {columns.count} numbers found.", "Export it again, or give it its right name."
        )
    scaling = look(rows, columns, choose_origin(rows[:, :3]))
    count, counted = _count_lines(path, start, size, lines)
    notes = (note,) if counted else (note, "the number of points is estimated from the file's size")
    return columns, Span(start, size, count), scaling, notes


def _first_lines(head: bytes, complete: bool) -> tuple[int, list[str], list[str]]:
    """(byte of the first row, names of columns or [], some lines of numbers) of a file's first bytes."""
    start = 3 if head.startswith(b"\xef\xbb\xbf") else 0
    names: list[str] = []
    rows: list[str] = []
    for raw in re.findall(rb"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+$", head[start:]):
        line = raw.decode("utf-8", errors="replace").strip()
        found = _names(line)
        if rows and (raw.endswith((b"\n", b"\r")) or complete):
            rows.append(line)
        elif not rows and (not line or line.startswith(("#", "/", "%")) or found or _lone_count(line)):
            names = found or names
            start += len(raw)
        elif not rows:
            rows.append(line)
    return start, names, [row for row in rows[:_LOOK] if row and not row.startswith(("#", "/", "%"))]


def _lone_count(line: str) -> bool:
    return re.fullmatch(r"\d+", line) is not None


def _names(line: str) -> list[str]:
    """The names in a line of names, such as ``//X,Y,Z,R,G,B``; an empty list where it is none."""
    bare = re.sub(r"\[[^]]*\]|\([^)]*\)", "", line.strip().lstrip("#/%").strip())
    words = [word for word in re.split(r"[\s,;]+", bare) if word]
    plain = [re.sub(r"[^a-z]", "", word.lower()) for word in words]
    letters = sum(
        bool(re.match(r"[\"']?[A-Za-z_]", word)) and not re.match(r"[+-]?(nan|inf)", word, re.IGNORECASE)
        for word in words
    )
    return plain if len(words) >= 3 and letters >= 3 else []


def find_columns(path: Path, names: list[str], lines: list[str]) -> tuple[Columns, str]:
    """The meaning of the columns, with a note that says so.

    Raises DamagedFileError where there are fewer than three.
    """
    decimal = "," if _has_decimal_comma(lines) else "."
    table = [_split(line, decimal) for line in lines[:256]]
    count = len(table[0])
    if not 3 <= count <= _MOST_COLUMNS:
        raise DamagedFileError(
            path,
            f"expected lines of x y z, found {lines[0][:60]!r}.",
            "Export it with three columns of numbers or more.",
        )
    roles = [_ROLES.get(name, "") for name in names] if len(names) == count else []
    if {"x", "y", "z"} <= set(roles):
        columns = _by_names(count, roles, decimal)
    else:
        columns = _by_values(count, np.array([row for row in table if len(row) == count]), decimal)
    return columns, "columns " + _describe(columns)


def _has_decimal_comma(lines: list[str]) -> bool:
    text = "\n".join(lines[:256])
    if "," not in text or "." in text:
        return False
    return ";" in text or all(re.fullmatch(r"[+-]?\d+(,\d+)?", word) for line in lines[:256] for word in line.split())


def _split(line: str, decimal: str) -> list[float]:
    parts = re.split(r"\s*;\s*|\s+" if decimal == "," else r"\s*[,;]\s*|\s+", line.strip())
    parts = parts[:-1] if parts and not parts[-1] else parts
    return [_float(part.replace(",", ".")) for part in parts]


def _float(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def _by_names(count: int, roles: list[str], decimal: str) -> Columns:
    place = {role: roles.index(role) for role in "xyzrgbi" if role in roles}
    rgb = (place["r"], place["g"], place["b"]) if {"r", "g", "b"} <= set(place) else None
    return Columns(count, (place["x"], place["y"], place["z"]), rgb, place.get("i"), decimal)


def _by_values(count: int, table: F64, decimal: str) -> Columns:
    """Coordinates, then colours where three columns look like them (whole or fractions), and one of intensity."""
    after = [_is_colour(table[:, column : column + 3]) for column in range(3, count - 2)]
    if count >= 6 and after[0] and not (count >= 7 and after[1] and not _is_whole_byte(table[:, 3:6])):
        return Columns(count, rgb=(3, 4, 5), intensity=6 if count == 7 else None, decimal=decimal)
    if count >= 7 and after[1]:
        return Columns(count, rgb=(4, 5, 6), intensity=3, decimal=decimal)
    return Columns(count, intensity=3 if count in (4, 5) else None, decimal=decimal)


def _is_colour(values: F64) -> bool:
    if not np.isfinite(values).all() or values.min() < 0:
        return False
    whole = bool((values == np.round(values)).all())
    return bool(whole and values.max() <= 65535) or bool(values.max() <= 1.0)


def _is_whole_byte(values: F64) -> bool:
    return bool((values == np.round(values)).all() and values.max() <= 255 and values.max() > 1)


def _describe(columns: Columns) -> str:
    meaning = dict(zip(columns.xyz, "xyz", strict=True))
    meaning |= dict(zip(columns.rgb or (), ("red", "green", "blue"), strict=False))
    if columns.intensity is not None:
        meaning[columns.intensity] = "intensity"
    sign = " (decimal comma)" if columns.decimal == "," else ""
    return "taken as " + " ".join(meaning.get(column, "-") for column in range(columns.count)) + sign


def _count_lines(path: Path, start: int, size: int, lines: list[str]) -> tuple[int, bool]:
    """(number of lines, whether it was counted rather than estimated)."""
    if size > _COUNTED:
        mean = sum(len(line) + 1 for line in lines) / len(lines)
        return int((size - start) / mean), False
    with path.open("rb") as file:
        file.seek(start)
        ends, last = 0, b"\n"
        while raw := file.read(BLOCK):
            ends, last = ends + (raw.count(b"\n") or raw.count(b"\r")), raw[-1:]
    return ends + (last not in b"\r\n"), True
