"""Which format a file holds: by its first bytes, by its text, and only then by its name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scan2bim.errors import ClosedFormatError, DamagedFileError, InputError, reason

Format = Literal["E57", "LAS", "PLY", "PCD", "PTS", "PTX", "TEXT"]

SUFFIXES: dict[str, Format] = {
    ".e57": "E57",
    ".las": "LAS",
    ".laz": "LAS",
    ".ply": "PLY",
    ".pcd": "PCD",
    ".pts": "PTS",
    ".ptx": "PTX",
    ".xyz": "TEXT",
    ".txt": "TEXT",
    ".csv": "TEXT",
    ".asc": "TEXT",
}
"""Suffixes (lower case) that are read, and the format that each promises. COPC files are named .copc.laz."""

LOOSE_SUFFIXES = frozenset({".txt", ".csv", ".asc"})
"""Suffixes that other things than points carry too: in a folder, such a file counts only if it begins with numbers."""

_RECAP = "In Autodesk ReCap open the project and choose Export > E57, one file per scan."
_FARO = "In FARO SCENE choose Export > Scans > E57, structured, with scanner positions."
_ZF = "In Z+F LaserControl or LaserControl Scout choose File > Export > E57, one file per scan."
_LEICA = (
    "In Leica Cyclone REGISTER 360 or Cyclone choose Export > E57 (separate setups) or PTX; "
    "JetStream and TruView can export E57 too."
)
_RIEGL = "In RIEGL RiSCAN PRO choose Export > Point cloud > E57, one file per scan position, registered."
_TRIMBLE = "In Trimble RealWorks choose Export > E57, gridded, with stations."
_TOPCON = "In Topcon MAGNET Collage choose Export > E57."
_REVIT = "This is a model, no scan. Give the point cloud that it was made from, as E57 or LAZ."
_DRAWING = "This is a drawing, no scan. Give the point cloud that it was drawn from, as E57 or LAZ."
_SKETCHUP = "This is a SketchUp model, no scan. Give the point cloud that it was drawn from, as E57 or LAZ."
_UNPACK = "Unpack it first and give the files in it."


@dataclass(frozen=True, slots=True)
class Closed:
    """A format that is not read: whose it is, and the way out of it."""

    what: str
    advice: str
    scan: bool = True


CLOSED: dict[str, Closed] = {
    ".rcp": Closed("an Autodesk ReCap project, a closed format", _RECAP),
    ".rcs": Closed("an Autodesk ReCap scan, a closed format", _RECAP),
    ".fls": Closed("a FARO scan, a closed format", _FARO),
    ".lsproj": Closed("a FARO SCENE project, a closed format", _FARO),
    ".fws": Closed("a FARO SCENE workspace, a closed format", _FARO),
    ".zfs": Closed("a Zoller+Froehlich scan, a closed format", _ZF),
    ".zfprj": Closed("a Zoller+Froehlich project, a closed format", _ZF),
    ".lgs": Closed("a Leica LGS file, a closed format", _LEICA),
    ".lgsx": Closed("a Leica LGSx file, a closed format", _LEICA),
    ".imp": Closed("a Leica Cyclone database, a closed format", _LEICA),
    ".rxp": Closed("a RIEGL scan stream, a closed format", _RIEGL),
    ".rdbx": Closed("a RIEGL point database, a closed format", _RIEGL),
    ".rdb": Closed("a RIEGL point database, a closed format", _RIEGL),
    ".rwp": Closed("a Trimble RealWorks project, a closed format", _TRIMBLE),
    ".tzf": Closed("a Trimble scan, a closed format", _TRIMBLE),
    ".tzs": Closed("a Trimble scan, a closed format", _TRIMBLE),
    ".clr": Closed("a Topcon scan, a closed format", _TOPCON),
    ".cl3": Closed("a Topcon scan, a closed format", _TOPCON),
    ".rvt": Closed("an Autodesk Revit model", _REVIT, scan=False),
    ".rfa": Closed("an Autodesk Revit family", _REVIT, scan=False),
    ".dwg": Closed("an AutoCAD drawing", _DRAWING, scan=False),
    ".dxf": Closed("an AutoCAD drawing", _DRAWING, scan=False),
    ".skp": Closed("a SketchUp model", _SKETCHUP, scan=False),
    ".gz": Closed("a compressed file", _UNPACK, scan=False),
    ".zip": Closed("an archive", _UNPACK, scan=False),
    ".7z": Closed("an archive", _UNPACK, scan=False),
    ".rar": Closed("an archive", _UNPACK, scan=False),
    ".tar": Closed("an archive", _UNPACK, scan=False),
    ".bz2": Closed("a compressed file", _UNPACK, scan=False),
    ".xz": Closed("a compressed file", _UNPACK, scan=False),
    ".zst": Closed("a compressed file", _UNPACK, scan=False),
}
"""Suffixes (lower case) that are refused.

``scan`` is False where a folder of scans may well hold such a file by the way.
"""

_MAGIC: tuple[tuple[bytes, Format], ...] = (
    (b"ASTM-E57", "E57"),
    (b"LASF", "LAS"),
    (b"ply\n", "PLY"),
    (b"ply\r", "PLY"),
)
_FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"\x1f\x8b", "a gzip file", _UNPACK),
    (b"PK\x03\x04", "a zip archive", _UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", _UNPACK),
    (b"Rar!", "a rar archive", _UNPACK),
    (b"BZh", "a bzip2 file", _UNPACK),
    (b"\xfd7zXZ", "an xz file", _UNPACK),
    (b"\x28\xb5\x2f\xfd", "a zstd file", _UNPACK),
    (b"AC10", "an AutoCAD drawing", _DRAWING),
    (
        b"\xd0\xcf\x11\xe0",
        "a compound document, such as a Revit or Office file",
        "Export the point cloud as E57 or LAZ.",
    ),
    (b"%PDF", "a PDF document", "Give the point cloud itself, as E57 or LAZ."),
    (b"\x89PNG", "a PNG picture", "Give the point cloud itself, as E57 or LAZ."),
    (b"\xff\xd8\xff", "a JPEG picture", "Give the point cloud itself, as E57 or LAZ."),
    (b"ISO-10303-21", "a STEP or IFC model", "Give the point cloud that it was made from, as E57 or LAZ."),
    (b"<", "an XML or HTML page", "Perhaps a download failed: fetch the file again."),
    (b"{", "a JSON file", "Give the point cloud itself, as E57 or LAZ."),
    (b"version https://git-lfs", "a Git LFS pointer, not the file itself", "Run 'git lfs pull' to fetch the file."),
    (b"\xff\xfe", "UTF-16 text", "Save it as plain text (ASCII or UTF-8)."),
    (b"\xfe\xff", "UTF-16 text", "Save it as plain text (ASCII or UTF-8)."),
)
_HEAD = 4096
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?$|[+-]?(nan|inf)", re.IGNORECASE)
_SPLIT = re.compile(r"[;\s]+|,(?=\s|[^\d]|$)|(?<=[^\d]),")


def detect(path: Path) -> tuple[Format, tuple[str, ...]]:
    """The format that the file's content shows, with a note where its name promised another.

    Raises ClosedFormatError, DamagedFileError (empty, unrecognisable) or InputError (missing, unreadable).
    """
    _refuse_suffix(path)
    head = read_head(path)
    promised = SUFFIXES.get(path.suffix.lower())
    found = _by_content(path, head, promised)
    if promised is None or found == promised or (found == "TEXT" and promised == "PTS"):
        return found, ()
    return found, (f"named {path.suffix} but holds {found}: read as {found}",)


def read_head(path: Path) -> bytes:
    """The first 4 KiB of a file. Raises InputError where there is no such file, DamagedFileError where it is empty."""
    try:
        if path.is_dir():
            raise InputError(
                path, "is a folder, a file was expected.", "Give the files in it, or the folder to find_inputs."
            )
        if not path.is_file():
            raise InputError(path, "no such file.", "Check the path.")
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be opened: {reason(error)}.", "Check the path and the permissions.") from error
    if not head:
        raise DamagedFileError(path, "the file is empty (0 bytes).", "Copy or export it again.")
    return head


def _refuse_suffix(path: Path) -> None:
    closed = CLOSED.get(path.suffix.lower())
    if closed is not None:
        raise ClosedFormatError(path, f"{closed.what}, cannot be read.", closed.advice)


def _by_content(path: Path, head: bytes, promised: Format | None) -> Format:
    for magic, form in _MAGIC:
        if head.startswith(magic):
            return form
    if _is_pcd(head):
        return "PCD"
    for magic, what, advice in _FOREIGN:
        if head.startswith(magic):
            raise DamagedFileError(path, f"expected {_promise(promised)}, but this is {what}.", advice)
    kind = text_kind(head)
    if kind is None or (
        promised in (None, "E57", "LAS", "PLY", "PCD") and kind == "TEXT" and not looks_like_points(head)
    ):
        raise DamagedFileError(
            path,
            f"expected {_promise(promised)}, but the file begins with {head[:12]!r}.",
            "It is damaged or has the wrong name: copy or export it again.",
        )
    return kind


def _promise(promised: Format | None) -> str:
    if promised is None:
        return "a point cloud (" + ", ".join(sorted(SUFFIXES)) + ")"
    if promised == "TEXT":
        return "a text file of points"
    return f"{'an' if promised in ('E57', 'LAS') else 'a'} {promised} file"


def _is_pcd(head: bytes) -> bool:
    if head.startswith((b"# .PCD", b"#.PCD")):
        return True
    return (
        re.search(rb"^FIELDS\s", head, re.MULTILINE) is not None
        and re.match(rb"\s*(#|VERSION|FIELDS)", head) is not None
    )


def text_kind(head: bytes) -> Literal["PTS", "PTX", "TEXT"] | None:
    """What kind of text a file's first bytes are, or None where they are not text."""
    if b"\0" in head or sum(byte < 9 or 13 < byte < 32 for byte in head) > 0:
        return None
    lines = content_lines(head)[:12]
    counts = [len(_SPLIT.split(line.strip())) for line in lines]
    single = [
        count == 1 and re.fullmatch(r"\d+", line.strip()) is not None for count, line in zip(counts, lines, strict=True)
    ]
    if len(lines) >= 10 and single[0] and single[1] and counts[2:10] == [3, 3, 3, 3, 4, 4, 4, 4]:
        return "PTX"
    if single[:1] == [True] and (len(lines) == 1 or counts[1] >= 3 or single[1]):
        return "PTS"
    return "TEXT"


def content_lines(head: bytes) -> list[str]:
    """Whole lines of text from a file's first bytes, without byte-order mark, empty lines and comments."""
    text = head.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if len(head) >= _HEAD and len(lines) > 1:
        lines = lines[:-1]
    return [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "//", "%"))]


def looks_like_points(head: bytes) -> bool:
    """True where text, after at most one line of names, begins with lines of three or more numbers."""
    if text_kind(head) is None:
        return False
    lines = content_lines(head)
    return any(_is_row(line) for line in lines[:2]) and all(_is_row(line) for line in lines[1:8])


def _is_row(line: str) -> bool:
    words = [word for word in re.split(r"[\s;,]+", line.strip()) if word]
    return (len(words) >= 3 and all(_NUMBER.match(word) for word in words[:3])) or (
        len(words) == 1 and words[0].isdigit()
    )
