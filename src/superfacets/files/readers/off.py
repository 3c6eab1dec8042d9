"""Read OFF files (the word OFF, counts, vertices, faces), skipping comments and blank lines."""

from __future__ import annotations

import re

import numpy as np

from ...base.arrays import contiguous_rows
from ...base.checks import counted
from ...base.errors import MeshError
from ...base.types import Array
from ...mesh.attributes import COLORS
from ..guards import Polygons, faces_of
from ..input import Columns, Input, Read
from .text import Lines, as_integers, runs, shown, table

# ST, C and N declare texture coordinates, colors and normals after x, y and z on vertex lines. Some
# data sets, such as ModelNet, have no space between the word and the counts.
MAGIC = re.compile(rb"(?:ST)?C?N?OFF(?=[\s\d]|$)\s*")

_FIELDS = {b"N": ("nx", "ny", "nz"), b"C": (*COLORS, "alpha"), b"ST": ("s", "t")}
"""Names of numbers after positions, keyed by the letters that declare them."""


def read_off(source: Input) -> Read:
    """Read an OFF file; without faces, the vertices are a point cloud."""
    lines = Lines.of(source.data, comment=b"#")
    n_vertices, n_faces, n_header = _read_header(lines)
    body = lines[n_header:]
    if len(body) != n_vertices + n_faces:
        return source.mesh(*_read_wrapped(body, n_vertices, n_faces))
    points = body[:n_vertices]
    faces, colors = _read_faces(body[n_vertices:], source)
    vertex = _read_fields(points, lines.content(0), source) if source.keep else []
    return source.mesh(points.parse_vertices(), faces, vertex=vertex, face=colors)


def _read_fields(points: Lines, head: bytes, source: Input) -> Columns:
    """Return the properties of vertices that the word of the first line declares."""
    word = head.split(b"OFF")[0]
    fields = [name for letter, names in _FIELDS.items() if letter in word for name in names]
    n_more = points.counts - 3
    if (n_more == len(fields) - 1).all() and "alpha" in fields:  # it is optional
        fields.remove("alpha")
    if not len(points) or (n_more != len(fields)).any():
        if n_more.any():
            source.declare("numbers after the positions of vertices")
        return []
    values = table(points.parse(np.float64), points.counts, 3 + len(fields))[:, 3:]
    are_colors = np.array([name in _FIELDS[b"C"] for name in fields], bool)
    shades = iter(_bytes_of(values[:, are_colors]).T)
    columns = zip(fields, values.T, are_colors, strict=True)
    return [(name, next(shades) if is_color else column) for name, column, is_color in columns]


def _bytes_of(colors: Array) -> Array:
    """Return colors as bytes; floats in a file are in the range 0 to 1."""
    are_shares = colors.dtype.kind == "f" and colors.max(initial=0) <= 1
    shades = np.nan_to_num(colors * (255 if are_shares else 1))
    return np.asarray(np.rint(np.clip(shades, 0, 255)), np.uint8)


def _read_wrapped(body: Lines, n_vertices: int, n_faces: int) -> tuple[Array, Array | Polygons]:
    """Return vertices and faces of a file whose rows span several lines or share a line."""
    numbers = body.parse_integers_or_floats()
    vertices, rest = numbers[: 3 * n_vertices].astype(np.float64), numbers[3 * n_vertices :]
    n_corners = np.nan_to_num(np.clip(rest, 0, len(rest))).astype(np.int64)
    places: list[int] = []
    place = 0
    while len(places) < n_faces and place < len(rest):
        places.append(place)
        place += 1 + int(n_corners[place])
    if len(vertices) < 3 * n_vertices or len(places) < n_faces or place != len(rest):
        raise MeshError(
            f"the header declares {counted(n_vertices, 'vertex')} and {counted(n_faces, 'face')},"
            f" but {counted(len(numbers), 'number')} in {counted(len(body), 'line')} follow:"
            " the file may be truncated"
        )
    starts = np.array(places, np.int64)
    sizes = _corner_counts(rest[starts])
    corners = as_integers(rest[runs(starts + 1, sizes)], "vertex indices")
    return vertices.reshape(-1, 3), faces_of(sizes, corners)


def _corner_counts(numbers: Array) -> Array:
    counts = as_integers(numbers, "corner counts").astype(np.int64)
    if counts.min(initial=3) < 3:
        face = int(np.argmax(counts < 3))
        raise MeshError(f"faces[{face}] must have at least 3 corners, got {counts[face]}")
    return counts


def _read_header(lines: Lines) -> tuple[int, int, int]:
    first = lines.content(0).rstrip() if len(lines) else b""
    magic = MAGIC.match(first)
    if magic is None:
        raise MeshError("not an OFF file: it does not begin with the word OFF")
    counts = first[magic.end() :]
    n_header = 1
    if counts.upper().startswith(b"BINARY"):
        raise MeshError("binary OFF files are not supported: save the mesh as ASCII OFF or PLY")
    if not counts and len(lines) > 1:
        counts = lines.content(1)
        n_header = 2
    tokens = counts.split()
    if not 2 <= len(tokens) <= 3 or not all(token.isdigit() for token in tokens):
        got = shown(counts.strip())
        raise MeshError(f"expected the counts of vertices, faces and edges, got {got}")
    # The length is limited, because `int` raises a ValueError for more than 4,300 digits.
    n_vertices, n_faces = (int(token[:30]) for token in tokens[:2])
    return n_vertices, n_faces, n_header


def _read_faces(lines: Lines, source: Input) -> tuple[Array | Polygons, Columns]:
    """Return the faces, and their colors."""
    values = lines.parse_integers_or_floats()  # colors may be floats
    firsts = np.cumsum(lines.counts, dtype=np.int64) - lines.counts
    n_corners = _corner_counts(values[firsts])
    n_more = lines.counts - 1 - n_corners
    if n_more.min(initial=0) < 0:
        line = int(np.argmax(n_more < 0))
        n = int(n_corners[line])
        raise MeshError(
            f"line {lines.number(line)}: a face with {counted(n, 'corner')} must have"
            f" {counted(n, 'index')}, got {lines.counts[line] - 1}"
        )
    if len(n_corners) and n_corners.min() == n_corners.max():
        corners = contiguous_rows(table(values, lines.counts, 1 + int(n_corners[0]))[:, 1:])
    else:
        corners = values[runs(firsts + 1, n_corners)]
    colors: Columns = []
    if source.keep and n_more.any():
        if n_more.min() == n_more.max() and n_more[0] in (3, 4):
            shades = values[runs(firsts + 1 + n_corners, n_more)].reshape(-1, int(n_more[0]))
            colors = [*zip(_FIELDS[b"C"], _bytes_of(shades).T, strict=False)]
        else:
            source.declare("numbers after the corners of faces")
    return faces_of(n_corners, as_integers(corners, "vertex indices").ravel()), colors
