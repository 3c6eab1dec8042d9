"""Read point clouds from text and from NPY files."""

from __future__ import annotations

import csv
import re

import numpy as np

from ...base.arrays import as_doubles
from ...base.checks import counted
from ...base.errors import MeshError
from ...base.text import shortened
from ...base.types import Array, Floats
from ...mesh.attributes import COLORS
from ..guards import Content
from ..input import NORMALS, Input, Read
from .npy import npy_array
from .text import Lines

_UNIT = 0.01
"""Unnamed columns are normals if all lengths differ from 1 by less than about this number."""

_MAX_COLUMNS = 12
"""Maximum number of columns of a cloud in .npy. Wider arrays are height grids or features."""

OTHER_NAMES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny",
                "normal_z": "nz"}  # fmt: skip


def read_text_cloud(source: Input) -> Read:
    """Parse numbers separated by spaces, commas or semicolons; line 1 may have column names."""
    data = source.data
    if data.find(b",") >= 0 or data.find(b";") >= 0:
        data = data[:].translate(bytes.maketrans(b",;", b"  "))
    lines = Lines.of(data, comment=b"#")
    names = _names_in(source.data, lines)
    lines = lines if names is None else lines[1:]
    if not len(lines):
        raise MeshError("the file has no points")
    n_columns = int(lines.counts[0])
    expected = counted(n_columns, "number")
    lines.refuse(lines.counts != n_columns, f"expected {expected} as in the previous lines")
    if names is not None and len(names) != n_columns:
        raise MeshError(
            f"the first line has {counted(len(names), 'column name')}, but the next has"
            f" {counted(n_columns, 'number')}"
        )
    return _cloud_of_table(source, lines.parse(np.float64).reshape(-1, n_columns), names)


def _names_in(data: Content, lines: Lines) -> list[str] | None:
    """Return the column names in the first line, in lower case, or None. `lines` have no commas."""
    if not len(lines) or not re.match(rb"[\s\"'/]*(?!(?:nan|inf)\b)[a-z_]", lines.content(0), re.I):
        return None
    begin = 3 * (data[:3] == b"\xef\xbb\xbf")  # of the text, after a byte order mark
    line = data[begin + int(lines.starts[0]) : begin + int(lines.ends[0])]
    text = line[: 1 << 16].decode("latin-1").lower().replace("\r", " ").strip("/ ")
    mark = next((mark for mark in ",;\t" if mark in text), " ")
    words = next(csv.reader([text], delimiter=mark, skipinitialspace=True))
    names = [word.strip("\"' ") for word in words if mark != " " or word]
    names = [OTHER_NAMES.get(name, name) for name in names]
    if not {"x", "y", "z"} <= set(names):
        got = shortened(", ".join(names))
        raise MeshError(f"the first line must name columns x, y and z, or be numbers, got {got}")
    return names


def read_npy_cloud(source: Input) -> Read:
    """Return the points of a ``.npy`` file with 3 to 12 columns."""
    array = npy_array(source.data)
    if array.dtype.kind not in "fiu":
        raise MeshError(f"expected an array of numbers, got {array.dtype}")
    if array.ndim != 2 or not 3 <= array.shape[1] <= _MAX_COLUMNS:
        advice = "a height grid, convert it to a mesh first (see Terrain in the documentation)"
        if array.ndim == 1 and array.dtype.kind in "iu":
            advice = "an array of labels, use --barriers, or superfacets regions MESH LABELS"
        raise MeshError(
            f"expected shape (N, n) with n from 3 to {_MAX_COLUMNS}, got {array.shape}: if this is"
            f" {advice}"
        )
    return _cloud_of_table(source, as_doubles(array), None)


def _cloud_of_table(source: Input, table: Floats, names: list[str] | None) -> Read:
    """Convert a table to a cloud. Without `names`, columns are x, y, z, then colors or normals."""
    n_columns = table.shape[1]
    if n_columns < 3:
        raise MeshError(f"expected 3 or more numbers per point, got {n_columns}")
    if names is None:
        names = ["x", "y", "z", *_meaning_of(table[:, 3:6])]
        names += [f"column_{place}" for place in range(len(names) + 1, n_columns + 1)]
    if (double := next((name for name in "xyz" if names.count(name) > 1), None)) is not None:
        raise MeshError(f"the first line has two columns named {double}")
    columns = zip(names, table.T, strict=True)
    return source.cloud((name, v if name in [*"xyz"] else _narrowed(v)) for name, v in columns)


def _narrowed(column: Floats) -> Array:
    """Convert whole numbers to uint8, as colors have, or to int32; return other columns."""
    if not np.isfinite(column).all() or np.any(column != np.floor(column)):
        return column
    low, high = column.min(), column.max()
    for kind in (np.uint8, np.int32):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return column.astype(kind)
    return column


def _meaning_of(further: Floats) -> tuple[str, ...]:
    """Return names for three unnamed columns if they can be colors or normals, otherwise none."""
    if further.shape[1] < 3:
        return ()
    if np.all((further >= 0) & (further <= 255) & (further == np.floor(further))):
        return COLORS
    lengths = np.einsum("ij,ij->i", further, further)
    return NORMALS if np.all(np.abs(lengths - 1) < 2 * _UNIT) else ()
