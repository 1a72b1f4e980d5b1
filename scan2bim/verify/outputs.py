"""Writing the report's folder: each file appears whole or not at all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from scan2bim.verify.result import dump_report

if TYPE_CHECKING:
    from scan2bim.verify.build import Found

Writer = Callable[["Found", Path], None]


def write_report(found: Found, folder: Path, extras: tuple[str, ...]) -> tuple[Path, ...]:
    """Write all outputs into ``folder`` and give their paths. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    writers: dict[str, Writer] = {"report.json": _json}
    written: list[Path] = []
    for name, writer in writers.items():
        path = folder / name
        temporary = folder / f".{name}.tmp"
        try:
            writer(found, temporary)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
        written.append(path)
    return tuple(written)


def _json(found: Found, path: Path) -> None:
    path.write_text(dump_report(found.report), encoding="utf-8")
