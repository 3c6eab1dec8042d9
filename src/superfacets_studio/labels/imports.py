"""Import labels from other tools or earlier exports, as classes and objects of cells."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from superfacets import MeshError, face_labels, kit, read_labels
from superfacets.kit import Bools, Cells, Longs
from superfacets_scans import GROUPS, NO_CLASS, SEGMENTS

from .classes import MAX_CLASS, MAX_OBJECT, ClassList, stuff_of, with_missing, with_named
from .coding import CellNumbers

OBJECTS = ".objects.json"
LISTS = (".npy", ".seg", ".txt")
ENDINGS = (".sstk.json", SEGMENTS, OBJECTS, *LISTS, GROUPS)

_Kind = TypeVar("_Kind", int, str)

_DAMAGE = (ValueError, LookupError, TypeError)
"""Errors that reading JSON with an unexpected structure can raise."""


@dataclass(frozen=True)
class Imported:
    """Imported classes and objects of cells, and the extended list of classes.

    The keys of `names` and `scores` are pairs (class, object).
    """

    cells: CellNumbers  # indices of all cells that the import labels, in ascending order
    classes: npt.NDArray[np.uint16]  # class of each of these cells; 0 removes its label
    objects: npt.NDArray[np.uint16]  # object of each of these cells; 0 means no object
    class_list: ClassList
    names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    scores: Mapping[tuple[int, int], float] = field(default_factory=dict)  # confidence, 0 to 1
    has_objects: bool = True  # whether the file groups cells into objects; False for class numbers


def read_import(files: Mapping[str, bytes], cells: Cells, known: ClassList) -> Imported:
    """Read a label file and, optionally, a file that groups its labels into objects.

    `files` maps file names to contents. `known` is the current list of classes.

    ``.npy``, ``.seg`` and ``.txt`` files contain one label per cell or vertex, and ``.segs.json``
    files one label per vertex. With labels of vertices, a cell gets the most frequent label of its
    corners. An ``.sstk.json`` file may contain several segmentations; the first is read, because it
    is the finest. Each label is the number of a class; 0 and -1 mean no class.

    If an ``.aggregation.json`` file is also given, labels are not class numbers: each group of
    labels becomes an object, whose class has the name of the group, ignoring case. Cells in no
    group are not imported. An ``.objects.json`` file, as exported by the studio, contains objects
    in COCO format. Raises ValueError if a file is damaged, belongs to another mesh, or has an
    unknown format.
    """
    endings = {name: kit.known_ending(name, ENDINGS) for name in files}
    grouping = [name for name, ending in endings.items() if ending == GROUPS]
    labeling = [name for name in files if name not in grouping]
    if len(labeling) != 1 or len(grouping) > 1:
        raise MeshError("import one label file, with at most one .aggregation.json")
    name = labeling[0]
    try:
        if endings[name] == OBJECTS and not grouping:
            return _by_annotation(kit.parsed_json(files[name]), cells.n_cells, known)
        labels = _labels_in(files[name], endings[name], cells)
    except _DAMAGE as error:
        raise MeshError(f"{name}: {_reason(error)}") from None
    if not grouping:
        return _by_number(labels, known)
    try:
        return _by_group(labels, kit.parsed_json(files[grouping[0]]), known)
    except _DAMAGE as error:
        raise MeshError(f"{grouping[0]}: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    if isinstance(error, IndexError):
        return "it contains an empty list"
    if isinstance(error, TypeError):
        return "it does not have the structure of this format"
    is_missing = isinstance(error, KeyError)
    return f"the entry {kit.shortened(str(error))} is missing" if is_missing else str(error)


def _labels_in(data: bytes, ending: str, cells: Cells) -> Longs:
    n_cells = cells.n_cells
    if ending in LISTS:
        with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
            path = Path(folder, f"labels{ending}")
            path.write_bytes(data)
            try:
                labels = read_labels(path).astype(np.int64)
            except MeshError as error:
                raise MeshError(str(error).removeprefix(f"{path}: ")) from None
        of_cells: Longs = kit.of_cells(labels, cells)
        if len(of_cells) != n_cells:
            n_vertices = getattr(cells, "n_vertices", None)  # point clouds have no vertices
            vertices = "" if n_vertices is None else f" or per vertex ({n_vertices})"
            raise MeshError(
                f"labels must have one value per {kit.kind_of(cells).noun} ({n_cells}){vertices},"
                f" got {kit.counted(len(labels), 'value')}"
            )
        return of_cells
    document = kit.parsed_json(data)
    if ending == SEGMENTS:
        return _of_corners(cells, _integers(document["segIndices"], "segIndices"))
    index = _integers(document["segmentation"][0]["index"], "index")
    kit.check_length(index, n_cells, "index", error=MeshError)
    return index


def checked_score(value: object) -> float | None:
    """Return a score from 0 to 1 as a float, or None; other values raise a ValueError."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value <= 1:
        raise MeshError(f"score must be 0 to 1, got {kit.shortened(str(value))}")
    return float(value)


def _entry(found: Any, name: str, kind: type[_Kind]) -> _Kind:
    """Return the entry `name` of an object in JSON; raise a MeshError if it is of another type."""
    value = found[name]
    if type(value) is not kind:
        words = "a whole number" if kind is int else "text"
        raise MeshError(f"{name} must be {words}, got {kit.shortened(repr(value))}")
    return value


def _integers(values: Any, name: str) -> Longs:
    array = np.asarray(values)
    if array.ndim != 1 or array.dtype.kind != "i":
        raise MeshError(f"{name} must be a list of whole numbers")
    return array.astype(np.int64)


def _of_corners(cells: Any, of_vertices: Longs) -> Longs:
    """Return the most frequent label at the corners of each cell, or the lowest of several."""
    n_vertices = cells.n_cells if kit.kind_of(cells).are_points else cells.n_vertices
    kit.check_length(of_vertices, n_vertices, "segIndices", "vertex", error=MeshError)
    ids, ranks = np.unique(of_vertices, return_inverse=True)  # ids of other tools may be large
    return np.asarray(ids[face_labels(cells, ranks)])


def _by_number(labels: Longs, known: ClassList) -> Imported:
    for label in (labels.min(), labels.max()):
        if not -1 <= label <= MAX_CLASS:
            raise MeshError(
                f"label {label} is not a class: classes are 1 to {MAX_CLASS}, and 0 and -1 mean no"
                " class"
            )
    classes = np.maximum(labels, 0)
    known = with_missing(known, np.unique(classes).tolist())
    objects = np.zeros(len(labels), np.uint16)
    cells = np.arange(len(labels), dtype=np.uint32)
    return Imported(cells, classes.astype(np.uint16), objects, known, has_objects=False)


def _by_group(labels: Longs, document: Any, known: ClassList) -> Imported:
    gathered = _Gathered(len(labels), known)
    for group in document["segGroups"]:
        name = _entry(group, "label", str).strip()
        if name not in ("", NO_CLASS):
            is_in = np.isin(labels, _integers(group["segments"], "segments"))
            gathered.add(name, is_in, group)
    return gathered.imported()


def _by_annotation(document: Any, n_cells: int, known: ClassList) -> Imported:
    """Import COCO annotations, which have a category and a run-length encoded mask of cells."""
    categories = document["categories"]
    names = {_entry(one, "id", int): _entry(one, "name", str).strip() for one in categories}
    gathered = _Gathered(n_cells, known)
    for annotation in document["annotations"]:
        runs = _integers(annotation["segmentation"]["counts"], "counts")
        if runs.min(initial=0) < 0 or runs.max(initial=0) > n_cells:  # their sum could wrap
            raise MeshError(f"counts must be 0 to {n_cells}, the number of cells of the mesh")
        if runs.sum() != n_cells:
            cells = kit.counted(int(runs.sum()), "cell")
            raise MeshError(f"an annotation has {cells}, but the mesh has {n_cells}")
        is_in = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
        name = names[_entry(annotation, "category_id", int)]
        wanted = 0 if annotation.get("iscrowd", 0) else annotation.get("object")
        gathered.add(name, is_in, annotation, wanted)
    return gathered.imported()


class _Gathered:
    """Collects groups of cells, each with a class name, and converts them to labels of cells."""

    def __init__(self, n_cells: int, known: ClassList) -> None:
        self._known = known
        self._taken: dict[int, set[int]] = {}  # object numbers in use in each class
        self._classes = np.zeros(n_cells, np.int64)
        self._objects = np.zeros(n_cells, np.int64)
        self._names: dict[tuple[int, int], str] = {}
        self._scores: dict[tuple[int, int], float] = {}

    def add(self, name: str, is_in: Bools, entry: Any, wanted: object = None) -> None:
        """Give the cells in the mask `is_in` the class `name`, and make them an object.

        An unknown class is added to the list, with the number that it has in the file if that is
        free. The object gets the number `wanted` if it is free, and otherwise the number after the
        highest in use. If `wanted` is 0, or if the class has no objects, the cells are in no
        object. `entry` is the entry in the file, which may contain name and score of the object.
        """
        class_id, self._known = with_named(self._known, name, entry.get("category_id"))
        self._classes[is_in], self._objects[is_in] = class_id, 0
        if wanted == 0 or class_id in stuff_of(self._known):
            self._keep_score(class_id, 0, entry)
            return
        taken = self._taken.setdefault(class_id, set())
        is_usable = type(wanted) is int and 0 < wanted <= MAX_OBJECT and wanted not in taken
        object_id = cast(int, wanted) if is_usable else max(taken, default=0) + 1
        if object_id > MAX_OBJECT:
            raise MeshError(f"{name} has more than {MAX_OBJECT} objects")
        taken.add(object_id)
        self._objects[is_in] = object_id
        self._keep_score(class_id, object_id, entry)
        own_name = _entry({"name": "", **entry}, "name", str).strip()
        is_usual = re.fullmatch(re.escape(name) + r"( #?\d+)?", own_name, re.IGNORECASE)
        if own_name and not is_usual:
            self._names[class_id, object_id] = own_name

    def _keep_score(self, class_id: int, object_id: int, entry: Any) -> None:
        """Store the score of an object if the entry has one; keep the lowest of several scores."""
        score = checked_score(entry.get("score"))
        if score is not None:
            key = class_id, object_id
            self._scores[key] = min(score, self._scores.get(key, 1.0))

    def imported(self) -> Imported:
        cells = np.flatnonzero(self._classes).astype(np.uint32)
        classes, objects = (a[cells].astype(np.uint16) for a in (self._classes, self._objects))
        return Imported(cells, classes, objects, self._known, self._names, self._scores)
