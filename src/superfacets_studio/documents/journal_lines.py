"""Convert changes of a document to lines of the work file, and lines back to changes."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ..labels import classes as labeling
from ..labels.classes import MAX_CLASS, MAX_OBJECT, ClassList, ObjectNames, class_of, object_of
from ..labels.coding import base64_of, bytes_from, inflated, unpack_cells
from ..labels.suggestions import Suggestion, Suggestions
from ..regions.revisions import Partition
from ..regions.segmenting import checked_parameters, default_parameters
from .changes import Change, Numbers, State, unsettled
from .journal import Line

SEVERAL = "several"
"""Entry ``op`` of a line with several changes. Older versions wrote a line for each change."""


def first_state(header: Line, n_cells: int, classes: ClassList | None) -> State:
    """Return the state before the first change; `classes` may replace the list in `header`."""
    usual = default_parameters(n_cells)
    parameters = checked_parameters(header["parameters"], usual, n_cells)
    if classes is None:
        own = header["classes"]  # None if all files of a folder share their classes
        classes = labeling.default_classes() if own is None else class_list_of(own)
    return State(np.zeros(n_cells, np.uint32), classes, Partition(parameters))


def line_of(changes: list[Change]) -> Line:
    """Return the changes of an operation as one line of the journal, to replay all or none."""
    entries = []
    for change in changes:
        values = {"stroke": change.stroke, "part": change.part}
        named = {name: value for name, value in values.items() if value is not None}
        entries.append({"op": change.kind, **_WRITERS[change.kind](change), **named})
    return entries[0] if len(entries) == 1 else {"op": SEVERAL, "changes": entries}


def change_of(line: Line, state: State) -> Change:
    """Return the change in a line; raise a ValueError, TypeError or KeyError if it is invalid."""
    name, stroke = str(line["op"]), line.get("stroke")
    if name == "paint":
        return _read_paint(line, state)
    if name not in _READERS:
        raise ValueError(f"unknown operation {name}")
    return Change.replacing(state, name, _READERS[name](line, state), stroke)


def class_list_of(value: Any) -> ClassList:
    """Check a list of classes, and remove lone surrogates, which older versions accepted."""
    text = json.dumps(value, ensure_ascii=False).encode("utf-8", "ignore")
    return labeling.checked_class_list(json.loads(text))


# For each kind of change, one function converts a change to the entries of a line. Another function
# converts a line to the new value of the field that the change replaces.


def _write_paint(change: Change) -> Line:
    values = change.after.unpacked()  # one value if all are equal
    cells = base64_of(change.after.cells)
    line = {"cells": cells, **_write_numbers("class", "es", class_of(values))}
    objects = object_of(values)  # version 1 can read a line only if it has no objects
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
    wanted = labeling.paint_of(classes, objects)
    part = int(line["part"]) if "part" in line else None
    change = Change.painting(state.paint, cells, wanted, line.get("stroke"), part)
    if change is None:
        raise ValueError("it changes no cell")
    return change


def _read_numbers(line: Line, name: str, plural: str, highest: int, n_cells: int) -> int | Numbers:
    """Return one number for all cells (entry `name`), or one per cell (entry `name + plural`).

    Raises ValueError if a number is above `highest`.
    """
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


def _read_segment(line: Line, state: State) -> Partition:
    usual, n_cells = state.partition.parameters, len(state.paint)
    return Partition(checked_parameters(line["parameters"], usual, n_cells), str(line["digest"]))


def _read_split(line: Line, state: State) -> Partition:
    packed = bytes_from(line["cells"], "cells")
    unpack_cells(packed, len(state.paint))  # raises a ValueError if the cells are damaged
    return state.partition.with_split(packed, str(line["digest"]))


def _read_objects(line: Line, state: State) -> ObjectNames:
    names: ObjectNames = ()
    for entry in line["names"]:
        object_id = labeling.checked_object(entry["object"])
        names = labeling.with_object_name(names, int(entry["class"]), object_id, entry["name"])
    return names


def _read_suggest(line: Line, state: State) -> Suggestions:
    return tuple(Suggestion.of_line(entry, len(state.paint)) for entry in line["suggestions"])


def _write_settle(change: Change) -> Line:
    left = {one.id for one in change.after}
    return {"settled": [one.id for one in change.before if one.id not in left]}


_WRITERS: dict[str, Callable[[Change], Line]] = {
    "paint": _write_paint,
    "segment": lambda one: {"parameters": one.after.parameters, "digest": one.after.digest},
    "split": lambda one: {"digest": one.after.digest, "cells": base64_of(one.after.splits[-1])},
    "classes": lambda change: {"classes": list(change.after)},
    "objects": lambda change: {"names": list(change.after)},
    "review": lambda change: {"reviewed": change.after},
    "suggest": lambda change: {"suggestions": [one.line() for one in change.after]},
    "settle": _write_settle,
}  # fmt: skip

_READERS: dict[str, Callable[[Line, State], Any]] = {
    "segment": _read_segment, "split": _read_split, "objects": _read_objects,
    "classes": lambda line, _: class_list_of(line["classes"]), "suggest": _read_suggest,
    "review": lambda line, _: bool(line["reviewed"]),
    "settle": lambda line, state: unsettled(state, {*map(int, line["settled"])}),
}  # fmt: skip
