"""Read OBJ files: vertices with colors, faces, names of groups, and the texture."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NoReturn

import numpy as np

from ...base.errors import MeshError
from ...base.types import Array, Floats, Ints
from ...mesh.attributes import COLORS
from ..guards import Content, Polygons, faces_of
from ..input import Input, Read
from .parts import Parts, parts_of
from .text import Lines, table

_OTHER_LINES = {"vn": "normals", "l": "lines", "p": "points", "vp": "parameters", "curv": "curves",
                "surf": "surfaces"}  # fmt: skip
"""First words of lines that are not read, and what the lines define."""

KEYWORDS = (b"v", b"f", *(word.encode() for word in _OTHER_LINES), b"g", b"o", b"vt", b"usemtl",
            b"mtllib")  # fmt: skip
VERTEX, FACE = range(2)

_CONTINUED = re.compile(rb"^([^#\n]*)\\[ \t]*\r?\n", re.MULTILINE)
"""Matches a line that continues on the next line and has no comment."""


def read_obj(source: Input) -> Read:
    """Read an OBJ file: a mesh, or a point cloud without faces. Corners do not split vertices."""
    data = source.data
    if data.find(b"\\") >= 0:
        data = _CONTINUED.sub(rb"\1 ", data)
    vertices, colors, faces, words = _read_arrays(data, source)
    if not source.keep:
        return source.mesh(vertices, faces, vertex=colors)
    for word, what in _OTHER_LINES.items():
        if word.encode() in words:
            source.declare(f"{word} ({what})")
    part, texture = Parts([], {}), None
    if words & {b"g", b"o"}:
        part = parts_of(data, (b"f", b"g", b"o"), "group", comment=b"#")
    if words >= {b"g", b"o"}:
        objects = parts_of(data, (b"f", b"o"), "object", comment=b"#")
        part = Parts(part.columns + objects.columns, part.names | objects.names)
    if words & {b"vt", b"usemtl", b"mtllib"}:
        texture = source.texture("obj_texture", data)
    return source.mesh(
        vertices, faces, vertex=colors, face=part.columns, names=part.names, texture=texture
    )


def _read_arrays(
    data: Content, source: Input
) -> tuple[Floats, list[tuple[str, Array]], Array | Polygons | None, set[bytes]]:
    """Return vertices, their colors, faces (None if there are none), and first words of lines."""
    known = KEYWORDS if source.keep else KEYWORDS[:2]
    parts = zip(*_read_blocks(data, known), strict=True)
    rows, sizes, corners, lengths, found = (np.concatenate(blocks) for blocks in parts)
    words = {known[place] for place in np.unique(found).tolist()}
    if not len(sizes) and not len(lengths):
        raise MeshError("not an OBJ file: it has no `v` and no `f` lines")
    vertices = table(rows, sizes, 3)
    colors: list[tuple[str, Array]] = []
    if len(sizes) and sizes.min() >= 6:  # x y z red green blue
        rgb = table(rows, sizes, 6)[:, 3:]
        top = rgb.max(initial=0.0)
        if rgb.min() >= 0 and top <= 255:
            rgb = np.rint(rgb * (255 if top <= 1 else 1)).astype(np.uint8)
            colors = [*zip(COLORS, rgb.T, strict=True)]
    if not colors and sizes.max(initial=3) > 3:
        source.declare("numbers after the positions of vertices")
    if not len(lengths):
        return vertices, colors, None, words
    faces = faces_of(lengths, corners)
    if ((corners < 0) | (corners >= len(vertices))).any():
        _raise_index_error(data, lengths, corners, len(vertices))
    return vertices, colors, faces, words


def _read_blocks(
    data: Content, words: tuple[bytes, ...]
) -> Iterator[tuple[Floats, Ints, Array, Ints, Array]]:
    """Yield per block: values and counts of vertices, corners and counts of faces, first words."""
    n_vertices = 0
    for lines in Lines.blocks(data, comment=b"#"):
        keywords = lines.keywords(words)
        is_vertex, is_face = keywords == VERTEX, keywords == FACE
        vertices = lines.after_keyword(is_vertex, b"v")
        vertices.refuse(vertices.counts < 3, "a vertex needs 3 coordinates")
        faces = lines.after_keyword(is_face, b"f")
        corners = faces.parse_corners()
        if corners.min(initial=1) < 0:
            n_before = n_vertices + np.cumsum(is_vertex, dtype=np.int64)[is_face]
            last = np.repeat(n_before, faces.counts)  # number of vertices that precede each corner
            corners = np.where(corners < 0, np.maximum(corners + last + 1, 0), corners)
        corners -= 1
        found = np.array([i for i in range(len(words)) if (keywords == i).any()], np.intp)
        yield vertices.parse(np.float64), vertices.counts, corners, faces.counts, found
        n_vertices += len(vertices)


def _raise_index_error(data: Content, lengths: Array, corners: Array, n_vertices: int) -> NoReturn:
    """Raise a MeshError that reports the first line with an index out of range."""
    place = int(np.argmax((corners < 0) | (corners >= n_vertices)))
    face = int(np.searchsorted(np.cumsum(lengths, dtype=np.int64), place, side="right"))
    lines = Lines.of(data, comment=b"#")
    faces = lines.after_keyword(lines.keywords(KEYWORDS) == FACE, b"f")
    raise MeshError(
        f"line {faces.number(face)}: the face refers to vertex {faces.parse_corners()[place]},"
        f" but the vertices have the numbers 1 to {n_vertices}"
    )
