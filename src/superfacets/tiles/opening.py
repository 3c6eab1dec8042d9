"""Inputs of any size: files that are read in pieces, folders of files, arrays."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..adapters.convert import as_cells, as_mesh
from ..errors import MeshError
from ..io.readers.clouds import holds_cloud
from ..io.readers.obj import read_blocks, without_continuations
from ..io.readers.ply_header import Header, parse_header
from ..io.readers.read import CELL_ENDINGS, cell_ending, read_cells
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh
from ..mesh.triangle_mesh import Mesh
from .clouds.reading import (
    CloudPieces,
    DoubleRows,
    array_pieces,
    cloud_pieces,
    npy_pieces,
    ply_cloud_pieces,
)
from .reading import ArrayRows, MeshPieces, RecordRows, Rows, ply_pieces
from .scratch import Scratch, write_all

__all__ = ["Pieces", "TiledSource", "files_of", "holds_points", "open_pieces", "starts_of"]

Pair: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]
Pieces: TypeAlias = MeshPieces | CloudPieces
TiledSource: TypeAlias = (
    str | os.PathLike[str] | Mesh | PolygonMesh | PointCloud | Pair | npt.NDArray[Any]
)
"""A file; a folder of files that share vertices by position; or arrays, as memory maps may be."""

FOLDER_ENDINGS = tuple(ending for ending in CELL_ENDINGS if ending not in (".npy", ".txt", ".csv"))
"""Others are as often labels, or anything else."""

BLOCK = 1 << 24
"""Bytes of text that are read at a time."""

HEADER_BLOCK = 1 << 16
MAX_HEADER = 1 << 24
"""Bytes that the header of a PLY file is looked for in."""

_LINE = re.compile(r"^line (\d+)")


def open_pieces(source: TiledSource, scratch: Scratch, *, for_workers: bool) -> Pieces:
    """Return the mesh or the cloud of a source, of which pieces can be read.

    Binary PLY files of triangles or points and ``.npy`` files of points are read where they are.
    OBJ files are written anew to the scratch folder, block by block, and files of other kinds
    whole. Of a folder all meshes, or all clouds, are taken, in the order of their names, one after
    the other.

    Parameters
    ----------
    source : path, Mesh, PolygonMesh, PointCloud, (N, 3) array, or (vertices, faces) pair
    scratch : Scratch
    for_workers : bool
        Whether other processes will read the pieces: arrays are then written to the scratch folder.

    Raises
    ------
    MeshError
        If a file is damaged, or holds no faces and no points; or if a folder holds both kinds.
    OSError
        If a file or a folder cannot be read.
    TypeError
        If the source is something else.
    """
    if isinstance(source, (str, os.PathLike)):
        return _joined([_opened(path.absolute(), scratch) for path in files_of(Path(source))])
    if isinstance(source, (tuple, list)) and len(source) == 2 and np.ndim(source[1]) == 2:
        pieces: Pieces = _pieces_of_pair(*source)
    elif isinstance(source, np.ndarray):
        pieces = array_pieces(source)
    else:
        pieces = _pieces_of_cells(as_cells(source))
    return _on_disk(pieces, scratch) if for_workers else pieces


def files_of(path: Path) -> list[Path]:
    """The file itself, or the meshes and clouds in the folder, by name."""
    if not path.is_dir():
        return [path]
    found = sorted(file for file in path.iterdir() if file.suffix.lower() in FOLDER_ENDINGS)
    if not found:
        raise FileNotFoundError(f"{path}: no file in it ends in {', '.join(FOLDER_ENDINGS)}")
    return found


def starts_of(pieces: Pieces) -> tuple[int, ...]:
    """The first face, or point, of each file of a source, and behind the last."""
    rows = pieces.points if isinstance(pieces, CloudPieces) else pieces.corners
    return rows.starts if isinstance(rows, _JoinedRows) else (0, pieces.n_cells)


def holds_points(path: Path) -> bool:
    """Whether the file, or the first one in the folder, is a point cloud."""
    first = files_of(path)[0]
    ending = cell_ending(first)
    return holds_cloud(_read_header(first)[1] if ending == ".ply" else b"", ending)


def _opened(path: Path, scratch: Scratch) -> Pieces:
    try:
        if not path.exists():
            raise FileNotFoundError(f"{path}: no such file")
        ending = cell_ending(path)
        pieces: Pieces | None = None
        if ending == ".ply":
            pieces = _ply_pieces(path)
        elif ending == ".npy":
            pieces = npy_pieces(path)
        elif ending == ".obj":
            pieces = _unpacked_obj(path, scratch)
        if pieces is not None:
            return pieces
    except MeshError as error:
        message = str(error)
        raise MeshError(message if str(path) in message else f"{path}: {message}") from None
    return _on_disk(_pieces_of_cells(read_cells(path), f"{path}: "), scratch)


def _ply_pieces(path: Path) -> Pieces | None:
    header, content = _read_header(path)
    if holds_cloud(content, ".ply"):
        return ply_cloud_pieces(path, header)
    return ply_pieces(path, header)


def _pieces_of_cells(cells: Any, where: str = "") -> Pieces:
    if isinstance(cells, TetMesh):
        raise MeshError(f"{where}tiles are of faces or points, and this holds tetrahedra")
    return cloud_pieces(cells) if isinstance(cells, PointCloud) else _pieces_of_mesh(cells)


def _read_header(path: Path) -> tuple[Header, bytes]:
    """The header of a PLY file, and the bytes that it was found in."""
    size = HEADER_BLOCK
    with path.open("rb") as file:
        content = file.read(size)
        while b"end_header" not in content and len(content) == size and size < MAX_HEADER:
            content += file.read(size)
            size *= 2
    return parse_header(content), content


def _pieces_of_mesh(mesh: Mesh | PolygonMesh) -> MeshPieces:
    if isinstance(mesh, Mesh):
        return MeshPieces(ArrayRows(mesh.vertices), ArrayRows(mesh.faces))
    offsets, indices = ArrayRows(mesh.offsets), ArrayRows(mesh.indices)
    return MeshPieces(ArrayRows(mesh.vertices), indices, offsets)


def _pieces_of_pair(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> MeshPieces:
    """The arrays as they are: they may be maps of files that are larger than memory."""
    points, corners = np.asanyarray(vertices), np.asanyarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise MeshError(f"vertices must be numbers of shape (V, 3), got {points.shape}")
    if corners.shape[1] < 3 or corners.dtype.kind not in "iu":
        raise MeshError(f"faces must be integers of shape (F, n >= 3), got {corners.shape}")
    if not len(corners):
        raise MeshError("the mesh has no faces")
    if corners.shape[1] == 3:
        return MeshPieces(ArrayRows(points), ArrayRows(corners))
    return _pieces_of_mesh(as_mesh((points, corners)))


def _on_disk(pieces: Pieces, scratch: Scratch) -> Pieces:
    """The same, with arrays in files."""
    if isinstance(pieces, CloudPieces):
        normals = pieces.normals
        return CloudPieces(
            _moved(pieces.points, scratch), None if normals is None else _moved(normals, scratch)
        )
    offsets = pieces.offsets
    return MeshPieces(
        _moved(pieces.vertices, scratch),
        _moved(pieces.corners, scratch),
        None if offsets is None else _moved(offsets, scratch),
    )


def _moved(rows: Rows, scratch: Scratch) -> Rows:
    if isinstance(rows, DoubleRows):
        return DoubleRows(_moved(rows.rows, scratch))
    if not isinstance(rows, ArrayRows):
        return rows
    with RowFile(scratch) as file:
        for first in range(0, rows.n_rows, BLOCK >> 5):
            file.add(rows.read(first, min(first + (BLOCK >> 5), rows.n_rows)))
    return file.rows


class RowFile:
    """A table in the scratch folder that grows; a context that closes it."""

    def __init__(self, scratch: Scratch) -> None:
        self._path = scratch.new_file()
        self._file = self._path.open("wb", buffering=0)
        self._n_rows = 0
        self._dtype: np.dtype[Any] | None = None
        self._shape: tuple[int, ...] = ()

    def __enter__(self) -> RowFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, rows: npt.NDArray[Any]) -> None:
        """Append rows, all of one type and width."""
        if self._dtype is None:
            self._dtype, self._shape = rows.dtype, rows.shape[1:]
        rows = np.ascontiguousarray(rows, self._dtype)
        write_all(self._file, rows.reshape(-1).view(np.uint8))
        self._n_rows += len(rows)

    @property
    def n_rows(self) -> int:
        """Rows so far."""
        return self._n_rows

    @property
    def rows(self) -> RecordRows:
        """What was written."""
        assert self._dtype is not None
        record = np.dtype([("row", self._dtype, self._shape)])
        return RecordRows(self._path, 0, self._n_rows, record, ("row",))


def _unpacked_obj(path: Path, scratch: Scratch) -> MeshPieces:
    """The vertices and faces of an OBJ file, as tables in the scratch folder."""
    with RowFile(scratch) as vertices, RowFile(scratch) as corners, RowFile(scratch) as offsets:
        offsets.add(np.zeros(1, np.int64))
        is_of_triangles, n_lines = True, 0
        for text in _text_blocks(path):
            try:
                blocks = list(read_blocks(without_continuations(text), vertices.n_rows))
            except MeshError as error:
                raise MeshError(_renumbered(str(error), n_lines)) from None
            for block in blocks:
                vertices.add(block.vertices)
                corners.add(block.corners.astype(np.int64))
                ends = np.cumsum(block.lengths, dtype=np.int64) + corners.n_rows
                offsets.add(ends - len(block.corners))
                is_of_triangles = is_of_triangles and bool((block.lengths == 3).all())
            n_lines += text.count(b"\n")
    if not corners.n_rows:
        raise MeshError("the mesh has no faces" if vertices.n_rows else "not an OBJ file")
    if not is_of_triangles:
        return MeshPieces(vertices.rows, corners.rows, offsets.rows)
    record = np.dtype([("row", np.int64, (3,))])
    found = corners.rows
    triangles = RecordRows(found.path, 0, found.n_rows // 3, record, ("row",))
    return MeshPieces(vertices.rows, triangles)


def _renumbered(message: str, n_before: int) -> str:
    """The message, with the number of the line in the whole file."""
    return _LINE.sub(lambda found: f"line {int(found[1]) + n_before}", message)


def _text_blocks(path: Path) -> Iterator[bytes]:
    """The text of a file in blocks of whole lines, none of which is continued in the next."""
    rest = b""
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            text = rest + block
            end = _end_of_lines(text)
            rest = text[end:]
            if end:
                yield text[:end]
    if rest:
        yield rest


def _end_of_lines(text: bytes) -> int:
    """Where the last line ends that is not continued in the next; 0 if there is none."""
    end = text.rfind(b"\n") + 1
    while end:
        begin = text.rfind(b"\n", 0, end - 1) + 1
        if not text[begin:end].rstrip().endswith(b"\\"):
            break
        end = begin
    return end


@dataclass(frozen=True)
class _JoinedRows:
    """Tables one after the other; a number is added to all that a table holds.

    Parameters
    ----------
    parts : tuple of Rows
    starts : tuple of int
        The first row of each, and behind the last.
    shifts : tuple of int
        What is added; nothing to numbers that are no integers.
    """

    parts: tuple[Rows, ...]
    starts: tuple[int, ...]
    shifts: tuple[int, ...]

    @property
    def n_rows(self) -> int:
        """Of all tables."""
        return self.starts[-1]

    def read(self, begin: int, end: int) -> npt.NDArray[Any]:
        """Rows begin to end - 1."""
        found = []
        places = zip(self.parts, self.starts, self.starts[1:], self.shifts, strict=False)
        for part, first, last, shift in places:
            if first < end and begin < last:
                rows = part.read(max(begin, first) - first, min(end, last) - first)
                found.append(rows.astype(np.int64) + shift if shift else rows)
        return np.concatenate(found)


def _joined(pieces: list[Pieces]) -> Pieces:
    """Meshes or clouds one after the other as one; a MeshError where they do not fit together."""
    if len(pieces) == 1:
        return pieces[0]
    clouds = [part for part in pieces if isinstance(part, CloudPieces)]
    meshes = [part for part in pieces if isinstance(part, MeshPieces)]
    if clouds and meshes:
        raise MeshError("the folder holds meshes and point clouds: take one kind at a time")
    return _joined_clouds(clouds) if clouds else _joined_meshes(meshes)


def _joined_clouds(pieces: list[CloudPieces]) -> CloudPieces:
    normals = [part.normals for part in pieces if part.normals is not None]
    if 0 < len(normals) < len(pieces):
        raise MeshError("some point clouds of the folder have normals, and others have none")
    points = _in_a_row([part.points for part in pieces])
    return CloudPieces(points, _in_a_row(normals) if normals else None)


def _in_a_row(tables: list[Rows]) -> _JoinedRows:
    starts = _sums([table.n_rows for table in tables])
    return _JoinedRows(tuple(tables), starts, (0,) * len(tables))


def _joined_meshes(pieces: list[MeshPieces]) -> MeshPieces:
    if any(part.offsets is not None for part in pieces):
        raise MeshError("a folder of several files has to hold triangles alone")
    vertices = _in_a_row([part.vertices for part in pieces])
    starts = _sums([part.n_faces for part in pieces])
    corners = _JoinedRows(tuple(part.corners for part in pieces), starts, vertices.starts)
    return MeshPieces(vertices, corners)


def _sums(counts: list[int]) -> tuple[int, ...]:
    return tuple(np.append(0, np.cumsum(counts)).tolist())
