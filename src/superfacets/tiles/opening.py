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

from ..adapters.convert import as_mesh
from ..errors import MeshError
from ..io.readers.obj import read_blocks, without_continuations
from ..io.readers.ply_header import Header, parse_header
from ..io.readers.read import MESH_ENDINGS, mesh_ending, read_mesh
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from .reading import ArrayRows, MeshPieces, RecordRows, Rows, ply_pieces
from .scratch import Scratch, write_all

__all__ = ["TiledSource", "files_of", "open_pieces"]

Pair: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]
TiledSource: TypeAlias = str | os.PathLike[str] | Mesh | PolygonMesh | Pair
"""A file; a folder of files that share vertices by position; or arrays, as memory maps may be."""

BLOCK = 1 << 24
"""Bytes of text that are read at a time."""

HEADER_BLOCK = 1 << 16
MAX_HEADER = 1 << 24
"""Bytes that the header of a PLY file is looked for in."""

_LINE = re.compile(r"^line (\d+)")


def open_pieces(source: TiledSource, scratch: Scratch, *, for_workers: bool) -> MeshPieces:
    """Return the mesh of a source, of which pieces can be read.

    Binary PLY files of triangles are read where they are. OBJ files are written anew to the scratch
    folder, block by block, and files of other kinds whole. Of a folder all meshes are taken, in the
    order of their names, one after the other.

    Parameters
    ----------
    source : path, Mesh, PolygonMesh, or (vertices, faces) pair
    scratch : Scratch
    for_workers : bool
        Whether other processes will read the pieces: arrays are then written to the scratch folder.

    Raises
    ------
    MeshError
        If a file is damaged, or holds no faces.
    OSError
        If a file or a folder cannot be read.
    TypeError
        If the source is something else.
    """
    if isinstance(source, (str, os.PathLike)):
        return _joined([_opened(path.absolute(), scratch) for path in files_of(Path(source))])
    if isinstance(source, (tuple, list)) and len(source) == 2 and np.ndim(source[1]) == 2:
        pieces = _pieces_of_pair(*source)
    else:
        pieces = _pieces_of_mesh(as_mesh(source))
    return _on_disk(pieces, scratch) if for_workers else pieces


def files_of(path: Path) -> list[Path]:
    """The file itself, or the meshes in the folder, by name."""
    if not path.is_dir():
        return [path]
    found = sorted(file for file in path.iterdir() if file.suffix.lower() in MESH_ENDINGS)
    if not found:
        raise FileNotFoundError(f"{path}: no file in it ends in {', '.join(MESH_ENDINGS)}")
    return found


def _opened(path: Path, scratch: Scratch) -> MeshPieces:
    try:
        if not path.exists():
            raise FileNotFoundError(f"{path}: no such file")
        ending = mesh_ending(path)
        if ending == ".ply":
            header = _read_header(path)
            pieces = None if header is None else ply_pieces(path, header)
            if pieces is not None:
                return pieces
        if ending == ".obj":
            return _unpacked_obj(path, scratch)
    except MeshError as error:
        message = str(error)
        raise MeshError(message if str(path) in message else f"{path}: {message}") from None
    mesh = read_mesh(path)
    if not isinstance(mesh, (Mesh, PolygonMesh)):
        raise MeshError(f"{path}: tiles are of faces, and this holds tetrahedra")
    return _on_disk(_pieces_of_mesh(mesh), scratch)


def _read_header(path: Path) -> Header | None:
    """The header of a PLY file; None where it is not found."""
    size = HEADER_BLOCK
    with path.open("rb") as file:
        content = file.read(size)
        while b"end_header" not in content and len(content) == size and size < MAX_HEADER:
            content += file.read(size)
            size *= 2
    return parse_header(content)


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


def _on_disk(pieces: MeshPieces, scratch: Scratch) -> MeshPieces:
    """The same, with arrays in files."""

    def moved(rows: Rows | None) -> Rows | None:
        if not isinstance(rows, ArrayRows):
            return rows
        with RowFile(scratch) as file:
            for first in range(0, rows.n_rows, BLOCK >> 5):
                file.add(rows.read(first, min(first + (BLOCK >> 5), rows.n_rows)))
        return file.rows

    vertices, corners = moved(pieces.vertices), moved(pieces.corners)
    assert vertices is not None
    assert corners is not None
    return MeshPieces(vertices, corners, moved(pieces.offsets))


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


def _joined(pieces: list[MeshPieces]) -> MeshPieces:
    """Meshes one after the other as one; a MeshError where several are not all of triangles."""
    if len(pieces) == 1:
        return pieces[0]
    if any(part.offsets is not None for part in pieces):
        raise MeshError("a folder of several files has to hold triangles alone")
    starts = _sums([part.vertices.n_rows for part in pieces])
    shifts = (0,) * len(pieces)
    return MeshPieces(
        _JoinedRows(tuple(part.vertices for part in pieces), starts, shifts),
        _JoinedRows(
            tuple(part.corners for part in pieces), _sums([part.n_faces for part in pieces]), starts
        ),
    )


def _sums(counts: list[int]) -> tuple[int, ...]:
    return tuple(np.append(0, np.cumsum(counts)).tolist())
