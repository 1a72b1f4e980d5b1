"""Writing the report's folder: each file appears whole or not at all."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scan2bim.verify.bcf import Topic, write_bcf
from scan2bim.verify.classified import write_classified, write_remainder
from scan2bim.verify.html import page
from scan2bim.verify.ifc_copy import write_copy
from scan2bim.verify.pictures import Surroundings, deviation_map
from scan2bim.verify.result import ElementResult, dump_report

if TYPE_CHECKING:
    from scan2bim.verify.build import Found

Writer = Callable[[Path], None]

MOST_PICTURES = 400
"""Pictures in the page, of the elements that deviate most: some 2 kB each."""


EXTRAS: dict[str, tuple[str, Callable[[Found, Path], None]]] = {
    "classified": ("classified.laz", write_classified),
    "remainder": ("remainder.laz", write_remainder),
}
"""Further outputs by name: file and writer."""


def write_report(
    found: Found, folder: Path, extras: Sequence[str], others: Sequence[tuple[str, Writer]] = ()
) -> tuple[Path, ...]:
    """Write all outputs, those of ``EXTRAS`` asked for and others (file, writer) into ``folder`` and give their paths.

    Raises OSError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures = _pictures(found)
    stem = Path(found.report.model_file).stem
    writers: dict[str, Writer] = {
        "report.json": lambda path: _text(path, dump_report(found.report)),
        "report.html": lambda path: _text(path, page(found, pictures)),
        "findings.bcf": lambda path: _bcf(found, pictures, path),
        f"{stem}.verified.ifc": lambda path: write_copy(found.model.path, found.report, path),
    }
    for name, write in (EXTRAS[extra] for extra in EXTRAS if extra in extras):
        writers[name] = lambda path, write=write: write(found, path)
    return tuple(_whole(folder / name, writer) for name, writer in (*writers.items(), *others))


def _whole(path: Path, writer: Writer) -> Path:
    temporary = path.with_name(f".unfinished.{path.name}")
    try:
        writer(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _pictures(found: Found) -> dict[str, bytes]:
    """PNG by GlobalId of the elements that deviate most."""
    surface, elements = found.surface, found.model.elements
    order, ends = surface.table.by_element(len(elements))
    place = {e.guid: i for i, e in enumerate(elements) if e.role == "compared"}
    patch = {e.guid: i for i, e in enumerate(elements) if e.role == "patch"}
    place |= {e.guid: patch[e.host] for e in elements if e.role == "fill" and e.host in patch}
    out: dict[str, bytes] = {}
    for result in sorted(found.report.elements, key=_worst)[:MOST_PICTURES]:
        number = place.get(result.guid)
        if number is not None:
            picture = deviation_map(surface, order[ends[number] : ends[number + 1]], result.tolerance)
            if picture is not None:
                out[result.guid] = picture
    return out


def _worst(result: ElementResult) -> float:
    fault = 1.0 if result.status in ("out_of_tolerance", "missing") else 0.0
    return -fault - (result.deviation.p95 if result.deviation else 0.0)


def _bcf(found: Found, pictures: dict[str, bytes], path: Path) -> None:
    report = found.report
    vertices = {e.guid: e.vertices for e in found.model.elements if e.role in ("compared", "fill")}
    around = Surroundings(found.model.elements)
    topics = [
        Topic(
            key=fault.guid,
            title=f"{fault.ifc_class[3:]} {fault.name or fault.guid}: {fault.status.replace('_', ' ')}",
            description=fault.reason,
            label=fault.status.replace("_", " "),
            guids=(fault.guid,),
            box=_box(vertices[fault.guid]),
            snapshot=pictures.get(fault.guid) or around.picture(_box(vertices[fault.guid])),
        )
        for fault in report.faults()
        if fault.guid in vertices
    ]
    topics += [
        Topic(a.id, f"Not in the model: {a.guess}", a.sentence, "addition", (), box, around.picture(box))
        for a, box in ((a, np.array([a.lower, a.upper])) for a in report.additions if a.guess != "object")
    ]
    date = datetime.datetime.fromtimestamp(found.model.path.stat().st_mtime, datetime.UTC)
    write_bcf(topics, path, report.model_name, date.isoformat(timespec="seconds"))


def _box(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([vertices.min(axis=0), vertices.max(axis=0)])
