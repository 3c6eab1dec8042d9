"""PLY of a mesh with labels and colors per face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...mesh.triangle_mesh import Mesh
from ..attributes import PLY_TYPES, MeshAttributes
from ..readers.ply_header import INDEX_NAMES

__all__ = ["names_replaced", "write_ply"]

ROWS_AT_ONCE = 1 << 14
"""Rows made at a time: they stay in the cache."""


OWN_NAMES = {
    "vertex": ("x", "y", "z"),
    "face": (*INDEX_NAMES, "label", "quality", "red", "green", "blue", "alpha"),
}
"""Names that attributes cannot have in a file with labels: the mesh's and the labels' own."""


def names_replaced(attributes: MeshAttributes) -> list[str]:
    """MeshAttributes, in words, that `write_ply` leaves out where there are labels."""
    return [
        f"{owner} property {name}"
        for owner, values in (("vertex", attributes.vertex), ("face", attributes.face))
        for name in values
        if name in OWN_NAMES[owner]
    ]


def write_ply(
    file: IO[bytes],
    mesh: Mesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
    *,
    ascii: bool,
    attributes: MeshAttributes | None = None,
) -> None:
    """Write checked arrays; see `superfacets.write_mesh` for what the file holds."""
    vertices, faces = _vertex_columns(mesh), _face_columns(mesh, labels, colors)
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0"]
    if attributes is not None:
        lines += attributes.comments
        vertices += _further_columns(attributes.vertex, vertices)
        faces += _further_columns(attributes.face, faces)
    lines += [f"element vertex {mesh.n_vertices}", *map(_declaration, vertices)]
    lines += [f"element face {mesh.n_faces}", *map(_declaration, faces)]
    file.write("\n".join([*lines, "end_header\n"]).encode("utf-8", "surrogateescape"))
    for columns, n_rows in ((vertices, mesh.n_vertices), (faces, mesh.n_faces)):
        for begin in range(0, n_rows, ROWS_AT_ONCE):
            rows = _fill_rows(columns, begin, min(begin + ROWS_AT_ONCE, n_rows))
            if ascii:
                file.write(_as_text(rows))
            else:
                file.write(rows.data)


@dataclass(frozen=True)
class _Column:
    """Values of a property, or one value for all rows, and how a row holds them."""

    name: str
    dtype: str
    values: Any
    length: int | None = None  # of the list in each row; None: a single number

    @property
    def length_dtype(self) -> str:
        return "u1" if self.length is None or self.length < 256 else "<i4"


def _vertex_columns(mesh: Mesh) -> list[_Column]:
    dtype = "<f4" if _fits_single(mesh.vertices) else "<f8"
    return [
        _Column(axis, dtype, values) for axis, values in zip("xyz", mesh.vertices.T, strict=True)
    ]


def _fits_single(values: npt.NDArray[np.float64]) -> bool:
    """Whether float32 holds all of the values exactly."""
    with np.errstate(over="ignore"):  # what becomes infinite is not equal
        return all(
            np.array_equal(part.astype(np.float32), part)
            for part in np.array_split(values, max(1, len(values) // ROWS_AT_ONCE))
        )


def _face_columns(
    mesh: Mesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
) -> list[_Column]:
    columns = [_Column("vertex_indices", "<i4", mesh.faces, 3)]
    if labels is not None:
        columns += [_Column("label", "<i4", labels), _Column("quality", "<f4", labels)]
    if colors is not None:
        columns += [
            _Column(channel, "u1", values)
            for channel, values in zip(("red", "green", "blue"), colors.T, strict=True)
        ]
        columns.append(_Column("alpha", "u1", 255))
    return columns


def _further_columns(
    attributes: Mapping[str, npt.NDArray[Any]], own: list[_Column]
) -> list[_Column]:
    """Columns of attributes but for those whose names the file's own columns have."""
    taken = {column.name for column in own}
    if "vertex_indices" in taken:
        taken |= {*INDEX_NAMES}
    return [
        _Column(
            name,
            values.dtype.newbyteorder("<").str,
            values,
            None if values.ndim == 1 else values.shape[1],
        )
        for name, values in attributes.items()
        if name not in taken
    ]


def _fill_rows(columns: list[_Column], begin: int, end: int) -> npt.NDArray[Any]:
    """Some rows as the binary file has them."""
    fields: list[Any] = []
    for column in columns:
        if column.length is None:
            fields.append((column.name, column.dtype))
        else:  # no attribute has a name with a space
            fields.append((f"length of {column.name}", column.length_dtype))
            fields.append((column.name, column.dtype, (column.length,)))
    rows = np.empty(end - begin, dtype=fields)
    for column in columns:
        is_array = isinstance(column.values, np.ndarray)
        rows[column.name] = column.values[begin:end] if is_array else column.values
        if column.length is not None:
            rows[f"length of {column.name}"] = column.length
    return rows


def _declaration(column: _Column) -> str:
    """The line of the header that declares a property."""
    kind = PLY_TYPES[column.dtype[-2:]]
    if column.length is not None:
        kind = f"list {PLY_TYPES[column.length_dtype[-2:]]} {kind}"
    return f"property {kind} {column.name}"


def _as_text(rows: npt.NDArray[Any]) -> bytes:
    """Rows as text that reads back as the same numbers; one format operation for all."""
    columns = [rows[name].reshape(len(rows), -1) for name in rows.dtype.names or ()]
    row_format = " ".join(_format(column.dtype) for column in columns for _ in column.T) + "\n"
    lists = [axis.tolist() for column in columns for axis in column.T]
    flat: list[Any] = [None] * (len(rows) * len(lists))
    for place, values in enumerate(lists):
        flat[place :: len(lists)] = values
    return (row_format * len(rows) % tuple(flat)).encode("ascii")


def _format(dtype: np.dtype[Any]) -> str:
    return {"f4": "%.9g", "f8": "%.17g"}.get(dtype.str[1:], "%d")
