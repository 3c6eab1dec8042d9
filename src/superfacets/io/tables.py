"""Read ranges of rows from tables: arrays, binary files, or several joined tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .._types import Array
from .._validate import counted
from ..errors import MeshError
from .guards import fill

BLOCK_BITS = 14
"""Binary logarithm of the number of rows per block in `take_rows`."""


class Rows(Protocol):
    """Interface of tables that are read in ranges of rows.

    Tables in files can be sent to other processes, because their pickles contain no rows.
    """

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        ...

    def read(self, begin: int, end: int) -> Array:
        """Return rows `begin` to `end` - 1, shape (end - begin, columns)."""
        ...


@dataclass(frozen=True, eq=False)
class ArrayRows:
    """A table in an array, which may be a memory map."""

    array: Array

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.array)

    def read(self, begin: int, end: int) -> Array:
        """Return rows `begin` to `end` - 1."""
        return np.ascontiguousarray(self.array[begin:end])


@dataclass(frozen=True)
class RecordRows:
    """A table in a binary file of records of equal size."""

    path: Path
    begin: int  # offset of the first record, in bytes
    n_rows: int
    record: np.dtype[Any]
    columns: tuple[str, ...]  # fields with one number each, or a single field with all numbers
    length: str | None = None  # field with the number of corners, which must be 3; None if absent

    def read(self, begin: int, end: int) -> Array:
        """Return rows `begin` to `end` - 1. Raise a MeshError if the field `length` is not 3."""
        records = np.empty(end - begin, self.record)
        with self.path.open("rb", buffering=0) as file:
            file.seek(self.begin + begin * self.record.itemsize)
            fill(records.view(np.uint8), file)
        if self.length is not None and np.any(records[self.length] != 3):
            first = int(np.argmax(records[self.length] != 3))
            raise MeshError(
                f"{self.path}: faces[{begin + first}] has"
                f" {counted(int(records[self.length][first]), 'corner')}, expected 3: the file may"
                " be damaged"
            )
        if len(self.columns) == 1:
            return np.ascontiguousarray(records[self.columns[0]])
        return np.stack([records[name] for name in self.columns], axis=1)


@dataclass(frozen=True)
class ConvertedRows:
    """A table whose rows are converted by ``convert(rows, index of the first row)``.

    `convert` must be a module-level function, so that the table can be pickled.
    """

    rows: Rows
    convert: Callable[[Array, int], Array]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return self.rows.n_rows

    def read(self, begin: int, end: int) -> Array:
        """Return the converted rows `begin` to `end` - 1."""
        return self.convert(self.rows.read(begin, end), begin)


@dataclass(frozen=True)
class JoinedRows:
    """Concatenation of tables."""

    parts: tuple[Rows, ...]
    shifts: tuple[int, ...] | None = None  # number added to all values of each table

    @property
    def starts(self) -> tuple[int, ...]:
        """Index of the first row of each table, and the total number of rows."""
        return tuple(np.append(0, np.cumsum([part.n_rows for part in self.parts])).tolist())

    @property
    def n_rows(self) -> int:
        """Total number of rows of the tables."""
        return self.starts[-1]

    def read(self, begin: int, end: int) -> Array:
        """Return rows `begin` to `end` - 1."""
        found = []
        for place, (first, last) in enumerate(pairwise(self.starts)):
            if first < end and begin < last:
                rows = self.parts[place].read(max(begin, first) - first, min(end, last) - first)
                shift = self.shifts[place] if self.shifts is not None else 0
                found.append(rows.astype(np.int64) + shift if shift else rows)
        return np.concatenate(found)


def take_rows(rows: Rows, wanted: Array, most: int) -> Array:
    """Return the rows with indices `wanted`, in this order; read about `most` rows at a time."""
    if isinstance(rows, ArrayRows):
        if not rows.array.flags.c_contiguous:  # `take` would copy the whole array
            return np.asarray(rows.array[wanted])
        return np.asarray(rows.array.take(wanted, axis=0))  # faster than array[wanted]
    low, high = int(wanted.min()), int(wanted.max()) + 1
    if high - low <= most:
        return rows.read(low, high).take(wanted - low, axis=0)
    blocks = wanted >> BLOCK_BITS
    used = np.flatnonzero(np.bincount(blocks))
    n_together = max(1, most >> BLOCK_BITS)
    if len(used) <= n_together:
        return _taken(rows, wanted, blocks, used)
    taken: Array | None = None
    for first in range(0, len(used), n_together):
        group = used[first : first + n_together]
        places = np.flatnonzero((blocks >= group[0]) & (blocks <= group[-1]))
        part = _taken(rows, wanted[places], blocks[places], group)
        if taken is None:
            taken = np.empty((len(wanted), *part.shape[1:]), part.dtype)
        taken[places] = part
    assert taken is not None
    return taken


def _taken(rows: Rows, wanted: Array, blocks: Array, used: Array) -> Array:
    """Return the rows with the indices `wanted`; `blocks` has the block of each of these rows.

    `used` has each of these blocks once, in ascending order. Consecutive blocks are read together.
    """
    size = 1 << BLOCK_BITS
    slots = np.zeros(int(used[-1]) + 1, np.int64)
    slots[used] = np.arange(len(used)) << BLOCK_BITS
    runs = np.split(used, np.flatnonzero(np.diff(used) > 1) + 1)
    parts = [
        rows.read(int(run[0]) * size, min((int(run[-1]) + 1) * size, rows.n_rows)) for run in runs
    ]
    return np.concatenate(parts).take(slots[blocks] + (wanted & (size - 1)), axis=0)
