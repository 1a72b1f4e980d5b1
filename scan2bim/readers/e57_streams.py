"""The byte streams of the points of an E57 scan (ASTM E2807, 9.3 to 9.5), taken from the file's pages by our own code.

Points lie in a section of data packets. A packet holds, for each field of the record, the next bytes of that field's
stream; packets of an index or of nothing may lie between them. A page is let through only if its checksum is right.
"""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import numba as nb
import numpy as np
from numpy.typing import NDArray

from scan2bim.errors import DamagedFileError
from scan2bim.readers.e57_file import PAGE, PAYLOAD, Section
from scan2bim.readers.e57_pages import CRC_TABLES, copy_bytes, unpage, wrong_page

BLOCK = 256
"""Pages read at a time: a quarter of a megabyte, which stays in the processor's cache."""
LONGEST = 1 << 16
"""Bytes of the longest packet."""
LEAST = 6
"""Bytes of the shortest head of a packet that says what it is: kind, flags, length less one, number of streams."""
DATA, EMPTY = 1, 2
"""Kinds of packets; 0 are those of an index."""
SLACK = 16
"""Bytes behind a stream that a reader of 64-bit words may touch."""
_MORE, _ENOUGH, _FULL, _BAD = range(4)


class ByteStreams:
    """Hands out the streams of some fields of one scan; a context manager.

    slots (f,): for each field of the record, the row of ``bytes`` that its stream goes to, -1 where it is not wanted.
    widths: bits of a record in each row. ``bytes`` (rows, n) uint8: each stream from its first unread record on, which
    begins ``skip`` (rows,) bits in. ``fill`` (rows,): bytes that are there.
    """

    def __init__(self, path: Path, section: Section, slots: NDArray[np.int64], widths: NDArray[np.int64]) -> None:
        self._path = path
        self._slots = slots
        self._widths = widths
        first = section.offset // PAGE
        self._page = first
        self._last = first + (section.offset % PAGE + section.length + PAYLOAD - 1) // PAYLOAD
        self._payload = np.empty(BLOCK * PAYLOAD + LONGEST, np.uint8)
        data = section.data // PAGE * PAYLOAD + section.data % PAGE
        self._start = data - first * PAYLOAD
        self._stop = 0
        self._left = section.length - (data - (first * PAYLOAD + section.offset % PAGE))
        self._pages = np.empty((BLOCK, PAGE), np.uint8)
        self.bytes = np.zeros((len(widths), 0), np.uint8)
        self.skip = np.zeros(len(widths), np.int64)
        self.fill = np.zeros(len(widths), np.int64)

    def __enter__(self) -> ByteStreams:
        self._file = self._path.open("rb", buffering=0)
        self._file.seek(self._page * PAGE)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def require(self, records: int) -> int:
        """Read until every stream holds so many records; gives how many all of them hold, fewer where they end."""
        wanted = (self.skip + records * self._widths + 7) // 8
        self._reserve(int(wanted.max(initial=0)))
        while (self.fill < wanted).any():
            end = min(self._stop, self._start + self._left)
            taken, state = _split(self._payload, self._start, end, self._slots, self.bytes, self.fill, wanted)
            self._left -= taken - self._start
            self._start = taken
            if state == _BAD:
                raise DamagedFileError(
                    self._path,
                    "damaged E57 file: one of its packets of points is malformed.",
                    "Copy or export it again.",
                )
            if state == _FULL:
                self._reserve(2 * self.bytes.shape[1])
            elif state == _MORE and (self._left <= 0 or not self._read_pages()):
                break
        held = (8 * self.fill - self.skip) // np.maximum(self._widths, 1)
        return min(records, int(np.where(self._widths > 0, held, records).min(initial=records)))

    def drop(self, records: int) -> None:
        """Forget so many records at the beginning of every stream."""
        for row, width in enumerate(self._widths.tolist()):
            bits = int(self.skip[row]) + records * width
            gone, stop = bits // 8, int(self.fill[row])
            self.bytes[row, : stop - gone] = self.bytes[row, gone:stop].copy()
            self.fill[row], self.skip[row] = stop - gone, bits % 8

    def check_rest(self) -> None:
        """Check the pages of the section that have not been read."""
        while self._read_pages():
            self._start = self._stop

    def _reserve(self, size: int) -> None:
        """Room for ``size`` bytes of each stream, for one packet more, and for whole words."""
        room = (size + LONGEST + SLACK + 7) // 8 * 8
        if room > self.bytes.shape[1]:
            held = self.bytes
            self.bytes = np.zeros((len(held), room), np.uint8)
            self.bytes[:, : held.shape[1]] = held

    def _read_pages(self) -> bool:
        """Take the payload of the next pages behind what is still there; whether there were any."""
        if self._start < self._stop and self._start > 0:
            rest = self._payload[self._start : self._stop].copy()
            self._payload[: len(rest)] = rest
            self._start, self._stop = 0, len(rest)
        elif self._start >= self._stop:
            self._start, self._stop = self._start - self._stop, 0
        wanted = min(BLOCK, self._last - self._page)
        got = (self._file.readinto(self._pages[:wanted].data) or 0) // PAGE if wanted > 0 else 0
        if got == 0:
            return False
        wrong = int(unpage(self._pages[:got], CRC_TABLES, self._payload[self._stop :]))
        if wrong >= 0:
            raise wrong_page(self._path, self._page + wrong)
        self._page += got
        self._stop += got * PAYLOAD
        return True


@nb.njit(cache=True, nogil=True)
def _split(payload, start, stop, slots, streams, fill, wanted):  # pyright: ignore
    """Take packets from ``payload`` between start and stop, and add what they hold to ``streams`` (rows, n), ``fill``.

    Gives where the first packet that was not taken begins, and why it was not: the payload ends, every row holds as
    many bytes as ``wanted`` (rows,), a row is full, the packet is malformed.
    """
    state = _MORE
    while state == _MORE and stop - start >= LEAST:
        kind = payload[start]
        length = _short(payload, start + 2) + 1
        if kind > EMPTY or length % 4 != 0:
            state = _BAD
        elif stop - start < length:
            break
        else:
            if kind == DATA:
                state = _take(payload, start, length, slots, streams, fill)
            if state == _MORE:
                start += length
                state = _ENOUGH
                for row in range(fill.shape[0]):
                    if fill[row] < wanted[row]:
                        state = _MORE
    return start, state


@nb.njit(cache=True, nogil=True)
def _take(payload, start, length, slots, streams, fill):  # pyright: ignore
    """Add what the data packet at ``start`` holds to the streams; _MORE, or why that cannot be."""
    fields = slots.shape[0]
    first = start + LEAST + 2 * fields
    if length < LEAST + 2 * fields or _short(payload, start + 4) != fields:
        return _BAD
    end = first
    for field in range(fields):
        end += _short(payload, start + LEAST + 2 * field)
        row = slots[field]
        if row >= 0 and fill[row] + LONGEST + SLACK > streams.shape[1]:
            return _FULL
    if end > start + length:
        return _BAD
    at = first
    for field in range(fields):
        size = _short(payload, start + LEAST + 2 * field)
        row = slots[field]
        if row >= 0:
            copy_bytes(payload, at, size, streams[row], fill[row])
            fill[row] += size
        at += size
    return _MORE


@nb.njit(cache=True, nogil=True, inline="always")
def _short(payload, at):  # pyright: ignore
    """The whole number of 16 bits, low byte first."""
    return np.int64(payload[at]) | np.int64(payload[at + 1]) << 8
