"""Read input files of commands: meshes, clouds, labels, masks, barriers and values."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from .._types import Array, Ints
from .._validate import check_length, counted
from ..cells.constraints import mask_of
from ..cells.kinds import kind_of
from ..errors import MeshError
from ..io.attributes import MeshAttributes
from ..io.guards import Content, known_ending, named_errors, read_content
from ..io.readers.b3dm import Placement
from ..io.readers.labels import (
    LABEL_ENDINGS,
    PLACED_ENDINGS,
    VERTEX_ENDINGS,
    checked_labels,
    find_labels,
    parse_labels,
    read_labels,
)
from ..io.readers.npy import npy_array
from ..io.readers.read import cell_ending, parse_cells_and_attributes, recognized_ending
from ..mesh.base import Cells
from .failures import print_note
from .options import FILE, STANDARD_STREAM, Real, numbers, option, options

WORK_ENDING = ".jsonl"
VALUE_ENDINGS = (".npy", ".txt")


class GivenLabels(NamedTuple):
    """Content of a label file."""

    path: Path
    labels: Ints
    are_of_vertices: bool  # whether there is one label per vertex of a mesh instead of one per cell


def check_inputs(inputs: tuple[str, ...]) -> None:
    """Raise a usage error if an input is not a file name, or if ``-`` is not the only input."""
    for text in inputs:
        if text != STANDARD_STREAM and not Path(text).name:
            raise click.UsageError(f"{text or repr(text)} is not a file name")
    if STANDARD_STREAM in inputs and len(inputs) > 1:
        raise click.UsageError("standard input (-) must be the only input")


def name_of(text: str) -> str:
    """Return the name of an input for messages."""
    return "standard input" if text == STANDARD_STREAM else text


class Input(NamedTuple):
    """Content of a mesh or point cloud file, from which cells and labels are parsed."""

    text: str  # path of the file, or - for standard input
    data: Content
    ending: str  # file ending of the format
    folder: Path | None  # folder of the file; None for standard input

    def cells(self) -> Cells:
        """Return the mesh or point cloud."""
        return self.cells_and_attributes(keep=False)[0]

    def cells_and_attributes(
        self, *, keep: bool = True, placement: Placement | None = None
    ) -> tuple[Cells, MeshAttributes | None]:
        """Return the mesh or point cloud, and its attributes.

        The attributes are None if `keep` is False, or if the input has no attributes. `placement`
        moves a model to its position in a 3D Tiles tileset.
        """
        with named_errors(name_of(self.text)):
            return parse_cells_and_attributes(
                self.data, self.ending, self.folder, keep=keep, placement=placement
            )

    def labels(self, n_cells: int, name: str) -> Ints | None:
        """Return the labels called `name`, one per cell, or None if the input has none."""
        with named_errors(name_of(self.text)):
            return find_labels(self.data, self.ending, n_cells, name)

    def integers(self, n_cells: int, name: str) -> Ints:
        """Return the integer property `name`, one value per cell; if missing, raise a MeshError."""
        with named_errors(name_of(self.text)):
            return parse_labels(self.data, self.ending, n_cells, name)


def labels_for(cells: Cells, path: Path, name: str, *, is_quiet: bool) -> Ints:
    """Read labels of `cells` from a label file; `name` is the same as in `read_labels`.

    Labels of vertices are converted by `labels_of_cells`, which also explains `is_quiet`.
    """
    return labels_of_cells(cells, given_labels(cells, path, name), is_quiet=is_quiet)


def labels_of_cells(cells: Cells, given: GivenLabels, *, is_quiet: bool) -> Ints:
    """Convert labels of vertices to labels of cells: the most frequent label at a cell's corners.

    A note is printed unless `is_quiet`. Labels of cells are returned unchanged, without a note.
    """
    from ..regions.vertices import face_labels

    if not given.are_of_vertices:
        return given.labels
    labels = face_labels(cells, given.labels)
    if not is_quiet:
        n_lost = len(np.setdiff1d(given.labels[given.labels >= 0], labels))
        lost = f"; left out: {counted(n_lost, 'region')} without a face" if n_lost else ""
        print_note(
            f"{given.path}: labels of vertices were converted to labels of faces (the majority of"
            f" the corners), which can split regions{lost}"
        )
    return labels


def given_labels(cells: Cells, path: Path, name: str) -> GivenLabels:
    """Read a label file, which has one label per cell or, for a mesh, one label per vertex.

    A work file of the studio has the class of each cell; 0 means no class.
    """
    if path.suffix == WORK_ENDING:
        from ..studio.documents.history import classes_in_work

        classes = classes_in_work(path, bytes(read_content(path)), cells.n_cells)
        return GivenLabels(path, classes, False)
    ending = known_ending(path, LABEL_ENDINGS)
    source = Input(str(path), read_content(path), ending, path.parent)
    n_vertices = getattr(cells, "n_vertices", None)
    with named_errors(path):
        labels = parse_labels(source.data, ending, None, name)
        if n_vertices is not None and ending in VERTEX_ENDINGS:
            check_length(labels, n_vertices, "labels", "vertex", error=MeshError)
            return GivenLabels(path, labels, True)
        if len(labels) == n_vertices != cells.n_cells:
            return GivenLabels(path, labels, True)
        checked_labels(labels, cells.n_cells)
    if ending in PLACED_ENDINGS:
        _check_same_order(cells, source.cells(), path)
    return GivenLabels(path, labels, False)


def _check_same_order(cells: Cells, labeled: Cells, path: Path) -> None:
    """Raise a MeshError if the cells of a labeled file differ from `cells` in position or order.

    Positions may differ by rounding to float32, which many formats store.
    """
    expected, given = (kind_of(some).positions(some) for some in (cells, labeled))
    rounding = np.finfo(np.float32).eps * np.abs(expected).max()
    tolerance = 1e-4 * np.ptp(expected, axis=0).max() + rounding
    if expected.shape != given.shape or np.abs(expected - given).max() > tolerance:
        plural = kind_of(cells).plural
        raise MeshError(
            f"{path}: the {plural} or their order differ from the input, so the labels do not fit:"
            f" use {path.name} as the input, or give labels as .npy"
        )


def labels_beside(
    source: Input, labels: Path | None, cells: Cells, name: str, *, is_quiet: bool
) -> Ints | None:
    """Read labels from the file `labels` or, if it is None, from the mesh file `source`.

    Returns None if the mesh file has no labels. `name` is the name of the labels in files that also
    contain other data. `is_quiet` is the same as in `labels_of_cells`.
    """
    if labels is None:
        return source.labels(cells.n_cells, name)
    return labels_for(cells, labels, name, is_quiet=is_quiet)


def read_input(text: str, format: str | None = None) -> Input:
    """Read a file, or standard input for ``-``.

    If `format` is None, the format is taken from the file ending, or recognized from the content of
    standard input.
    """
    ending = None if format is None else f".{format}"
    if text != STANDARD_STREAM:
        path = Path(text)
        return Input(text, read_content(path), ending or cell_ending(path), path.parent)
    if sys.stdin is None:
        raise OSError("standard input is closed")
    data = sys.stdin.buffer.read()
    if not data:
        raise MeshError("standard input is empty")
    ending = ending or recognized_ending(data)
    if ending is None:
        raise MeshError("the format of standard input is unknown: give it with --format")
    return Input(text, data, ending, None)


def read_values(path: Path) -> Array:
    """Read numbers from a .npy or .txt file, one per cell, region or vertex."""
    ending = known_ending(path, VALUE_ENDINGS)
    data = read_content(path)
    try:
        if ending == ".npy":
            return npy_array(data, "values")
        return np.array(bytes(data).split(), dtype=np.float64)
    except ValueError as error:
        raise MeshError(f"{path}: {error}") from None


mask_values_option = option(
    "--mask-values N,N", None,
    "Keep only cells with one of these values, such as 2,6, in the property of IN that"
    " --labels-named names, or in the mask file if one is given. Other cells get label -1.",
    callback=partial(numbers, least=0),
)  # fmt: skip
constraint_options = options(
    option("--mask FILE", FILE,
           "Label file with one value per face or point. Without --mask-values, cells with value 0"
           " (or False) are left out and get label -1."),
    mask_values_option,
    option("--barriers FILE", FILE,
           "Label file with one whole number per face or point. Cells with different numbers never"
           " share a region."),
)  # fmt: skip
"""Decorator that adds ``--mask``, ``--mask-values`` and ``--barriers`` to a command."""

barrier_angle_option = option(
    "--barrier-angle DEG", Real(0.0, 180.0, min_open=True),
    "No region extends across an edge at which the surface bends by at least this angle, convex or"
    " concave (meshes only). With -n 1 and an angle of 30, each face of a CAD part becomes one"
    " region. Faces that meet tangentially, such as a flat side and its fillet, stay one region."
    " Where a line of sharp edges ends inside a face, the region extends around the end.",
)  # fmt: skip


def constraints_of(
    mask: Path | None, values: tuple[int, ...] | None, barriers: Path | None, source: Input,
    cells: Cells, *, name: str,
) -> dict[str, Any]:  # fmt: skip
    """Read the mask and the barriers, and return them as keyword arguments of `segment`.

    Cells whose value in the mask is one of `values` are kept. If `values` is None, cells with any
    value except 0 are kept. If `values` are given without `mask`, the mask is the property `name`
    of `source`, the input that contains the `cells`. Raises a MeshError if no cell is kept.
    """
    keywords: dict[str, Any] = {}
    if mask is not None:
        keywords["mask"] = mask_of(_read_mask(mask, cells.n_cells, name), values, mask, cells)
    elif values is not None:
        labels = source.integers(cells.n_cells, name)
        keywords["mask"] = mask_of(labels, values, name_of(source.text), cells)
    if barriers is not None:
        keywords["barriers"] = read_labels(barriers, cells.n_cells, name=name)
    return keywords


def _read_mask(path: Path, n_cells: int, name: str) -> Ints:
    """Read the value of each cell from a mask file; False is 0, and True is 1."""
    if known_ending(path, LABEL_ENDINGS) != ".npy":
        return read_labels(path, n_cells, name=name)
    data = read_content(path)
    with named_errors(path):
        values = npy_array(data, "labels")
        if values.dtype == bool:
            values = values.view(np.uint8)
        return checked_labels(values, n_cells)
