"""A mesh that is being labeled: its classes, its regions, and the journal of the work."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from .._types import Floats, Ints
from .._validate import checked_threads
from ..cells.kinds import measures_of
from ..io.atomic import atomic_outputs
from ..mesh.cells import Cells
from .agreement import Side, Theirs, agreement, read_theirs
from .classes import (
    INSTANCES,
    MAX_CLASS,
    MAX_OBJECT,
    ClassList,
    checked_class_list,
    class_of,
    default_classes,
    names_of,
    object_of,
    paint_of,
    stuff_of,
    with_missing,
    with_object_name,
)
from .coding import CellNumbers, pack_cells, unpack_cells
from .history import Change, History, Partition, State, settling
from .imports import Imported
from .journal import Journal, Line
from .revisions import GoneError, Revision, Revisions
from .segmenting import Base, Segmenter, default_parameters
from .source import Source
from .splitting import split_cells
from .suggestions import suggestions_of


def work_file_of(path: Path) -> Path:
    """Default work file of an input, beside it."""
    return path.with_name(path.name + ".studio.jsonl")


OTHER_VERSION = (
    "This version of superfacets makes other regions than the version that began this work."
    " Splits of regions are lost; all classes and objects are kept."
)


@dataclass
class Document:
    """A mesh with the state of its labeling.

    All changes go through the journal. A change that cannot be written is reverted.
    """

    source: Source
    journal: Journal
    history: History
    segmenter: Segmenter
    base: Base
    share_classes: Callable[[ClassList], object] | None = None
    notes: list[str] = field(default_factory=list)
    revisions: Revisions = field(default_factory=Revisions)
    revision: Revision = field(init=False)
    theirs: Theirs | None = None  # work that this one is compared with
    lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.notes += self.journal.notes
        self._show(self.base)
        self._adopt_base()

    @classmethod
    def open(
        cls, path: Path, work: Path | None = None, n_segments: int | None = None,
        classes: ClassList = (), share_classes: Callable[[ClassList], object] | None = None,
    ) -> Document:  # fmt: skip
        """Read an input and the work on it, and find its regions.

        By default, the work file is beside the input. `n_segments` and `classes` are for new work.
        In a folder, `classes` are for all work, and `share_classes` stores a new list for all
        meshes.

        Raises MeshError or OSError if the input cannot be read; JournalError if the work file
        cannot be used, or is about another file.
        """
        source = Source.read(path)
        own = None if share_classes else list(classes or default_classes())
        parameters = default_parameters(source.n_cells, n_segments)
        header = {**source.facts, "parameters": parameters, "classes": own}
        journal = Journal.open(work.resolve() if work else work_file_of(path), header)
        try:
            source.check_work(journal)
            history = History.replayed(journal, source.n_cells, classes if share_classes else None)
            segmenter = Segmenter(source.cells)
            base = segmenter.base(history.state.partition.parameters)
            return cls(source, journal, history, segmenter, base, share_classes)
        except BaseException:
            journal.close()
            raise

    @property
    def path(self) -> Path:
        """The input file."""
        return self.source.path

    @property
    def cells(self) -> Cells:
        """The mesh or point cloud that is labeled."""
        return self.source.cells

    @property
    def state(self) -> State:
        """The class and object of each cell, the lists of both, and the regions."""
        return self.history.state

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return len(self.state.paint)

    @cached_property
    def areas(self) -> Floats:
        """Area (or volume) of each cell."""
        return measures_of(self.cells, checked_threads(None))

    @property
    def progress(self) -> float:
        """Share of the area that has a class, 0 to 1; of the cells if the area is 0."""
        is_done = self.state.paint > 0
        if self._total > 0:
            return float(min(1.0, np.sum(self.areas, where=is_done) / self._total))
        return float(np.count_nonzero(is_done) / self.n_cells)

    @cached_property
    def _total(self) -> float:
        return float(self.areas.sum())

    @property
    def class_list(self) -> ClassList:
        """The list of classes, with all classes of cells and suggestions."""
        used = np.flatnonzero(np.bincount(self.state.classes, minlength=1)).tolist()
        suggested = {one.class_id for one in self.state.suggestions}
        return with_missing(self.state.class_list, suggested.union(used))

    @property
    def instances(self) -> Ints:
        """Class and object of each cell, as ``class * 1000 + object``, (N,); 0: no class."""
        return self.state.classes.astype(np.int32) * INSTANCES + self.state.objects

    def name_of(self, class_id: int, object_id: int = 0) -> str:
        """The name of a class, or of an object of it."""
        for entry in self.state.object_names:
            if object_id and (entry["class"], entry["object"]) == (class_id, object_id):
                return str(entry["name"])
        name = names_of(self.class_list)[class_id]
        sign = "#" if name[-1].isdigit() else ""  # "class 1 #2", but "chair 2"
        return f"{name} {sign}{object_id}" if object_id else name

    def close(self) -> None:
        """Stop all runs, and close the work file."""
        with self.lock:
            self.segmenter.close()
            self.journal.close()

    # Operations. Each returns after its line of the journal is on the disk. In a folder,
    # `set_classes` writes no line, but the list that all files of the folder share.

    def paint(
        self, cells: CellNumbers, classes: Any, stroke: str | None = None, *, objects: Any = 0
    ) -> Change | None:
        """Give cells (ascending) a class and an object of it, one for all or one each; 0 is none.

        Returns None if nothing changes. Raises ValueError if there is no such class; JournalError
        if the change could not be written; ChangedError if the input has changed.
        """
        with self.lock:
            values = np.unique(np.asarray(classes))
            if unknown := {*values.tolist()} - {0, *names_of(self.class_list)}:
                raise ValueError(f"there is no class {min(unknown)}")
            wanted = paint_of(classes, objects)
            change = Change.painting(self.state.paint, cells, wanted, stroke)
            if change is not None:
                self._commit(change)
            return change

    def split_object(self, class_id: int, object_id: int) -> list[int]:
        """Make each connected piece of an object, except the largest, an object; return their ids.

        Object 0 stands for all cells of the class without an object: each piece becomes an object.
        Raises ValueError if there is no such object, or it is in one piece.
        """
        with self.lock:
            is_in = (self.state.classes == class_id) & (self.state.objects == object_id)
            if not class_id or not is_in.any():
                raise ValueError(f"there is no object {object_id} of class {class_id}")
            surface = self.segmenter.surface
            pieces, _ = _core.find_components(
                surface.offsets, surface.neighbors, is_in.astype(np.int32)
            )
            cells = np.flatnonzero(is_in)
            ids, ranks = np.unique(pieces[cells], return_inverse=True)
            if object_id and len(ids) == 1:
                raise ValueError(f"{self.name_of(class_id, object_id)} is in one piece")
            kept = [object_id] if object_id else []  # the largest piece keeps its number
            first = self.free_object(class_id)
            new = list(range(first, first + len(ids) - len(kept)))
            if new[-1] > MAX_OBJECT:
                raise ValueError(f"{len(ids)} pieces are too many: objects go to {MAX_OBJECT}")
            numbers = np.zeros(len(ids), np.int64)
            areas = np.bincount(ranks, self.areas[cells])
            numbers[np.argsort(-areas, kind="stable")] = kept + new
            self.paint(cells.astype(np.uint32), class_id, objects=numbers[ranks])
            return new

    def free_object(self, class_id: int) -> int:
        """The lowest number of an object of a class above all numbers that cells have."""
        of_class = self.state.objects[self.state.classes == class_id]
        return int(of_class.max(initial=0)) + 1

    def name_object(self, class_id: int, object_id: int, name: object) -> None:
        """Give an object a name, or remove it if it is empty; a ValueError if one is wrong."""
        with self.lock:
            if not object_id or object_id not in self.state.objects[self.state.classes == class_id]:
                raise ValueError(f"there is no object {object_id} of class {class_id}")
            before = self.state.object_names
            after = with_object_name(before, class_id, object_id, name)
            if after != before:
                self._commit(Change("objects", before, after))

    def review(self, is_reviewed: bool) -> None:
        """Mark the work on this file as reviewed, or not; also again after later changes."""
        with self.lock:
            if is_reviewed != self.state.is_reviewed or self.state.is_changed:
                self._commit(Change("review", self.state.is_reviewed, is_reviewed))

    def set_base(self, parameters: dict[str, Any], base: Base) -> Revision:
        """Show the regions computed by the segmenter for these parameters."""
        with self.lock:
            before, partition = self.state.partition, Partition(parameters, base.digest)
            is_new = before.digest not in ("", base.digest) or bool(before.splits)
            if is_new or before.parameters != parameters:
                self._commit(Change("segment", before, partition))
            return self._show(base)

    def split(
        self, region: int, number: object, red: CellNumbers, blue: CellNumbers
    ) -> CellNumbers:
        """Split a region of this revision by strokes; return the cells of the new region.

        The new region has the blue stroke, and the next free label. Raises GoneError if the
        revision is not current; ValueError if there is no such region, or it has no stroke.
        """
        with self.lock:
            if self.revisions.get(number) is not self.revision:
                raise GoneError("the regions have changed: ask for the state and its labels")
            whole = self.revision.cells_of(region)
            cells = split_cells(self.segmenter.surface, whole, red, blue)
            self._adopt_base()
            before = self.state.partition
            after = before.with_split(pack_cells(cells), self.base.digest)
            self._commit(Change("split", before, after))
            labels = self.revision.labels.copy()
            labels[cells] = self.revision.n_regions
            self.revision = self.revisions.add(after, labels, self.revision.n_regions + 1)
            return cells

    def take(self, imported: Imported) -> Change | None:
        """Paint imported classes and objects, and add new ones to the lists; one undo reverts all.

        Imported objects get numbers above the objects of all cells that are not imported. Raises
        ValueError if a class would have more than `MAX_OBJECT` objects.
        """
        with self.lock:
            stroke = f"import {self.history.seq + 1}"
            highest = np.zeros(MAX_CLASS + 1, np.int64)
            is_left = np.ones(self.n_cells, bool)
            is_left[imported.cells] = False
            np.maximum.at(highest, self.state.classes[is_left], self.state.objects[is_left])
            objects = imported.objects.astype(np.int64)
            objects += np.where(objects > 0, highest[imported.classes], 0)
            if objects.max(initial=0) > MAX_OBJECT:
                raise ValueError(f"a class has at most {MAX_OBJECT} objects")
            self.set_classes(list(imported.class_list), stroke)
            change = self.paint(imported.cells, imported.classes, stroke, objects=objects)
            names = self.state.object_names
            for (class_id, object_id), name in imported.names.items():
                shifted = object_id + int(highest[class_id])
                names = with_object_name(names, class_id, shifted, name)
            if names != self.state.object_names:
                self._commit(Change("objects", self.state.object_names, names, stroke))
            return change

    def suggest(self, imported: Imported) -> int:
        """Replace all suggestions by imported objects; return their number, which must not be 0."""
        with self.lock:
            suggestions, classes = suggestions_of(imported, self.class_list)
            if not suggestions:
                raise ValueError("the files suggest no object: no cell has a label above 0")
            stroke = f"suggest {self.history.seq + 1}"
            self.set_classes(list(classes), stroke)
            self._commit(Change("suggest", self.state.suggestions, suggestions, stroke))
            return len(suggestions)

    def settle(self, accepted: Mapping[int, int], rejected: Collection[int] = ()) -> list[Change]:
        """Accept and reject suggestions; return the changes, which one undo reverts.

        `accepted` has the class of each suggestion by its id. The cells of a suggestion that have
        no class become a new object of its class; stuff has no objects. Raises ValueError if there
        is no such suggestion or class, a suggestion is both accepted and rejected, none is named,
        or a class would have more than `MAX_OBJECT` objects.
        """
        if both := {*accepted}.intersection(rejected):
            raise ValueError(f"suggestion {min(both)} is both accepted and rejected")
        if not accepted and not rejected:
            raise ValueError("name suggestions to accept or reject")
        with self.lock:
            stroke = f"settle {self.history.seq + 1}"
            settled = settling(self.state, {*accepted, *rejected}, stroke)
            n_before = len(self.history.undo_stack)
            self._paint_suggestions(accepted, stroke)
            self._commit(settled)
            return self.history.undo_stack[n_before:]

    def _paint_suggestions(self, accepted: Mapping[int, int], stroke: str) -> None:
        stuff = stuff_of(self.class_list)
        paint = np.zeros(self.n_cells, np.uint32)
        next_object = {class_id: self.free_object(class_id) for class_id in {*accepted.values()}}
        for one in self.state.suggestions:
            if one.id not in accepted:
                continue
            class_id = accepted[one.id]
            cells = unpack_cells(one.cells, self.n_cells)
            bare = cells[self.state.paint[cells] == 0]
            object_id = 0 if class_id in stuff else next_object[class_id]
            if object_id > MAX_OBJECT:
                raise ValueError(f"a class has at most {MAX_OBJECT} objects")
            if not class_id:
                raise ValueError(f"suggestion {one.id} needs a class")
            paint[bare] = paint_of(class_id, object_id)
            next_object[class_id] += bool(len(bare))
        painted = np.flatnonzero(paint).astype(np.uint32)
        found = paint[painted]
        self.paint(painted, class_of(found), stroke, objects=object_of(found))

    def compare(self, name: str, data: bytes) -> None:
        """Compare with another work file of the mesh; a JournalError if it cannot be used."""
        with self.lock:
            self.theirs = read_theirs(name, data, self.source, self.state, self.areas)

    def agreement(self) -> dict[str, Any]:
        """The agreement of both works, as from `agreement`; a ValueError without a comparison."""
        return agreement(self.state, self._compared(), self.areas)

    def differing(self) -> CellNumbers:
        """Cells that both works have given a class, but not the same class and object."""
        with self.lock:
            return np.flatnonzero(self._compared().differs(self.state.paint)).astype(np.uint32)

    def accept(self, cells: CellNumbers, side: Side) -> Change | None:
        """Resolve the differences in these cells: take their labels, or keep mine.

        Their labels are also taken for cells to which I have given no class.
        """
        with self.lock:
            theirs = self._compared()
            if side == "mine":
                theirs.paint[cells] = self.state.paint[cells]
                return None
            stroke = f"theirs {self.history.seq + 1}"
            known = names_of(self.class_list)
            new = [entry for entry in theirs.class_list if entry["id"] not in known]
            self.set_classes([*self.class_list, *new], stroke)
            taken = cells[theirs.paint[cells] > 0]
            paint = theirs.paint[taken]
            return self.paint(taken, class_of(paint), stroke, objects=object_of(paint))

    def _compared(self) -> Theirs:
        if self.theirs is None:
            raise ValueError("there is no work to compare with: read another work file first")
        return self.theirs

    def set_classes(self, value: object, stroke: str | None = None) -> None:
        """Replace the list of classes.

        Raises ValueError if the list is wrong, or lacks a class that cells have.
        """
        classes = checked_class_list(value)
        with self.lock:
            counts = np.bincount(self.state.classes).tolist()
            kept = names_of(classes)
            for class_id in np.flatnonzero(counts).tolist():
                if class_id and class_id not in kept:
                    raise ValueError(
                        f"class {class_id} has {counts[class_id]} cells:"
                        " give these another class first"
                    )
            for one in self.state.suggestions:
                if one.class_id and one.class_id not in kept:
                    raise ValueError(
                        f"class {one.class_id} has suggestions: accept or reject these first"
                    )
            if self.share_classes is not None:
                self.share_classes(classes)
                self.state.class_list = classes
            elif classes != self.state.class_list:
                self._commit(Change("classes", self.state.class_list, classes, stroke))

    def undo(self) -> list[Change]:
        """Undo the last operation or stroke; return its changes, or raise NothingError."""
        return self._move("undo")

    def redo(self) -> list[Change]:
        """Redo the last undone operation or stroke; return its changes, or raise NothingError."""
        return self._move("redo")

    def _move(self, name: str) -> list[Change]:
        with self.lock:
            self.source.check()
            changes = self.history.move(name, lambda seq: self._write(seq, {"op": name}))
            if changes[-1].kind in ("segment", "split"):
                self._show(self.segmenter.base(self.state.partition.parameters))
            return changes

    def _commit(self, change: Change) -> None:
        """Make a new change, and write it."""
        self.source.check()
        self.history.make(change, lambda seq: self._write(seq, change.line()))

    def _write(self, seq: int, line: Line) -> None:
        done = round(self.progress, 6)
        self.journal.append({"seq": seq, **line, "done": done, **self.state.review_marks})

    def _is_foreign(self) -> bool:
        """Whether the state's partition was made from other labels than those of the base."""
        return self.state.partition.digest not in ("", self.base.digest)

    def _adopt_base(self) -> None:
        """Replace a partition of another version by the base, as a step that can be undone.

        Undo does not call this: the new step would come before the steps still to be undone.
        """
        if self._is_foreign():
            self.set_base(self.state.partition.parameters, self.base)

    def _show(self, base: Base) -> Revision:
        """Show the labels of the base with later splits; splits of another version are ignored."""
        self.base = base
        labels, n_regions = base.labels, base.n_regions
        partition = self.state.partition
        if self._is_foreign():
            if OTHER_VERSION not in self.notes:
                self.notes.append(OTHER_VERSION)
        elif partition.splits:
            labels = labels.copy()
            for split in partition.splits:
                labels[unpack_cells(split, self.n_cells)] = n_regions
                n_regions += 1
        self.revision = self.revisions.add(partition, labels, n_regions)
        return self.revision


def merged_work(
    path: Path, mine: Path, theirs: Path, output: Path | None = None, *, prefer_theirs: bool = False
) -> dict[str, Any]:
    """Compare two work files of a mesh, and return their agreement, as from `agreement`.

    With `output`, the merged work is written there: my work, and one more step. This step takes
    their labels for cells without a class and, with `prefer_theirs`, for cells that differ.

    Raises MeshError, JournalError or OSError if a file cannot be read or written.
    """
    with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
        copy = Path(folder, mine.name)
        copy.write_bytes(mine.read_bytes())
        document = Document.open(path, copy)
        try:
            document.compare(theirs.name, theirs.read_bytes())
            found = document.agreement()
            paint = document.state.paint
            wanted = paint != document._compared().paint if prefer_theirs else paint == 0
            document.accept(np.flatnonzero(wanted).astype(np.uint32), "theirs")
        finally:
            document.close()
        if output is not None:
            with atomic_outputs([output]) as (temporary,):
                temporary.write_bytes(copy.read_bytes())
    return found
