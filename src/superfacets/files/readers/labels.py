"""Read labels of cells from files, and check labels."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from ...base.checks import check_length, refuse_first, refuse_mask, refuse_order
from ...base.errors import MeshError
from ...base.types import Array, Ints
from ..formats import FORMATS
from ..guards import Content, hint_at_integers, known_ending, named_errors, read_content
from .clouds import CLOUD_READERS
from .npy import npy_array, npy_header
from .parts import has_region_parts
from .ply import has_ply_labels
from .text import Lines, shown

MAX_LABEL = 2**31 - 1
"""Largest allowed label, because labels are int32."""

NO_REGION = -1
"""Label of cells that are in no region."""


def read_labels(
    path: str | os.PathLike[str], n_faces: int | None = None, *, name: str = "label"
) -> Ints:
    r"""Read the label of each cell or vertex from a file, in the order of the cells or vertices.

    Parameters
    ----------
    path : path-like
        File of labels. The ending, in upper or lower case, selects the format:

        - ``.npy``: a one-dimensional array of any integer type;
        - ``.seg`` and ``.txt``: one integer per line, without a header;
        - ``.ply``: integer property ``label`` of the faces, or of the vertices if there are no
          faces;
        - ``.vtp``, ``.vtu``, ``.vtk``, ``.msh`` and ``.mesh``: integer cell data ``label``;
        - other formats of `read_cloud`: a column or dimension ``label``;
        - ``.segs.json`` (ScanNet): one id per vertex. `face_labels` converts labels of vertices to
          labels of faces;
        - ``.label.gii`` (GIFTI) and ``.annot`` (FreeSurfer): one label per vertex: the key of the
          vertex (GIFTI), or its row in the color table (FreeSurfer), minus 1. The first entry of
          the table means no region, and becomes -1;
        - ``.shape.gii``, ``.func.gii`` (GIFTI) and ``.curv``, ``.thickness``, ``.sulc``, ``.area``
          (FreeSurfer): one whole number per vertex;
        - ``.stl`` (text) and ``.obj``: one label per part of the mesh (solid, group or object). If
          all parts have names like ``region_17``, the numbers in the names are the labels.
          Otherwise parts are numbered in the order of the file.
    n_faces : int, optional
        Number of labels that the file must have: one per cell, or one per vertex. By default, any
        number is accepted.
    name : str, default "label"
        Name of the property, column or cell data with the labels, for example ``"Label"`` or
        ``"classification"``. It is ignored for formats that have only labels or parts.

    Returns
    -------
    ndarray, shape (F,) or (V,), int32
        Label of each cell or vertex, 0 or greater; -1 if it is in no region. Labels may have gaps.

    Raises
    ------
    MeshError
        If the file is empty, truncated or damaged, if a label is not an integer or is below -1, if
        the number of labels is not `n_faces`, or if the ending is unknown. The message is one line
        that begins with the path.
    MissingExtraError
        If the format needs a package that is not installed.
    OSError
        If the file does not exist or cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.seg")
    ...     _ = path.write_text("0\n1\n")
    ...     read_labels(path, n_faces=2)
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
        return parse_labels(data, ending, n_faces, name)


def parse_labels(data: Content, ending: str, n_cells: int | None, name: str) -> Ints:
    """Return the labels in the content of a file, or raise a MeshError if they are missing."""
    if ending not in FORMATS.labels:
        raise MeshError(f"expected a format that can store labels, got {ending}")
    if ending in FORMATS.found_labels:
        found, missing = _find(data, name, ending)
        if found is None:
            raise MeshError(missing)
        return checked_labels(found, n_cells)
    table = FORMATS["labels" if ending in FORMATS["labels"] else "vertex_labels"]
    return checked_labels(table[ending](data, name), n_cells)


def find_labels(data: Content, ending: str, n_cells: int | None, name: str) -> Ints | None:
    """Return the labels in the content of a mesh or point cloud file, or None if missing."""
    if ending in (".ply", *FORMATS.part_labels):
        is_found = has_ply_labels(data, name) if ending == ".ply" else has_region_parts(data)
        return parse_labels(data, ending, n_cells, name) if is_found else None
    found = _find(data, name, ending)[0] if ending in FORMATS.found_labels else None
    return None if found is None else checked_labels(found, n_cells)


def checked_labels(labels: Any, n_faces: int | None = None, n_vertices: int | None = None) -> Ints:
    """Return labels as an int32 array, or raise a MeshError if they are not integers >= -1."""
    refuse_mask(labels, "labels", MeshError)
    refuse_order(labels, "labels")
    array = np.asarray(labels)
    if array.ndim != 1:
        raise MeshError(f"labels must be one-dimensional, got shape {array.shape}")
    if not len(array):
        raise MeshError("labels must have at least one value, got an empty array")
    if array.dtype.kind not in "iu":
        raise MeshError(f"labels must be integers, got {array.dtype}")
    if n_faces is not None:
        check_length(array, n_faces, "labels", n_vertices=n_vertices, error=MeshError)
    is_wrong = (array < NO_REGION) | (array > MAX_LABEL)
    must = f"{NO_REGION} to {MAX_LABEL}"
    refuse_first(is_wrong, "labels", array, must, MeshError)
    return np.ascontiguousarray(array, dtype=np.int32)


def read_text_labels(data: Content, name: str) -> Array:
    """Return the integers of a text file, one per line."""
    lines = Lines.of(data)
    crowded = np.flatnonzero(lines.counts != 1)
    if len(crowded):
        line, found = lines.number(crowded[0]), shown(lines.content(crowded[0]).strip())
        raise MeshError(f"line {line}: expected one integer, got {found}")
    return lines.parse(np.int64)


def read_segments(data: Content, name: str) -> Array:
    """Return the id of each vertex in a ``.segs.json`` file."""
    try:
        document = json.loads(bytes(data))
    except (ValueError, RecursionError):
        raise MeshError("is not valid JSON: the file may be truncated") from None
    values = document.get("segIndices") if isinstance(document, dict) else None
    try:
        array = np.asarray(values if isinstance(values, list) else None)
    except ValueError:  # lists of different lengths
        array = np.empty(0)
    if array.ndim != 1 or array.dtype.kind != "i" or not len(array) or array.min() < 0:
        raise MeshError("must have segIndices, a list of integers >= 0")
    return array


def read_npy_labels(data: Content, name: str) -> Array:
    """Return the array of a ``.npy`` file, which must be one-dimensional integers."""
    shape, dtype, _, _ = npy_header(data)
    if dtype.kind not in "iu":
        raise MeshError(f"labels must be integers: the .npy header declares {dtype}")
    if len(shape) != 1:
        raise MeshError(f"labels must be one-dimensional: the .npy header declares {list(shape)}")
    return npy_array(data, "labels")


def _find(data: Content, name: str, ending: str) -> tuple[Array | None, str]:
    """Return the labels named `name`, and the error message if they are missing (None)."""
    if ending not in FORMATS.label_columns:
        missing = f"the {ending[1:].upper()} file has no cell data {name}"
        return FORMATS["found_labels"][ending](data, name), missing
    stored = CLOUD_READERS[ending](data)[1].vertex
    others = [key for key, values in stored.items() if values.dtype.kind in "iu"]
    return stored.get(name), f"the points have no property {name}{hint_at_integers(others)}"
