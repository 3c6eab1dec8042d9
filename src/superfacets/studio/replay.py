"""The state that the lines of a journal lead to."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..io.guards import shortened
from .changes import Change, Painted, Partition, State, last_stroke
from .classes import MAX_CLASS, ClassList, checked_class_list, default_classes
from .coding import bytes_from, inflated, unpack_cells
from .journal import Journal, JournalError, Line
from .parameters import checked_parameters, default_parameters


@dataclass
class Replay:
    """The state, and what can be undone and redone."""

    state: State
    undo_stack: list[Change] = field(default_factory=list)
    redo_stack: list[Change] = field(default_factory=list)
    seq: int = 0

    @classmethod
    def of(cls, journal: Journal, n_cells: int, classes: ClassList | None) -> Replay:
        """Replay all lines; classes are those of the folder, if it has some.

        Raises
        ------
        JournalError
            If a line says what cannot be done.
        """
        try:
            replay = cls(_first_state(journal.header, n_cells, classes))
            for line in journal.lines:
                replay.step(line)
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            number = replay.seq + 2 if "replay" in locals() else 1
            reason = f"it has no {error}" if isinstance(error, KeyError) else str(error)
            raise JournalError(
                f"{journal.path}: line {number} of the work file makes no sense:"
                f" {shortened(reason)}"
            ) from None
        if classes is not None:  # whatever the work had before the folder
            replay.state.class_list = classes
        journal.lines.clear()
        return replay

    def step(self, line: Line) -> None:
        """Do what a line says."""
        if line["seq"] != self.seq + 1:
            raise ValueError(f"it is number {line['seq']}, not {self.seq + 1}")
        if line["op"] in ("undo", "redo"):
            self._move(line["op"])
        else:
            read = _READERS.get(str(line["op"]))
            if read is None:
                raise ValueError(f"there is no operation {line['op']}")
            change = read(line, self.state)
            change.do(self.state)
            self.undo_stack.append(change)
            self.redo_stack.clear()
        self.seq += 1

    def _move(self, name: str) -> None:
        source, target = self.undo_stack, self.redo_stack
        if name == "redo":
            source, target = target, source
        changes = last_stroke(source)
        if not changes:
            raise ValueError(f"there is nothing to {name}")
        for change in changes:
            (change.undo if name == "undo" else change.do)(self.state)
        del source[len(source) - len(changes) :]
        target.extend(changes)


def _first_state(header: Line, n_cells: int, classes: ClassList | None) -> State:
    usual = default_parameters(n_cells)
    parameters = checked_parameters(header["parameters"], usual, n_cells)
    if classes is None:
        own = header["classes"]  # None: of work that was begun in a folder
        classes = default_classes() if own is None else _class_list(own)
    return State(np.zeros(n_cells, np.uint16), classes, Partition(parameters))


def _read_paint(line: Line, state: State) -> Change:
    n_cells = len(state.classes)
    cells = unpack_cells(bytes_from(line["cells"], "cells"), n_cells)
    wanted: int | npt.NDArray[np.uint16]
    if "class" in line:
        wanted = line["class"]
        if not isinstance(wanted, int) or not 0 <= wanted <= MAX_CLASS:
            raise ValueError(f"class {wanted} is not 0 to {MAX_CLASS}")
    else:
        data = inflated(bytes_from(line["classes"], "classes"), 2 * n_cells)
        wanted = np.frombuffer(data, np.uint16)
    painted = Painted.of(state.classes, cells, wanted)
    if painted is None:
        raise ValueError("it changes nothing")
    return Change("paint", painted, painted, line.get("stroke"))


def _read_segment(line: Line, state: State) -> Change:
    before, n_cells = state.partition, len(state.classes)
    parameters = checked_parameters(line["parameters"], before.parameters, n_cells)
    return Change("segment", before, Partition(parameters, str(line["digest"])))


def _read_split(line: Line, state: State) -> Change:
    cells = unpack_cells(bytes_from(line["cells"], "cells"), len(state.classes))
    return Change("split", state.partition, state.partition.with_split(cells, str(line["digest"])))


def _read_classes(line: Line, state: State) -> Change:
    classes = _class_list(line["classes"])
    return Change("classes", state.class_list, classes, line.get("stroke"))


def _class_list(value: Any) -> ClassList:
    """Class names of a line, without lone surrogates, which older versions accepted."""
    text = json.dumps(value, ensure_ascii=False).encode("utf-8", "ignore")
    return checked_class_list(json.loads(text))


_READERS: dict[str, Callable[[Line, Any], Change]] = {
    "paint": _read_paint,
    "segment": _read_segment,
    "split": _read_split,
    "classes": _read_classes,
}
