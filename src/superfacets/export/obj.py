"""Write OBJ with a group for each region, and OFF with a color for each face."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

import numpy as np
import numpy.typing as npt

from .._types import Array
from ..mesh.faces import FaceMesh, corners_of
from .content import Content
from .text import ROWS_AT_ONCE, coordinate_format, text_rows, write_rows


def write_obj(file: IO[bytes], content: Content) -> None:
    """Write OBJ, with the faces of each region in a group, in their order.

    The format has no place for colors and attributes of faces.
    """
    mesh, labels = content.cells, content.labels
    row = " ".join(["v", *[coordinate_format(mesh.vertices)] * 3]) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    if labels is None:
        for lines in face_lines(mesh, np.arange(mesh.n_faces), "f ", first=1):
            file.write(b"".join(lines))
        return
    order = np.argsort(labels, kind="stable")
    begin, last = 0, -2  # no label is below -1
    for lines in face_lines(mesh, order, "f ", first=1):
        regions = labels[order[begin : begin + len(lines)]]
        for place in np.flatnonzero(np.diff(regions, prepend=last)).tolist():
            lines[place] = _group_line(int(regions[place])) + lines[place]
        file.write(b"".join(lines))
        begin, last = begin + len(lines), regions[-1]


def _group_line(region: int) -> bytes:
    return b"g region_%d\n" % region if region >= 0 else b"g unlabeled\n"


def face_lines(
    mesh: FaceMesh,
    faces: npt.NDArray[np.intp],
    begin: str,
    *,
    first: int = 0,
    ends: tuple[Array, ...] = (),
) -> Iterator[list[bytes]]:
    """Yield lists of at most `ROWS_AT_ONCE` lines, one per face: `begin`, corners, `ends`.

    A ``#`` in `begin` is replaced by the number of corners. The first vertex has the index `first`.
    Each array of `ends` holds a number per face of the mesh.
    """
    for place in range(0, len(faces), ROWS_AT_ONCE):
        yield _lines_of(mesh, faces[place : place + ROWS_AT_ONCE], begin, first, ends)


def _lines_of(
    mesh: FaceMesh, faces: npt.NDArray[np.integer], begin: str, first: int, ends: tuple[Array, ...]
) -> list[bytes]:
    lines = np.empty(len(faces), dtype=object)
    corners, offsets = corners_of(mesh).of(faces)
    sizes = np.diff(offsets)
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        columns = [corners[offsets[alike] + place] + first for place in range(size)]
        columns += [values[faces[alike]] for values in ends]
        row = begin.replace("#", str(size)) + " ".join(["%d"] * len(columns)) + "\n"
        lines[alike] = text_rows(row, columns).splitlines(keepends=True)
    return lines.tolist()


def write_off(file: IO[bytes], content: Content) -> None:
    """Write OFF, with red, green and blue, 0 to 255, after the corners of each face.

    The file begins with OFF, because COFF would announce colors of vertices. The format has no
    place for labels and attributes.
    """
    mesh, colors = content.cells, content.colors
    file.write(b"OFF\n%d %d 0\n" % (mesh.n_vertices, mesh.n_faces))
    row = " ".join([coordinate_format(mesh.vertices)] * 3) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    ends = () if colors is None else tuple(colors.T)
    for lines in face_lines(mesh, np.arange(mesh.n_faces), "# ", ends=ends):
        file.write(b"".join(lines))
