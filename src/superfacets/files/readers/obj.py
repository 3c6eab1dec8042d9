"""Read OBJ files: the `v` and `f` lines of all objects, groups and materials."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Floats, Ints
from ..attributes import MeshAttributes
from ..guards import Arrays, Content, checked_faces
from .text import Lines

KEYWORDS = (b"v", b"f")
VERTEX, FACE = range(2)

_CONTINUED = re.compile(rb"^([^#\n]*)\\[ \t]*\r?\n", re.MULTILINE)
"""Matches a line that continues on the next line and has no comment."""


def read_obj(data: Content) -> Arrays:
    """Return vertices, one per `v` line, and faces, one per `f` line, of an OBJ file.

    Texture and normal indices do not split vertices. Lines and points are skipped. Truncation of a
    file between two lines is not detected, because OBJ does not declare counts.
    """
    data = without_continuations(data)
    parts = zip(*_read_blocks(data), strict=True)
    vertices, corners, lengths = (np.concatenate(blocks) for blocks in parts)
    if not len(vertices) and not len(lengths):
        raise MeshError("not an OBJ file: it has no `v` and no `f` lines")
    faces = checked_faces(lengths, corners)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        _raise_index_error(data, lengths, corners, len(vertices))
    return vertices, faces


def read_obj_with_attributes(data: Content, folder: Path | None) -> tuple[Arrays, MeshAttributes]:
    """Return vertices, faces and texture of an OBJ file; MTL files must be in `folder`."""
    data = without_continuations(data)
    vertices, faces = read_obj(data)
    read_texture = load("superfacets_textures.obj_texture:read_texture")
    return (vertices, faces), read_texture(data, folder)


def without_continuations(data: Content) -> Content:
    """Join each line that ends in a backslash, and has no comment, with the next line."""
    return _CONTINUED.sub(rb"\1 ", data) if data.find(b"\\") >= 0 else data


def _read_blocks(data: Content) -> Iterator[tuple[Floats, Array, Ints]]:
    """Yield vertices, flat corners and corner counts of each block of lines.

    Corners are vertex indices, counted from 0. They may be out of range.
    """
    n_vertices = 0
    for lines in Lines.blocks(data, comment=b"#"):
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
        yield vertices, corners, faces.counts
        n_vertices += len(vertices)


def _raise_index_error(data: Content, lengths: Array, corners: Array, n_vertices: int) -> NoReturn:
    """Raise a MeshError that reports the first line with an index out of range."""
    place = int(np.argmax((corners < 0) | (corners >= n_vertices)))
    ends = np.cumsum(lengths, dtype=np.int64)
    face = int(np.searchsorted(ends, place, side="right"))
    corner = place - int(ends[face] - lengths[face])
    row = face
    for lines in Lines.blocks(data, comment=b"#"):
        found = lines[lines.keywords(KEYWORDS) == FACE]
        if row < len(found):
            break
        row -= len(found)
    written = found.after_keyword(np.arange(len(found)) == row, b"f").parse_corners()[corner]
    raise MeshError(
        f"line {found.number(row)}: the face refers to vertex {written},"
        f" but the vertices have the numbers 1 to {n_vertices}"
    )
