"""PLY of a mesh with labels and colors per face."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ..mesh import Mesh

__all__ = ["write_ply"]

ROWS_AT_ONCE = 1 << 16
"""Rows turned into text at a time."""

TYPE_NAMES = {"f4": "float", "f8": "double", "i4": "int", "u1": "uchar"}


def write_ply(
    file: IO[bytes],
    mesh: Mesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
    *,
    ascii: bool,
) -> None:
    """Write checked arrays; see `superfacets.io.write_mesh` for what the file holds."""
    vertices, faces = _vertex_rows(mesh), _face_rows(mesh, labels, colors)
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0"]
    lines += [f"element vertex {len(vertices)}", *_declare(vertices.dtype)]
    lines += [f"element face {len(faces)}", *_declare(faces.dtype)]
    file.write("\n".join([*lines, "end_header\n"]).encode("ascii"))
    for rows in (vertices, faces):
        if ascii:
            _write_text(file, rows)
        else:
            file.write(rows.tobytes())


def _vertex_rows(mesh: Mesh) -> npt.NDArray[Any]:
    with np.errstate(over="ignore"):  # what becomes infinite is not equal
        single = mesh.vertices.astype("<f4")
    kind = "<f4" if np.array_equal(single, mesh.vertices) else "<f8"
    rows = np.empty(mesh.n_vertices, dtype=[(axis, kind) for axis in "xyz"])
    for axis, values in zip("xyz", mesh.vertices.T, strict=True):
        rows[axis] = values
    return rows


def _face_rows(
    mesh: Mesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
) -> npt.NDArray[Any]:
    fields: list[Any] = [("length", "u1"), ("vertex_indices", "<i4", 3)]
    if labels is not None:
        fields += [("label", "<i4"), ("quality", "<f4")]
    if colors is not None:
        fields += [(channel, "u1") for channel in ("red", "green", "blue", "alpha")]
    rows = np.empty(mesh.n_faces, dtype=fields)
    rows["length"] = 3
    rows["vertex_indices"] = mesh.faces
    if labels is not None:
        rows["label"] = labels
        rows["quality"] = labels
    if colors is not None:
        for channel, values in zip(("red", "green", "blue"), colors.T, strict=True):
            rows[channel] = values
        rows["alpha"] = 255
    return rows


def _declare(dtype: np.dtype[Any]) -> list[str]:
    """Header lines of the properties; the length of the list belongs to the list."""
    lines = []
    for name in dtype.names or ():
        if name == "vertex_indices":
            lines.append("property list uchar int vertex_indices")
        elif name != "length":
            lines.append(f"property {TYPE_NAMES[dtype[name].str[1:]]} {name}")
    return lines


def _write_text(file: IO[bytes], rows: npt.NDArray[Any]) -> None:
    """Rows as text that reads back as the same numbers; one format operation for many rows."""
    columns = [rows[name].reshape(len(rows), -1) for name in rows.dtype.names or ()]
    row_format = " ".join(_format(column.dtype) for column in columns for _ in column.T) + "\n"
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        lists = [
            axis.tolist() for column in columns for axis in column[begin : begin + ROWS_AT_ONCE].T
        ]
        n_rows = len(lists[0])
        flat: list[Any] = [None] * (n_rows * len(lists))
        for place, values in enumerate(lists):
            flat[place :: len(lists)] = values
        file.write((row_format * n_rows % tuple(flat)).encode("ascii"))


def _format(dtype: np.dtype[Any]) -> str:
    return {"f4": "%.9g", "f8": "%.17g"}.get(dtype.str[1:], "%d")
