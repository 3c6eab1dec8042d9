"""Manage the input files of the studio, and keep a few recently used documents in memory."""

from __future__ import annotations

import contextlib
import threading
from collections import Counter, OrderedDict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from superfacets.kit import FORMATS, InputFile, atomic_outputs, counted, output_folder
from superfacets_show import Up

from ..labels import classes as labeling
from ..labels.classes import ClassList, default_classes, shared_classes
from .agreement import agreement_text, folders_text, together, with_means
from .changes import REVIEW_MARKS
from .document import Document, merged_work, work_file_of
from .effort import Effort, statistics
from .journal import SHARED, JournalError, Line, parsed_work, summary
from .journal_lines import class_list_of

MAX_OPEN = 3  # maximum number of documents in memory, unless more are in use at the same time
EXPORTED = ".classes"  # suffix in names of exported files, which are not listed as inputs


@dataclass
class Files:
    """Input files of the studio, each identified by its index in `paths`."""

    paths: list[Path]
    work: Path | None = None  # work file of a single input; None means the default path
    n_segments: int | None = None  # number of regions in a new work file
    classes: ClassList = ()  # classes for a new work file, or for all files of a folder
    folder: Path | None = None
    parameters: Mapping[str, Any] | None = None  # other parameters for a new work file
    up: Up = "auto"  # axis that points up in the first view of each file
    _must_store: bool = False  # whether `classes` must be stored when the first document is opened
    # Open documents by index in `paths`, least recently used first, and the number of `with` blocks
    # that use each document.
    _open: OrderedDict[int, Document] = field(default_factory=OrderedDict)
    _users: Counter[int] = field(default_factory=Counter)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @classmethod
    def of(cls, path: Path, work: Path | None, n_segments: int | None, classes: ClassList) -> Files:
        """Return the input files at a path, which is a file or a folder.

        Raises ValueError if a work file is given for a folder, or if the folder's list of classes
        is damaged. Raises OSError if no input file is found.
        """
        if not path.is_dir():
            return cls([path], work, n_segments, classes)
        if work is not None:
            raise ValueError("--work is for one file: each mesh of a folder has its own work file")
        found = [Path(source.input) for source in InputFile.find(path)]
        paths = [file for file in found if EXPORTED not in file.suffixes]
        if not paths:
            raise FileNotFoundError(f"{path}: contains only exported files, no mesh to label")
        known = classes or _list_of(path, map(work_file_of, paths)) or default_classes()
        return cls(paths, None, n_segments, known, path, _must_store=bool(classes))

    @property
    def home(self) -> Path:
        """The work file of a single input, or the input folder."""
        return self.folder or self.work_of(0)

    def work_of(self, number: int) -> Path:
        """Return the path of the work file of a file; the work file may not exist."""
        return self.work or work_file_of(self.path(number))

    def read(self, number: int) -> Document:
        """Read a file and its work file with `Document.read`."""
        shared = None if self.folder is None else self.classes
        return Document.read(self.path(number), self.work_of(number), shared)

    def path(self, number: int) -> Path:
        """Return the path of a file; raise an IndexError if there is no such file."""
        if not 0 <= number < len(self.paths):
            n_files = counted(len(self.paths), "file")
            raise IndexError(f"file {number} does not exist: the studio has {n_files}")
        return self.paths[number]

    def name_of(self, number: int) -> str:
        """Return the name of a file, with its path in the folder."""
        path, folder = self.paths[number], self.folder
        return path.name if folder is None else path.relative_to(folder).as_posix()

    def targets(self, output: Path | None) -> list[tuple[int, Path]]:
        """Return number and target of each file with a work file; raise an OSError if none has one.

        A target consists of the folder and the first part of the names of exports.
        """
        works = [self.work_of(i) for i in range(len(self.paths))]  # an empty one has no work
        started = [i for i, work in enumerate(works) if work.exists() and work.stat().st_size]
        if not started:
            message = f"{self.home}: there is no work file, so there are no labels yet"
            raise FileNotFoundError(message)
        root = self.folder or self.paths[0].parent
        output = output or (root if self.work is None else self.work.parent)
        stems = [path.with_name(FORMATS.stem_of(path)) for path in self.paths]
        return [(i, output / stems[i].relative_to(root)) for i in started]

    def listed(self) -> list[dict[str, Any]]:
        """List all files and the progress in their work files, without opening the files."""
        return [self._entry(number) for number in range(len(self.paths))]

    @contextlib.contextmanager
    def document(self, number: int) -> Iterator[Document]:
        """Open a file as a document, which stays open at least until the `with` block ends.

        Raises IndexError if the number is invalid, and MeshError, JournalError or OSError if the
        file or its work file cannot be opened.
        """
        with self._lock:
            document = self._open.get(number) or self._opened(number)
            self._open.move_to_end(number)
            self._users[number] += 1
        try:
            yield document
        finally:
            with self._lock:
                self._users[number] -= 1
                self._close_surplus()

    def close(self) -> None:
        """Close all documents."""
        with self._lock:
            documents = list(self._open.values())
            self._open.clear()
        for document in documents:  # without `_lock`, which threads that use a document may need
            document.close()

    def _opened(self, number: int) -> Document:
        share = None if self.folder is None else self._share
        if self._must_store:  # later runs then have the same classes without --classes
            self._share(self.classes)
        document = self._open[number] = Document.open(
            self.path(number), self.work, self.n_segments, self.classes, share,
            parameters=self.parameters,
        )  # fmt: skip
        document.up = self.up
        return document

    def _close_surplus(self) -> None:
        """Close unused documents, least recently used first, until `MAX_OPEN` documents are open.

        More documents stay open if `with` blocks use them. The caller has acquired `_lock`, so no
        thread can open a work file again before it is closed. Closing does not wait for locks,
        because no thread uses these documents.
        """
        idle = [number for number in self._open if not self._users[number]]
        for number in idle[: max(0, len(self._open) - MAX_OPEN)]:
            self._open.pop(number).close()

    def _entry(self, number: int) -> dict[str, Any]:
        entry: dict[str, Any] = {"id": number, "name": self.name_of(number)}
        try:
            return {**entry, **_progress_of(summary(self.work_of(number)))}
        except JournalError as error:
            return {**entry, "done": 0.0, "n_cells": None, "error": str(error)}

    def _share(self, classes: ClassList) -> None:
        assert self.folder is not None
        with self._lock:
            labeling.write_classes(self.folder / labeling.CLASSES_FILE, classes)
            self._must_store = False
            self.classes = classes
            for document in self._open.values():
                document.state.class_list = classes


def _progress_of(found: tuple[Line, Line] | None) -> dict[str, Any]:
    """Check the `summary` of a work file, and return the progress and the number of cells in it."""
    if found is None:
        return {"done": 0.0, "n_cells": None}
    done, n_cells = found[1].get("done", 0.0), found[0].get("n_cells")
    if not isinstance(done, (int, float)) or not 0 <= done <= 1 or not isinstance(n_cells, int):
        raise JournalError("the work file is damaged: its progress or number of cells is missing")
    marks = {name: True for name in REVIEW_MARKS if found[1].get(name) is True}
    times = {"time": effort.time} if (effort := Effort.read(found[1])) else {}  # of the last step
    return {"done": done, "n_cells": n_cells, **marks, **times, **statistics(effort)}


def agreed(
    path: Path, mine: Path, theirs: Path, output: Path | None, *, prefer_theirs: bool
) -> tuple[dict[str, Any], str, list[str]]:
    """Compare two work files of a mesh, or two folders; return the result, its text, and notes.

    Merged work is written to the new file `output`, or to new files in the folder `output`. Raises
    ValueError if only some paths are folders, FileExistsError if an output exists, and the errors
    of `merged_work`.
    """
    if any(one.is_dir() for one in (path, mine, theirs)):
        return _agreed_folders(path, (mine, theirs), output, prefer_theirs=prefer_theirs)
    _check_new([] if output is None else [output])
    found = merged_work(path, mine, theirs, output, prefer_theirs=prefer_theirs)
    for one in (found, *found["classes"]):
        del one["area"]
    return found, agreement_text(found), []


def _agreed_folders(
    path: Path, folders: tuple[Path, Path], output: Path | None, *, prefer_theirs: bool
) -> tuple[dict[str, Any], str, list[str]]:
    for one in folders:
        if not one.is_dir():
            message = f"{one} is no folder: MINE and THEIRS must be two files or two folders"
            raise ValueError(message)
    files = Files.of(path, None, None, ())
    meshes = {files.name_of(number): mesh for number, mesh in enumerate(files.paths)}
    works = [{name: work_file_of(one / name) for name in meshes} for one in folders]
    lacking = [[name for name, work in some.items() if not work.exists()] for some in works]
    paired = [name for name in meshes if not any(name in some for some in lacking)]
    single = [name for name in meshes if (name in lacking[0]) != (name in lacking[1])]
    if not paired and (output is None or not single):
        wanted = " and ".join(str(next(iter(some.values()))) for some in works)
        raise FileNotFoundError(f"{path}: no mesh has two work files, such as {wanted}")
    mine, theirs = map(_list_of, folders, map(dict.values, works))
    merged = mine or theirs
    for entry in theirs:  # a class that only they have has one number in all files
        _, merged = labeling.with_named(merged, entry["name"], entry["id"])
    mine = mine and merged
    entries = []
    with _new_files(output, [*paired, *(single if output else ())], merged) as targets:
        for name, target in targets:
            *first, (last, classes) = [
                (work[name], one) for work, one in zip(works, (mine, theirs), strict=True)
                if work[name].exists()
            ]  # fmt: skip
            found = merged_work(
                meshes[name], first[0][0] if first else None, last, target,
                prefer_theirs=prefer_theirs, shared=(mine, classes),
            )  # fmt: skip
            entries += [with_means(name, found)] if first else []
    total = with_means(f"all {len(entries)}", together(entries))
    missing = dict(zip(("mine", "theirs"), lacking, strict=True))
    end = ": copied from {}" if output else ""
    notes = [f"{one}: has no work file of {', '.join(some)}{end.format(other)}"
             for one, other, names in zip(folders, folders[::-1], lacking, strict=True)
             if (some := [name for name in names if name in single])]  # fmt: skip
    if bare := [name for name in lacking[0] if name in lacking[1]]:
        notes.append(f"no one has a work file of {', '.join(bare)}")
    result = {"files": entries, "all": total, "missing": missing}
    return result, folders_text([*entries, total]), notes


def _list_of(folder: Path, works: Iterable[Path]) -> ClassList:
    """Return the shared classes of a folder, or else of its first work file that lists them."""
    found = shared_classes([folder])
    for work in () if found else filter(Path.is_file, works):
        with contextlib.suppress(OSError, ValueError, LookupError):  # `listed` shows errors
            lines = reversed(parsed_work(work, work.read_bytes()).lines)
            listed = (class_list_of(one["classes"]) for one in lines if one["op"] == SHARED)
            found = found or next(listed, ())
    return found


@contextlib.contextmanager
def _new_files(
    folder: Path | None, names: list[str], classes: ClassList
) -> Iterator[Iterable[tuple[str, Path | None]]]:
    """Yield names with temporary paths of new work files in a folder, or None; write classes."""
    if folder is None:
        yield [(name, None) for name in names]
        return
    targets = [work_file_of(folder / name) for name in names]
    lists = [] if classes in ((), shared_classes([folder])) else [folder / labeling.CLASSES_FILE]
    _check_new([*targets, *lists])
    with contextlib.ExitStack() as stack:
        for target in targets:
            stack.enter_context(output_folder(target.parent))
        temporaries = stack.enter_context(atomic_outputs([*targets, *lists]))
        for temporary in temporaries[len(targets) :]:
            labeling.write_classes(temporary, classes)
        yield zip(names, temporaries, strict=False)


def _check_new(outputs: Iterable[Path]) -> None:
    for output in outputs:
        if output.exists():
            raise FileExistsError(f"{output} exists already: choose another file name")
