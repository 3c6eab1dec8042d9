"""Read ASCII and binary STL files; vertices at the same position are not merged."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from ...base.arrays import as_doubles, contiguous_rows
from ...base.checks import MAX_CELLS, counted
from ...base.errors import MeshError
from ...base.types import Array, Floats
from ..guards import Content
from ..input import Input, Read
from .parts import Parts, parts_of
from .text import Lines

HEADER_SIZE = 80

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

KEYWORDS = (b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"solid", b"endsolid")
FACET, OUTER, VERTEX, ENDLOOP, ENDFACET, SOLID, ENDSOLID = range(7)

_SPACED = re.compile(rb"^([ \t]*end)[ \t]+(solid|facet|loop)\b", re.I | re.M)
"""Matches keywords that some programs write as two words."""

TRIANGLE_LINES = np.array([FACET, OUTER, VERTEX, VERTEX, VERTEX, ENDLOOP, ENDFACET], dtype=np.int8)


def read_stl(source: Input) -> Read:
    """Read an STL file: three vertices per face, and names of solids in a text file."""
    data, parts = source.data, Parts([], {})
    if is_binary_stl(data):
        triangles = _triangles_in(data)
        corners: Array = contiguous_rows(triangles["corners"].reshape(-1, 9))
        if source.keep and triangles["attribute"].any():
            parts = Parts([("attribute", triangles["attribute"])], {})
    else:
        try:
            corners = _read_ascii(data, source)
        except MeshError:
            if not _SPACED.search(data):
                raise
            data = _SPACED.sub(rb"\1\2", data)
            corners = _read_ascii(data, source)
        if source.keep:
            parts = parts_of(data, (b"facet", b"solid"), "solid", any_case=True)
    source.declare("normals of triangles", "cells")
    vertices = as_doubles(corners).reshape(-1, 3)
    index_type = np.int32 if len(vertices) <= MAX_CELLS else np.int64
    faces = np.arange(len(vertices), dtype=index_type).reshape(-1, 3)
    return source.mesh(vertices, faces, face=parts.columns, names=parts.names)


def _declared(data: Content) -> tuple[int, int]:
    """Return the number of faces that a binary header declares, and the implied file size."""
    n_faces = int.from_bytes(data[HEADER_SIZE : HEADER_SIZE + 4], "little")
    return n_faces, HEADER_SIZE + 4 + n_faces * TRIANGLE.itemsize


def has_binary_size(data: Content) -> bool:
    """Return whether the file size is exactly the size that a binary header implies."""
    return len(data) >= HEADER_SIZE + 4 and len(data) == _declared(data)[1]


def is_binary_stl(data: Content) -> bool:
    """Return whether the file is binary. Binary files may also begin with the word solid."""
    return (
        has_binary_size(data)
        or not re.match(rb"\s*solid", data, re.I)
        or b"\0" in data[: HEADER_SIZE + 4]
    )


def _triangles_in(data: Content) -> Array:
    """Return the triangles of a binary file, or raise a MeshError if it has another size."""
    n_faces, size = _declared(data)
    if len(data) < HEADER_SIZE + 4:
        raise MeshError(f"not an STL file: it has {counted(len(data), 'byte')} and no word solid")
    if size > len(data) or data[size:].strip(b"\0 \r\n\t"):
        raise MeshError(
            f"not an STL file, or damaged: the size must be {size} bytes for"
            f" {counted(n_faces, 'declared triangle')}, got {len(data)}"
        )
    return np.frombuffer(data, dtype=TRIANGLE, count=n_faces, offset=HEADER_SIZE + 4)


def _read_ascii(data: Content, source: Input) -> Floats:
    blocks = []
    for lines in Lines.blocks(data):
        found = lines.keywords(KEYWORDS, any_case=True)
        corners = lines.after_keyword(found == VERTEX, KEYWORDS[VERTEX])
        corners.refuse(corners.counts != 3, "a vertex needs 3 coordinates")
        blocks.append((corners.parse(np.float64), found))
    vertices, keywords = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if keywords[-1] not in (ENDFACET, ENDSOLID):
        number = Lines.of(data).number(-1)
        raise MeshError(
            f"line {number}: the file ends, but not after a facet or solid: it may be truncated"
        )
    borders = keywords[(keywords == SOLID) | (keywords == ENDSOLID)]
    expected = np.resize([SOLID, ENDSOLID], len(borders) + len(borders) % 2)
    if keywords[-1] != ENDSOLID or not np.array_equal(borders, expected):
        source.declare("end of a solid", "which is missing: the file may be truncated")
    _check_facets(keywords, data)
    return vertices


def _check_facets(keywords: npt.NDArray[np.int8], data: Content) -> None:
    """Raise a MeshError if the lines of a triangle do not have the keywords `TRIANGLE_LINES`."""
    is_content = (keywords != SOLID) & (keywords != ENDSOLID)
    content = keywords[is_content]
    is_wrong = content != np.tile(TRIANGLE_LINES, len(content) // 7 + 1)[: len(content)]
    if not is_wrong.any():
        if len(content) % 7:
            raise MeshError("the last facet is incomplete: the file may be truncated")
        return
    place = int(np.argmax(is_wrong))
    number = Lines.of(data).number(np.flatnonzero(is_content)[place])
    wanted = TRIANGLE_LINES[place % 7]
    if wanted == ENDLOOP and content[place] == VERTEX:
        raise MeshError(
            f"line {number}: faces[{place // 7}] has more than 3 corners;"
            " only triangles are supported: triangulate the mesh first"
        )
    raise MeshError(f"line {number}: expected the keyword {KEYWORDS[wanted].decode()}")
