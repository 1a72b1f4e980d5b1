"""Point records of an E57 scan (ASTM E2807, 9.7) unpacked from their byte streams into arrays by our own code.

Fields are floats, whole numbers packed into as many bits as their range takes, or such numbers with scale and offset.
What else the standard allows and hardly any writer makes (text, nested fields, numbers of more than 53 bits)
is left to libE57, which takes five times as long.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import DamagedFileError
from scan2bim.readers.e57_file import Section
from scan2bim.readers.e57_layout import Buffers, Packing, Records, named_columns
from scan2bim.readers.e57_streams import ByteStreams
from scan2bim.readers.points import LIMIT


@dataclass(frozen=True, slots=True)
class Target:
    """A field that is wanted: its packing, and the column of floats or bytes that its values go to."""

    packing: Packing
    values: NDArray[Any]


class PointReader:
    """Fills a scan's buffers with its next points, as libE57's reader does; a context manager."""

    def __init__(
        self, path: Path, section: Section, fields: Mapping[str, Packing], wanted: dict[str, NDArray[Any]]
    ) -> None:
        self._path = path
        self._left = section.records
        self._targets = [Target(fields[name], values) for name, values in wanted.items()]
        rows = {name: row for row, name in enumerate(wanted)}
        slots = np.array([rows.get(name, -1) for name in fields], np.int64)
        self._streams = ByteStreams(path, section, slots, np.array([t.packing.bits for t in self._targets], np.int64))
        self._capacity = min((len(target.values) for target in self._targets), default=0)

    def __enter__(self) -> PointReader:
        self._streams.__enter__()
        return self

    def __exit__(self, *exc: Any) -> None:
        self._streams.__exit__(*exc)

    def read(self) -> int:
        """Fill the buffers from their beginning; gives the number of records, 0 where there are no more.

        Raises DamagedFileError, at the latest behind the last record.
        """
        count = self._streams.require(min(self._capacity, self._left))
        for row, target in enumerate(self._targets):
            self._unpack(target, self._streams.bytes[row], int(self._streams.skip[row]), target.values[:count])
        self._streams.drop(count)
        self._left -= count
        if self._left == 0:
            self._streams.check_rest()
        return count

    def _unpack(self, target: Target, stream: NDArray[np.uint8], skip: int, values: NDArray[Any]) -> None:
        packing = target.packing
        if packing.real:
            raw = stream[: len(values) * packing.bits // 8].view("<f4" if packing.bits == 32 else "<f8")
            with np.errstate(over="ignore", invalid="ignore"):
                values[:] = raw
            if values.itemsize < raw.itemsize and (np.isinf(values) | np.isinf(raw)).any():
                problem = "damaged E57 file: a field holds numbers too large for its use."
                raise DamagedFileError(self._path, problem, "Export it again.")
        elif packing.bits == 8 and packing.fits_byte:
            np.add(stream[: len(values)], packing.low, out=values, casting="unsafe")
        else:
            _unpack_whole(
                stream.view(np.uint64), skip, packing.bits, packing.low, packing.scale, packing.offset, values
            )


def point_reader(path: Path, records: Records, buffers: Buffers) -> PointReader | None:
    """A reader of a scan's points into buffers, None where its records are packed unusually."""
    fields = records.layout.packings
    if fields is None:
        return None
    wanted = named_columns(records.layout, buffers)
    if any(values.dtype == np.uint8 and not fields[name].fits_byte for name, values in wanted.items()):
        return None
    return PointReader(path, records.section, fields, wanted)


@nb.njit(cache=True, nogil=True)
def _unpack_whole(words, skip, bits, low, scale, offset, values):  # pyright: ignore
    """Numbers of ``bits`` bits, lowest bit first, from bit ``skip`` of ``words`` uint64 on, as ``values`` (n,)."""
    one, six, most = np.uint64(1), np.uint64(6), np.uint64(63)
    mask = (one << np.uint64(bits)) - one
    first = np.uint64(skip)
    width = np.uint64(bits)
    for i in range(np.uint64(values.shape[0])):
        place = first + i * width
        word = place >> six
        shift = place & most
        number = (words[word] >> shift | (words[word + 1] << one) << (most - shift)) & mask
        values[i] = (low + np.int64(number)) * scale + offset


@nb.njit(cache=True, nogil=True)
def keep_points(raw, origin, state, centre):  # pyright: ignore
    """Coordinates (n, 3) less origin as float32 and row numbers of the records that are points, and how many records
    are directions without a range.

    Those with a ``state`` (n,) other than 0 are none (empty: all may be), nor those beyond LIMIT or not finite, nor, if
    ``centre`` is to be left out, those at (0, 0, 0).
    """
    count = raw.shape[0]
    xyz = np.empty((count, 3), np.float32)
    rows = np.empty(count, np.int64)
    kept = np.uint64(0)
    missed = 0
    for i in range(np.uint64(count)):
        if state.shape[0] > 0 and state[i] != 0:
            missed += state[i] == 1
            continue
        x = np.float32(raw[i, 0] - origin[0])
        y = np.float32(raw[i, 1] - origin[1])
        z = np.float32(raw[i, 2] - origin[2])
        inside = abs(x) < LIMIT and abs(y) < LIMIT and abs(z) < LIMIT
        if inside and not (centre and x == 0.0 and y == 0.0 and z == 0.0):
            xyz[kept, 0] = x
            xyz[kept, 1] = y
            xyz[kept, 2] = z
            rows[kept] = i
            kept += np.uint64(1)
    return xyz[:kept], rows[:kept], missed
