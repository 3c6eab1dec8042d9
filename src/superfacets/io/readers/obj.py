"""Read OBJ files: the `v` and `f` lines of all objects, groups and materials."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..._types import Array, Floats, Ints
from ...errors import MeshError
from ..guards import Arrays, Content, checked_faces
from .text import iterate_lines

KEYWORDS = (b"v", b"f")
VERTEX, FACE = range(2)

_CONTINUED = re.compile(rb"^([^#\n]*)\\[ \t]*\r?\n", re.MULTILINE)
"""Matches a line that continues on the next line and has no comment."""

_LINE = re.compile(r"line (\d+)")
"""Matches the line number at the beginning of an error message."""


def read_obj(data: Content) -> Arrays:
    """Return vertices, one per `v` line, and faces, one per `f` line, of an OBJ file.

    Texture and normal indices do not split vertices. Lines and points are skipped. Truncation of a
    file between two lines is not detected, because OBJ does not declare counts.
    """
    data = without_continuations(data)
    blocks = list(read_blocks(data))
    vertices = np.concatenate([block.vertices for block in blocks])
    lengths = np.concatenate([block.lengths for block in blocks])
    if not len(vertices) and not len(lengths):
        raise MeshError("not an OBJ file: it has no `v` and no `f` lines")
    corners = np.concatenate([block.corners for block in blocks])
    faces = checked_faces(lengths, corners)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        _raise_index_error(data, lengths, corners, len(vertices))
    return vertices, faces


def without_continuations(data: Content) -> Content:
    """Join each line that ends in a backslash, and has no comment, with the next line."""
    return _CONTINUED.sub(rb"\1 ", data) if data.find(b"\\") >= 0 else data


@dataclass(frozen=True, eq=False)
class _Block:
    vertices: Floats  # (V, 3) positions in the `v` lines
    corners: Array  # (C,) vertex index of each corner, counted from 0; may be out of range
    lengths: Ints  # (F,) number of corners of each `f` line


def read_blocks(data: Content, n_vertices: int = 0) -> Iterator[_Block]:
    """Parse a text block by block; `n_vertices` vertices precede the text in the file."""
    for lines in iterate_lines(data, comment=b"#"):
        keywords = lines.keywords(KEYWORDS)
        is_vertex, is_face = keywords == VERTEX, keywords == FACE
        vertices = lines.after_keyword(is_vertex, b"v").parse_vertices()
        faces = lines.after_keyword(is_face, b"f")
        corners = faces.parse_corners()
        if corners.min(initial=1) < 0:
            n_before = n_vertices + np.cumsum(is_vertex, dtype=np.int64)[is_face]
            last = np.repeat(n_before, faces.counts)  # number of vertices that precede each corner
            corners = np.where(corners < 0, np.maximum(corners + last + 1, 0), corners)
        corners -= 1
        yield _Block(vertices, corners, faces.counts)
        n_vertices += len(vertices)


def read_file_blocks(path: Path, size: int) -> Iterator[_Block]:
    """Parse a file block by block, with about `size` bytes of text in memory."""
    n_vertices, n_lines = 0, 0
    for text in _text_blocks(path, size):
        try:
            blocks = list(read_blocks(without_continuations(text), n_vertices))
        except MeshError as error:
            number = _LINE.match(str(error))
            rest = str(error) if number is None else str(error)[number.end() :]
            message = rest if number is None else f"line {int(number[1]) + n_lines}{rest}"
            raise MeshError(message) from None
        yield from blocks
        n_vertices += sum(len(block.vertices) for block in blocks)
        n_lines += text.count(b"\n")


def _text_blocks(path: Path, size: int) -> Iterator[bytes]:
    """Yield a file in blocks of complete lines; a line and its continuation are in one block."""
    rest = b""
    with path.open("rb") as file:
        while block := file.read(size):
            text = rest + block
            end = _end_of_lines(text)
            rest = text[end:]
            if end:
                yield text[:end]
    if rest:
        yield rest


def _end_of_lines(text: bytes) -> int:
    """Return the offset after the last line that does not continue on the next line, or 0."""
    end = text.rfind(b"\n") + 1
    while end:
        begin = text.rfind(b"\n", 0, end - 1) + 1
        if not text[begin:end].rstrip().endswith(b"\\"):
            break
        end = begin
    return end


def _raise_index_error(data: Content, lengths: Array, corners: Array, n_vertices: int) -> NoReturn:
    """Raise a MeshError that reports the first line with an index out of range."""
    place = int(np.argmax((corners < 0) | (corners >= n_vertices)))
    ends = np.cumsum(lengths, dtype=np.int64)
    face = int(np.searchsorted(ends, place, side="right"))
    corner = place - int(ends[face] - lengths[face])
    row = face
    for lines in iterate_lines(data, comment=b"#"):
        found = lines[lines.keywords(KEYWORDS) == FACE]
        if row < len(found):
            break
        row -= len(found)
    written = found.after_keyword(np.arange(len(found)) == row, b"f").parse_corners()[corner]
    raise MeshError(
        f"line {found.number(row)}: the face refers to vertex {written},"
        f" but the vertices have the numbers 1 to {n_vertices}"
    )
