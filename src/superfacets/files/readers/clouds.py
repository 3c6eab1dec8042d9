"""Read point clouds: PLY without faces, text, NPY, LAS, LAZ, E57 and PCD."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...base.checks import counted
from ...base.errors import MeshError
from ...base.types import Array, Bools, Floats
from ...mesh.point_cloud import PointCloud
from ..attributes import COLORS, LasFrame, MeshAttributes, is_word
from ..formats import FORMATS
from ..guards import Content, as_doubles, as_rows, narrowed
from .npy import npy_array
from .ply import attributes_of
from .ply_body import read_tables
from .ply_header import parse_header
from .text import Lines

_NORMALS = ("nx", "ny", "nz")
_SPLAT_COLORS = ("f_dc_0", "f_dc_1", "f_dc_2")
_SPLAT_COLOR = 0.5 / math.sqrt(math.pi)
"""Value of the spherical harmonic of degree 0. The color of a Gaussian splat is 0.5 plus this value
times the coefficients `_SPLAT_COLORS`."""

SCALES = ("scale_0", "scale_1", "scale_2")
ROTATIONS = ("rot_0", "rot_1", "rot_2", "rot_3")
_FLAT = math.log(2.0)
"""Minimum difference between the two smallest log scales of a Gaussian splat. If the difference is
smaller, the splat has no normal direction."""

_UNIT = 0.01
"""Unnamed columns are normals if all lengths differ from 1 by less than about this number."""

_MAX_COLUMNS = 12
"""Maximum number of columns of a cloud in .npy. Wider arrays are height grids or features."""

OTHER_NAMES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny",
                "normal_z": "nz"}  # fmt: skip

CLOUD_READERS = FORMATS.readers["points"]


CloudFile: TypeAlias = tuple[PointCloud, MeshAttributes]
"""A point cloud, and the attributes of its points."""


def holds_cloud(data: Content, ending: str) -> bool:
    """Return whether a file with this content and ending has points but no faces."""
    if ending != ".ply":
        return ending in CLOUD_READERS
    return parse_header(data).faces is None


def read_ply_cloud(data: Content) -> CloudFile:
    """Return the vertices of a PLY file with their normals, colors and attributes."""
    header = parse_header(data)
    tables = read_tables(header, data)
    attributes = attributes_of(header, tables)
    columns = {name: values for name, values in attributes.vertex.items() if values.ndim == 1}
    place = header.find("vertex")
    for axis in "xyz":
        column = None if place is None else header.elements[place].find(axis)
        values = None if place is None or column is None else tables[place][column].values
        if values is None or values.ndim != 1:
            raise MeshError(f"the vertices of the PLY file have no property {axis}")
        columns[axis] = values
    return cloud_of(columns, {})[0], attributes


def read_text_cloud(data: Content) -> CloudFile:
    """Parse numbers separated by spaces, commas or semicolons; line 1 may have column names."""
    if data.find(b",") >= 0 or data.find(b";") >= 0:
        data = data[:].translate(bytes.maketrans(b",;", b"  "))
    lines = Lines.of(data, comment=b"#")
    names = _names_in(lines)
    if names is not None:
        lines = lines[1:]
    if not len(lines):
        raise MeshError("the file has no points")
    n_columns = int(lines.counts[0])
    odd = np.flatnonzero(lines.counts != n_columns)
    if len(odd):
        line = int(odd[0])
        raise MeshError(
            f"line {lines.number(line)} has {counted(int(lines.counts[line]), 'number')}, but the"
            f" previous lines have {n_columns}"
        )
    if names is not None and len(names) != n_columns:
        raise MeshError(
            f"the first line has {counted(len(names), 'column name')}, but the next has"
            f" {counted(n_columns, 'number')}"
        )
    return _cloud_of_table(lines.parse(np.float64).reshape(-1, n_columns), names)


def _names_in(lines: Lines) -> list[str] | None:
    """Return the column names in the first line, in lower case, or None if it has no names."""
    if not len(lines):
        return None
    words = lines.content(0).decode("latin-1").strip().lower().split()
    names = [word.strip("\"'/") for word in words]
    if not names or not re.fullmatch(r"[a-z_].*", names[0]) or names[0] in ("nan", "inf"):
        return None
    return [OTHER_NAMES.get(name, name) for name in names]


def read_npy_cloud(data: Content) -> CloudFile:
    """Return the points of a ``.npy`` file with 3 to 12 columns."""
    array = npy_array(data)
    if array.dtype.kind not in "fiu":
        raise MeshError(f"expected an array of numbers, got {array.dtype}")
    if array.ndim != 2 or not 3 <= array.shape[1] <= _MAX_COLUMNS:
        raise MeshError(
            f"expected shape (N, n) with n from 3 to {_MAX_COLUMNS}, got {array.shape}: if this is"
            " a height grid, convert it to a mesh first (see Terrain in the documentation)"
        )
    return _cloud_of_table(as_doubles(array), None)


def _cloud_of_table(table: Floats, names: list[str] | None) -> CloudFile:
    """Convert a table to a cloud. Without `names`, columns are x, y, z, then colors or normals."""
    n_columns = table.shape[1]
    if n_columns < 3:
        raise MeshError(f"expected 3 or more numbers per point, got {n_columns}")
    if names is None:
        names = ["x", "y", "z", *_meaning_of(table[:, 3:6])]
        names += [f"column_{place}" for place in range(len(names) + 1, n_columns + 1)]
    if not {"x", "y", "z"} <= set(names):
        raise MeshError(f"the first line must name columns x, y and z, got {', '.join(names)}")
    columns = {name: table[:, place] for place, name in enumerate(names)}
    others = {
        name: _narrowed(values)
        for name, values in columns.items()
        if name not in "xyz" and is_word(name)
    }
    return cloud_of(columns | others, others)


def _narrowed(column: Floats) -> Array:
    """Convert whole numbers to uint8 if they fit, so that they can be colors, or else to int32.

    A column with fractions, or with numbers that do not fit in int32, is returned unchanged.
    """
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
    return _NORMALS if np.all(np.abs(lengths - 1) < 2 * _UNIT) else ()


def cloud_of(
    columns: Mapping[str, Array], stored: Mapping[str, Array], *, left_out: Sequence[str] = (),
    las: LasFrame | None = None, viewpoint: Floats | None = None,
) -> CloudFile:  # fmt: skip
    """Return the cloud of columns, (N,) each, with names as in PLY, and attributes of its points.

    Readers of clouds use it. Positions are x, y and z, normals nx, ny and nz, and colors red, green
    and blue. `stored` are the attributes, (N,) or (N, n); integers of 64 bits become int32, or
    float64 if they do not fit. `left_out` and `las` are the same as in `MeshAttributes`, and
    `viewpoint` is a viewpoint of `PointCloud`.
    """
    kept = {name: narrowed(values) for name, values in stored.items()}
    attributes = MeshAttributes(vertex=kept, left_out=tuple(left_out), las=las)

    def rows(names: Sequence[str], dtype: npt.DTypeLike) -> Array:
        return as_rows([columns[name] for name in names], dtype)

    points = rows("xyz", np.float64)
    normals = rows(_NORMALS, np.float64) if {*_NORMALS} <= columns.keys() else None
    if normals is not None and not normals.any():  # normals of Gaussian splats are often zero
        normals = None
    colors = None
    if {*COLORS} <= columns.keys():
        kinds = {columns[name].dtype.kind + str(columns[name].dtype.itemsize) for name in COLORS}
        if len(kinds) == 1 and kinds <= {"u1", "u2", "f4", "f8"}:
            colors = rows(COLORS, columns["red"].dtype)
    elif {*_SPLAT_COLORS} <= columns.keys():
        shades = 0.5 + _SPLAT_COLOR * rows(_SPLAT_COLORS, np.float64)
        colors = np.clip(shades, 0.0, 1.0) if np.isfinite(shades).all() else None
    axes = splat_axes(columns) if normals is None else None
    return PointCloud(points, normals, colors, axes, viewpoint), attributes


def splat_axes(columns: Mapping[str, Array]) -> Floats | None:
    """Return the shortest axis of each Gaussian splat, or zero if no axis is clearly the shortest.

    The vector is also zero if rotation or scales are not valid. The result is None if the columns
    of rotations (w, x, y, z) or scales are missing. For splats with only two scales, the axis is
    the rotated z axis.
    """
    names = [name for name in SCALES if name in columns]
    if len(names) < 2 or not {*ROTATIONS} <= columns.keys():
        return None
    scales = np.stack([np.asarray(columns[name], np.float64) for name in names], axis=1)
    turns = np.stack([np.asarray(columns[name], np.float64) for name in ROTATIONS], axis=1)
    shortest = np.full(len(scales), 2)
    is_known: Bools = np.asarray(np.isfinite(turns).all(axis=1))
    if len(names) == 3:
        ordered = np.sort(scales, axis=1)
        shortest = scales.argmin(axis=1)
        is_known &= np.isfinite(scales).all(axis=1)
        is_known[is_known] = ordered[is_known, 1] - ordered[is_known, 0] >= _FLAT
    lengths = np.sqrt(np.einsum("ij,ij->i", turns, turns))
    is_known &= (lengths > 0) & np.isfinite(lengths)
    axes = np.zeros((len(scales), 3))
    axes[is_known] = _columns_of_rotations(turns[is_known], shortest[is_known])
    return axes


def _columns_of_rotations(rotations: Floats, columns: npt.NDArray[np.integer[Any]]) -> Floats:
    """Return column `columns[i]` of the rotation matrix of each quaternion i.

    Quaternions (w, x, y, z) may have any norm except 0.
    """
    w, axis = rotations[:, :1], rotations[:, 1:]
    unit = np.eye(3)[columns]
    crossed = np.cross(axis, unit)
    squared = np.einsum("ij,ij->i", rotations, rotations)[:, None]
    return np.asarray(unit + 2.0 * (w * crossed + np.cross(axis, crossed)) / squared)
