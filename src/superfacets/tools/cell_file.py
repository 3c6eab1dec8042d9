"""The content of a mesh or point cloud file, and the label files that belong to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.checks import check_length
from ..base.errors import MeshError
from ..base.types import Array, Bools, Floats, Ints
from ..files.atomic import StrPath
from ..files.formats import FORMATS
from ..files.guards import Content, known_ending, named_errors, read_content
from ..files.input import Input, Read
from ..files.readers.labels import (
    OwnLabels,
    checked_labels,
    find_labels,
    parse_labels,
    parse_labels_of,
)
from ..files.readers.npy import npy_array, npy_header, npz_array
from ..files.readers.read import cell_ending, parse, recognized_ending
from ..files.readers.text import as_integers
from ..graph.constraints import mask_of
from ..graph.kinds import are_of_vertices, kind_of
from ..mesh.base import Cells


@dataclass(frozen=True)
class CellFile:
    """Content of a mesh or point cloud file, from which cells and labels are parsed.

    Apps use it to read a file once, and to parse cells, attributes and labels from its content.
    """

    name: str  # path of the file, or another name for messages
    data: Content
    ending: str  # ending of the format
    folder: Path | None = None  # folder of other files that the file names; None if there is none

    @classmethod
    def read(cls, path: StrPath, ending: str | None = None) -> CellFile:
        """Read a file in the format of `ending`; by default, the ending of its name."""
        path = Path(path)
        ending = ending or cell_ending(path)
        return cls(str(path), read_content(path), ending, path.parent)

    @classmethod
    def of_stream(cls, data: Content, name: str, ending: str | None = None) -> CellFile | None:
        """Return the file in `data`, or None if its format is neither given nor recognized."""
        ending = ending or recognized_ending(data)
        return None if ending is None else cls(name, data, ending)

    def cells_and_attributes(self, *, keep: bool = True) -> Read:
        """Return the mesh or point cloud, and its attributes; None if `keep` is False."""
        with named_errors(self.name):
            return parse(replace(self._input, keep=keep))

    def cells(self) -> Cells:
        """Return the mesh or point cloud."""
        return self.cells_and_attributes(keep=False)[0]

    def own_labels(self, n_cells: int, name: str) -> OwnLabels | None:
        """Return the result of `find_labels` with checked labels, one per cell."""
        with named_errors(self.name):
            found = find_labels(*parse(self._input), name)
            if found is None:
                return None
            return found._replace(values=checked_labels(as_integers(found.values, name), n_cells))

    def integers(self, cells: Cells, name: str, *, at_vertices: bool = False) -> tuple[Ints, bool]:
        """Return the result of `parse_labels_of`, or raise a MeshError if it is missing."""
        with named_errors(self.name):
            return parse_labels_of(cells, self._input, name, at_vertices=at_vertices)

    @property
    def _input(self) -> Input:
        return Input(self.data, self.ending, self.folder)

    def mask(
        self, labels: Ints, values: Sequence[int] | None, cells: Cells, path: Path | None = None
    ) -> Bools:
        """Return the mask of the cells whose label is one of `values`, or not 0 if it is None.

        Raises a MeshError that names the label file `path`, or this file, if there are none.
        """
        return mask_of(labels, values, self.name if path is None else path, cells)

    def labels_in(
        self, path: Path, cells: Cells, name: str, *, are_values: bool = False
    ) -> tuple[Ints, bool]:
        """Read a label file; return the labels, and whether they are labels of vertices.

        `cells` are the cells in this file. `name` is the same as in `read_labels`. If `are_values`
        is True, an array of bools is accepted. Raises a MeshError if the number of labels is wrong,
        or if the label file also contains cells, but other cells or in another order.
        """
        if path.suffix.lower() == ".npz":
            advice = "superfacets levels -o OUT.npy writes a file per level, and view shows .npz"
            raise MeshError(f"{path}: .npz is not a format of labels: {advice}")
        ending = known_ending(path, FORMATS.labels)
        labeled = CellFile(str(path), read_content(path), ending, path.parent)
        n_vertices = getattr(cells, "n_vertices", None)
        with named_errors(path):
            is_mask = are_values and ending == ".npy" and npy_header(labeled.data)[1].kind == "b"
            if is_mask:
                labels = checked_labels(npy_array(labeled.data, "labels").view(np.uint8))
                of_vertices = False
            else:
                n_all = n_vertices if ending in FORMATS["vertex_lists"] else None
                labels, of_vertices = parse_labels(labeled._input, n_all, name)
            if n_vertices is not None and of_vertices:
                check_length(labels, n_vertices, "labels", "vertex", error=MeshError)
            else:
                labels = self._of_points(labels, cells)
                of_vertices = are_of_vertices(labels, cells)
        if ending in FORMATS.cells and ending not in FORMATS["labels"]:
            self._check_same_order(cells, labeled, are_of_vertices=of_vertices)
        elif not of_vertices and self._has_regions_like(labels):
            raise MeshError(
                f"{path}: the faces of {self.name} are sorted by region, but the labels are in"
                f" another order: give {self.name} itself as the label file"
            )
        return labels, of_vertices

    def _of_points(self, labels: Ints, cells: Cells) -> Ints:
        """Return labels of points, given labels of the records of a point cloud file."""
        if not kind_of(cells).are_points or len(labels) == cells.n_cells:
            return labels
        attributes = self.cells_and_attributes(keep=False)[1]
        records = None if attributes is None else attributes.records
        return labels if records is None or len(records) != len(labels) else labels[records]

    @staticmethod
    def levels_in(path: Path) -> Array:
        """Return the labels of all L levels in an .npz of ``superfacets levels``, shape (L, N)."""
        content = read_content(path)
        try:
            return npz_array(content, "labels")
        except Exception:  # zipfile and zlib raise many kinds of errors for damaged files
            raise MeshError(f"{path}: is not a .npz of superfacets levels, or is damaged") from None

    @staticmethod
    def values_in(path: StrPath) -> Array:
        """Return the numbers in a file of `Formats.value_files`, in the order of the file."""
        path = Path(path)
        ending, content = known_ending(path, FORMATS.value_files), read_content(path)
        try:
            if ending == ".npy":
                return npy_array(content, "values")
            if ending in FORMATS.vertex_values:
                return np.asarray(FORMATS["vertex_labels"][ending](content))
            return np.array(bytes(content).split(), dtype=np.float64)
        except ValueError as error:
            raise MeshError(f"{path}: {error}") from None

    def _has_regions_like(self, labels: Ints) -> bool:
        """Return whether labels have the sizes of the named regions in this file, but other faces.

        Regions of one size say nothing, because balanced regions can agree by chance.
        """
        if self.ending not in FORMATS.sorted_outputs or self.data.find(b"region_") < 0:
            return False
        found = self.own_labels(len(labels), "label")
        if found is None or found.are_parts:
            return False
        own = found.values
        (values, sizes), others = (np.unique(each, return_counts=True) for each in (own, labels))
        are_like = np.array_equal(values, others[0]) and np.array_equal(sizes, others[1])
        if not are_like or len({*sizes.tolist()}) == 1:
            return False
        return len(np.unique(np.stack([own, labels]), axis=1)[0]) > len(values)

    def _check_same_order(self, cells: Any, labeled: CellFile, *, are_of_vertices: bool) -> None:
        """Raise a MeshError if labeled cells differ from these cells in position or order.

        Positions may differ by rounding to float32, and by one quantization step of LAS.
        """
        kind, others = kind_of(cells), labeled.cells()
        sources: tuple[Any, Any] = cells, others
        expected, given = (
            each.vertices
            if are_of_vertices and not kind_of(each).are_points
            else kind_of(each).positions(each)
            for each in sources
        )
        # Half of `eps` is the maximum relative error of rounding.
        tolerance = np.finfo(np.float32).eps * np.abs(cells.bounds).max(axis=0)
        tolerance += np.maximum(self._steps, labeled._steps)
        if expected.shape != given.shape or (np.abs(expected - given) > tolerance).any():
            path, plural = Path(labeled.name), "vertices" if are_of_vertices else kind.plural
            raise MeshError(
                f"{path}: the {plural} or their order differ from the input, so the labels do not"
                f" fit: use {path.name} as the input, or give labels as .npy"
            )

    @property
    def _steps(self) -> Floats:
        """Quantization steps of x, y and z, (3,); 0 if the format has none."""
        steps = FORMATS["steps"]
        return np.array(steps[self.ending](self.data) if self.ending in steps else (0.0, 0.0, 0.0))
