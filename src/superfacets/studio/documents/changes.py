"""Represent the state of a labeling, and its changes.

A change can be applied and reverted, and takes about one byte per cell.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..labels.classes import (
    MAX_CLASS,
    ClassList,
    ObjectNames,
    Paint,
    class_of,
    object_of,
    stuff_of,
)
from ..labels.coding import CellNumbers, pack_cells, unpack_cells
from ..labels.suggestions import Suggestions
from ..regions.revisions import Partition
from .journal import Line

Numbers = npt.NDArray[np.uint16]

REVIEW_MARKS = "reviewed", "changed_since_review"


@dataclass
class State:
    """Labels of all cells, list of classes, names of objects, and regions."""

    paint: Paint  # class and object of each cell, shape (N,), see `paint_of`
    class_list: ClassList
    partition: Partition
    object_names: ObjectNames = ()
    is_reviewed: bool = False
    is_changed: bool = False  # whether classes or objects have changed since the review
    suggestions: Suggestions = ()  # suggestions that are neither accepted nor rejected

    @property
    def classes(self) -> Numbers:
        """Class of each cell, shape (N,); 0 means no class."""
        return class_of(self.paint)

    @property
    def objects(self) -> Numbers:
        """Object number of each cell within its class, shape (N,); 0 means no object."""
        is_stuff = np.zeros(MAX_CLASS + 1, bool)
        is_stuff[[*stuff_of(self.class_list)]] = True
        return np.where(is_stuff[self.classes], np.uint16(0), object_of(self.paint))

    @property
    def review_marks(self) -> Line:
        """Entries of a journal line that store whether the work is reviewed."""
        values = self.is_reviewed, self.is_changed
        return {name: True for name, value in zip(REVIEW_MARKS, values, strict=True) if value}


@dataclass(frozen=True)
class Painted:
    """Compressed classes and objects of some cells."""

    cells: bytes  # see `pack_cells`
    n: int  # number of cells
    values: bytes  # compressed `Paint`: one value per cell, or one value for all cells

    @classmethod
    def of(cls, cells: bytes, values: Paint) -> Painted:
        """Compress the paint of packed cells; if all values are equal, only one is stored."""
        row = values[:1] if bool((values == values[0]).all()) else values
        return cls(cells, len(values), zlib.compress(row.tobytes(), level=1))

    def unpacked(self) -> Paint:
        """Return the paint of each cell, or an array with one value for all cells."""
        return np.frombuffer(zlib.decompress(self.values), np.uint32)

    def set(self, paint: Paint) -> None:
        """Write the values into `paint`, which has one value per cell."""
        paint[unpack_cells(self.cells, len(paint))] = self.unpacked()


@dataclass(frozen=True)
class Change:
    """A change that can be applied and reverted."""

    kind: Literal["paint", "split", "segment", "classes", "objects", "review", "suggest", "settle"]
    before: Any  # `Painted` for the kind "paint"; otherwise the value of the changed field
    after: Any
    stroke: str | None = None  # consecutive changes with the same name are undone together

    @classmethod
    def painting(
        cls, paint: Paint, cells: CellNumbers, wanted: Any, stroke: str | None = None
    ) -> Change | None:
        """Create a change of the paint of ascending cells; None if nothing changes.

        `wanted` is one value for all cells, or one value per cell.
        """
        after = np.broadcast_to(np.asarray(wanted, np.uint32), cells.shape)
        before = paint[cells]
        differs = before != after
        if not differs.any():
            return None
        packed = pack_cells(cells[differs])
        old, new = (Painted.of(packed, values[differs]) for values in (before, after))
        return cls("paint", old, new, stroke)

    def do(self, state: State) -> None:
        """Apply the change."""
        if self.kind == "paint":
            self.after.set(state.paint)
        else:
            setattr(state, _FIELDS[self.kind], self.after)

    def cells(self, n_cells: int) -> CellNumbers:
        """Return the cells whose paint changes."""
        is_paint = self.kind == "paint"
        return unpack_cells(self.after.cells, n_cells) if is_paint else np.empty(0, np.uint32)

    def inverse(self) -> Change:
        """Return the inverse change."""
        return replace(self, before=self.after, after=self.before)


def settling(state: State, ids: set[int], stroke: str | None) -> Change:
    """Return a change that removes suggestions; raise a ValueError if one does not exist."""
    if lacking := ids - {one.id for one in state.suggestions}:
        raise ValueError(f"suggestion {min(lacking)} does not exist")
    left = tuple(one for one in state.suggestions if one.id not in ids)
    return Change("settle", state.suggestions, left, stroke)


_FIELDS = {
    "split": "partition",
    "segment": "partition",
    "classes": "class_list",
    "objects": "object_names",
    "review": "is_reviewed",
    "suggest": "suggestions",
    "settle": "suggestions",
}
"""Field of `State` that each kind of change replaces; "paint" changes parts of a field instead."""
