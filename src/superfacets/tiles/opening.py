"""Open inputs larger than memory (files, folders or arrays) as tables that are read in pieces."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .._types import Array
from ..adapters.convert import as_cells, as_mesh
from ..cells.kinds import kind_of
from ..cells.point_graph import estimate_normals
from ..errors import MeshError
from ..io.readers.obj import read_file_blocks
from ..io.readers.pieces import (
    Pieces,
    SourceFile,
    as_doubles,
    files_of,
    joined_pieces,
    pieces_of_file,
)
from ..io.readers.read import cell_ending, read_cells
from ..io.tables import ArrayRows, ConvertedRows, Rows
from ..mesh.faces import corners_of
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from ..workers.scratch import RowFile, Scratch

Pair: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]
TiledSource: TypeAlias = (
    str | os.PathLike[str] | Mesh | PolygonMesh | PointCloud | Pair | npt.NDArray[Any]
)
"""Input of `segment_tiled`: a file, a folder or tileset whose files form one mesh or cloud, a mesh
or cloud object, or arrays, which may be memory maps."""

BLOCK = 1 << 24
"""Approximate number of bytes that are read or written at a time."""


def open_pieces(source: TiledSource, scratch: Scratch, *, for_workers: bool) -> Pieces:
    """Return a mesh or cloud in a form that can be read piece by piece.

    Binary PLY files of triangles or points, and ``.npy`` files of points, are read in place. OBJ
    files are converted block by block to tables in the scratch folder. Files of other formats are
    loaded completely. Files of a folder are joined in the order of their names, and files of a
    tileset in the order of the tileset. If `for_workers` is true, arrays are written to the scratch
    folder, from which other processes can read them.

    Raises
    ------
    MeshError
        If a file is damaged or has neither faces nor points, or if the files of a folder cannot be
        joined, for example meshes and clouds.
    OSError
        If a file or a folder cannot be read.
    TypeError
        If the source is not a `TiledSource`.
    """
    if isinstance(source, (str, os.PathLike)):
        return joined_pieces([_opened(file, scratch) for file in files_of(Path(source))])
    if isinstance(source, (tuple, list)) and len(source) == 2 and np.ndim(source[1]) == 2:
        pieces = _pieces_of_pair(*source)
    elif isinstance(source, np.ndarray):
        points = _checked_points(source, "points", "N")
        if not len(points):
            raise MeshError("the cloud has no points")
        pieces = Pieces(ConvertedRows(ArrayRows(points), as_doubles))
    else:
        pieces = _pieces_of_cells(as_cells(source))
    return _on_disk(pieces, scratch) if for_workers else pieces


def _opened(file: SourceFile, scratch: Scratch) -> Pieces:
    path = file.path.absolute()
    try:
        ending = cell_ending(path)
        if ending == ".obj":
            return _unpacked_obj(path, scratch)
        pieces = pieces_of_file(path)
        if pieces is not None:
            return pieces
    except MeshError as error:
        message = str(error)
        raise MeshError(message if str(path) in message else f"{path}: {message}") from None
    cells = read_cells(path, file.placement)
    return _on_disk(_pieces_of_cells(cells, f"{path}: "), scratch)


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
        raise MeshError(f"{where}only faces or points can be processed in tiles, not {kind.plural}")
    vertices, corners = ArrayRows(cells.vertices), corners_of(cells)
    if corners.offsets is None:
        return Pieces(vertices, ArrayRows(corners.vertices.reshape(-1, 3)))
    return Pieces(vertices, ArrayRows(corners.vertices), ArrayRows(corners.offsets))


def _checked_points(array: Array, name: str, count: str) -> Array:
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "fiu":
        raise MeshError(
            f"{name} must be numbers of shape ({count}, 3),"
            f" got {array.dtype} of shape {array.shape}"
        )
    return array


def _pieces_of_pair(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> Pieces:
    """Return a pair of arrays as `Pieces`.

    Triangles are not copied, because memory maps may be larger than memory. Polygons are copied.
    """
    points = _checked_points(np.asanyarray(vertices), "vertices", "V")
    corners = np.asanyarray(faces)
    if corners.shape[1] < 3 or corners.dtype.kind not in "iu":
        raise MeshError(
            "faces must be integers of shape (F, n), n >= 3,"
            f" got {corners.dtype} of shape {corners.shape}"
        )
    if not len(corners):
        raise MeshError("the mesh has no faces")
    if corners.shape[1] == 3:
        return Pieces(ArrayRows(points), ArrayRows(corners))
    return _pieces_of_cells(as_mesh((points, corners)))


def _on_disk(pieces: Pieces, scratch: Scratch) -> Pieces:
    """Write arrays in memory to files, and return pieces that are read from these files."""

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


def _unpacked_obj(path: Path, scratch: Scratch) -> Pieces:
    """Convert an OBJ file block by block to tables of vertices and faces in the scratch folder."""
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
