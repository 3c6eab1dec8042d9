"""OBJ with a group for each region."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...mesh.faces import FaceMesh, corners_in_a_row, face_sizes
from ...mesh.polygon_mesh import PolygonMesh
from ..attributes import MeshAttributes
from .text import coordinate_format, text_rows, write_rows

__all__ = ["face_lines", "write_obj"]


def write_obj(
    file: IO[bytes],
    mesh: FaceMesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
    *,
    ascii: bool,
    attributes: MeshAttributes | None = None,
) -> None:
    """Write checked arrays: the faces of each region in a group, in their order.

    Colors and attributes are left out: the format has no place for those of faces.
    """
    row = " ".join(["v", *[coordinate_format(mesh.vertices)] * 3]) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    if labels is None:
        file.write(b"".join(face_lines(mesh, np.arange(mesh.n_faces), "f ", first=1)))
        return
    order = np.argsort(labels, kind="stable")
    lines = face_lines(mesh, order, "f ", first=1)
    starts = np.flatnonzero(np.diff(labels[order], prepend=-2)).tolist()
    for begin, end in zip(starts, [*starts[1:], len(order)], strict=True):
        region = int(labels[order[begin]])
        file.write(b"g region_%d\n" % region if region >= 0 else b"g unlabeled\n")
        file.write(b"".join(lines[begin:end]))


def face_lines(
    mesh: FaceMesh,
    faces: npt.NDArray[np.intp],
    begin: str,
    *,
    first: int = 0,
    ends: tuple[npt.NDArray[Any], ...] = (),
) -> list[bytes]:
    """Lines of text of some faces: the corners, counted from `first`, between `begin` and `ends`.

    A ``#`` in `begin` stands for the number of corners.
    """
    lines = np.empty(len(faces), dtype=object)
    sizes = face_sizes(mesh)[faces]
    corners = corners_in_a_row(mesh)
    starts = mesh.offsets[faces] if isinstance(mesh, PolygonMesh) else 3 * faces
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        columns = [corners[starts[alike] + place] + first for place in range(size)]
        columns += [values[faces[alike]] for values in ends]
        row = begin.replace("#", str(size)) + " ".join(["%d"] * len(columns)) + "\n"
        lines[alike] = text_rows(row, columns).splitlines(keepends=True)
    return lines.tolist()
