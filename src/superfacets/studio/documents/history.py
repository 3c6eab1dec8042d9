"""Keep the state of a document, and the changes that can be undone or redone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..._types import Ints
from ...io.guards import shortened
from ..labels.classes import ClassList
from .changes import Change, State
from .journal import Journal, JournalError, Line, parsed_work
from .journal_lines import change_of, first_state


class NothingError(LookupError):
    """Error raised if there is nothing to undo or redo."""


def last_stroke(changes: list[Change]) -> list[Change]:
    """Return the last change and the changes just before it in the same stroke, latest first."""
    found: list[Change] = []
    for change in reversed(changes):
        if found and (change.stroke is None or change.stroke != found[0].stroke):
            break
        found.append(change)
    return found


def _nothing(seq: int) -> None:
    """Do nothing instead of recording a step: replayed steps are in the journal already."""


@dataclass
class History:
    """State of a document, and stacks of changes that can be undone and redone.

    Methods that change the state call a function `record` with the number of the step, to write the
    step to the journal. If `record` raises an error, the state does not change.
    """

    state: State
    undo_stack: list[Change] = field(default_factory=list)
    redo_stack: list[Change] = field(default_factory=list)
    seq: int = 0  # number of steps (changes, undos and redos) in the journal
    parts: dict[str, int] = field(default_factory=dict)  # last part of each stroke that has parts

    @classmethod
    def replayed(cls, journal: Journal, n_cells: int, classes: ClassList | None) -> History:
        """Return the history that results from all lines of a journal.

        `classes` is the class list that the meshes of a folder share, or None to use the list in
        the journal. Raises JournalError if a line cannot be replayed.
        """
        number = 1
        try:
            history = cls(first_state(journal.header, n_cells, classes))
            for line in journal.lines:
                number = history.seq + 2
                history.replay(line)
        except (KeyError, TypeError, ValueError, OverflowError, NothingError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise JournalError(
                f"{journal.path}: line {number} of the work file is not valid: {shortened(reason)}"
            ) from None
        if classes is not None:  # because replayed lines may have replaced the list
            history.state.class_list = classes
        journal.lines.clear()
        return history

    def replay(self, line: Line) -> None:
        """Apply a line of the journal, which contains a change, an undo or a redo."""
        if line["seq"] != self.seq + 1:
            raise ValueError(f"seq must be {self.seq + 1}, got {line['seq']}")
        name = str(line["op"])
        if name in ("undo", "redo"):
            self.move(name)
        else:
            self.make(change_of(line, self.state))

    def make(self, change: Change, record: Callable[[int], object] = _nothing) -> None:
        """Apply a new change; changes that were undone before can then no longer be redone."""
        self._apply([change], record)
        if change.stroke is not None and change.part is not None:
            self.parts[change.stroke] = change.part
        self.undo_stack.append(change)
        self.redo_stack.clear()

    def move(self, name: str, record: Callable[[int], object] = _nothing) -> list[Change]:
        """Undo or redo the last change or stroke, and return its changes.

        `name` is "undo" or "redo". Raises NothingError if there is nothing to undo or redo.
        """
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
        """Return whether labels may differ from the reviewed labels after changes of these kinds.

        If the document is not reviewed, the result is False. If undoing a review restores an older
        review, the result is True, because labels may have changed between the two reviews.
        """
        is_new = is_undo if "review" in kinds else bool(kinds & _LABELING)
        kept = self.state.is_changed and "review" not in kinds
        return self.state.is_reviewed and (is_new or kept)


def classes_in_work(
    path: Path, data: bytes, source: Path, digest: str, n_cells: int
) -> tuple[Ints, list[str]]:
    """Return the class of each cell, (N,), in the content of a work file, and notes about damage.

    The class 0 means no class. `digest` is the SHA-256 hash of `source`, the file of the cells.
    Raises JournalError if the data is not a valid work file of this file.
    """
    journal = parsed_work(path, data)
    journal.check_source(source, digest, n_cells)
    state = History.replayed(journal, n_cells, None).state
    return state.classes.astype(np.int32), journal.notes


_LABELING = frozenset({"paint", "classes", "objects"})
"""Kinds of changes that make a review outdated."""
