"""Stable identifiers: the same key gives the same identifier on every run and every machine.

Identifiers of elements come from what the element is: its kind, its storey's index and its geometry on a coarse grid,
so that noise below the grid does not rename a wall. IFC's own 22 character form is made from them.
"""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral, Real
from uuid import UUID, uuid5

NAMESPACE = UUID("c5f1a6d2-5f0b-5a53-9d0e-3f0c1c7e2b11")
"""Root of all identifiers of this program. A change renames every element of every model."""

GRID = 0.25
"""Metres. Lengths in a key are rounded to this: far above what two scans of one thing differ by, so that few lengths
fall on either side of a line of the grid; what then has one key is told apart by ``distinct``."""

_IFC_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"

KeyPart = object
"""A part of a key: text, an integer, a length in metres, or a sequence of these."""


def stable_id(kind: str, *key: KeyPart) -> str:
    """The identifier (a UUID as text) of the thing of this kind with this key.

    Text and integers count as they are, floats are lengths in metres and are rounded to ``GRID``, sequences and arrays
    count part by part: ``stable_id("wall", storey_index, start, end)``.
    """
    return str(uuid5(NAMESPACE, "/".join([kind, *(_text(part) for part in key)])))


def distinct(ids: Iterable[str]) -> tuple[str, ...]:
    """The identifiers in the same order, each repeated one replaced by a new one made from it and its count.

    For elements that fall into the same cell of the grid. Stable as long as the order is.
    """
    seen: dict[str, int] = {}
    out: list[str] = []
    for name in ids:
        count = seen.get(name, 0)
        seen[name] = count + 1
        out.append(name if count == 0 else stable_id("again", name, count))
    return tuple(out)


def ifc_guid(identifier: str) -> str:
    """The 22 characters that IFC writes for an identifier: of the UUID itself, or of one made from any other text."""
    number = _uuid(identifier).int
    digits = [_IFC_DIGITS[(number >> shift) & 63] for shift in range(126, -1, -6)]
    return "".join(digits)


def _uuid(identifier: str) -> UUID:
    try:
        value = UUID(identifier)
    except ValueError:
        return uuid5(NAMESPACE, identifier)
    return value if str(value) == identifier else uuid5(NAMESPACE, identifier)


def _text(part: KeyPart) -> str:
    if isinstance(part, str):
        return part
    if isinstance(part, Integral):
        return str(int(part))
    if isinstance(part, Real):
        return f"{round(float(part) / GRID)}g"
    if isinstance(part, Iterable):
        return "(" + ",".join(_text(p) for p in part) + ")"
    raise TypeError(f"a key of an identifier is made of text, numbers and sequences, not {type(part).__name__}")
