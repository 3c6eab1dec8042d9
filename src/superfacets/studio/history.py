"""The state of a labeling, its changes, and the lines of the journal that store the changes.

A change can be applied and reverted, and takes about one byte per cell.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..io.guards import shortened
from .classes import (
    MAX_CLASS,
    MAX_OBJECT,
    ClassList,
    ObjectNames,
    Paint,
    checked_class_list,
    checked_object,
    class_of,
    default_classes,
    object_of,
    paint_of,
    stuff_of,
    with_object_name,
)
from .coding import CellNumbers, base64_of, bytes_from, inflated, pack_cells, unpack_cells
from .journal import Journal, JournalError, Line
from .segmenting import checked_parameters, default_parameters
from .suggestions import Suggestion, Suggestions

Numbers = npt.NDArray[np.uint16]


REVIEW_MARKS = "reviewed", "changed_since_review"


class NothingError(LookupError):
    """There is nothing to undo or redo."""


@dataclass(frozen=True)
class Partition:
    """Description of the regions: parameters that reproduce them, and later splits."""

    parameters: dict[str, Any]
    digest: str = ""  # hash of the labels before splits; empty if unknown
    splits: tuple[bytes, ...] = ()  # packed cells of each split; they get the next free label

    def with_split(self, packed: bytes, digest: str) -> Partition:
        """Copy with one more split; `digest` is the hash of the labels before all splits."""
        return replace(self, digest=digest, splits=(*self.splits, packed))


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
        """Paint of each cell, or an array with one value for all cells."""
        return np.frombuffer(zlib.decompress(self.values), np.uint32)

    def set(self, paint: Paint) -> None:
        """Write the values to the paint of all cells."""
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
        """The cells whose paint changes."""
        is_paint = self.kind == "paint"
        return unpack_cells(self.after.cells, n_cells) if is_paint else np.empty(0, np.uint32)

    def inverse(self) -> Change:
        """The inverse change."""
        return replace(self, before=self.after, after=self.before)

    def line(self) -> Line:
        """Line of the journal that stores the change."""
        stroke = {} if self.stroke is None else {"stroke": self.stroke}
        return {"op": self.kind, **_WRITERS[self.kind](self), **stroke}


def last_stroke(changes: list[Change]) -> list[Change]:
    """Changes of the last stroke, most recent first."""
    found: list[Change] = []
    for change in reversed(changes):
        if found and (change.stroke is None or change.stroke != found[0].stroke):
            break
        found.append(change)
    return found


def _nothing(seq: int) -> None:
    """Record nothing, because replayed steps are in the journal already."""


@dataclass
class History:
    """The state, and the changes that can be undone and redone.

    Methods that change the state take a function `record`, which gets the number of the step and
    writes the step to the journal. If `record` raises an error, the state does not change.
    """

    state: State
    undo_stack: list[Change] = field(default_factory=list)
    redo_stack: list[Change] = field(default_factory=list)
    seq: int = 0

    @classmethod
    def replayed(cls, journal: Journal, n_cells: int, classes: ClassList | None) -> History:
        """Replay all lines of a journal.

        If `classes`, the list of a folder, is given, it replaces the list in the journal. Raises
        JournalError if a line cannot be replayed.
        """
        number = 1
        try:
            history = cls(_first_state(journal.header, n_cells, classes))
            for line in journal.lines:
                number = history.seq + 2
                history.replay(line)
        except (KeyError, TypeError, ValueError, OverflowError, NothingError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise JournalError(
                f"{journal.path}: line {number} of the work file is not valid: {shortened(reason)}"
            ) from None
        if classes is not None:  # replayed lines may have replaced the list
            history.state.class_list = classes
        journal.lines.clear()
        return history

    def replay(self, line: Line) -> None:
        """Apply the change of a line."""
        if line["seq"] != self.seq + 1:
            raise ValueError(f"seq must be {self.seq + 1}, got {line['seq']}")
        name = str(line["op"])
        if name in ("undo", "redo"):
            self.move(name)
        elif name in _READERS:
            self.make(_READERS[name](line, self.state))
        else:
            raise ValueError(f"unknown operation {name}")

    def make(self, change: Change, record: Callable[[int], object] = _nothing) -> None:
        """Apply a new change, which can be undone; changes undone before cannot be redone again."""
        self._apply([change], record)
        self.undo_stack.append(change)
        self.redo_stack.clear()

    def move(self, name: str, record: Callable[[int], object] = _nothing) -> list[Change]:
        """Undo or redo the last stroke; return its changes, or raise NothingError."""
        is_undo = name == "undo"
        stacks = self.undo_stack, self.redo_stack
        source, target = stacks if is_undo else stacks[::-1]
        changes = last_stroke(source)
        if not changes:
            raise NothingError(f"there is nothing to {name}")
        made = [change.inverse() if is_undo else change for change in changes]
        self._apply(made, record, is_undo=is_undo)
        del source[len(source) - len(changes) :]
        target.extend(changes)
        return changes

    def _apply(
        self, changes: list[Change], record: Callable[[int], object], *, is_undo: bool = False
    ) -> None:
        """Apply changes and record the step; if recording fails, revert the changes."""
        was_changed = self.state.is_changed
        for change in changes:
            change.do(self.state)
        self.state.is_changed = self._is_changed({change.kind for change in changes}, is_undo)
        try:
            record(self.seq + 1)
        except BaseException:
            for change in reversed(changes):
                change.inverse().do(self.state)
            self.state.is_changed = was_changed
            raise
        self.seq += 1

    def _is_changed(self, kinds: set[str], is_undo: bool) -> bool:
        """Whether the work has changed since its review, after changes of these kinds.

        If the last review is undone, an older review may be restored. The result is then True,
        because it is unknown whether the work has changed since the older review.
        """
        is_new = is_undo if "review" in kinds else bool(kinds & _LABELING)
        kept = self.state.is_changed and "review" not in kinds
        return self.state.is_reviewed and (is_new or kept)


def _first_state(header: Line, n_cells: int, classes: ClassList | None) -> State:
    usual = default_parameters(n_cells)
    parameters = checked_parameters(header["parameters"], usual, n_cells)
    if classes is None:
        own = header["classes"]  # None if the work was begun in a folder
        classes = default_classes() if own is None else _class_list(own)
    return State(np.zeros(n_cells, np.uint32), classes, Partition(parameters))


def _class_list(value: Any) -> ClassList:
    """Check a list of classes; lone surrogates, which older versions accepted, are removed."""
    text = json.dumps(value, ensure_ascii=False).encode("utf-8", "ignore")
    return checked_class_list(json.loads(text))


_LABELING = frozenset({"paint", "classes", "objects"})
"""Kinds of changes after which a review is out of date."""

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


# For each kind of change, one function writes the entries of a line, and another function reads
# them.


def _write_paint(change: Change) -> Line:
    values = change.after.unpacked()
    line = {
        "cells": base64_of(change.after.cells),
        **_write_numbers("class", "es", class_of(values)),
    }
    objects = object_of(values)  # without objects, the line has the format of version 1
    return {**line, **_write_numbers("object", "s", objects)} if objects.any() else line


def _write_numbers(name: str, plural: str, values: Numbers) -> Line:
    if bool((values == values[0]).all()):
        return {name: int(values[0])}
    return {name + plural: base64_of(zlib.compress(values.tobytes(), level=1))}


def _read_paint(line: Line, state: State) -> Change:
    n_cells = len(state.paint)
    cells = unpack_cells(bytes_from(line["cells"], "cells"), n_cells)
    classes = _read_numbers(line, "class", "es", MAX_CLASS, n_cells)
    has_objects = "object" in line or "objects" in line
    objects = _read_numbers(line, "object", "s", MAX_OBJECT, n_cells) if has_objects else 0
    change = Change.painting(state.paint, cells, paint_of(classes, objects), line.get("stroke"))
    if change is None:
        raise ValueError("it changes no cell")
    return change


def _read_numbers(line: Line, name: str, plural: str, highest: int, n_cells: int) -> int | Numbers:
    """Read one number for all cells of a line, or one number per cell."""
    if name not in line:
        data = inflated(bytes_from(line[name + plural], name + plural), 2 * n_cells)
        numbers = np.frombuffer(data, np.uint16)
        if numbers.max(initial=0) > highest:
            raise ValueError(f"{name} must be 0 to {highest}, got {numbers.max()}")
        return numbers
    value: int = line[name]
    if not isinstance(value, int) or not 0 <= value <= highest:
        raise ValueError(f"{name} must be 0 to {highest}, got {value}")
    return value


def _read_segment(line: Line, state: State) -> Change:
    before, n_cells = state.partition, len(state.paint)
    parameters = checked_parameters(line["parameters"], before.parameters, n_cells)
    return Change("segment", before, Partition(parameters, str(line["digest"])))


def _read_split(line: Line, state: State) -> Change:
    packed = bytes_from(line["cells"], "cells")
    unpack_cells(packed, len(state.paint))  # raises an error if the cells are damaged
    return Change("split", state.partition, state.partition.with_split(packed, str(line["digest"])))


def _read_objects(line: Line, state: State) -> Change:
    names: ObjectNames = ()
    for entry in line["names"]:
        object_id = checked_object(entry["object"])
        names = with_object_name(names, int(entry["class"]), object_id, entry["name"])
    return Change("objects", state.object_names, names, line.get("stroke"))


def _read_suggest(line: Line, state: State) -> Change:
    n_cells = len(state.paint)
    found = tuple(Suggestion.of_line(entry, n_cells) for entry in line["suggestions"])
    return Change("suggest", state.suggestions, found, line.get("stroke"))


def _write_settle(change: Change) -> Line:
    left = {one.id for one in change.after}
    return {"settled": [one.id for one in change.before if one.id not in left]}


def settling(state: State, ids: set[int], stroke: str | None) -> Change:
    """Change that removes these suggestions; a ValueError if one of them does not exist."""
    if lacking := ids - {one.id for one in state.suggestions}:
        raise ValueError(f"suggestion {min(lacking)} does not exist")
    left = tuple(one for one in state.suggestions if one.id not in ids)
    return Change("settle", state.suggestions, left, stroke)


_WRITERS: dict[str, Callable[[Change], Line]] = {
    "paint": _write_paint,
    "segment": lambda change: {
        "parameters": change.after.parameters, "digest": change.after.digest,
    },
    "split": lambda change: {
        "digest": change.after.digest, "cells": base64_of(change.after.splits[-1]),
    },
    "classes": lambda change: {"classes": list(change.after)},
    "objects": lambda change: {"names": list(change.after)},
    "review": lambda change: {"reviewed": change.after},
    "suggest": lambda change: {"suggestions": [one.line() for one in change.after]},
    "settle": _write_settle,
}  # fmt: skip

_READERS: dict[str, Callable[[Line, State], Change]] = {
    "paint": _read_paint,
    "segment": _read_segment,
    "split": _read_split,
    "classes": lambda line, state: Change(
        "classes", state.class_list, _class_list(line["classes"]), line.get("stroke")
    ),
    "objects": _read_objects,
    "review": lambda line, state: Change("review", state.is_reviewed, bool(line["reviewed"])),
    "suggest": _read_suggest,
    "settle": lambda line, state: settling(state, {*map(int, line["settled"])}, line.get("stroke")),
}
