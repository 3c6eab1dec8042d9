"""Read input files of commands: meshes, clouds, labels, masks, barriers and values."""

from __future__ import annotations

import hashlib
import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from superfacets import MeshAttributes, MeshError, kit
from superfacets.files.readers.labels import (
    KEY_ENDINGS,
    LABEL_ENDINGS,
    PLACED_ENDINGS,
    VERTEX_ENDINGS,
    WORK_ENDING,
    checked_labels,
    find_labels,
)
from superfacets.files.readers.npy import npy_header
from superfacets.files.readers.read import recognized_ending
from superfacets.graph.corner_labels import are_of_vertices
from superfacets.kit import NO_REGION, Array, Cells, Content, Floats, Ints
from superfacets_formats import CORTEX_VALUES, las_steps, values_of_vertices
from superfacets_show import Z_UP_ENDINGS

from .failures import print_note, print_notes
from .options import FILE, STANDARD_STREAM, Real, numbers, option, options

VALUE_ENDINGS = (".npy", ".txt", *CORTEX_VALUES)


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

    def cells_and_attributes(self, *, keep: bool = True) -> tuple[Cells, MeshAttributes | None]:
        """Return the mesh or point cloud, and its attributes.

        The attributes are None if `keep` is False, or if the input has no attributes.
        """
        with kit.named_errors(name_of(self.text)):
            return kit.parse_cells_and_attributes(self.data, self.ending, self.folder, keep=keep)

    def labels(self, n_cells: int, name: str) -> Ints | None:
        """Return the labels called `name`, one per cell, or None if the input has none."""
        with kit.named_errors(name_of(self.text)):
            return find_labels(self.data, self.ending, n_cells, name)

    def integers(self, n_cells: int, name: str) -> Ints:
        """Return the integer property `name`, one value per cell; if missing, raise a MeshError."""
        with kit.named_errors(name_of(self.text)):
            return kit.parse_labels(self.data, self.ending, n_cells, name)

    def classes_in_work(self, path: Path, n_cells: int) -> Ints:
        """Return the class of each cell in a work file of the studio; 0 means no class.

        Notes about labels that were lost are always printed. Raises a MeshError if the work file
        belongs to another input.
        """
        from superfacets_studio import classes_in_work

        content, digest = bytes(kit.read_content(path)), hashlib.sha256(self.data).hexdigest()
        source = Path(name_of(self.text))
        classes, notes = classes_in_work(path, content, source, digest, n_cells)
        print_notes(notes)
        return classes

    def up_axis(self, requested: Any) -> Any:
        """Return the axis that points up: `requested`, or if it is auto, the axis of the format."""
        return "z" if requested == "auto" and self.ending in Z_UP_ENDINGS else requested

    @property
    def steps(self) -> Floats:
        """Quantization steps of x, y and z, (3,), if this is a LAS or LAZ file; 0 otherwise."""
        is_las = self.ending in (".las", ".laz")
        return np.array(las_steps(self.data) if is_las else (0.0, 0.0, 0.0))


def labels_for(source: Input, cells: Cells, path: Path, name: str, *, is_quiet: bool) -> Ints:
    """Read labels of `cells` from a label file; the other parameters are as in `given_labels`.

    Labels of vertices are converted by `labels_of_cells`, which also explains `is_quiet`.
    """
    return labels_of_cells(cells, given_labels(source, cells, path, name), is_quiet=is_quiet)


def labels_of_cells(cells: Cells, given: GivenLabels, *, is_quiet: bool) -> Ints:
    """Convert labels of vertices to labels of cells: the most frequent label at a cell's corners.

    A note is printed unless `is_quiet`. Labels of cells are returned unchanged, without a note.
    """
    from superfacets import face_labels

    if not given.are_of_vertices:
        return given.labels
    labels = face_labels(cells, given.labels)
    if not is_quiet:
        n_lost = len(np.setdiff1d(given.labels[given.labels >= 0], labels))
        lost = f"; left out: {kit.counted(n_lost, 'region')} without a face" if n_lost else ""
        print_note(
            f"{given.path}: labels of vertices were converted to labels of faces (the majority of"
            f" the corners), which can split regions{lost}"
        )
    return labels


def given_labels(
    source: Input, cells: Cells, path: Path, name: str, *, are_values: bool = False
) -> GivenLabels:
    """Read a label file, which has one label per cell or, for a mesh, one label per vertex.

    `source` is the input that contains the `cells`, and `name` is the same as in `read_labels`. If
    the label file is a work file of the studio, the labels are the classes, and -1 for no class. If
    `are_values` is True, an array of bools is accepted.
    """
    if is_work(path):
        classes = source.classes_in_work(path, cells.n_cells)
        return GivenLabels(path, np.where(classes > 0, classes, np.int32(NO_REGION)), False)
    ending = kit.known_ending(path, LABEL_ENDINGS)
    labeled = Input(str(path), kit.read_content(path), ending, path.parent)
    n_vertices = getattr(cells, "n_vertices", None)
    with kit.named_errors(path):
        is_mask = are_values and ending == ".npy" and npy_header(labeled.data)[1].kind == "b"
        labels = (
            checked_labels(kit.npy_array(labeled.data, "labels").view(np.uint8))
            if is_mask
            else kit.parse_labels(labeled.data, ending, None, name)
        )
        if n_vertices is not None and ending in VERTEX_ENDINGS:
            kit.check_length(labels, n_vertices, "labels", "vertex", error=MeshError)
            return GivenLabels(path, labels, True)
        of_vertices = are_of_vertices(labels, cells)
    if ending in PLACED_ENDINGS:
        _check_same_order(source, cells, labeled, are_of_vertices=of_vertices)
    return GivenLabels(path, labels, of_vertices)


def is_work(path: Path) -> bool:
    """Return whether a path has the ending of work files of the studio."""
    return path.suffix.lower() == WORK_ENDING


def _check_same_order(source: Input, cells: Any, labeled: Input, *, are_of_vertices: bool) -> None:
    """Raise a MeshError if labeled cells differ from the cells of `source` in position or order.

    If `are_of_vertices` is true, the points in `labeled` are compared with the vertices of `cells`.
    Positions may differ by rounding to float32, which many formats store, and by one quantization
    step of LAS. These tolerances are smaller than the distances that the formats can represent.
    """
    kind, others = kit.kind_of(cells), labeled.cells()
    expected = cells.vertices if are_of_vertices else kind.positions(cells)
    given = kit.kind_of(others).positions(others)
    # Half of `eps` is the maximum relative error of rounding.
    tolerance = np.finfo(np.float32).eps * np.abs(cells.bounds).max(axis=0)
    tolerance += np.maximum(source.steps, labeled.steps)
    if expected.shape != given.shape or (np.abs(expected - given) > tolerance).any():
        path, plural = Path(labeled.text), "vertices" if are_of_vertices else kind.plural
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
    return labels_for(source, cells, labels, name, is_quiet=is_quiet)


def read_input(text: str, format: str | None = None) -> Input:
    """Read a file, or standard input for ``-``.

    If `format` is None, the format is taken from the file ending, or recognized from the content of
    standard input.
    """
    ending = None if format is None else f".{format}"
    if text != STANDARD_STREAM:
        path = Path(text)
        return Input(text, kit.read_content(path), ending or kit.cell_ending(path), path.parent)
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
    """Read numbers from a .npy, .txt, GIFTI or FreeSurfer file, one per cell, region or vertex."""
    ending = kit.known_ending(path, VALUE_ENDINGS)
    data = kit.read_content(path)
    try:
        if ending == ".npy":
            return kit.npy_array(data, "values")
        if ending in CORTEX_VALUES:
            return values_of_vertices(data, ending)
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
           "Label file with one value per face, point or vertex; in .label.gii and .annot files,"
           " the key or table row. Without --mask-values, cells with value 0 (or False) are left"
           " out and get label -1. A face has the most frequent value of its vertices."),
    mask_values_option,
    option("--barriers FILE", FILE,
           "Label file with one whole number per face, point or vertex. Cells with different"
           " numbers never share a region."),
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
        of_file = _values_of_cells(mask, source, cells, name)
        keywords["mask"] = kit.mask_of(of_file, values, mask, cells)
    elif values is not None:
        labels = source.integers(cells.n_cells, name)
        keywords["mask"] = kit.mask_of(labels, values, name_of(source.text), cells)
    if barriers is not None:
        keywords["barriers"] = _values_of_cells(barriers, source, cells, name)
    return keywords


def _values_of_cells(path: Path, source: Input, cells: Cells, name: str) -> Ints:
    """Read one integer per cell: a value, a key, or the class in a work file of the studio.

    Values of vertices are converted: a cell gets the most frequent value of its corners. False is
    0, and True is 1.
    """
    if is_work(path):
        return source.classes_in_work(path, cells.n_cells)
    given = given_labels(source, cells, path, name, are_values=True)
    first = int(path.name.lower().endswith(KEY_ENDINGS))  # key of label 0
    return labels_of_cells(cells, given, is_quiet=True) + np.int32(first)
