"""PLY of a mesh with labels and colors per face."""

from __future__ import annotations

from dataclasses import dataclass
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...mesh.triangle_mesh import Mesh

__all__ = ["write_ply"]

ROWS_AT_ONCE = 1 << 14
"""Rows made at a time: they stay in the cache."""

TYPE_NAMES = {"f4": "float", "f8": "double", "i4": "int", "u1": "uchar"}


def write_ply(
    file: IO[bytes],
    mesh: Mesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
    *,
    ascii: bool,
) -> None:
    """Write checked arrays; see `superfacets.write_mesh` for what the file holds."""
    vertices, faces = _vertex_columns(mesh), _face_columns(mesh, labels, colors)
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0"]
    lines += [f"element vertex {mesh.n_vertices}", *_declare(vertices)]
    lines += [f"element face {mesh.n_faces}", *_declare(faces)]
    file.write("\n".join([*lines, "end_header\n"]).encode("ascii"))
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
    shape: tuple[int, ...] = ()


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
    columns = [_Column("length", "u1", 3), _Column("vertex_indices", "<i4", mesh.faces, (3,))]
    if labels is not None:
        columns += [_Column("label", "<i4", labels), _Column("quality", "<f4", labels)]
    if colors is not None:
        columns += [
            _Column(channel, "u1", values)
            for channel, values in zip(("red", "green", "blue"), colors.T, strict=True)
        ]
        columns.append(_Column("alpha", "u1", 255))
    return columns


def _fill_rows(columns: list[_Column], begin: int, end: int) -> npt.NDArray[Any]:
    """Some rows as the binary file has them."""
    rows = np.empty(
        end - begin, dtype=[(column.name, column.dtype, column.shape) for column in columns]
    )
    for column in columns:
        is_array = isinstance(column.values, np.ndarray)
        rows[column.name] = column.values[begin:end] if is_array else column.values
    return rows


def _declare(columns: list[_Column]) -> list[str]:
    """Header lines of the properties; the length of the list belongs to the list."""
    lines = []
    for column in columns:
        if column.name == "vertex_indices":
            lines.append("property list uchar int vertex_indices")
        elif column.name != "length":
            lines.append(f"property {TYPE_NAMES[column.dtype[-2:]]} {column.name}")
    return lines


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
