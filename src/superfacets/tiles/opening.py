"""Inputs of any size: files that are read in pieces, folders of files, arrays."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .._types import Array, Longs
from .._validate import checked_normals, exact_doubles
from ..adapters.convert import as_cells, as_mesh
from ..cells.kinds import kind_of
from ..cells.point_graph import estimate_normals
from ..errors import MeshError
from ..io.guards import check_regular
from ..io.readers.clouds import SCALES, TURNS, holds_cloud, splat_axes
from ..io.readers.npy import MAX_NPY_HEADER, npy_header
from ..io.readers.obj import read_file_blocks
from ..io.readers.ply_header import INDEX_NAMES, Element, read_header
from ..io.readers.read import CELL_ENDINGS, cell_ending, read_cells
from ..io.tables import ArrayRows, ConvertedRows, JoinedRows, RecordRows, Rows
from ..mesh.faces import corners_of
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from .scratch import RowFile, Scratch

Pair: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]
TiledSource: TypeAlias = (
    str | os.PathLike[str] | Mesh | PolygonMesh | PointCloud | Pair | npt.NDArray[Any]
)
"""A file; a folder of files that share vertices by position; or arrays, also memory maps."""

FOLDER_ENDINGS = tuple(ending for ending in CELL_ENDINGS if ending not in (".npy", ".txt", ".csv"))
"""Endings of files that are read from a folder; ``.npy``, ``.txt``, ``.csv`` are often labels."""

BLOCK = 1 << 24
"""Bytes of text that are read at a time."""

AXES = ("x", "y", "z")
NORMALS = ("nx", "ny", "nz")
AXES_OF_SPLATS = ((*TURNS, *SCALES), (*TURNS, *SCALES[:2]))


_ROWS_AT_ONCE = 1 << 16
"""Number of rows that are looked at together."""


@dataclass(frozen=True)
class Pieces:
    """A mesh or a cloud that is read piece by piece."""

    points: Rows  # vertices, or the points of a cloud: three coordinates
    corners: Rows | None = None  # (F, 3) vertices of each triangle; with offsets, (C,)
    offsets: Rows | None = None  # (F + 1,) first corner of each polygon, and the end of the last
    normals: Rows | None = None  # (N, 3) of points, of length 1 or 0
    axes: Rows | None = None  # (N, 3) normals of unknown sign, of length 1 or 0

    @property
    def n_cells(self) -> int:
        """Number of faces or points."""
        return self.starts[-1]

    @property
    def starts(self) -> tuple[int, ...]:
        """Offsets of the faces, or points, of each file of the source: (n_files + 1,)."""
        if self.offsets is not None:
            return 0, self.offsets.n_rows - 1
        cells = self.points if self.corners is None else self.corners
        return cells.starts if isinstance(cells, JoinedRows) else (0, cells.n_rows)

    def corners_of(self, begin: int, end: int) -> tuple[Longs, Longs | None]:
        """Corners of faces begin to end - 1, flat; and their offsets, None if all faces have 3."""
        assert self.corners is not None
        if self.offsets is None:
            return self.corners.read(begin, end).reshape(-1).astype(np.int64), None
        offsets = self.offsets.read(begin, end + 1)
        corners = self.corners.read(int(offsets[0]), int(offsets[-1]))
        return corners.astype(np.int64), offsets - offsets[0]


def open_pieces(source: TiledSource, scratch: Scratch, *, for_workers: bool) -> Pieces:
    """Return the mesh or the cloud of a source, of which pieces can be read.

    Binary PLY files of triangles or points and ``.npy`` files of points are read in place. OBJ
    files are converted block by block to tables in the scratch folder; other formats are read whole
    first. Files of a folder are joined in the order of their names. With `for_workers` arrays are
    written to the scratch folder, for other processes to read.

    Raises
    ------
    MeshError
        If a file is damaged, or holds no faces and no points; or if a folder holds both kinds.
    OSError
        If a file or a folder cannot be read.
    TypeError
        If the source is of another type.
    """
    if isinstance(source, (str, os.PathLike)):
        return _joined([_opened(path.absolute(), scratch) for path in files_of(Path(source))])
    if isinstance(source, (tuple, list)) and len(source) == 2 and np.ndim(source[1]) == 2:
        pieces = _pieces_of_pair(*source)
    elif isinstance(source, np.ndarray):
        points = _checked_points(source, "points", "N")
        if not len(points):
            raise MeshError("the cloud has no points")
        pieces = Pieces(ConvertedRows(ArrayRows(points), _as_doubles))
    else:
        pieces = _pieces_of_cells(as_cells(source))
    return _on_disk(pieces, scratch) if for_workers else pieces


def files_of(path: Path) -> list[Path]:
    """The file itself, or the meshes and clouds of the folder, sorted by name."""
    found = [path]
    if path.is_dir():
        found = sorted(file for file in path.iterdir() if file.suffix.lower() in FOLDER_ENDINGS)
    if not found:
        raise FileNotFoundError(f"{path}: no file in it ends in {', '.join(FOLDER_ENDINGS)}")
    for file in found:
        check_regular(file)
    return found


def holds_points(path: Path) -> bool:
    """Whether the file, or the first one in the folder, is a point cloud."""
    first = files_of(path)[0]
    ending = cell_ending(first)
    return holds_cloud(read_header(first)[1] if ending == ".ply" else b"", ending)


def _opened(path: Path, scratch: Scratch) -> Pieces:
    try:
        ending = cell_ending(path)
        if ending == ".obj":
            return _unpacked_obj(path, scratch)
        pieces = {".ply": _ply_pieces, ".npy": _npy_pieces}.get(ending, lambda _: None)(path)
        if pieces is not None:
            return pieces
    except MeshError as error:
        message = str(error)
        raise MeshError(message if str(path) in message else f"{path}: {message}") from None
    return _on_disk(_pieces_of_cells(read_cells(path), f"{path}: "), scratch)


def _as_doubles(rows: Array, _begin: int) -> Array:
    return exact_doubles(rows)


def _are_zero(rows: RecordRows) -> bool:
    """Whether all numbers are 0; reads up to the first that is not."""
    blocks = range(0, rows.n_rows, _ROWS_AT_ONCE)
    return not any(
        rows.read(begin, min(begin + _ROWS_AT_ONCE, rows.n_rows)).any() for begin in blocks
    )


def _as_normals(rows: Array, begin: int) -> Array:
    """Vectors of length 1, or 0; a MeshError names the first that is not finite."""
    return checked_normals(rows, len(rows), begin)


def _as_axes(rows: Array, begin: int) -> Array:
    """The axes of splats, from their rotations and scales."""
    axes = splat_axes(dict(zip((*TURNS, *SCALES), rows.T, strict=False)))
    assert axes is not None
    return checked_normals(axes, len(axes), begin)


def _pieces_of_cells(cells: Any, where: str = "") -> Pieces:
    kind = kind_of(cells)
    if kind.are_points:
        normals, axes = cells.normals, cells.axes
        if normals is None and cells.viewpoints is not None:
            normals, axes = estimate_normals(cells), None
        return Pieces(
            ArrayRows(cells.points),
            normals=None if normals is None else ArrayRows(normals),
            axes=None if axes is None else ArrayRows(axes),
        )
    if not kind.has_faces:
        raise MeshError(f"{where}tiles are of faces or points, and this holds {kind.plural}")
    vertices, corners = ArrayRows(cells.vertices), corners_of(cells)
    if corners.offsets is None:
        return Pieces(vertices, ArrayRows(corners.vertices.reshape(-1, 3)))
    return Pieces(vertices, ArrayRows(corners.vertices), ArrayRows(corners.offsets))


def _checked_points(array: Array, name: str, count: str) -> Array:
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must be numbers of shape ({count}, 3), got {array.shape}")
    return array


def _pieces_of_pair(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> Pieces:
    """The pieces of arrays, without a copy: they may be memory maps of files larger than memory."""
    points = _checked_points(np.asanyarray(vertices), "vertices", "V")
    corners = np.asanyarray(faces)
    if corners.shape[1] < 3 or corners.dtype.kind not in "iu":
        raise MeshError(f"faces must be integers of shape (F, n >= 3), got {corners.shape}")
    if not len(corners):
        raise MeshError("the mesh has no faces")
    if corners.shape[1] == 3:
        return Pieces(ArrayRows(points), ArrayRows(corners))
    return _pieces_of_cells(as_mesh((points, corners)))


def _on_disk(pieces: Pieces, scratch: Scratch) -> Pieces:
    """The same pieces, with arrays written to files."""

    def moved(rows: Rows | None) -> Rows | None:
        if isinstance(rows, ConvertedRows):
            inner = moved(rows.rows)
            assert inner is not None
            return ConvertedRows(inner, rows.convert)
        if not isinstance(rows, ArrayRows):
            return rows
        with RowFile(scratch) as file:
            for first in range(0, rows.n_rows, BLOCK >> 5):
                file.add(rows.read(first, min(first + (BLOCK >> 5), rows.n_rows)))
        return file.rows()

    columns: Any = {field.name: moved(getattr(pieces, field.name)) for field in fields(pieces)}
    return Pieces(**columns)


def _ply_pieces(path: Path) -> Pieces | None:
    """The tables of a binary PLY file, or None if the file must be read whole.

    A MeshError if the file of a mesh ends before its faces.
    """
    header, content = read_header(path)
    is_cloud, n_bytes = holds_cloud(content, ".ply"), path.stat().st_size
    found, begin = dict[str, tuple[int, Element, np.dtype[Any]]](), header.size
    for element in header.elements if header.byte_order else ():
        record = element.record()
        if record is None:
            break
        if element.n_rows * record.itemsize > n_bytes - begin:
            if is_cloud or element.name == "face":  # faces of two corners, or a cut file
                break
            raise MeshError(
                f"{path}: the PLY header declares {element.n_rows} rows of element"
                f" {element.name!r} but the file ends before: is it cut?"
            )
        found[element.name] = begin, element, record
        begin += element.n_rows * record.itemsize

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
        normals = rows("vertex", NORMALS)
        if normals is not None and _are_zero(normals):  # as `read_cloud`
            normals = None
        columns = [rows("vertex", names) for names in AXES_OF_SPLATS]
        axes = next((some for some in columns if some is not None), None)
        return Pieces(
            ConvertedRows(points, _as_doubles),
            normals=None if normals is None else ConvertedRows(normals, _as_normals),
            axes=None if axes is None or normals is not None else ConvertedRows(axes, _as_axes),
        )
    tables = [rows("face", (name,), f"number of {name}") for name in INDEX_NAMES]
    corners = next((table for table in tables if table is not None), None)
    return Pieces(points, corners) if points and corners and begin == n_bytes else None


def _npy_pieces(path: Path) -> Pieces | None:
    """The points of a .npy file of shape (N, 3), or None if the file must be read whole."""
    with path.open("rb") as file:
        shape, dtype, is_fortran, begin = npy_header(file.read(2 * MAX_NPY_HEADER))
    if len(shape) != 2 or shape[1] != 3 or is_fortran or dtype.kind not in "fiu" or not shape[0]:
        return None
    record = np.dtype([("row", dtype, (3,))])
    if shape[0] * record.itemsize != path.stat().st_size - begin:
        return None
    return Pieces(ConvertedRows(RecordRows(path, begin, shape[0], record, ("row",)), _as_doubles))


def _unpacked_obj(path: Path, scratch: Scratch) -> Pieces:
    """The vertices and faces of an OBJ file, as tables in the scratch folder."""
    with RowFile(scratch) as vertices, RowFile(scratch) as corners, RowFile(scratch) as offsets:
        offsets.add(np.zeros(1, np.int64))
        is_of_triangles = True
        for block in read_file_blocks(path, BLOCK):
            vertices.add(block.vertices)
            ends = np.cumsum(block.lengths, dtype=np.int64) + corners.n_rows
            corners.add(block.corners.astype(np.int64))
            offsets.add(ends)
            is_of_triangles = is_of_triangles and bool((block.lengths == 3).all())
    if not corners.n_rows:
        raise MeshError("the mesh has no faces" if vertices.n_rows else "not an OBJ file")
    if is_of_triangles:
        return Pieces(vertices.rows(), corners.rows(3))
    return Pieces(vertices.rows(), corners.rows(), offsets.rows())


def _joined(pieces: Sequence[Pieces]) -> Pieces:
    """Join meshes or clouds into one; a MeshError if they do not fit together."""
    if len(pieces) == 1:
        return pieces[0]
    corners = [part.corners for part in pieces if part.corners is not None]
    normals = [part.normals for part in pieces if part.normals is not None]
    if 0 < len(corners) < len(pieces):
        raise MeshError("the folder holds meshes and point clouds: take one kind at a time")
    if 0 < len(normals) < len(pieces):
        raise MeshError("some point clouds of the folder have normals, and others have none")
    axes = [part.axes for part in pieces if part.axes is not None]
    if any(part.offsets is not None for part in pieces):
        raise MeshError("a folder of several files has to hold triangles alone")
    points = JoinedRows(tuple(part.points for part in pieces))
    return Pieces(
        points,
        JoinedRows(tuple(corners), points.starts[:-1]) if corners else None,
        normals=JoinedRows(tuple(normals)) if normals else None,
        axes=JoinedRows(tuple(axes)) if len(axes) == len(pieces) else None,
    )
