"""Columns and beams of the model stage, and what all measured elements say of their scans and colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely.geometry import Polygon

from scan2bim.model.elements import Beam, Colour, Column, Dimension, Evidence, ScanSource
from scan2bim.model.ids import distinct, stable_id
from scan2bim.structure.shapes import BeamShape, ColumnShape, StructureShape


def columns_of(number: int, structure: StructureShape, sources: dict[int, ScanSource]) -> tuple[Column, ...]:
    """The columns of a storey."""
    shapes = structure.storeys[number].columns
    ids = distinct(stable_id("column", number, *Polygon(s.outline).centroid.coords[0]) for s in shapes)
    return tuple(
        _column(i, s, f"Column {number}.{k + 1:02d}", sources) for k, (i, s) in enumerate(zip(ids, shapes, strict=True))
    )


def _column(identifier: str, shape: ColumnShape, name: str, sources: dict[int, ScanSource]) -> Column:
    size = f"{shape.size[0]:.3f} m across" if shape.section == "round" else "{:.3f} x {:.3f} m".format(*shape.size)
    return Column(
        id=identifier,
        name=name,
        confidence=round(min(0.97, 0.6 + 0.37 * shape.coverage), 3),
        evidence=Evidence(
            points=shape.points,
            rms=shape.rms,
            coverage=shape.coverage,
            scans=seen_by(shape.stations, sources),
            sentence=f"{shape.section} column, {size}, seen on {shape.coverage:.0%} of its outline, {shape.points} "
            f"points, RMS {shape.rms * 1000:.0f} mm",
        ),
        colour=linear(shape.colour),
        outline=shape.outline,
        base=shape.base,
        height=Dimension(
            value=round(max(shape.top - shape.base, 0.3), 4),
            source="measured" if shape.top_seen else "assumed",
            sigma=0.005 if shape.top_seen else None,
        ),
        section=shape.section,
    )


def beams_of(number: int, structure: StructureShape) -> tuple[Beam, ...]:
    """The downstand beams of a storey."""
    shapes = structure.storeys[number].beams
    ids = distinct(stable_id("beam", number, *Polygon(s.outline).centroid.coords[0]) for s in shapes)
    return tuple(_beam(i, s, f"Beam {number}.{k + 1:02d}") for k, (i, s) in enumerate(zip(ids, shapes, strict=True)))


def _beam(identifier: str, shape: BeamShape, name: str) -> Beam:
    drop = shape.top - shape.base
    return Beam(
        id=identifier,
        name=name,
        confidence=round(min(0.95, 0.5 + 0.45 * shape.coverage), 3),
        evidence=Evidence(
            coverage=shape.coverage,
            sentence=f"hangs {drop:.2f} m below the ceiling over {shape.size[0]:.2f} m, {shape.size[1]:.2f} m wide; "
            f"underside seen on {shape.coverage:.0%}",
        ),
        outline=shape.outline,
        base=shape.base,
        height=Dimension(value=round(drop, 4), source="measured", sigma=0.005),
    )


def seen_by(stations: Sequence[int], sources: dict[int, ScanSource]) -> tuple[str, ...]:
    """Ids of the scans of these stations."""
    return tuple(sources[s].id for s in stations if s in sources)


def linear(rgb: tuple[int, int, int]) -> Colour:
    """8-bit sRGB to linear 0-1."""
    c = np.array(rgb) / 255.0
    value = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return (round(float(value[0]), 4), round(float(value[1]), 4), round(float(value[2]), 4))
