"""Meshes in files and arrays, read piece by piece: rows of vertices, and rows of faces."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from ..io.readers.ply_header import INDEX_NAMES, Element, Header
from .scratch import read_all

__all__ = ["ArrayRows", "Faces", "MeshPieces", "RecordRows", "Rows", "ply_pieces", "take_rows"]

BLOCK_BITS = 14
"""Rows are looked up in blocks of 2 to this power."""


class Rows(Protocol):
    """A table that is read in ranges of rows. It can be pickled, but for `ArrayRows`."""

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        ...

    def read(self, begin: int, end: int) -> npt.NDArray[Any]:
        """Rows begin to end - 1, each of as many numbers as the table has columns."""
        ...


@dataclass(frozen=True, eq=False)
class ArrayRows:
    """The rows of an array, which may be a memory map."""

    array: npt.NDArray[Any]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.array)

    def read(self, begin: int, end: int) -> npt.NDArray[Any]:
        """Rows begin to end - 1."""
        return np.ascontiguousarray(self.array[begin:end])


@dataclass(frozen=True)
class RecordRows:
    """Columns of records of equal size in a binary file.

    Parameters
    ----------
    path : Path
    begin : int
        First byte.
    n_rows : int
    record : numpy dtype
    columns : tuple of str
        Fields of the record that hold numbers; one that holds several stands for all of these.
    length : str or None
        A field that must be 3 in every record: the number of corners.
    """

    path: Path
    begin: int
    n_rows: int
    record: np.dtype[Any]
    columns: tuple[str, ...]
    length: str | None = None

    def read(self, begin: int, end: int) -> npt.NDArray[Any]:
        """Rows begin to end - 1; a MeshError if one has not three corners."""
        records = np.empty(end - begin, self.record)
        with self.path.open("rb", buffering=0) as file:
            file.seek(self.begin + begin * self.record.itemsize)
            read_all(file, records)
        if self.length is not None and np.any(records[self.length] != 3):
            first = int(np.argmax(records[self.length] != 3))
            raise MeshError(
                f"{self.path}: faces[{begin + first}] has {records[self.length][first]} corners,"
                " and others have fewer than three: is the file damaged?"
            )
        if len(self.columns) == 1:  # of one number, or of several
            values = records[self.columns[0]]
            return np.ascontiguousarray(values, values.dtype.newbyteorder("="))
        kind = np.result_type(*(self.record[column] for column in self.columns))
        rows = np.empty((end - begin, len(self.columns)), kind.newbyteorder("="))
        for place, column in enumerate(self.columns):
            rows[:, place] = records[column]
        return rows


class Faces(NamedTuple):
    """Some faces: their corners in a row, and where those of each begin."""

    corners: npt.NDArray[np.int64]
    offsets: npt.NDArray[np.int64] | None
    """And behind the last; None for triangles."""

    def face_of(self, corner: int) -> int:
        """The face that a corner belongs to."""
        if self.offsets is None:
            return corner // 3
        return int(np.searchsorted(self.offsets, corner, side="right")) - 1


@dataclass(frozen=True)
class MeshPieces:
    """A mesh of which pieces can be read.

    Parameters
    ----------
    vertices : Rows
        Of three coordinates.
    corners : Rows
        Of three vertex indices, one row per face; with `offsets` one index per row.
    offsets : Rows or None
        Where the corners of each face begin, and behind the last; None if all are triangles.
    """

    vertices: Rows
    corners: Rows
    offsets: Rows | None = None

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return self.corners.n_rows if self.offsets is None else self.offsets.n_rows - 1

    @property
    def n_cells(self) -> int:
        """The same, whatever kind the cells are of."""
        return self.n_faces

    def faces(self, begin: int, end: int) -> Faces:
        """Faces begin to end - 1."""
        if self.offsets is None:
            return Faces(self.corners.read(begin, end).reshape(-1).astype(np.int64), None)
        offsets = self.offsets.read(begin, end + 1)
        corners = self.corners.read(int(offsets[0]), int(offsets[-1]))
        return Faces(corners.astype(np.int64), offsets - offsets[0])


def ply_pieces(path: Path, header: Header) -> MeshPieces | None:
    """The vertices and triangles of a binary PLY file, or None if that has to be read whole.

    So it is where rows are of unequal size: in a text, with polygons, with lists of other things.
    A MeshError if the file is cut.
    """
    if header.is_ascii:
        return None
    found: dict[str, Rows] = {}
    begin = header.size
    for element in header.elements:
        record = _record_of(element)
        if record is None:
            break
        if element.n_rows * record.itemsize > path.stat().st_size - begin:
            if element.name == "face":  # polygons of two corners, or a cut file
                return None
            raise MeshError(
                f"{path}: the PLY header declares {element.n_rows} rows of element"
                f" {element.name!r} but the file ends before: is it cut?"
            )
        if element.name == "vertex" and {"x", "y", "z"} <= set(record.names or ()):
            found["vertex"] = RecordRows(path, begin, element.n_rows, record, ("x", "y", "z"))
        if element.name == "face":
            name = next((name for name in INDEX_NAMES if name in (record.names or ())), None)
            if name is not None:
                length = f"number of {name}"
                found["face"] = RecordRows(path, begin, element.n_rows, record, (name,), length)
        begin += element.n_rows * record.itemsize
    if len(found) < 2 or path.stat().st_size != begin:
        return None
    return MeshPieces(found["vertex"], found["face"])


def _record_of(element: Element) -> np.dtype[Any] | None:
    """The record of a row, in which the corners of a face are three; None with other lists."""
    fields: list[tuple[Any, ...]] = []
    for column, stored in enumerate(element.properties):
        name = stored.name if element.find(stored.name) == column else f"again {column}"
        if not stored.is_list:
            fields.append((name, stored.dtype))
        elif element.name == "face" and name in INDEX_NAMES and stored.is_integer:
            fields.append((f"number of {name}", stored.count_dtype))
            fields.append((name, stored.dtype, (3,)))
        else:
            return None
    return np.dtype(fields)


def take_rows(rows: Rows, wanted: npt.NDArray[np.integer[Any]], most: int) -> npt.NDArray[Any]:
    """Rows in any order and number, with no more than about `most` of the table in memory."""
    if isinstance(rows, ArrayRows):
        if not rows.array.flags.c_contiguous:
            return np.asarray(rows.array[wanted])
        return np.asarray(rows.array.take(wanted, axis=0))  # faster, but of a copy of other arrays
    low, high = int(wanted.min()), int(wanted.max()) + 1
    if high - low <= most:
        found: npt.NDArray[Any] = rows.read(low, high).take(wanted - low, axis=0)
        return found
    blocks = wanted >> BLOCK_BITS
    used = np.flatnonzero(np.bincount(blocks))
    n_together = max(1, most >> BLOCK_BITS)
    if len(used) <= n_together:
        return _taken(rows, wanted, blocks, used)
    taken: npt.NDArray[Any] | None = None
    for first in range(0, len(used), n_together):
        group = used[first : first + n_together]
        places = np.flatnonzero((blocks >= group[0]) & (blocks <= group[-1]))
        part = _taken(rows, wanted[places], blocks[places], group)
        if taken is None:
            taken = np.empty((len(wanted), *part.shape[1:]), part.dtype)
        taken[places] = part
    assert taken is not None
    return taken


def _taken(
    rows: Rows,
    wanted: npt.NDArray[Any],
    blocks: npt.NDArray[Any],
    used: npt.NDArray[np.int64],
) -> npt.NDArray[Any]:
    """Rows that are all in some blocks, which are read where they follow each other at once."""
    size = 1 << BLOCK_BITS
    slots = np.zeros(int(used[-1]) + 1, np.int64)
    slots[used] = np.arange(len(used)) << BLOCK_BITS
    runs = np.split(used, np.flatnonzero(np.diff(used) > 1) + 1)
    parts = [
        rows.read(int(run[0]) * size, min((int(run[-1]) + 1) * size, rows.n_rows)) for run in runs
    ]
    taken: npt.NDArray[Any] = np.concatenate(parts).take(
        slots[blocks] + (wanted & (size - 1)), axis=0
    )
    return taken
