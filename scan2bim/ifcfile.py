"""Opening an IFC file of anybody's."""

from __future__ import annotations

import contextlib
import io
import os
from pathlib import Path
from typing import Any

from scan2bim.absent import absent
from scan2bim.errors import DamagedFileError, InputError

# Grammars of view definitions and streams, which nobody asks for, take 70 ms to compile; that they are missing is told.
with absent("lark"), contextlib.redirect_stderr(io.StringIO()):
    import ifcopenshell

_SIGNATURE = b"ISO-10303-21"
_END = b"END-ISO-10303-21"
_TAIL = 4096
"""Bytes at the end of the file in which ``_END`` is to stand: some programs add comments."""
_ZIPPED = ".ifczip"
_ADVICE = "Give a model as .ifc, such as scan2bim convert writes with -o MODEL.ifc."


def open_ifc(path: Path) -> ifcopenshell.file:
    """The file. Raises InputError where there is none, DamagedFileError where it is no IFC file or cut off."""
    if path.suffix.lower() != _ZIPPED:
        _look(path)
    elif not path.is_file():
        raise InputError(path, "no such IFC file.", "Check the path.")
    try:
        file: Any = ifcopenshell.open(str(path))
    except Exception as error:  # RuntimeError, OSError, its own errors and KeyError, as the damage may be
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise DamagedFileError(path, f"cannot be read as IFC ({reason}).", "Export it again.") from error
    if not isinstance(file, ifcopenshell.file):
        raise DamagedFileError(path, "is no IFC file in STEP form.", "Export the model as .ifc.")
    return file


def _look(path: Path) -> None:
    """Whether the file begins and ends as IFC does: the parser takes what is cut off without a word."""
    if path.is_dir():
        raise InputError(path, "is a folder, an IFC file was expected.", _ADVICE)
    if not path.is_file():
        raise InputError(path, "no such IFC file.", "Check the path.")
    try:
        with path.open("rb") as file:
            head = file.read(64)
            file.seek(-min(_TAIL, file.seek(0, os.SEEK_END)), os.SEEK_END)
            tail = file.read()
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror}).", "Check the permissions.") from error
    if not head:
        raise DamagedFileError(path, "the file is empty (0 bytes).", "Copy or export it again.")
    if not head.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(_SIGNATURE):
        raise DamagedFileError(
            path, f"expected an IFC file ({_SIGNATURE.decode()}), but it does not start as one.", _ADVICE
        )
    if _END not in tail:
        raise DamagedFileError(path, f"expected {_END.decode()} at its end: the file is cut off.", "Copy it again.")
