"""Keep the state of a document, and the changes that can be undone or redone."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from superfacets.kit import CellFile, Ints, shortened

from ..labels.classes import ClassList, names_of, shared_classes, with_missing
from .changes import Change, State
from .effort import NO_STEP, Effort, line_after
from .journal import SHARED, Journal, JournalError, Line, parsed_work
from .journal_lines import SEVERAL, change_of, class_list_of, first_state, line_of


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


Recorder = Callable[[Line], object]
"""Function that writes a step to the journal, `Document._write`; not used to replay steps."""


@dataclass
class History:
    """State of a document, and stacks of changes that can be undone and redone.

    Each step (operation, undo or redo) is done completely or not at all. At its end, a step calls
    the function `record`, which writes a line to the journal. If the step or `record` raises an
    error, the state is the same as before the step.
    """

    state: State
    undo_stack: list[Change] = field(default_factory=list)
    redo_stack: list[Change] = field(default_factory=list)
    seq: int = 0  # number of steps in the journal
    effort: Effort | None = NO_STEP  # None if unknown
    shared: ClassList | None = None  # last class list of a folder in the journal
    unnamed: ClassList | None = None  # default list of a folder's journal that lists no classes
    parts: dict[str, int] = field(default_factory=dict)  # last part of each stroke, also if undone
    _made: list[Change] = field(default_factory=list)  # changes of the current or last step
    _reverting: contextlib.ExitStack | None = None  # reverts `_made`; None between two steps

    @classmethod
    def replayed(
        cls, journal: Journal, n_cells: int, classes: ClassList | None, work: Path | None = None
    ) -> History:
        """Return the history that results from all lines of a journal.

        `classes` is the class list that the meshes of a folder share, or None to use the list in
        the journal. If the journal has none, as from older versions, it is the list of the folder
        of the file `work`, or of the nearest above. Raises JournalError if a line is not valid.
        """
        number = 1
        try:
            history = cls(first_state(journal.header, n_cells, classes))
            first = history.state.class_list
            for line in journal.lines:
                number = history.seq + 2
                history.replay(line)
        except (KeyError, TypeError, ValueError, OverflowError, NothingError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise JournalError(
                f"{journal.path}: line {number} of the work file is not valid: {shortened(reason)}"
            ) from None
        if classes is None and journal.is_of_folder and history.state.class_list is first:
            history.unnamed = first
            classes = shared_classes(work.absolute().parents if work else ()) or None
        if classes is not None:  # because replayed lines may have replaced the list
            history.state.class_list = classes
        journal.lines.clear()
        return history

    def replay(self, line: Line) -> None:
        """Apply a line of the journal, which contains a change, an undo or a redo."""
        if line["seq"] != self.seq + 1:
            raise ValueError(f"seq must be {self.seq + 1}, got {line['seq']}")
        if line["op"] == SHARED:
            self.shared = self.state.class_list = class_list_of(line["classes"])
            self.seq += 1
            return
        name, self.effort = str(line["op"]), Effort.read(line)
        if name in ("undo", "redo"):
            with self.moving(name):
                return
        with self.operation() as made:
            for part in line["changes"] if name == SEVERAL else [line]:
                self.make(change_of(part, self.state))
            if not made:
                raise ValueError("it changes nothing")

    def check_names(self, name: str) -> None:
        """Raise a JournalError if the classes of cells have no names; `name` names the work."""
        if self.state.class_list is self.unnamed and self.state.paint.any():
            message = "has no class list, by which to match classes: open it once with its folder"
            raise JournalError(f"{name}: {message}")

    def share(self, record: Recorder) -> None:
        """Record the class list of a folder between two steps, unless the last one is the same."""
        if self._reverting is None and self.shared != self.state.class_list:
            times = asdict(self.effort) if self.effort else {}
            listed = list(self.state.class_list)
            record({"seq": self.seq + 1, "op": SHARED, "classes": listed, **times})
            self.shared = self.state.class_list
            self.seq += 1

    def make(self, change: Change) -> None:
        """Apply a change in the current step."""
        assert self._reverting is not None
        change.do(self.state)
        self._reverting.callback(change.inverse().do, self.state)
        self._made.append(change)

    def on_failure(self, action: Callable[..., object], *arguments: object) -> None:
        """Call a function if the current step fails, before earlier changes are reverted."""
        assert self._reverting is not None
        self._reverting.callback(action, *arguments)

    @contextlib.contextmanager
    def operation(self, record: Recorder | None = None) -> Iterator[list[Change]]:
        """Make all changes of a `with` block one operation, and yield the list of its changes.

        Operations that were undone before can then no longer be redone. An operation inside of an
        operation is a part of it. An operation without changes is not recorded.
        """
        if self._reverting is not None:
            yield self._made
            return
        with self._whole(record):
            yield self._made
        self.undo_stack.extend(self._made)
        for one in self._made:
            if one.stroke is not None and one.part is not None:
                self.parts[one.stroke] = one.part
        if self._made:
            self.redo_stack.clear()

    @contextlib.contextmanager
    def moving(self, name: str, record: Recorder | None = None) -> Iterator[list[Change]]:
        """Undo or redo the last operation or stroke, and yield its changes to the `with` block.

        `name` is "undo" or "redo". Raises NothingError if there is nothing to undo or redo.
        """
        is_undo = name == "undo"
        stacks = self.undo_stack, self.redo_stack
        source, target = stacks if is_undo else stacks[::-1]
        changes = last_stroke(source)
        if not changes:
            raise NothingError(f"there is nothing to {name}")
        with self._whole(record, name):
            for change in changes:
                self.make(change.inverse() if is_undo else change)
            yield changes
        del source[len(source) - len(changes) :]
        target.extend(changes)

    @contextlib.contextmanager
    def _whole(self, record: Recorder | None, name: str | None = None) -> Iterator[None]:
        """Record the changes of the `with` block when it ends; after an error, revert them.

        `name` is "undo" or "redo", and None for an operation.
        """
        self._made = []
        was_changed = self.state.is_changed
        try:
            with contextlib.ExitStack() as self._reverting:
                yield
                if self._made:
                    self._reverting.callback(setattr, self.state, "is_changed", was_changed)
                    self.state.is_changed = self._is_changed_since_review(name == "undo")
                    if record is not None:
                        line = {"op": name} if name else line_of(self._made)
                        times = line_after(self.effort, self._n_strokes(name))
                        record({"seq": self.seq + 1, **line, **times})
                        self.effort = Effort.read(times)
                    self.seq += 1
                self._reverting.pop_all()
        finally:
            self._reverting = None

    def _n_strokes(self, name: str | None) -> int:
        """Return 1 if an operation, not an undo or redo `name`, begins a stroke, otherwise 0."""
        is_new = len(last_stroke([*self.undo_stack[-1:], self._made[0]])) == 1  # no change before
        is_stroke = any(change.kind in ("paint", "split") for change in self._made)
        return int(name is None and is_new and is_stroke)

    def _is_changed_since_review(self, is_undo: bool) -> bool:
        """Return whether labels may differ from the reviewed labels after the current step.

        If the document is not reviewed, the result is False. If undoing a review restores an older
        review, the result is True, because labels may have changed between the two reviews.
        """
        kinds = {change.kind for change in self._made}
        is_new = is_undo if "review" in kinds else bool(kinds & _LABELING)
        kept = self.state.is_changed and "review" not in kinds
        return self.state.is_reviewed and (is_new or kept)


def classes_in_work(
    path: Path, data: bytes, source: CellFile, n_cells: int
) -> tuple[Ints, dict[int, str], list[str]]:
    """Return classes of cells in a work file, (N,), names of classes, and notes about damage.

    The class 0 means no class. `source` is the file of the cells.
    Raises JournalError if the data is not a valid work file of this file.
    """
    journal = parsed_work(path, data)
    digest = hashlib.sha256(source.data).hexdigest()
    journal.check_source(Path(source.name), digest, n_cells)
    state = History.replayed(journal, n_cells, None, path).state
    classes = state.classes.astype(np.int32)
    return classes, names_of(with_missing(state.class_list, np.unique(classes))), journal.notes


_LABELING = frozenset({"paint", "classes", "objects"})
"""Kinds of changes that make a review outdated."""
