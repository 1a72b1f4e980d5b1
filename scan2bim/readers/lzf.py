"""LZF, the compression of PCD's ``binary_compressed``: decoded block by block, so that memory stays bounded."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, BinaryIO

import numpy as np
from numba import njit

from scan2bim.errors import DamagedFileError

_HISTORY = 8192
"""Bytes that a back reference reaches, by the format."""
_LONGEST = 264
"""Bytes that one code adds at most, by the format."""
_BLOCK = 4 << 20
_IN_MEMORY = 64 << 20
"""Bytes. Larger decoded data go to a temporary file."""


@njit(cache=True, nogil=True)
def _decode(source, position, target, filled, last):  # pyright: ignore
    """Decodes until ``target`` is nearly full or ``source`` (with ``last`` False: nearly) used up.

    filled -1: damaged.
    """
    size = len(source)
    margin = 0 if last else 40
    while position < size - margin and filled + _LONGEST <= len(target):
        control = source[position]
        position += 1
        if control < 32:
            count = control + 1
            if position + count > size:
                return position, -1
            target[filled : filled + count] = source[position : position + count]
            position += count
            filled += count
            continue
        count = control >> 5
        if position + 1 + (count == 7) > size:
            return position, -1
        if count == 7:
            count += source[position]
            position += 1
        start = filled - ((control & 31) << 8) - source[position] - 1
        position += 1
        if start < 0:
            return position, -1
        for index in range(count + 2):
            target[filled + index] = target[start + index]
        filled += count + 2
    return position, filled


def decompressed(path: Path, offset: int, packed: int, unpacked: int) -> IO[bytes]:
    """A temporary file with the ``unpacked`` bytes of ``packed`` ones at ``offset``.

    Raises DamagedFileError. The caller closes it.
    """
    output: IO[bytes] = tempfile.SpooledTemporaryFile(max_size=_IN_MEMORY)  # noqa: SIM115
    try:
        done = 0
        with path.open("rb") as file:
            file.seek(offset)
            for block in _blocks(path, file, packed):
                done += len(block)
                if done > unpacked:
                    break
                output.write(block)
        if done != unpacked:
            raise _damaged(path)
    except BaseException:
        output.close()
        raise
    return output


def _blocks(path: Path, file: BinaryIO, packed: int) -> Iterator[bytes]:
    target = np.zeros(_HISTORY + _BLOCK, np.uint8)
    source, position, filled, begin = np.zeros(0, np.uint8), 0, 0, 0
    left = packed
    while left > 0 or position < len(source):
        raw = file.read(min(_BLOCK, left)) if len(source) - position <= 40 else b""
        left -= len(raw)
        if raw:
            source, position = np.concatenate([source[position:], np.frombuffer(raw, np.uint8)]), 0
        before = position, filled
        position, filled = _decode(source, position, target, filled, left == 0)
        if filled < 0 or ((position, filled) == before and not raw and filled + _LONGEST <= len(target)):
            raise _damaged(path)
        yield target[begin:filled].tobytes()
        keep = min(filled, _HISTORY)
        target[:keep] = target[filled - keep : filled].copy()
        begin = filled = keep


def _damaged(path: Path) -> DamagedFileError:
    return DamagedFileError(path, "the compressed part of this PCD file is damaged.", "Copy or export it again.")
