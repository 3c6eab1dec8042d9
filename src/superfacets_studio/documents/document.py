"""Represent a mesh that is being labeled: its cells, labels, regions, and journal of changes."""

from __future__ import annotations

import contextlib
import itertools
import tempfile
import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partialmethod
from pathlib import Path
from typing import Any

import numpy as np

from superfacets.kit import Cells, Floats, Ints, atomic_outputs, counted, kind_of
from superfacets_show import Up

from ..labels import classes as labeling
from ..labels.classes import MAX_OBJECT, ClassList, class_of, names_of, object_of, paint_of
from ..labels.coding import CellNumbers, pack_cells, unpack_cells
from ..labels.imports import Imported
from ..labels.suggestions import suggestions_of
from ..regions.revisions import GoneError, Partition, Revision, Revisions
from ..regions.segmenting import Segmenter, UnsplitRegions, first_parameters
from ..regions.splitting import split_cells
from .agreement import Side, Theirs, agreement, read_theirs
from .changes import Change, State, unsettled
from .effort import statistics
from .history import History
from .journal import Journal, JournalError, Line, WriteError, parsed_work
from .source import ChangedError, Source


def work_file_of(path: Path) -> Path:
    """Return the default path of the work file, which is in the folder of the input file."""
    return path.with_name(path.name + ".studio.jsonl")


OTHER_VERSION = (
    "This version of superfacets computes other regions than the version that created the work."
    " Splits of regions are lost; all classes and objects are kept."
)


@dataclass
class Document:
    """A mesh that is being labeled; every change of its state is also written to the journal."""

    source: Source
    journal: Journal
    history: History
    segmenter: Segmenter
    base: UnsplitRegions
    share_classes: Callable[[ClassList], object] | None = None
    notes: list[str] = field(default_factory=list)
    revisions: Revisions = field(default_factory=Revisions)
    revision: Revision = field(init=False)
    theirs: Theirs | None = None  # labels to compare with, from another work file
    up: Up = "auto"  # axis that points up in the first view
    lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.notes += self.journal.notes
        self._show(self.base)

    @classmethod
    def open(
        cls, path: Path, work: Path | None = None, n_segments: int | None = None,
        classes: ClassList = (), share_classes: Callable[[ClassList], object] | None = None,
        *, parameters: Mapping[str, Any] | None = None,
    ) -> Document:  # fmt: skip
        """Read an input file and its work file, and compute the regions.

        By default, the work file is in the folder of the input. A new work file starts with
        `n_segments` regions, with other `parameters`, and with `classes`. The parameter "radius" is
        the radius of a region, instead of `n_segments`. If a folder is open, all its meshes use the
        same list `classes`, and the function `share_classes` stores a changed list for all meshes.
        Raises MeshError if the input is invalid, OSError if the input or the work file cannot be
        read or written, and JournalError if the work file cannot be used or belongs to another
        input.
        """
        source = Source.read(path)
        own = None if share_classes else list(classes or labeling.default_classes())
        checked = first_parameters(source.cells, n_segments, **(parameters or {}))
        if checked["color"] and source.color_features is None:
            raise ValueError(f"{path.name} has no colors and no texture")
        header = {**source.facts, "parameters": checked, "classes": own}
        journal = Journal.open(work.resolve() if work else work_file_of(path), header)
        try:
            document = cls._of(source, journal, classes if share_classes else None)
            document.share_classes = share_classes
            document._adopt_base()
            document.segmenter.build()  # the page soon asks for areas, drawing and borders
            return document
        except BaseException:
            journal.close()
            raise

    @classmethod
    def read(cls, path: Path, work: Path, classes: ClassList | None = None) -> Document:
        """Read an input file and its work file for exports; the document cannot be changed.

        The work file is neither locked nor written, so a studio may have it open. `classes` is the
        class list that the meshes of a folder share, or None to use the list in the work file.
        Raises the same errors as `open`, and FileNotFoundError if there is no work file.
        """
        return cls._of(Source.read(path), parsed_work(work, work.read_bytes()), classes)

    @classmethod
    def _of(
        cls, source: Source, journal: Journal, classes: ClassList | None, work: Path | None = None
    ) -> Document:
        journal.check_source(source.path, source.digest, source.n_cells)
        history = History.replayed(journal, source.n_cells, classes, work or journal.path)
        segmenter = Segmenter(source.cells, source.color_features)
        base = segmenter.base(history.state.partition.parameters)
        return cls(source, journal, history, segmenter, base)

    @property
    def path(self) -> Path:
        """Path of the input file."""
        return self.source.path

    @property
    def cells(self) -> Cells:
        """The mesh or point cloud that is labeled."""
        return self.source.cells

    @property
    def state(self) -> State:
        """Current state: labels of all cells, classes, names of objects, regions, suggestions."""
        return self.history.state

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return len(self.state.paint)

    @cached_property
    def areas(self) -> Floats:
        """Area (or volume) of each cell."""
        return self.segmenter.surface.measures

    @property
    def progress(self) -> float:
        """Labeled fraction of the area, 0 to 1, or of the cells if the total area is 0."""
        is_done, total = self.state.paint > 0, self.areas.sum()
        if total > 0:
            return float(min(1.0, np.sum(self.areas, where=is_done) / total))
        return float(np.count_nonzero(is_done) / self.n_cells)

    @property
    def statistics(self) -> dict[str, Any]:
        """Entry "statistics" with active time and strokes; empty if they are unknown."""
        return statistics(self.history.effort)

    @property
    def class_list(self) -> ClassList:
        """List of classes, plus new classes for numbers that only cells or suggestions have."""
        used = np.flatnonzero(np.bincount(self.state.classes, minlength=1)).tolist()
        suggested = {one.class_id for one in self.state.suggestions}
        return labeling.with_missing(self.state.class_list, suggested.union(used))

    @property
    def instances(self) -> Ints:
        """``class * 1000 + object`` for each cell, shape (N,); 0 for cells without a class."""
        return self.state.classes.astype(np.int32) * labeling.INSTANCES + self.state.objects

    def name_of(self, class_id: int, object_id: int = 0) -> str:
        """Return the name of a class or of an object, such as "chair 2" if it has no own name."""
        for entry in self.state.object_names:
            if object_id and (entry["class"], entry["object"]) == (class_id, object_id):
                return str(entry["name"])
        name = names_of(self.class_list)[class_id]
        sign = "#" if name[-1].isdigit() else ""  # "class 1 #2" is clearer than "class 1 2"
        return f"{name} {sign}{object_id}" if object_id else name

    def close(self) -> None:
        """Cancel running segmentations, and close the work file."""
        with self.lock:
            self._note_classes()
            self.segmenter.close()
            self.journal.close()

    # Each of the following operations returns only after its journal line is on disk. After an
    # error, nothing has changed, in memory or on disk. If a folder is open, `set_classes` writes
    # the class list that all its meshes share, and adds it to the journal.

    def paint(
        self, cells: CellNumbers, classes: Any, stroke: str | None = None, *, objects: Any = 0,
        part: int | None = None,
    ) -> Change | None:  # fmt: skip
        """Set the classes and objects of cells: one number for all cells, or one number per cell.

        `cells` are indices in ascending order. The number 0 means no class or no object. Returns
        the change, or None if no cell changes. A client that got no reply sends a `part` of a
        stroke again. If the part is in the journal already, even if it was undone, it changes
        nothing. Parts of a stroke have ascending numbers. Raises ValueError if a class does not
        exist or if an object number exceeds `MAX_OBJECT`, JournalError if the change could not be
        written, and ChangedError if the input file has changed.
        """
        with self.lock:
            if np.max(objects, initial=0) > MAX_OBJECT:
                raise ValueError(f"a class has at most {MAX_OBJECT} objects")
            values = np.unique(np.asarray(classes))
            if unknown := {*values.tolist()} - {0, *names_of(self.class_list)}:
                raise ValueError(f"there is no class {min(unknown)}")
            if part is not None and part <= self.history.parts.get(stroke or "", -1):
                return None
            wanted = paint_of(classes, objects)
            change = Change.painting(self.state.paint, cells, wanted, stroke, part)
            if change is not None:
                self._commit(change)
            return change

    def split_object(self, class_id: int, object_id: int) -> list[int]:
        """Make each connected component of an object, except the largest, a new object.

        If `object_id` is 0, the cells of the class that are in no object are split, and each
        component becomes an object. Returns the numbers of the new objects. Raises ValueError if
        the object does not exist or is already connected, or if a number would exceed `MAX_OBJECT`.
        """
        with self.lock:
            is_in = (self.state.classes == class_id) & (self.state.objects == object_id)
            if not class_id or not is_in.any():
                raise ValueError(f"there is no object {object_id} of class {class_id}")
            pieces = self.segmenter.surface.components(is_in.astype(np.int32))
            cells = np.flatnonzero(is_in)
            ids, ranks = np.unique(pieces[cells], return_inverse=True)
            if object_id and len(ids) == 1:
                raise ValueError(f"{self.name_of(class_id, object_id)} has only one piece")
            kept = [object_id] if object_id else []  # the largest component keeps the number
            new = list(itertools.islice(self.free_objects(class_id), len(ids) - len(kept)))
            numbers = np.zeros(len(ids), np.int64)
            areas = np.bincount(ranks, self.areas[cells])
            numbers[np.argsort(-areas, kind="stable")] = kept + new
            self.paint(cells.astype(np.uint32), class_id, objects=numbers[ranks])
            return new

    def free_objects(self, class_id: int) -> Iterator[int]:
        """Yield object numbers that no cell and no name of the class has, in ascending order."""
        used = {*np.unique(self.state.objects[self.state.classes == class_id]).tolist()}
        used |= {one["object"] for one in self.state.object_names if one["class"] == class_id}
        return (number for number in itertools.count(1) if number not in used)

    def name_object(self, class_id: int, object_id: int, name: object) -> None:
        """Name an object, or remove its name if `name` is empty; raise a ValueError if invalid."""
        with self.lock:
            if not object_id or object_id not in self.state.objects[self.state.classes == class_id]:
                raise ValueError(f"there is no object {object_id} of class {class_id}")
            names = labeling.with_object_name(self.state.object_names, class_id, object_id, name)
            if names != self.state.object_names:
                self._replace("objects", names)

    def review(self, is_reviewed: bool) -> None:
        """Mark the document as reviewed or not reviewed, and as unchanged since the review."""
        with self.lock:
            if is_reviewed != self.state.is_reviewed or self.state.is_changed:
                self._replace("review", is_reviewed)

    def set_base(self, parameters: dict[str, Any], base: UnsplitRegions) -> Revision:
        """Replace the current regions by `base`, and return the new current revision.

        `parameters` are the parameters with which `base` was computed.
        """
        with self._operation():
            before = self.state.partition
            is_new = before.digest not in ("", base.digest) or bool(before.splits)
            if is_new or before.parameters != parameters:
                self._replace("segment", Partition(parameters, base.digest))
            return self._show(base)

    def split(
        self, region: int, number: object, red: CellNumbers, blue: CellNumbers
    ) -> CellNumbers:
        """Split a region between two brush strokes, and return the cells of the new region.

        `number` is the number of the revision that the client shows. The new region contains the
        blue stroke, and gets the next free label. Raises GoneError if this is not the current
        revision, and ValueError if the region does not exist, if one of the strokes has no cell in
        the region, or if the strokes cross.
        """
        with self._operation():
            whole = self._cells_of(region, number)
            cells = split_cells(self.segmenter.surface, whole, red, blue)
            self._divide([cells])
            return cells

    def refine(self, region: int, number: object, n_parts: int) -> None:
        """Divide a region into parts by `segment`, which a single undo reverts.

        The first part keeps the label of the region. Raises the same errors as `split`.
        """
        with self._operation():
            whole = self._cells_of(region, number)
            parts = self.segmenter.divided(self.state.partition.parameters, whole, n_parts)
            self._divide([whole[parts == part] for part in range(1, int(parts.max()) + 1)])

    def _cells_of(self, region: int, number: object) -> CellNumbers:
        """Return the cells of a region, if `number` is the number of the current revision."""
        if self.revisions.get(number) is not self.revision:
            raise GoneError("the regions have changed: request the state and labels again")
        return self.revision.cells_of(region)

    def _divide(self, regions: list[CellNumbers]) -> None:
        """Make each list of cells a new region."""
        self._adopt_base()
        stroke = f"split {self.history.seq + 1}" if len(regions) > 1 else None
        labels, n_regions = self.revision.labels.copy(), self.revision.n_regions
        for cells in regions:
            before = self.state.partition
            after = before.with_split(pack_cells(cells), self.base.digest)
            self._commit(Change("split", before, after, stroke))
            labels[cells] = n_regions
            n_regions += 1
        self.revision = self.revisions.add(self.state.partition, labels, n_regions)

    def apply_import(self, imported: Imported) -> Change | None:
        """Apply imported labels, classes and names of objects.

        A single undo reverts the import, except new classes in the list that the meshes of a folder
        share. In each class, imported objects get numbers above all object numbers of cells outside
        of the import. Returns the change of labels, or None if no label changes. Raises ValueError
        if an object number would exceed `MAX_OBJECT`.
        """
        with self._operation():
            stroke = f"import {self.history.seq + 1}"
            highest = np.zeros(labeling.MAX_CLASS + 1, np.int64)
            is_left = np.ones(self.n_cells, bool)
            is_left[imported.cells] = False
            np.maximum.at(highest, self.state.classes[is_left], self.state.objects[is_left])
            objects = imported.objects.astype(np.int64)
            objects += np.where(objects > 0, highest[imported.classes], 0)
            self.set_classes(list(imported.class_list), stroke)
            change = self.paint(imported.cells, imported.classes, stroke, objects=objects)
            names = self.state.object_names
            for (class_id, object_id), name in imported.names.items():
                shifted = object_id + int(highest[class_id])
                names = labeling.with_object_name(names, class_id, shifted, name)
            if names != self.state.object_names:
                self._replace("objects", names, stroke)
            return change

    def suggest(self, imported: Imported) -> int:
        """Replace all suggestions by `suggestions_of` an import, and return their number.

        Raises ValueError if no object was imported.
        """
        with self._operation():
            surface = self.segmenter.surface
            suggestions, classes = suggestions_of(imported, self.class_list, surface)
            if not suggestions:
                raise ValueError("the files suggest no object: no cell has a label above 0")
            stroke = f"suggest {self.history.seq + 1}"
            self.set_classes(list(classes), stroke)
            self._replace("suggest", suggestions, stroke)
            return len(suggestions)

    def settle(self, accepted: Mapping[int, int], rejected: Collection[int] = ()) -> list[Change]:
        """Accept and reject suggestions; return the changes, which a single undo reverts.

        `accepted` maps ids of suggestions to classes, and `rejected` contains ids. The unlabeled
        cells of an accepted suggestion become a new object of its class; if the class has no
        objects, the cells get only the class. Raises ValueError if a suggestion or class does not
        exist, if a suggestion is both accepted and rejected, if no suggestion is given, or if an
        object number would exceed `MAX_OBJECT`.
        """
        if both := {*accepted}.intersection(rejected):
            raise ValueError(f"suggestion {min(both)} is both accepted and rejected")
        if not accepted and not rejected:
            raise ValueError("no suggestion to accept or reject was given")
        with self._operation() as changes:
            stroke = f"settle {self.history.seq + 1}"
            left = unsettled(self.state, {*accepted, *rejected})
            self._paint_suggestions(accepted, stroke)
            self._replace("settle", left, stroke)
            return changes

    def _paint_suggestions(self, accepted: Mapping[int, int], stroke: str) -> None:
        stuff = labeling.stuff_of(self.class_list)
        paint = np.zeros(self.n_cells, np.uint32)
        free = {class_id: self.free_objects(class_id) for class_id in {*accepted.values()}}
        next_object = {class_id: next(numbers) for class_id, numbers in free.items()}
        for one in self.state.suggestions:
            if one.id not in accepted:
                continue
            class_id = accepted[one.id]
            cells = unpack_cells(one.cells, self.n_cells)
            unlabeled = cells[self.state.paint[cells] == 0]
            object_id = 0 if class_id in stuff else next_object[class_id]
            if not class_id:
                raise ValueError(f"suggestion {one.id} needs a class")
            paint[unlabeled] = paint_of(class_id, object_id)
            if len(unlabeled):
                next_object[class_id] = next(free[class_id])
        painted = np.flatnonzero(paint).astype(np.uint32)
        found = paint[painted]
        self.paint(painted, class_of(found), stroke, objects=object_of(found))

    def compare(self, name: str, data: bytes, work: Path | None = None) -> None:
        """Compare with the content of a work file, and its path if known, as in `read_theirs`."""
        with self.lock:
            self.history.check_names(str(self.journal.path))
            self.theirs = read_theirs(name, data, self.source, self.state, self.areas, work)

    def agreement(self) -> dict[str, Any]:
        """Return the agreement with the file that `compare` has read, or raise a ValueError."""
        are_points = kind_of(self.cells).are_points  # points are counted
        areas = np.ones(self.n_cells) if are_points else self.areas
        return agreement(self.state, self._compared(), areas)

    def differing(self) -> CellNumbers:
        """Return the indices of cells that are labeled in both work files, but differently."""
        with self.lock:
            mine, theirs = self.state.paint, self._compared().paint
            return np.flatnonzero((mine != theirs) & (mine > 0) & (theirs > 0)).astype(np.uint32)

    def accept(self, cells: CellNumbers, side: Side) -> Change | None:
        """Resolve differences in `cells`: use the labels of the second work file, or keep mine.

        With "theirs", `cells` get the labels of the second file, except where it has no labels.
        With "mine", only the copy of the second file in memory changes: its `cells` get my labels,
        so they no longer differ. Returns the change of my labels, or None if no label changes.
        """
        with self._operation():
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
            raise ValueError("there is nothing to compare with: read another work file first")
        return self.theirs

    def set_classes(self, value: object, stroke: str | None = None) -> None:
        """Replace the classes; raise a ValueError if one is invalid, or a used one is missing."""
        classes = labeling.checked_class_list(value)
        with self._operation():
            counts = np.bincount(self.state.classes).tolist()
            kept = names_of(classes)
            for class_id in np.flatnonzero(counts).tolist():
                if class_id and class_id not in kept:
                    raise ValueError(
                        f"class {class_id} has {counted(counts[class_id], 'cell')}: give all cells"
                        " of this class another class first"
                    )
            for one in self.state.suggestions:
                if one.class_id and one.class_id not in kept:
                    message = f"class {one.class_id} has suggestions: accept or reject them first"
                    raise ValueError(message)
            if self.share_classes is not None:
                before = self.state.class_list
                self.share_classes(classes)
                self.state.class_list = classes
                self.history.on_failure(self._share_again, before, classes)
            elif classes != self.state.class_list:
                self._replace("classes", classes, stroke)

    def _share_again(self, before: ClassList, failed: ClassList) -> None:
        """Restore the shared list after an error, unless it changed again or the disk is full."""
        if self.share_classes is not None and self.state.class_list is failed:
            with contextlib.suppress(OSError):
                self.share_classes(before)
                self.state.class_list = before

    def _move(self, name: str) -> list[Change]:
        """Undo the last operation or stroke, or redo what was undone last; return the changes.

        `name` is "undo" or "redo". Raises NothingError if there is nothing to undo or redo.
        """
        self.source.check()
        with self._step(self.history.moving(name, self._write)) as changes:
            if changes[-1].kind in ("segment", "split"):
                self._show(self.segmenter.base(self.state.partition.parameters))
            return changes

    undo = partialmethod(_move, "undo")
    redo = partialmethod(_move, "redo")

    def _replace(self, kind: str, value: Any, stroke: str | None = None) -> None:
        self._commit(Change.replacing(self.state, kind, value, stroke))

    def _commit(self, change: Change) -> None:
        """Make a change as a part of the current operation, or as an operation of its own."""
        with self._operation():
            self.history.make(change)

    def _operation(self) -> contextlib.AbstractContextManager[list[Change]]:
        """Make all changes of a `with` block one operation, which is done completely or not at all.

        The operation is one line of the journal, which is written when the block ends.
        """
        return self._step(self.history.operation(self._write))

    @contextlib.contextmanager
    def _step(
        self, step: contextlib.AbstractContextManager[list[Change]]
    ) -> Iterator[list[Change]]:
        """Lock the document during a step; after an error, show the same regions as before."""
        with self.lock:
            shown = self.base, self.revision
            try:
                with step as changes:
                    yield changes
            except BaseException:
                self.base, self.revision = shown
                raise
            self._note_classes()

    def _note_classes(self) -> None:
        """Write the classes of the folder to the work file, so that it is complete without them."""
        if self.share_classes and self.journal.is_of_folder and self.history.seq:
            with contextlib.suppress(WriteError, ChangedError):  # the next step tries again
                self.history.share(self._write)

    def _write(self, line: Line) -> None:
        self.source.check()
        self.journal.append({**line, "done": round(self.progress, 6), **self.state.review_marks})

    def _is_foreign(self) -> bool:
        """Return whether the hash of unsplit regions in the work file is not that of `base`."""
        return self.state.partition.digest not in ("", self.base.digest)

    def _adopt_base(self) -> None:
        """If the stored regions are from another version of superfacets, replace them by `base`.

        `undo` must not call this method, because the next undo would revert the replacement.
        """
        if self._is_foreign():
            self.set_base(self.state.partition.parameters, self.base)

    def _show(self, base: UnsplitRegions) -> Revision:
        """Make `base` current, with the user's splits or, if they do not fit, with a note."""
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
    path: Path, mine: Path | None, theirs: Path, output: Path | None = None, *,
    prefer_theirs: bool = False, shared: tuple[ClassList, ClassList] = ((), ()),
) -> dict[str, Any]:  # fmt: skip
    """Compare two work files of a mesh, and return the same dict as `agreement`.

    If `output` is given, a copy of my work file is written there. In this copy, cells without a
    class get their label from `theirs`; with `prefer_theirs`, so do cells whose labels differ. If a
    work file belongs to a folder whose meshes share classes, `shared` has the classes for both work
    files; empty lists are read from the files or folders. If `mine` is None, `output` is a copy of
    `theirs`, or new work with its labels if my class numbers differ.

    Raises MeshError, JournalError or OSError if a file cannot be read or written.
    """
    first, (own, other) = mine or theirs, map(names_of, shared)
    data = first.read_bytes()
    if mine is None and own and (not other or other.items() - own.items()):
        data = data[: data.index(b"\n") + 1]  # the first line, which names mesh and classes
    with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
        copy = Path(folder, first.name)
        copy.write_bytes(data)
        try:
            with contextlib.closing(Journal.open(copy, {})) as journal:
                known = shared[0] if journal.is_of_folder and shared[0] else None
                document = Document._of(Source.read(path), journal, known, first)
                if journal.is_of_folder:  # its classes are written to the copy, and to no folder
                    document.share_classes = lambda _: None
                document.compare(str(theirs), theirs.read_bytes(), theirs)
                found, paint = document.agreement(), document.state.paint
                wanted = paint != document._compared().paint if prefer_theirs else paint == 0
                document.accept(np.flatnonzero(wanted).astype(np.uint32), "theirs")
                document.close()
        except JournalError as error:
            raise JournalError(str(error).replace(str(copy), str(first))) from None
        if output is not None:
            with atomic_outputs([output]) as (temporary,):
                temporary.write_bytes(copy.read_bytes())
    return found
