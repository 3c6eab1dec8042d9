"""Represent the state of a document and its changes. Changes are compressed and can be undone."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..labels.classes import MAX_CLASS, ClassList, ObjectNames, Paint, class_of, object_of, stuff_of
from ..labels.coding import CellNumbers, pack_cells, unpack_cells
from ..labels.suggestions import Suggestions
from ..regions.revisions import Partition
from .journal import Line

Numbers = npt.NDArray[np.uint16]

REVIEW_MARKS = "reviewed", "changed_since_review"


@dataclass
class State:
    """State of a document: labels of all cells, classes, names of objects, regions, suggestions."""

    paint: Paint  # class and object of each cell, (N,), encoded by `paint_of`
    class_list: ClassList
    partition: Partition
    object_names: ObjectNames = ()
    is_reviewed: bool = False
    is_changed: bool = False  # whether labels, classes or names may differ from the reviewed ones
    suggestions: Suggestions = ()  # suggested objects that wait for a decision

    @property
    def classes(self) -> Numbers:
        """Class of each cell, shape (N,); 0 means no class."""
        return class_of(self.paint)

    @property
    def objects(self) -> Numbers:
        """Object number of each cell within its class, shape (N,); 0 means no object.

        All cells of a class without objects (``stuff``) have 0.
        """
        is_stuff = np.zeros(MAX_CLASS + 1, bool)
        is_stuff[[*stuff_of(self.class_list)]] = True
        return np.where(is_stuff[self.classes], np.uint16(0), object_of(self.paint))

    @property
    def review_marks(self) -> Line:
        """Entries for a journal line: each of `REVIEW_MARKS` that applies, with the value True."""
        values = self.is_reviewed, self.is_changed
        return {name: True for name, value in zip(REVIEW_MARKS, values, strict=True) if value}


@dataclass(frozen=True)
class Painted:
    """Compressed set of cells, and their classes and objects."""

    cells: bytes  # indices of the cells, encoded by `pack_cells`
    n: int  # number of cells
    values: bytes  # compressed `Paint`: one value per cell, or one value for all cells

    @classmethod
    def of(cls, cells: bytes, values: Paint) -> Painted:
        """Compress the values (class and object) of packed cells; store equal values only once."""
        row = values[:1] if bool((values == values[0]).all()) else values
        return cls(cells, len(values), zlib.compress(row.tobytes(), level=1))

    def unpacked(self) -> Paint:
        """Return the value of each cell, or an array of length 1 if all values are equal."""
        return np.frombuffer(zlib.decompress(self.values), np.uint32)

    def set(self, paint: Paint) -> None:
        """Write the values into `paint`, the array of all cells."""
        paint[unpack_cells(self.cells, len(paint))] = self.unpacked()


@dataclass(frozen=True)
class Change:
    """A change of a `State`, with the values before and after the change, to undo and redo it."""

    kind: Literal["paint", "split", "segment", "classes", "objects", "review", "suggest", "settle"]
    before: Any  # old `Painted` for the kind "paint", otherwise old value of a field, see `_FIELDS`
    after: Any  # new `Painted` or new value of the field
    stroke: str | None = None  # a name; successive changes with the same name are undone together
    part: int | None = None  # number of its request; later requests of a stroke have higher ones

    @classmethod
    def painting(
        cls, paint: Paint, cells: CellNumbers, wanted: Any,
        stroke: str | None = None, part: int | None = None,
    ) -> Change | None:  # fmt: skip
        """Return the change that sets values of cells, or None if it would change no value.

        `cells` are indices in ascending order. `wanted` is one value (class and object) for all
        cells, or one value per cell.
        """
        after = np.broadcast_to(np.asarray(wanted, np.uint32), cells.shape)
        before = paint[cells]
        differs = before != after
        if not differs.any():
            return None
        packed = pack_cells(cells[differs])
        old, new = (Painted.of(packed, values[differs]) for values in (before, after))
        return cls("paint", old, new, stroke, part)

    @classmethod
    def replacing(cls, state: State, kind: Any, after: Any, stroke: str | None = None) -> Change:
        """Return the change after which the field `_FIELDS[kind]` of the state is `after`."""
        return cls(kind, getattr(state, _FIELDS[kind]), after, stroke)

    def do(self, state: State) -> None:
        """Apply the change to a state, in place."""
        if self.kind == "paint":
            self.after.set(state.paint)
        else:
            setattr(state, _FIELDS[self.kind], self.after)

    def cells(self, n_cells: int) -> CellNumbers:
        """Return the indices of the cells whose class or object changes, in ascending order.

        If the kind of the change is not "paint", the result is empty.
        """
        is_paint = self.kind == "paint"
        return unpack_cells(self.after.cells, n_cells) if is_paint else np.empty(0, np.uint32)

    def inverse(self) -> Change:
        """Return the change that reverts this change."""
        return replace(self, before=self.after, after=self.before)


def unsettled(state: State, ids: set[int]) -> Suggestions:
    """Return the suggestions except `ids`; raise a ValueError if one of `ids` does not exist."""
    if lacking := ids - {one.id for one in state.suggestions}:
        raise ValueError(f"suggestion {min(lacking)} does not exist")
    return tuple(one for one in state.suggestions if one.id not in ids)


_FIELDS = {
    "split": "partition", "segment": "partition", "classes": "class_list",
    "objects": "object_names", "review": "is_reviewed", "suggest": "suggestions",
    "settle": "suggestions",
}  # fmt: skip
"""Field of `State` that each kind of change replaces. The kind "paint" is not listed, because it
writes to the array `paint` instead."""
