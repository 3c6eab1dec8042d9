"""OBJ: the `v` and `f` lines, whatever objects, groups and materials they belong to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from .guards import Arrays, check_triangles
from .text import LAST_BLANK, Lines, iterate_lines, table, token_start_mask

__all__ = ["read_obj"]

Index = npt.NDArray[np.int64]

SLASH = ord("/")


def read_obj(data: bytes) -> Arrays:
    """Vertices, one per `v` line, and faces, one per `f` line, of an OBJ file.

    Texture and normal indices do not split vertices. Lines and points are skipped. The format
    declares no counts: a file that was cut between two lines cannot be told from a whole one.

    lagrange is not used: it misrounds decimals (0.348799 becomes 0.34879899999999997), reads
    ``nan`` as 0, drops a cut last face, and refuses comments behind, and lines continued in, faces.
    """
    if b"\\" in data:
        data = re.sub(rb"\\[ \t]*\r?\n", b" ", data)  # lines that go on in the next one
    blocks = list(_read_blocks(data))
    vertices = np.concatenate([block.vertices for block in blocks])
    lengths = np.concatenate([block.lengths for block in blocks])
    if not len(vertices) and not len(lengths):
        raise MeshError("not an OBJ file: it has no `v` and no `f` lines")
    check_triangles(lengths)
    corners = np.concatenate([block.corners for block in blocks]).reshape(-1, 3)
    numbers = np.concatenate([block.numbers for block in blocks])
    n_before = np.concatenate([block.n_vertices_before for block in blocks])
    return vertices, _resolve(corners, numbers, n_before, len(vertices))


@dataclass(frozen=True, eq=False)
class _Block:
    """What some lines of the file hold.

    Parameters
    ----------
    vertices : (V, 3) float64
        Of the `v` lines.
    corners : (C,) int64
        Vertex indices of the `f` lines, as they are written.
    lengths, numbers, n_vertices_before : (F,) int64
        Of each `f` line: number of corners, number in the file, and number of `v` lines before it.
    """

    vertices: npt.NDArray[np.float64]
    corners: Index
    lengths: Index
    numbers: Index
    n_vertices_before: Index


def _read_blocks(data: bytes) -> Iterator[_Block]:
    n_vertices = 0
    for lines in iterate_lines(data, comment=b"#"):
        is_vertex = lines.having_keyword(b"v")
        is_face = lines.having_keyword(b"f")
        vertices = _read_vertices(lines.after_keyword(is_vertex, b"v"))
        faces = lines.after_keyword(is_face, b"f")
        n_before = np.cumsum(is_vertex, dtype=np.int64)[is_face] + n_vertices
        yield _Block(vertices, _corner_indices(faces), faces.counts, faces.numbers, n_before)
        n_vertices += len(vertices)


def _read_vertices(lines: Lines) -> npt.NDArray[np.float64]:
    """Coordinates; a weight or a color may follow them."""
    short = np.flatnonzero(lines.counts < 3)
    if len(short):
        number, n_tokens = int(lines.numbers[short[0]]), int(lines.counts[short[0]])
        raise MeshError(f"line {number}: a vertex needs 3 coordinates, got {n_tokens}")
    vertices: npt.NDArray[np.float64] = table(lines.parse(np.float64), lines.counts, 3)
    return vertices


def _corner_indices(lines: Lines) -> Index:
    """The vertex index of each corner, flat: the 7 in ``7``, ``7/2``, ``7//3`` and ``7/2/3``."""
    is_slash = lines.text == SLASH
    if not is_slash.any():
        return lines.parse(np.int64)
    headless = np.flatnonzero(is_slash[1:] & (lines.text[:-1] <= LAST_BLANK))
    if len(headless):
        number = lines.numbers[np.searchsorted(lines.ends, headless[0])]
        raise MeshError(f"line {number}: a corner has no vertex index")
    text = np.where(is_slash, np.uint8(LAST_BLANK), lines.text)
    starts = np.flatnonzero(token_start_mask(text))
    counts = np.diff(np.searchsorted(starts, lines.ends), prepend=0)
    values = replace(lines, text=text, counts=counts).parse(np.int64)
    indices: Index = values[~is_slash[starts - 1]]
    return indices


def _resolve(corners: Index, numbers: Index, n_before: Index, n_vertices: int) -> Index:
    """Faces that count from 0; the file counts from 1, or from -1 back over the vertices so far."""
    faces = np.where(corners < 0, corners + n_before[:, np.newaxis], corners - 1)
    wrong = np.argwhere((corners == 0) | (faces < 0) | (faces >= n_vertices))
    if len(wrong):
        face, corner = wrong[0]
        raise MeshError(
            f"line {numbers[face]}: faces[{face}] refers to vertex {corners[face, corner]}"
            f" but the vertices are 1 to {n_vertices}"
        )
    return faces
