"""Read labels of cells from files, and check labels."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...base.checks import checked_classes, integer_array, refuse_first, refuse_order
from ...base.errors import MeshError
from ...base.types import Array, Ints
from ...graph.kinds import kind_of, labels_of_corners
from ...mesh.attributes import MeshAttributes, found_name
from ...mesh.base import Cells
from ..formats import FORMATS
from ..guards import Content, known_ending, named_errors, read_content
from ..input import Input
from .read import as_declared, parse
from .text import Lines, as_integers


def read_labels(
    path: str | os.PathLike[str], n_faces: int | None = None, *, name: str = "label"
) -> Ints:
    """Read the label of each cell or vertex from a file, in the order of the cells or vertices.

    Parameters
    ----------
    path : path-like
        File of labels. The ending, in upper or lower case, selects the format:

        - ``.npy``: a one-dimensional array of any integer type;
        - ``.seg`` and ``.txt``: one integer per line, without a header;
        - other formats of `read_mesh` and `read_cloud`: the integer property ``label`` of cells; if
          it is missing, named parts of the mesh, such as solids and groups, numbered in the order
          of the file (numbers in names like ``region_17`` are labels); if parts are missing, too,
          the property ``label`` of vertices, as in ``.labels.ply`` of ScanNet;
        - labels of vertices: ``.segs.json`` (ScanNet); ``.aggregation.json``: the ``objectId`` of
          each vertex, by the segments file that it names; ``.label.gii`` (GIFTI) and ``.annot``
          (FreeSurfer): the key of the vertex, or its row in the color table, minus 1; whole numbers
          in ``.shape.gii``, ``.func.gii``, ``.curv``, ``.thickness``, ``.sulc`` and ``.area``;
          ``.label`` (FreeSurfer): 0 for listed vertices and -1 for others. `face_labels` converts
          labels of vertices to labels of faces.
    n_faces : int, optional
        Number of labels that the file must have: one per cell, or one per vertex. By default, any
        number is accepted. Required for ``.label``, which does not list all vertices.
    name : str, default "label"
        Name of the property, column or cell data with the labels, for example ``"Label"`` or
        ``"classification"``. It is ignored for formats that have only labels or parts.

    Returns
    -------
    ndarray, shape (F,) or (V,), int32
        Label of each cell or vertex, 0 or greater; -1 if it is in no region. Labels may have gaps.

    Raises
    ------
    MeshError, MissingExtraError, OSError
        For the same reasons as in `read_mesh`; if a label is not an integer or is below -1; or if
        the number of labels is not `n_faces`.

    Examples
    --------
    >>> from superfacets import write_labels
    >>> write_labels("square.seg", [0, 1])
    >>> read_labels("square.seg", n_faces=2)
    array([0, 1], dtype=int32)
    """
    path = Path(path)
    if path.suffix.lower() == ".jsonl":
        raise MeshError(
            f"{path}: work files of the studio cannot be read without their mesh: write the labels"
            f" with superfacets convert MESH {path.name} -o labels.npy"
        )
    ending = known_ending(path, FORMATS.labels)
    data = read_content(path)
    with named_errors(path):
        return parse_labels(Input(data, ending, path.parent), n_faces, name)[0]


def parse_labels_of(
    cells: Cells, source: Input, name: str, *, at_vertices: bool = False
) -> tuple[Ints, bool]:
    """Return the labels in the file of `cells`, and whether they belong to vertices.

    If `at_vertices`, labels of vertices are returned unchanged. Otherwise, a cell gets the most
    frequent label of its corners.
    """
    labels, are_of_vertices = parse_labels(source, None, name)
    if are_of_vertices and at_vertices:
        return labels, True
    labels = labels_of_corners(cells, labels) if are_of_vertices else labels
    return checked_labels(labels, cells.n_cells), False


def parse_labels(source: Input, n_cells: int | None, name: str) -> tuple[Ints, bool]:
    """Return the labels in a file, and whether they are known to be labels of vertices."""
    for role in ("labels", "vertex_labels", "groups"):
        if source.ending in FORMATS[role]:
            given = source if role == "groups" else as_declared(source.data)
            found = FORMATS[role][source.ending](given)
            if source.ending in FORMATS.vertex_values:
                found = as_integers(found, "labels")
            return checked_labels(found, n_cells), role != "labels"
    if source.ending in FORMATS["vertex_lists"]:
        return _expanded(FORMATS["vertex_lists"][source.ending](source.data), n_cells), True
    if source.ending not in FORMATS.cells:
        raise MeshError(f"expected a format that can store labels, got {source.ending}")
    cells, attributes = parse(replace(source, keep=True))
    own = find_labels(cells, attributes, name)
    of_vertices = {} if attributes is None or kind_of(cells).are_points else attributes.vertex
    found = of_vertices.get(found_name(of_vertices, name)) if own is None else own.values
    if found is not None and found.ndim == 1:
        return checked_labels(as_integers(found, "labels"), n_cells), own is None
    stored = {**_stored_of(cells, attributes), **of_vertices}
    others = [key for key, each in stored.items() if each.dtype.kind in "iu" and each.ndim == 1]
    how = "choose --labels-named (name=) from" if name == "label" else "the integer properties are"
    hint = f": {how} {', '.join(others)}" if others else ""
    raise MeshError(f"the {kind_of(cells).plural} have no property {name}{hint}")


def _expanded(listed: Array, n_vertices: int | None) -> Ints:
    """Return label 0 for listed vertices, and -1 for others."""
    if n_vertices is None:
        raise MeshError("the file lists only some vertices: pass the number of vertices as n_faces")
    is_wrong = (listed < 0) | (listed >= n_vertices)
    refuse_first(is_wrong, "listed vertices", listed, f"0 to {n_vertices - 1}", MeshError)
    return np.isin(np.arange(n_vertices), listed).astype(np.int32) - np.int32(1)


class OwnLabels(NamedTuple):
    """Labels of cells in the file of these cells."""

    values: Array
    names: tuple[str, ...]  # names of the parts that the values number, or ()
    are_parts: bool  # whether the file has no labels, but named parts, such as solids or groups


def find_labels(cells: Cells, attributes: MeshAttributes | None, name: str) -> OwnLabels | None:
    """Return the property `name` of cells, or else named parts if it is ``"label"``, or None."""
    stored = _stored_of(cells, attributes)
    key = found_name(stored, name)
    parts = {} if attributes is None else attributes.names
    are_parts = key not in stored and name == "label"
    key = next(iter(parts), key) if are_parts else key
    if key not in stored:
        return None
    values, names = stored[key], parts.get(key, ())
    return OwnLabels(values, names if names and values.max() < len(names) else (), are_parts)


def _stored_of(cells: Cells, attributes: MeshAttributes | None) -> Mapping[str, Array]:
    if attributes is None:
        return {}
    return attributes.vertex if kind_of(cells).are_points else attributes.face


def checked_labels(labels: Any, n_faces: int | None = None, n_vertices: int | None = None) -> Ints:
    """Return labels as an int32 array, or raise a MeshError if they are not integers >= -1."""
    refuse_order(labels, "labels")
    try:
        given = integer_array(labels, "labels")
        if not len(given):
            raise MeshError("labels must have at least one value, got an empty array")
        n = len(given) if n_faces is None else n_faces
        return checked_classes(given, n, "labels", n_vertices=n_vertices)
    except (TypeError, ValueError) as error:
        raise MeshError(str(error)) from None


def read_text_labels(data: Content) -> Array:
    """Return the integers of a text file, one per line."""
    lines = Lines.of(data)
    lines.refuse(lines.counts != 1, "expected 1 number")
    return lines.parse(np.int64)
