"""Open meshes and clouds in files and folders as tables that are read in ranges of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..._types import Array, Longs, Viewpoint
from ..._validate import checked_normals, counted, exact_doubles
from ...errors import MeshError
from ..guards import check_regular
from ..tables import ConvertedRows, JoinedRows, RecordRows, Rows
from .b3dm import Placement
from .clouds import ROTATIONS, SCALES, holds_cloud, splat_axes
from .npy import MAX_NPY_HEADER, npy_header
from .ply_body import check_end, skip_rows
from .ply_header import INDEX_NAMES, Element, Header, read_header
from .read import CELL_ENDINGS, cell_ending
from .tileset import read_tileset, tileset_at

FOLDER_ENDINGS = tuple(ending for ending in CELL_ENDINGS if ending not in (".npy", ".txt", ".csv"))
"""Endings of files that are read from a folder. ``.npy``, ``.txt`` and ``.csv`` are excluded,
because they often contain labels."""

AXES = ("x", "y", "z")
NORMALS = ("nx", "ny", "nz")
AXES_OF_SPLATS = ((*ROTATIONS, *SCALES), (*ROTATIONS, *SCALES[:2]))

_ROWS_AT_ONCE = 1 << 16
"""Number of rows that are read at a time."""


@dataclass(frozen=True)
class Pieces:
    """Tables of a mesh or a cloud, which are read in ranges of rows."""

    points: Rows  # (V, 3) vertices, or (N, 3) points of a cloud
    corners: Rows | None = None  # (F, 3) vertices of triangles; (C,) of polygons; None for clouds
    offsets: Rows | None = None  # (F + 1,) first corner of each polygon, then C; None for triangles
    normals: Rows | None = None  # (N, 3) normals of points, of length 1 or 0
    axes: Rows | None = None  # (N, 3) normals with unknown sign, of length 1 or 0
    viewpoint: Viewpoint | None = None  # sensor position; estimated normals point to it

    @property
    def n_cells(self) -> int:
        """Number of faces or points."""
        return self.starts[-1]

    @property
    def starts(self) -> tuple[int, ...]:
        """Index of the first cell of each file, then the number of cells, (n_files + 1,)."""
        if self.offsets is not None:
            return 0, self.offsets.n_rows - 1
        cells = self.points if self.corners is None else self.corners
        return cells.starts if isinstance(cells, JoinedRows) else (0, cells.n_rows)

    def corners_of(self, begin: int, end: int) -> tuple[Longs, Longs | None]:
        """Return the vertex of each corner of faces `begin` to `end` - 1, flat, and offsets.

        The offsets are the index of the first corner of each face, then the number of corners. They
        are None for triangles.
        """
        assert self.corners is not None
        if self.offsets is None:
            return self.corners.read(begin, end).reshape(-1).astype(np.int64), None
        offsets = self.offsets.read(begin, end + 1)
        corners = self.corners.read(int(offsets[0]), int(offsets[-1]))
        return corners.astype(np.int64), offsets - offsets[0]


class SourceFile(NamedTuple):
    """A mesh or point cloud file. Its name is relative to the folder of the input."""

    path: Path
    name: str
    placement: Placement | None = None  # None if the file is not in a tileset


def holds_files(path: Path) -> bool:
    """Return whether a path is a folder or a tileset, which may have several files."""
    return path.is_dir() or tileset_at(path) is not None


def files_of(path: Path) -> list[SourceFile]:
    """Return the file `path`, the files in a folder, sorted by name, or a tileset's models."""
    tileset = tileset_at(path)
    if tileset is not None:
        found = [SourceFile(*tile) for tile in read_tileset(tileset).tiles]
    elif path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in FOLDER_ENDINGS)
        found = [SourceFile(file, file.name) for file in files]
    else:
        found = [SourceFile(path, path.name)]
    if not found:
        raise FileNotFoundError(f"{path}: has no file that ends in {', '.join(FOLDER_ENDINGS)}")
    for file in found:
        check_regular(file.path)
    return found


def holds_points(path: Path) -> bool:
    """Return whether a file, or the first file of a folder, is a point cloud."""
    first = files_of(path)[0].path
    ending = cell_ending(first)
    return holds_cloud(read_header(first)[1] if ending == ".ply" else b"", ending)


def pieces_of_file(path: Path) -> Pieces | None:
    """Return the tables in a file, or None if the file must be loaded completely."""
    readers = {".ply": _ply_pieces, ".npy": _npy_pieces}
    return readers.get(cell_ending(path), lambda _: None)(path)


def joined_pieces(pieces: Sequence[Pieces]) -> Pieces:
    """Join the tables of triangle meshes, or of point clouds.

    Raises a MeshError if there are both kinds, if a mesh has polygons other than triangles, or
    if only some clouds have normals.
    """
    if len(pieces) == 1:
        return pieces[0]
    corners = [part.corners for part in pieces if part.corners is not None]
    normals = [part.normals for part in pieces if part.normals is not None]
    if 0 < len(corners) < len(pieces):
        raise MeshError("the folder has both meshes and point clouds: use separate folders")
    if 0 < len(normals) < len(pieces):
        raise MeshError("either all or none of the point clouds in a folder must have normals")
    axes = [part.axes for part in pieces if part.axes is not None]
    if any(part.offsets is not None for part in pieces):
        raise MeshError("all files in a folder must be triangle meshes, but one has other polygons")
    points = JoinedRows(tuple(part.points for part in pieces))
    return Pieces(
        points,
        JoinedRows(tuple(corners), points.starts[:-1]) if corners else None,
        normals=JoinedRows(tuple(normals)) if normals else None,
        axes=JoinedRows(tuple(axes)) if len(axes) == len(pieces) else None,
    )


def as_doubles(rows: Array, _begin: int) -> Array:
    """Convert rows of a table with `exact_doubles`, for `ConvertedRows`."""
    return exact_doubles(rows)


def _are_zero(rows: RecordRows) -> bool:
    """Return whether all numbers are 0. Stop reading at the first block with another number."""
    blocks = range(0, rows.n_rows, _ROWS_AT_ONCE)
    return not any(
        rows.read(begin, min(begin + _ROWS_AT_ONCE, rows.n_rows)).any() for begin in blocks
    )


def _as_normals(rows: Array, begin: int) -> Array:
    """Scale nonzero vectors to length 1, or raise a MeshError if a vector is not finite."""
    return checked_normals(rows, len(rows), begin)


def _as_axes(rows: Array, begin: int) -> Array:
    """Return the shortest axis of each Gaussian splat, from rows of rotations and scales."""
    axes = splat_axes(dict(zip((*ROTATIONS, *SCALES), rows.T, strict=False)))
    assert axes is not None
    return checked_normals(axes, len(axes), begin)


def _ply_pieces(path: Path) -> Pieces | None:
    """Return the tables of a binary PLY file, or None if the file must be loaded completely."""
    header, content = read_header(path)
    is_cloud = holds_cloud(content, ".ply")
    located = _elements_in(path, header, is_cloud=is_cloud)
    if located is None:
        return None
    found, end = located

    def rows(name: str, columns: tuple[str, ...], length: str | None = None) -> RecordRows | None:
        first, element, record = found.get(name, (0, None, np.dtype([])))
        if element is None or not element.n_rows or not set(columns) <= set(record.names or ()):
            return None
        return RecordRows(path, first, element.n_rows, record, columns, length)

    points = rows("vertex", AXES)
    if is_cloud and points is not None:
        names = [stored.name for stored in found["vertex"][1].properties]
        if len(set(names)) < len(names):
            return None
        check_end(path, end)
        normals = rows("vertex", NORMALS)
        if normals is not None and _are_zero(normals):  # as in `read_cloud`, zeros are ignored
            normals = None
        tables = [rows("vertex", names) for names in AXES_OF_SPLATS]
        axes = next((table for table in tables if table is not None), None)
        return Pieces(
            ConvertedRows(points, as_doubles),
            normals=None if normals is None else ConvertedRows(normals, _as_normals),
            axes=None if axes is None or normals is not None else ConvertedRows(axes, _as_axes),
        )
    tables = [rows("face", (name,), f"number of {name}") for name in INDEX_NAMES]
    corners = next((table for table in tables if table is not None), None)
    return Pieces(points, corners) if points and corners and end == path.stat().st_size else None


def _elements_in(
    path: Path, header: Header, *, is_cloud: bool
) -> tuple[dict[str, tuple[int, Element, np.dtype[Any]]], int] | None:
    """Return the offset and row type of each element of a binary PLY file, and the end offset.

    Elements with lists other than corners are left out. In a mesh, all elements after them are left
    out, too. The result is None if the file must be loaded completely, because it is truncated.
    """
    found, begin, n_bytes = {}, header.size, path.stat().st_size
    for element in header.elements if header.byte_order else ():
        record = element.record()
        if record is None and is_cloud:
            begin = skip_rows(element, path, begin)
            continue
        if record is None:
            break
        if element.n_rows * record.itemsize > n_bytes - begin:
            if is_cloud or element.name == "face":
                return None
            raise MeshError(
                f"{path}: the PLY header declares {counted(element.n_rows, 'row')} of element"
                f" {element.name!r} but the file has fewer: it may be truncated"
            )
        found[element.name] = begin, element, record
        begin += element.n_rows * record.itemsize
    return found, begin


def _npy_pieces(path: Path) -> Pieces | None:
    """Return the points of a .npy file, or None if its array is not (N, 3) numbers in C order."""
    with path.open("rb") as file:
        shape, dtype, is_fortran, begin = npy_header(file.read(2 * MAX_NPY_HEADER))
    if len(shape) != 2 or shape[1] != 3 or is_fortran or dtype.kind not in "fiu" or not shape[0]:
        return None
    record = np.dtype([("row", dtype, (3,))])
    if shape[0] * record.itemsize != path.stat().st_size - begin:
        return None
    return Pieces(ConvertedRows(RecordRows(path, begin, shape[0], record, ("row",)), as_doubles))
