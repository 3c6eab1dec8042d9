"""Input files of commands: meshes, clouds, labels, masks, barriers and values."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np

from .._types import Array, Ints
from ..cells.kinds import kind_of
from ..errors import MeshError
from ..io.attributes import MeshAttributes
from ..io.guards import Content, counted, known_ending, named_errors, read_content
from ..io.readers.b3dm import Placement
from ..io.readers.labels import LABEL_ENDINGS, checked_labels, has_labels, read_labels
from ..io.readers.npy import npy_array
from ..io.readers.parts import PART_ENDINGS
from ..io.readers.read import cell_ending, parse_cells_and_attributes, recognized_ending
from ..mesh.cells import Cells
from .options import FILE, STANDARD_STREAM, Real, numbers, option, options

VALUE_ENDINGS = (".npy", ".txt")


def check_inputs(inputs: tuple[str, ...]) -> None:
    """Raise a usage error if inputs cannot be combined, or one is not a file name."""
    for text in inputs:
        if text != STANDARD_STREAM and not Path(text).name:
            raise click.UsageError(f"{text or repr(text)} is not a file")
    if STANDARD_STREAM in inputs and len(inputs) > 1:
        raise click.UsageError("standard input (-) has to be the only input")


def name_of(text: str) -> str:
    """Name of an input in messages."""
    return "standard input" if text == STANDARD_STREAM else text


def load_cells(text: str, format: str | None) -> Cells:
    """Return the mesh or cloud in a file, or on standard input for ``-``.

    The format is `format` if it is given. Otherwise the ending of the file tells it or, on standard
    input, the content.
    """
    return load_cells_and_attributes(text, format, keep=False)[0]


def load_cells_and_attributes(
    text: str, format: str | None, *, keep: bool = True, placement: Placement | None = None
) -> tuple[Cells, MeshAttributes | None]:
    """Return the mesh or cloud; with `keep`, also its attributes, if there are any, else None.

    `placement` moves a model of 3D Tiles.
    """
    data, ending, folder = _content(text, None if format is None else f".{format}")
    try:
        return parse_cells_and_attributes(data, ending, folder, keep=keep, placement=placement)
    except MeshError as error:
        raise MeshError(f"{name_of(text)}: {error}") from None


def labels_for(cells: Cells, path: Path, name: str) -> Ints:
    """Labels of these cells from a file; `name` is as for `read_labels`.

    From one label per vertex of a mesh, each cell gets the most frequent label of its corners.
    """
    if path.name.lower().endswith(".segs.json"):
        labels: Array = _labels_of_segments(cells, path)
    else:
        labels = read_labels(path, name=name)
        if len(labels) == getattr(cells, "n_vertices", None) != cells.n_cells:
            labels = _from_vertices(cells, labels)
    with named_errors(path):
        checked = checked_labels(labels, cells.n_cells)
    if path.suffix.lower() in PART_ENDINGS:
        _check_same_order(cells, path)
    return checked


def _labels_of_segments(cells: Cells, path: Path) -> Array:
    """The segment of each cell, from a file with the segment of each vertex."""
    from ..interop.aggregation import read_segments

    labels = read_segments(path)
    n_vertices = getattr(cells, "n_vertices", cells.n_cells)
    if len(labels) != n_vertices:
        raise MeshError(
            f"{path}: has {counted(len(labels), 'label')}, but the mesh has {n_vertices} vertices"
        )
    return _from_vertices(cells, labels)


def _from_vertices(cells: Cells, labels: Array) -> Array:
    from ..regions.vertices import labels_of_corners

    return labels_of_corners(cells, labels)


def _check_same_order(cells: Cells, path: Path) -> None:
    """Raise a MeshError if a file of parts has other faces, or faces in another order."""
    expected, given = (
        kind_of(some).positions(some) for some in (cells, load_cells(str(path), None))
    )
    tolerance = 1e-4 * np.ptp(expected, axis=0).max()
    if expected.shape != given.shape or np.abs(expected - given).max() > tolerance:
        raise MeshError(
            f"{path}: has its faces in another order than the mesh, so its labels do not fit:"
            f" use {path.name} as the mesh, or give labels as .npy"
        )


def labels_beside(mesh: Path, labels: Path | None, cells: Cells, name: str) -> Ints | None:
    """Labels from a file, or else from the file of the mesh; None if that has no labels.

    `name` is the name of the labels in files that hold more than labels.
    """
    if labels is None and not has_labels(mesh, name=name):
        return None
    if labels is None:
        return read_labels(mesh, cells.n_cells, name=name)
    return labels_for(cells, labels, name)


def _content(text: str, ending: str | None) -> tuple[Content, str, Path | None]:
    """Content of an input, the ending that names its format, and the folder of the file."""
    if text != STANDARD_STREAM:
        path = Path(text)
        return read_content(path), ending or cell_ending(path), path.parent
    if sys.stdin is None:
        raise OSError("standard input is closed")
    data = sys.stdin.buffer.read()
    if not data:
        raise MeshError("standard input is empty")
    ending = ending or recognized_ending(data)
    if ending is None:
        raise MeshError("standard input is of no known format: name it with --format")
    return data, ending, None


def read_values(path: Path) -> Array:
    """The numbers in a file, one per cell or region."""
    ending = known_ending(path, VALUE_ENDINGS)
    data = read_content(path)
    try:
        if ending == ".npy":
            return npy_array(data, "values")
        return np.array(bytes(data).split(), dtype=np.float64)
    except ValueError as error:
        raise MeshError(f"{path}: {error}") from None


constraint_options = options(
    option("--mask FILE", FILE,
           "Leave out faces or points whose value in this file of labels is 0 (or False): they get"
           " label -1."),
    option("--mask-values N,N", None,
           "Keep the faces or points with these values in the file of --mask, such as 6 or 2,6."
           "  [default: all values except 0]", callback=partial(numbers, least=0)),
    option("--barriers FILE", FILE,
           "A file of labels: one whole number per face or point. No region contains two different"
           " numbers."),
)  # fmt: skip
"""Adds the options ``--mask``, ``--mask-values`` and ``--barriers`` to a command."""

barrier_angle_option = option(
    "--barrier-angle DEG", Real(0.0, 180.0, min_open=True),
    "No region extends across an edge that bends by this angle or more, convex or concave. With"
    " -n 1 and an angle of 30, each face of a CAD part becomes one region.",
)  # fmt: skip


def constraints_of(
    mask: Path | None, values: tuple[int, ...] | None, barriers: Path | None, n_cells: int,
    name: str,
) -> dict[str, Any]:  # fmt: skip
    """Read the files, and return them as keywords of `segment`.

    `values` are the values of the mask that are kept; by default all except 0. `name` is as for
    `read_labels`.
    """
    keywords: dict[str, Any] = {}
    if mask is not None:
        labels = _read_mask(mask, n_cells, name)
        keywords["mask"] = labels != 0 if values is None else np.isin(labels, values)
    if barriers is not None:
        keywords["barriers"] = read_labels(barriers, n_cells, name=name)
    return keywords


def _read_mask(path: Path, n_cells: int, name: str) -> Ints:
    """The label of each cell; 0 and 1 for False and True in a .npy."""
    if known_ending(path, LABEL_ENDINGS) != ".npy":
        return read_labels(path, n_cells, name=name)
    data = read_content(path)
    try:
        values = npy_array(data, "labels")
        if values.dtype == bool:
            values = values.view(np.uint8)
        return checked_labels(values, n_cells)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
