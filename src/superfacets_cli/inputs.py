"""Read input files of commands: meshes, clouds, labels, masks, barriers and values."""

from __future__ import annotations

import hashlib
import sys
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import FORMATS, Array, CellFile, Cells, Ints
from superfacets_formats import CORTEX_VALUES, values_of_vertices

from .failures import print_line, print_note
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


def classes_in_work(source: CellFile, path: Path, n_cells: int) -> Ints:
    """Return the class of each cell in a work file of the studio; 0 means no class.

    Notes about labels that were lost are always printed. Raises a MeshError if the work file
    belongs to another input than `source`.
    """
    from superfacets_studio import classes_in_work as classes_of

    content, digest = bytes(kit.read_content(path)), hashlib.sha256(source.data).hexdigest()
    classes, notes = classes_of(path, content, Path(source.name), digest, n_cells)
    for note in notes:
        print_line("note", note)
    return classes


def up_axis(source: CellFile, requested: Any) -> Any:
    """Return the axis that points up: `requested`, or if it is auto, the axis of the format."""
    return "z" if requested == "auto" and source.ending in FORMATS.z_up else requested


def labels_for(
    source: CellFile, cells: Cells, path: Path, name: str, *, is_noted: bool = True
) -> Ints:
    """Read labels of `cells` from a label file; the other parameters are as in `given_labels`.

    Labels of vertices are converted by `labels_of_cells`, which also explains `is_noted`.
    """
    return labels_of_cells(cells, given_labels(source, cells, path, name), is_noted=is_noted)


def labels_of_cells(cells: Cells, given: GivenLabels, *, is_noted: bool = True) -> Ints:
    """Convert labels of vertices to labels of cells: the most frequent label at a cell's corners.

    A note is printed if `is_noted`. Labels of cells are returned unchanged, without a note.
    """
    from superfacets import face_labels

    if not given.are_of_vertices:
        return given.labels
    labels = face_labels(cells, given.labels)
    if is_noted:
        n_lost = len(np.setdiff1d(given.labels[given.labels >= 0], labels))
        lost = f"; left out: {kit.counted(n_lost, 'region')} without a face" if n_lost else ""
        print_note(
            f"{given.path}: labels of vertices were converted to labels of faces (the majority of"
            f" the corners), which can split regions{lost}"
        )
    return labels


def given_labels(
    source: CellFile, cells: Cells, path: Path, name: str, *, are_values: bool = False
) -> GivenLabels:
    """Read a label file, which has one label per cell or, for a mesh, one label per vertex.

    `source` is the input that contains the `cells`. `name` and `are_values` are the same as in
    `CellFile.labels_in`. If the label file is a work file of the studio, the labels are the
    classes, and -1 for no class.
    """
    if is_work(path):
        classes = classes_in_work(source, path, cells.n_cells)
        return GivenLabels(path, np.where(classes > 0, classes, np.int32(-1)), False)
    return GivenLabels(path, *source.labels_in(path, cells, name, are_values=are_values))


def is_work(path: Path) -> bool:
    """Return whether a path has the ending of work files of the studio."""
    return path.suffix.lower() == ".jsonl"


def labels_beside(
    source: CellFile, labels: Path | None, cells: Cells, name: str, *, is_noted: bool = True
) -> Ints | None:
    """Read labels from the file `labels` or, if it is None, from the mesh file `source`.

    Returns None if the mesh file has no labels. `name` is the name of the labels in files that also
    contain other data. `is_noted` is the same as in `labels_of_cells`.
    """
    if labels is None:
        return source.labels(cells.n_cells, name)
    return labels_for(source, cells, labels, name, is_noted=is_noted)


def read_input(text: str, format: str | None = None) -> CellFile:
    """Read a file, or standard input for ``-``.

    If `format` is None, the format is taken from the file ending, or recognized from the content of
    standard input.
    """
    ending = None if format is None else f".{format}"
    if text != STANDARD_STREAM:
        return CellFile.read(Path(text), ending)
    if sys.stdin is None:
        raise OSError("standard input is closed")
    data = sys.stdin.buffer.read()
    if not data:
        raise MeshError("standard input is empty")
    found = CellFile.of_stream(data, name_of(text), ending)
    if found is None:
        raise MeshError("the format of standard input is unknown: give it with --format")
    return found


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
           "Label file with one value per face, point or vertex, as superfacets.read_labels reads"
           " it. Without --mask-values, cells with value 0 (or False) are left out and get label"
           " -1, or with value -1 (no area) in .label.gii and .annot files. A face has the most"
           " frequent value of its vertices."),
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
    mask: Path | None, values: tuple[int, ...] | None, barriers: Path | None, source: CellFile,
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
        if values is None and mask.name.lower().endswith(FORMATS.key_labels):
            of_file = of_file + np.int32(1)  # -1 means no area
        keywords["mask"] = source.mask(of_file, values, cells, mask)
    elif values is not None:
        labels = source.integers(cells.n_cells, name)
        keywords["mask"] = source.mask(labels, values, cells)
    if barriers is not None:
        keywords["barriers"] = _values_of_cells(barriers, source, cells, name)
    return keywords


def _values_of_cells(path: Path, source: CellFile, cells: Cells, name: str) -> Ints:
    """Read one integer per cell: a value, a label, or the class in a work file of the studio.

    Values of vertices are converted: a cell gets the most frequent value of its corners. False is
    0, and True is 1.
    """
    if is_work(path):
        return classes_in_work(source, path, cells.n_cells)
    given = given_labels(source, cells, path, name, are_values=True)
    return labels_of_cells(cells, given, is_noted=False)
