"""Folders beside an exported file that hold what belongs to it: layers, maps."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from scan2bim.errors import UsageError


def parts_folder(path: Path, kind: str) -> Path:
    """The folder beside ``path`` for its parts, of a name that is plain in any format: letters, digits, underscores."""
    stem = path.name.split(".", maxsplit=1)[0]
    return path.parent / f"{re.sub(r'[^A-Za-z0-9]+', '_', stem).strip('_') or 'building'}_{kind}"


def check_parts(new: Path, old: Path) -> None:
    """Raises UsageError where ``old``, which ``new`` is to replace, is no folder or holds other kinds of files."""
    if not old.exists():
        return
    kinds = {file.suffix for file in new.rglob("*") if file.is_file()}
    strange = [file for file in sorted(old.rglob("*")) if file.is_file() and file.suffix not in kinds]
    if not old.is_dir() or strange:
        found = f"holds {strange[0].relative_to(old)}" if strange else "is a file"
        raise UsageError(f"{old}: is to hold parts of an output, but {found}. Move it away or choose another output.")


def replace_parts(new: Path, old: Path) -> None:
    """Move the folder ``new`` to ``old``; what was there before is removed. Raises as ``check_parts`` does."""
    check_parts(new, old)
    if old.exists():
        aside = new.with_name(f"{new.name}.old")
        old.replace(aside)
        new.replace(old)
        shutil.rmtree(aside)
    else:
        new.replace(old)
