"""How much of the building's inside the scans saw, summed over the faces that bound its spaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from scan2bim.model.elements import Building, FaceView, ScanSource, Storey

NOTABLE = 0.005
"""Metres from which on a scan's offset is worth a word: beyond what registration usually leaves."""
SURE = 3.0
"""Standard deviations that it must be, too."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Square metres of faces that bound spaces, openings left out, and the shares of them."""

    area: float
    seen: float
    occluded: float
    unseen: float


@dataclass(frozen=True, slots=True)
class BuildingCoverage:
    """Of all faces, and of those of the walls, the floors and the ceilings, roof planes among them."""

    total: Coverage
    walls: Coverage
    floors: Coverage
    ceilings: Coverage


def coverage_of(building: Building) -> BuildingCoverage | None:
    """The coverage of a building; None where the model does not tell."""
    walls = [view for storey in building.storeys for view in _wall_views(storey)]
    floors = [view for storey in building.storeys for slab in storey.slabs for view in slab.evidence.faces]
    over = [part for storey in building.storeys for part in (*storey.coverings, *storey.roofs)]
    ceilings = [view for part in over for view in part.evidence.faces]
    total = _summed([*walls, *floors, *ceilings])
    return BuildingCoverage(total, _summed(walls), _summed(floors), _summed(ceilings)) if total.area else None


def coverage_line(building: Building) -> str | None:
    """The coverage in words; None where the model does not tell."""
    found = coverage_of(building)
    if found is None:
        return None
    parts = (("walls", found.walls), ("floors", found.floors), ("ceilings", found.ceilings))
    each = ", ".join(f"{name} {part.seen:.0%}" for name, part in parts if part.area)
    whole = found.total
    return (
        f"{whole.seen:.0%} of {whole.area:,.0f} m2 inside seen ({each}), "
        f"{whole.occluded:.0%} hidden by things, {whole.unseen:.0%} never seen"
    )


def scan_offset(scan: ScanSource) -> float | None:
    """Length of a scan's offset from the others, metres, as far as it is known."""
    if scan.residual is None or all(part is None for part in scan.residual.offset):
        return None
    return sum(part**2 for part in scan.residual.offset if part is not None) ** 0.5


def worst_scan_line(building: Building) -> str | None:
    """The scan that is farthest off the others, in words, where it is off by more than ``NOTABLE``."""
    off = [(length, scan) for scan in building.scans if (length := scan_offset(scan)) is not None and _is_notable(scan)]
    if not off:
        return None
    length, scan = max(off, key=lambda item: item[0])
    residual = scan.residual
    parts = zip("xyz", residual.offset if residual else (), residual.sigma if residual else (), strict=False)
    each = ", ".join(
        f"{axis} {1000 * o:+.0f} ± {1000 * s:.0f}" for axis, o, s in parts if o is not None and s is not None
    )
    more = f", and {len(off) - 1} more by over {1000 * NOTABLE:.0f} mm" if len(off) > 1 else ""
    return f"{scan.name} lies {1000 * length:.0f} mm off the other scans ({each} mm){more}: check its registration."


def _is_notable(scan: ScanSource) -> bool:
    residual = scan.residual
    return residual is not None and any(
        o is not None and s is not None and abs(o) > max(NOTABLE, SURE * s)
        for o, s in zip(residual.offset, residual.sigma, strict=True)
    )


def _wall_views(storey: Storey) -> Iterator[FaceView]:
    """Of the sides of walls that have a space before them."""
    for wall in storey.walls:
        beside = {"left": wall.left_spaces, "right": wall.right_spaces}
        yield from (view for view in wall.evidence.faces if beside.get(view.side))


def _summed(views: list[FaceView]) -> Coverage:
    area = sum(view.area or 0.0 for view in views)
    seen, occluded, unseen = (
        sum((view.area or 0.0) * getattr(view, share) for view in views) / area if area else 0.0
        for share in ("seen", "occluded", "unseen")
    )
    return Coverage(area, seen, occluded, unseen)
