"""Points of an E57 scan by libE57: for records that are packed unusually; and who reads a scan's points."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from scan2bim.readers.e57_layout import Buffers, Records, libe57, named_columns
from scan2bim.readers.e57_pages import check_pages
from scan2bim.readers.e57_points import PointReader, point_reader


@contextmanager
def open_image(path: Path) -> Generator[Any]:
    """The libE57 image file, which verifies the checksums of the pages it reads."""
    image = libe57.ImageFile(str(path), "r", libe57.CHECKSUM_POLICY_ALL)
    try:
        yield image
    finally:
        image.close()


class LibraryReader:
    """Fills a scan's buffers as ``PointReader`` does, by libE57; a context manager."""

    def __init__(self, path: Path, index: int, records: Records, buffers: Buffers) -> None:
        self._path = path
        self._index = index
        self._section = records.section
        self._columns = named_columns(records.layout, buffers)
        self._left = records.section.records
        self._stack = ExitStack()

    def __enter__(self) -> LibraryReader:
        with ExitStack() as stack:
            image = stack.enter_context(open_image(self._path))
            scan = image.root()["data3D"][self._index]
            self._reader = scan["points"].reader(_targets(image, self._columns))
            stack.callback(self._reader.close)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *exc: Any) -> None:
        self._stack.close()

    def read(self) -> int:
        """The number of records read, 0 where there are no more. Raises DamagedFileError."""
        count = int(self._reader.read())
        self._left -= count
        if self._left == 0:
            check_pages(self._path, self._section.offset, self._section.length)
        return count


def open_points(path: Path, index: int, records: Records, buffers: Buffers) -> PointReader | LibraryReader:
    """What fills the buffers with a scan's points: our own reader, libE57's where records are packed unusually."""
    return point_reader(path, records, buffers) or LibraryReader(path, index, records, buffers)


def _targets(image: Any, columns: dict[str, Any]) -> Any:
    """libE57's view of the columns, each with an explicit stride, since the binding ignores numpy's."""
    targets = libe57.VectorSourceDestBuffer()
    for name, values in columns.items():
        stride = values.strides[0]
        targets.append(libe57.SourceDestBuffer(image, name, values, len(values), True, True, stride=stride))
    return targets
