"""From what a person names (files, folders, patterns) to the list of files to read."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from scan2bim.errors import ClosedFormatError, InputError, reason
from scan2bim.readers.formats import CLOSED, LOOSE_SUFFIXES, SUFFIXES, looks_like_points, read_head

_WILDCARDS = re.compile(r"[*?\[]")


def find_inputs(paths: Sequence[Path | str]) -> list[Path]:
    """The files that the paths stand for, each once, as given; within a folder sorted naturally (2 before 10).

    A path is a file, a folder (searched through, known suffixes only) or a glob pattern. Scans in a vendor's closed
    format that lie among readable ones are listed too: reading their headers says what they are. Raises InputError
    where a path is missing or holds no point cloud, ClosedFormatError where it is or only holds a closed format.
    """
    if not paths:
        raise InputError("(nothing)", "no scans were given.", "Name a file, a folder or a pattern.")
    found: dict[Path, Path] = {}
    for path in paths:
        for file in _expand(Path(path)):
            found.setdefault(file.resolve(), file)
    return list(found.values())


def one_a_kind(errors: Sequence[InputError]) -> list[InputError]:
    """The errors, those of closed files of one kind in one folder as one: a project may hold hundreds of them."""
    kinds: dict[object, list[InputError]] = {}
    for place, error in enumerate(errors):
        closed = isinstance(error, ClosedFormatError)
        kinds.setdefault((error.path.parent, error.problem) if closed else place, []).append(error)
    return [_with_count(group) for group in kinds.values()]


def _with_count(alike: Sequence[InputError]) -> InputError:
    first = alike[0]
    if len(alike) == 1:
        return first
    problem = f"{first.problem.removesuffix('.')} ({len(alike)} such files in {first.path.parent})."
    return type(first)(first.path, problem, first.advice)


def natural_key(path: Path) -> tuple[tuple[tuple[int, int, str], ...], ...]:
    """A sort key under which ``scan2`` comes before ``scan10``, folder by folder."""
    return tuple(_key_of_name(part) for part in path.parts)


def _key_of_name(name: str) -> tuple[tuple[int, int, str], ...]:
    words = re.split(r"([0-9]+)", name.lower())
    return tuple((0, int(word), "") if word.isdecimal() else (1, 0, word) for word in words if word)


def _expand(path: Path) -> list[Path]:
    try:
        if path.is_dir():
            return _search(path)
        if path.exists():
            _refuse([path], path)
            return [path]
        if _WILDCARDS.search(str(path)):
            return _match(path)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be opened: {reason(error)}.", "Check the path and the permissions.") from error
    raise InputError(path, "no such file or folder.", "Check the path; quote patterns such as 'scans/*.e57'.")


def _search(folder: Path) -> list[Path]:
    closed_folder = CLOSED.get(folder.suffix.lower())
    if closed_folder is not None:
        raise ClosedFormatError(folder, f"{closed_folder.what}, cannot be read.", closed_folder.advice)
    next(folder.iterdir(), None)  # rglob is silent about a folder that may not be read
    files = [file for file in sorted(folder.rglob("*"), key=natural_key) if not _hidden(file, folder)]
    known = [file for file in files if file.is_file() and _is_cloud(file)]
    closed = [file for file in files if _is_closed_scan(file)]
    if not known:
        _refuse(closed, folder)
        raise InputError(folder, "no point cloud found in this folder.", f"Files read are {', '.join(SUFFIXES)}.")
    return known + closed


def _match(pattern: Path) -> list[Path]:
    root = Path(pattern.anchor) if pattern.anchor else Path()
    parts = pattern.parts[1:] if pattern.anchor else pattern.parts
    files = sorted((file for file in root.glob(str(Path(*parts))) if file.is_file()), key=natural_key)
    known = [file for file in files if file.suffix.lower() in SUFFIXES]
    closed = [file for file in files if _is_closed_scan(file)]
    if not known:
        _refuse(closed, pattern)
        raise InputError(pattern, "no point cloud matches this pattern.", f"Files read are {', '.join(SUFFIXES)}.")
    return known + closed


def _hidden(file: Path, folder: Path) -> bool:
    return any(part.startswith((".", "__MACOSX")) for part in file.relative_to(folder).parts)


def _is_cloud(file: Path) -> bool:
    suffix = file.suffix.lower()
    if suffix not in LOOSE_SUFFIXES:
        return suffix in SUFFIXES
    return file.stat().st_size > 0 and looks_like_points(read_head(file))


def _is_closed_scan(file: Path) -> bool:
    closed = CLOSED.get(file.suffix.lower())
    if closed is None:
        return False
    return closed.scan or Path(file.stem).suffix.lower() in SUFFIXES


def _refuse(files: Iterable[Path], named: Path) -> None:
    """Raises ClosedFormatError for the first closed file, saying how many more there are."""
    closed = [file for file in files if file.suffix.lower() in CLOSED]
    if not closed:
        return
    first = CLOSED[closed[0].suffix.lower()]
    more = f" ({len(closed)} such files in {named})" if len(closed) > 1 else ""
    raise ClosedFormatError(closed[0], f"{first.what}, cannot be read{more}.", first.advice)
