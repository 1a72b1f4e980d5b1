"""Pages of an E57 file (ASTM E2807, 7.2): 1020 bytes, and their CRC-32C in the last 4 of 1024, high byte first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numba as nb
import numpy as np
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from scan2bim.errors import DamagedFileError
from scan2bim.readers.e57_file import PAGE, PAYLOAD

BLOCK = 2048
"""Pages read at a time: 2 MB, which stay in the processor's cache."""
POLYNOMIAL = 0x82F63B78
"""CRC-32C (Castagnoli), bits reversed."""


def _tables() -> NDArray[np.uint32]:
    """Lookup tables (8, 256): the checksum of a byte followed by 0 to 7 zero bytes."""
    tables = np.zeros((8, 256), np.uint32)
    for value in range(256):
        crc = value
        for _ in range(8):
            crc = (crc >> 1) ^ (POLYNOMIAL if crc & 1 else 0)
        tables[0, value] = crc
    for k in range(1, 8):
        before = tables[k - 1]
        tables[k] = (before >> np.uint32(8)) ^ tables[0][before & np.uint32(255)]
    return tables


CRC_TABLES = _tables()


def check_pages(path: Path, offset: int, length: int) -> None:
    """Check the pages that hold ``length`` bytes of payload from the physical ``offset`` on.

    Raises DamagedFileError naming the first page whose checksum is wrong.
    """
    first, skip = divmod(offset, PAGE)
    pages = (skip + length + PAYLOAD - 1) // PAYLOAD
    buffer, payload = np.empty((BLOCK, PAGE), np.uint8), np.empty(BLOCK * PAYLOAD, np.uint8)
    with path.open("rb", buffering=0) as file:
        file.seek(first * PAGE)
        done = 0
        while done < pages:
            got = (file.readinto(buffer[: min(BLOCK, pages - done)].data) or 0) // PAGE
            if got == 0:
                return
            wrong = int(unpage(buffer[:got], CRC_TABLES, payload))
            if wrong >= 0:
                raise wrong_page(path, first + done + wrong)
            done += got


def wrong_page(path: Path, page: int) -> DamagedFileError:
    """The error for a page, by its number in the file, whose checksum is wrong."""
    problem = f"damaged E57 file: the checksum of its page at byte {page * PAGE:,} is wrong."
    return DamagedFileError(path, problem, "Copy or export it again.")


@nb.njit(cache=True, nogil=True)
def unpage_by_table(raw, tables, payload):  # pyright: ignore
    """Copy what pages (n, 1024) uint8 hold to ``payload``, up to the first whose checksum is wrong.

    Gives the number of that page, -1 if none is. Eight bytes are looked up at a time.
    """
    pages = raw.view(np.uint32)
    byte = np.uint32(255)
    for p in range(pages.shape[0]):
        crc = np.uint32(0xFFFFFFFF)
        for i in range(0, 254, 2):
            low = crc ^ pages[p, i]
            high = pages[p, i + 1]
            crc = (
                tables[7, low & byte]
                ^ tables[6, (low >> np.uint32(8)) & byte]
                ^ tables[5, (low >> np.uint32(16)) & byte]
                ^ tables[4, low >> np.uint32(24)]
                ^ tables[3, high & byte]
                ^ tables[2, (high >> np.uint32(8)) & byte]
                ^ tables[1, (high >> np.uint32(16)) & byte]
                ^ tables[0, high >> np.uint32(24)]
            )
        last = crc ^ pages[p, 254]
        crc = (
            tables[3, last & byte]
            ^ tables[2, (last >> np.uint32(8)) & byte]
            ^ tables[1, (last >> np.uint32(16)) & byte]
            ^ tables[0, last >> np.uint32(24)]
        ) ^ np.uint32(0xFFFFFFFF)
        if crc != _swapped(pages[p, 255]):
            return p
        copy_bytes(raw[p], 0, PAYLOAD, payload, p * PAYLOAD)
    return -1


@nb.njit(cache=True, nogil=True)
def unpage_by_processor(raw, tables, payload):  # pyright: ignore
    """The same by the processor's own instruction for this checksum, seven times as fast; needs no tables."""
    words = raw.view(np.uint64)
    halves = raw.view(np.uint32)
    for p in range(raw.shape[0]):
        crc = np.uint64(0xFFFFFFFF)
        for i in range(127):
            crc = _crc_of_eight(crc, words[p, i])
        if _crc_of_four(np.uint32(crc), halves[p, 254]) ^ np.uint32(0xFFFFFFFF) != _swapped(halves[p, 255]):
            return p
        copy_bytes(raw[p], 0, PAYLOAD, payload, p * PAYLOAD)
    return -1


@nb.njit(cache=True, nogil=True)
def copy_bytes(source, start, size, target, at):  # pyright: ignore
    """``target[at : at + size] = source[start : start + size]``, twenty times as fast: unsigned places are not looked
    at for counting from the end, so that whole registers are moved.
    """
    begin = np.uint64(start)
    to = np.uint64(at)
    for i in range(np.uint64(size)):
        target[to + i] = source[begin + i]


@nb.njit(cache=True, nogil=True, inline="always")
def _swapped(word):  # pyright: ignore
    """The bytes of a word of 32 bits in reverse order."""
    byte = np.uint32(255)
    return (
        (word & byte) << np.uint32(24)
        | ((word >> np.uint32(8)) & byte) << np.uint32(16)
        | ((word >> np.uint32(16)) & byte) << np.uint32(8)
        | word >> np.uint32(24)
    )


def _instruction(bits: int) -> Any:
    """A function for compiled code: the checksum so far and the next ``bits`` of data give the new checksum."""
    kind, word = (nb.uint32, ir.IntType(32)) if bits == 32 else (nb.uint64, ir.IntType(64))

    def typed(context: Any, crc: Any, data: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            name = f"llvm.x86.sse42.crc32.{bits}.{bits}"
            function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(word, [word, word]), name)
            return builder.call(function, arguments)

        return kind(kind, kind), generate

    return intrinsic(typed)


_crc_of_four, _crc_of_eight = _instruction(32), _instruction(64)
unpage = unpage_by_processor if get_host_cpu_features().get("sse4.2", False) else unpage_by_table
