"""What all readers share: making chunks of raw arrays, choosing an origin, mapping foreign errors to ours."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from scan2bim.cloud.scan import F32, F64, U8, U16, Chunk
from scan2bim.errors import DamagedFileError, InputError, ResourceError, Scan2BimError

_Number = TypeVar("_Number", bound=np.generic)
Numbers = NDArray[np.integer] | NDArray[np.floating]

LIMIT = 1e9
"""File units.

No scan is larger than a thousand kilometres even in millimetres: what lies farther from the origin is no measurement.
"""

FAR = 1000.0
"""File units.

Up to here float32 keeps a tenth of a millimetre in metres; larger coordinates are taken down by an origin.
"""

START_SPREAD = 4
"""A sample of E57 is thinned from so many times its points at the scan's start: libE57 cannot jump to a record."""

ORIGIN_STEP = 100.0
"""File units. Origins are whole multiples of this, so that they are readable and exact."""


def choose_origin(*corners: NDArray[np.floating] | None) -> F64:
    """The (3,) origin to take off: zeros for small coordinates, else the corners' centre rounded to 100 units."""
    rows = [np.asarray(corner, np.float64).reshape(-1, 3) for corner in corners if corner is not None]
    points = np.concatenate(rows) if rows else np.zeros((0, 3))
    points = points[(np.abs(points) < 1e15).all(axis=1)]
    if len(points) == 0 or np.abs(points).max() <= FAR:
        return np.zeros(3)
    return np.round(np.median(points, axis=0) / ORIGIN_STEP) * ORIGIN_STEP


def measured(xyz: F32 | F64) -> NDArray[np.bool_] | None:
    """Which of (n, 3) coordinates are finite and within the limit, (n,) bool, or None where all are."""
    if xyz.size == 0 or (xyz.min() > -LIMIT and xyz.max() < LIMIT):
        return None
    with np.errstate(invalid="ignore"):
        inside = (xyz > -LIMIT) & (xyz < LIMIT)
    return inside[:, 0] & inside[:, 1] & inside[:, 2]


def make_chunk(
    xyz: F32,
    rgb: U8 | None = None,
    intensity: F32 | None = None,
    source: U16 | None = None,
    *,
    valid: NDArray[np.bool_] | None = None,
    misses: F32 | None = None,
) -> Chunk:
    """A chunk of the records that are valid (n,), finite and within the limit; the rest, less misses, is counted."""
    finite = measured(xyz)
    keep = finite if valid is None else valid if finite is None else valid & finite
    if intensity is not None:
        intensity = unit_range(intensity)
    if keep is None:
        return Chunk(xyz, rgb, intensity, source, misses)
    # Rows by number: a mask over the rows of (n, 3) costs five times as much.
    rows = np.flatnonzero(keep)
    kept = np.take(xyz, rows, axis=0)
    dropped = len(xyz) - len(kept) - (0 if misses is None else len(misses))
    return Chunk(
        kept,
        None if rgb is None else np.take(rgb, rows, axis=0),
        None if intensity is None else intensity[rows],
        None if source is None else source[rows],
        misses,
        dropped,
    )


def unit_range(values: F32) -> F32:
    """Intensities clipped to 0-1, in place; what is not a number becomes 0."""
    np.fmin(values, 1.0, out=values)
    np.fmax(values, 0.0, out=values)
    return values


def stretch(values: NDArray[np.generic], low: float, high: float) -> F32:
    """Values (n,) of any type as float32, with low at 0 and high at 1."""
    span = high - low if high > low else 1.0
    return ((values.astype(np.float64) - low) / span).astype(np.float32)


def guess_range(values: Numbers) -> tuple[float, float]:
    """Low and high of an intensity whose file does not state them, guessed from some values.

    Whole numbers and fractions in 0-1 are taken as they are; else the smallest usual range that holds them: 8, 11
    (Leica's
    -2048 to 2047), 12 or 16 bits; else their own range.
    """
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    if len(finite) == 0:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    for usual in ((0.0, 1.0), (0.0, 255.0), (-2048.0, 2047.0), (0.0, 4095.0), (0.0, 65535.0)):
        if usual[0] <= low and high <= usual[1]:
            return usual
    return low, high


def colour_scale(values: Numbers) -> float:
    """The factor that takes colours to 0-255, guessed from some values: fractions, bytes or 16-bit numbers."""
    high = float(np.nanmax(values)) if values.size and not np.all(np.isnan(values.astype(np.float64))) else 0.0
    if values.dtype.kind == "f" and high <= 1.0:
        return 255.0
    return 1.0 if high <= 255.0 else 255.0 / 65535.0


def to_bytes(values: NDArray[np.generic], scale: float) -> U8:
    """Colours of any type times ``scale`` as uint8, clipped; what is not a number becomes 0."""
    if values.dtype == np.uint8 and scale == 1.0:
        return values.astype(np.uint8, copy=False)
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = np.fmax(np.fmin(values.astype(np.float32) * scale + 0.5, 255.0), 0.0)
    return scaled.astype(np.uint8)


def unpack_colours(packed: NDArray[np.generic]) -> U8:
    """(n, 3) of packed colours (n,): whole numbers 0xRRGGBB, or single floats whose bits are such numbers."""
    bits = packed.astype(np.float32).view(np.uint32) if packed.dtype.kind == "f" else packed.astype(np.uint32)
    return np.stack([(bits >> shift).astype(np.uint8) for shift in (16, 8, 0)], axis=1)


def rotation_matrix(quaternion: F64) -> F64:
    """The (3, 3) rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = (float(value) for value in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rows_of(array: NDArray[np.generic], wanted: int) -> NDArray[np.generic]:
    """At most ``wanted`` rows, spread evenly."""
    if len(array) <= wanted:
        return array
    return array[np.linspace(0, len(array) - 1, wanted).astype(np.int64)]


def join_chunks(chunks: list[Chunk], count: int) -> Chunk:
    """One chunk of at most ``count`` points, spread evenly over the given ones. Misses and dropped are added up."""
    total = sum(len(chunk.xyz) for chunk in chunks)
    rows = np.linspace(0, total - 1, min(count, total)).astype(np.int64)
    misses = [chunk.misses for chunk in chunks if chunk.misses is not None]
    xyz = np.concatenate([np.zeros((0, 3), np.float32), *(chunk.xyz.astype(np.float32) for chunk in chunks)])
    return Chunk(
        np.ascontiguousarray(xyz[rows]),
        _joined([chunk.rgb for chunk in chunks], rows),
        _joined([chunk.intensity for chunk in chunks], rows),
        _joined([chunk.source for chunk in chunks], rows),
        np.concatenate(misses) if misses else None,
        sum(chunk.dropped for chunk in chunks),
    )


def _joined(parts: list[NDArray[_Number] | None], rows: NDArray[np.int64]) -> NDArray[_Number] | None:
    present = [part for part in parts if part is not None]
    return np.concatenate(present)[rows] if present and len(present) == len(parts) else None


def read_exactly(path: Path, size: int) -> bytes:
    """The first ``size`` bytes of a file, or all of a smaller one."""
    with path.open("rb") as file:
        return file.read(size)


def stamp(path: Path) -> tuple[Path, int, int]:
    """What tells one state of a file from another: path, size, time of change. Used as a key of caches."""
    state = path.stat()
    return path, state.st_size, state.st_mtime_ns


@contextmanager
def mapped_errors(path: Path, form: str) -> Generator[None]:
    """Turns whatever a library raises on a bad file into an InputError that names the file. Ours pass through."""
    try:
        yield
    except Scan2BimError:
        raise
    except MemoryError as error:
        raise ResourceError(f"{path}: not enough memory to read this {form} file.") from error
    except OSError as error:
        raise InputError(path, f"cannot be read: {error}.", "Check the path, the permissions and the disk.") from error
    except Exception as error:
        raise _damaged(path, form, error) from error
    except BaseException as error:
        if type(error).__name__ != "PanicException":
            raise
        raise _damaged(path, form, error) from error


def _damaged(path: Path, form: str, error: BaseException) -> DamagedFileError:
    reason = (str(error).strip() or type(error).__name__).splitlines()[0][:200]
    return DamagedFileError(path, f"not a sound {form} file: {reason.rstrip('.')}.", "Copy or export it again.")


def truncated(path: Path, form: str, expected: int, came: int) -> DamagedFileError:
    """The error for a file that is shorter than its header says, in bytes."""
    return DamagedFileError(
        path,
        f"truncated {form} file: its header promises {expected:,} bytes, the file has {came:,}.",
        "Copy or export it again.",
    )


def tail_notes(path: Path, end: int) -> tuple[str, ...]:
    """A note where a file goes on behind its last point at byte ``end``."""
    extra = path.stat().st_size - end
    return (f"{extra:,} bytes behind the last point are not read",) if extra > 0 else ()


def no_points(path: Path, form: str) -> DamagedFileError:
    """The error for a file that holds no points."""
    return DamagedFileError(path, f"this {form} file holds no points.", "Export it again with its points.")
