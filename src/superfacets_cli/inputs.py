"""Read input files of commands: meshes, clouds, labels, masks, barriers and values."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError, enforce_connectivity, face_labels, kit
from superfacets.kit import FORMATS, Array, CellFile, Cells, Ints

from .failures import print_line, print_note
from .options import FILE, STANDARD_STREAM, Count, Listed, Real, option, options


class GivenLabels(NamedTuple):
    """Content of a label file."""

    path: Path
    labels: Ints
    are_of_vertices: bool  # whether there is one label per vertex of a mesh instead of one per cell
    names: dict[int, str]  # names of labels, such as names of solids


def name_of(text: str) -> str:
    """Return the name of an input for messages."""
    return "standard input" if text == STANDARD_STREAM else text


def _classes_in_work(source: CellFile, path: Path, n_cells: int) -> tuple[Ints, dict[int, str]]:
    """Return the class of each cell in a work file (0: no class), and the names of classes."""
    from superfacets_studio import classes_in_work

    classes, names, notes = classes_in_work(path, bytes(kit.read_content(path)), source, n_cells)
    for note in notes:
        print_line("note", note)
    return classes, names


def up_axis(source: CellFile, requested: Any) -> Any:
    """Return the axis that points up: `requested`, or if it is auto, the axis of the format."""
    return "z" if requested == "auto" and source.ending in FORMATS.z_up else requested


def labels_of_cells(cells: Cells, given: GivenLabels, *, is_noted: bool = True) -> Ints:
    """Return labels of cells; a cell gets the most frequent label of the vertices at its corners.

    If labels of vertices are converted, a note is printed if `is_noted`.
    """
    labels = face_labels(cells, given.labels) if given.are_of_vertices else given.labels
    if not (given.are_of_vertices and is_noted):
        return labels
    edit = enforce_connectivity(cells, kit.ranked_labels(labels)[0]) if labels.max() >= 0 else None
    n_lost = len(np.setdiff1d(given.labels[given.labels >= 0], labels))
    n_apart = 0 if edit is None else edit.n_joined + edit.n_islands
    changes = [f"{kit.counted(n_apart, 'piece')} apart from the rest of a region"] * bool(n_apart)
    changes += [f"{kit.counted(n_lost, 'region')} left out without a face"] * bool(n_lost)
    if changes:
        print_note(
            f"{given.path}: labels of vertices were converted to labels of faces (the majority of"
            f" the corners): {' and '.join(changes)}"
        )
    return labels


def note_on_side(source: CellFile, path: str | Path) -> None:
    """Print a note if the names of two files of brains say different hemispheres."""
    names = f"{Path(source.name).name}/{Path(path).name}".lower()
    if len({*re.findall(r"(?:^|[./])([lr])h?\.", names)}) == 2:
        print_note(f"{path}: another hemisphere than {source.name}, according to the names")


def given_labels(
    source: CellFile, cells: Cells, path: Path, name: str, *, are_values: bool = False
) -> GivenLabels:
    """Read a label file, which has one label per cell or, for a mesh, one label per vertex.

    `source` is the input that contains the `cells`. `name` and `are_values` are as in
    `CellFile.labels_in`. If the label file is a work file of the studio, labels are classes or -1.
    """
    from superfacets_formats import label_names  # slow to import

    note_on_side(source, path)
    if path.suffix.lower() == ".jsonl":
        classes, names = _classes_in_work(source, path, cells.n_cells)
        return GivenLabels(path, np.where(classes > 0, classes, np.int32(-1)), False, names)
    if str(path) == source.name and (own := source.own_labels(cells.n_cells, name)):
        return GivenLabels(path, own.values, False, dict(enumerate(own.names)))
    named = label_names(path) if path.name.lower().endswith(FORMATS.key_labels) else {}
    return GivenLabels(path, *source.labels_in(path, cells, name, are_values=are_values), named)


def labels_for(source: CellFile, cells: Cells, path: Path, name: str) -> Ints:
    """Read labels of `cells` from a label file; the parameters are as in `given_labels`."""
    return labels_of_cells(cells, given_labels(source, cells, path, name))


def stored_labels(source: CellFile, cells: Cells, name: str, loss: str | None = "") -> Ints | None:
    """Return the labels in a file, or None after a note on the `loss`, unless `loss` is None."""
    found = source.own_labels(cells.n_cells, name)
    if found is not None and not found.are_parts:
        return found.values
    if loss is not None:
        parts = f", or {source.name} again to use its named parts" if found else ""
        print_note(f"{source.name} has no labels{loss}: give a label file as LABELS{parts}")
    return None


def ranked_labels_beside(
    source: CellFile, labels: Path | None, cells: Cells, name: str
) -> tuple[Ints, Array, Ints, dict[int, str]]:
    """Read labels from the file `labels` or, if it is None, from the input `source`.

    Returns four values: labels 0 to K - 1 of cells; the label of each region in the file; labels 0
    to K - 1 of the cells or vertices that the file labels; and names of labels, if they have any.
    Raises a MeshError if there are no labels, or if all are -1.
    """
    if labels is not None:
        given = given_labels(source, cells, labels, name)
    elif own := source.own_labels(cells.n_cells, name):
        given = GivenLabels(Path(source.name), own.values, False, dict(enumerate(own.names)))
    else:
        kept, are_points = source.cells_and_attributes()[1], kit.kind_of(cells).are_points
        stored = {} if kept is None else kept.vertex if are_points else kept.face
        listed = [key for key, each in stored.items() if each.dtype.kind in "iu" and each.ndim == 1]
        hint = f", or --labels-named with one of {', '.join(listed)}" if listed else ""
        raise MeshError(f"{source.name} has no labels: give a label file as LABELS{hint}")
    compact, names = kit.ranked_labels(labels_of_cells(cells, given))
    if not len(names):
        raise MeshError(f"{given.path}: no cell is in a region: all labels are -1")
    found = np.where(np.isin(given.labels, names), given.labels, -1)
    as_given = kit.ranked_labels(found)[0] if given.are_of_vertices else compact
    return compact, names, as_given, given.names


def read_input(text: str, format: str | None = None) -> CellFile:
    """Read a file, or standard input for ``-``.

    If `format` is None, it is found from the file ending, or the content of standard input.
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


mask_values_option = option(
    "--mask-values N,N", Listed(Count(0)),
    "Keep only cells with one of these values, such as 2,6, in the property of IN that"
    " --labels-named names, or in the mask file if one is given. Other cells get label -1.",
)  # fmt: skip
constraint_options = options(
    option("--mask FILE", FILE,
           "Label file with one value per face, point or vertex, as superfacets.read_labels reads"
           " it. Without --mask-values, cells with value 0 (or False) are left out and get label"
           " -1, or with value -1 (no area) in .label.gii, .annot and .label files. With one"
           " value per vertex, a face follows the majority of its corners."),
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
    " region, but faces that meet tangentially stay one: superfacets.cad_faces in Python divides"
    " them.",
)  # fmt: skip


def constraints_of(given: Mapping[str, Any], source: CellFile, cells: Cells) -> dict[str, Any]:
    """Read the mask and the barriers, and return them as keyword arguments of `segment`.

    `given` are the options of the command, and `cells` are the content of `source`. Without a file
    `mask`, its property `labels_named` is used. Cells or vertices with one of `mask_values` are
    kept, by default with any value except 0. Raises a MeshError if nothing is kept.
    """
    keywords: dict[str, Any] = {}
    for path in given.get("features", ()):
        note_on_side(source, path)
    mask, values, name = given["mask"], given["mask_values"], given["labels_named"]
    if mask is not None or values is not None:
        if mask is None:
            found = source.integers(cells, name)[0]
        else:
            found = _values_in(mask, source, cells, name)
        if mask is not None and values is None and mask.name.lower().endswith(FORMATS.area_files):
            found = found + np.int32(1)  # -1 means no area
        keywords["mask"] = source.mask(found, values, cells, mask)
    if given["barriers"] is not None:
        keywords["barriers"] = _values_in(given["barriers"], source, cells, name)
    return keywords


def likely_labels(constraints: Mapping[str, Any]) -> Ints | None:
    """Return labels for `OutputFiles.check_fit`: -1 for cells that the mask leaves out, else 0."""
    mask = constraints.get("mask")
    return None if mask is None else np.asarray(mask, np.int32) - np.int32(1)


def _values_in(path: Path, source: CellFile, cells: Cells, name: str) -> Ints:
    """Read one integer per cell or vertex: a value, a label, or the class in a work file.

    If there are as many vertices as cells, values of vertices become values of cells.
    """
    if path.suffix.lower() == ".jsonl":
        return _classes_in_work(source, path, cells.n_cells)[0]
    given = given_labels(source, cells, path, name, are_values=True)
    if len(given.labels) != cells.n_cells:
        return given.labels
    return labels_of_cells(cells, given, is_noted=False)
