"""Read MESH files of Medit. Each section has a keyword, a count, and rows of numbers."""

from __future__ import annotations

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Content, Lines, as_integers, counted, shown

from .grids import Grid, as_count

_KINDS = {
    b"Edges": (3, 2), b"Triangles": (5, 3), b"Quadrilaterals": (9, 4), b"Tetrahedra": (10, 4),
    b"Pyramids": (14, 5), b"Prisms": (13, 6), b"Wedges": (13, 6), b"Hexahedra": (12, 8),
    b"Hexaedra": (12, 8),
}  # fmt: skip
"""VTK cell type and number of corners, keyed by the keyword of the section."""


def read_medit(data: Content, name: str) -> Grid:
    """Read the cells of a file. The only cell data are references, called ``medit:ref``."""
    lines = Lines.of(data, comment=b"#")
    letters = lines.text[lines.starts] | 0x20
    heads = np.flatnonzero((letters >= ord("a")) & (letters <= ord("z")))
    none = np.empty(0, np.int64)
    vertices, parts = None, [(none, none, none, none)]
    words = [lines.content(int(head)).split() for head in heads]
    if not words or heads[0] or words[0][0] != b"MeshVersionFormatted":
        raise MeshError("not a MESH file: it does not begin with MeshVersionFormatted")
    ends = [*heads[1:], len(lines)]  # the keyword End may be missing
    for head, end, tokens in zip(heads, ends, words, strict=True):
        section = lines[head + 1 : end]
        if tokens[0] == b"Dimension":
            given = tokens[1:] or (section.content(0).split() if len(section) else [])
            if given != [b"3"]:
                raise MeshError(f"expected the Dimension 3, got {shown(b' '.join(given))}")
        elif tokens[0] == b"Vertices":
            vertices = _rows_of(tokens, section, 4, np.float64)
        elif tokens[0] in _KINDS:
            kind, n_corners = _KINDS[tokens[0]]
            rows = as_integers(_rows_of(tokens, section, n_corners + 1, np.int64), "corners")
            sizes, corners = np.full(len(rows), n_corners), rows[:, :-1].ravel() - 1
            parts.append((np.full(len(rows), kind), sizes, corners, rows[:, -1]))
    if vertices is None:
        raise MeshError("the file has no section Vertices")
    kinds, sizes, corners, references = map(np.concatenate, zip(*parts, strict=True))
    points = np.ascontiguousarray(vertices[:, :3])
    return Grid(points, kinds, sizes, corners, references if name == "medit:ref" else None)


def _rows_of(
    tokens: list[bytes], section: Lines, width: int, dtype: type[np.float64] | type[np.int64]
) -> Array:
    """Parse the numbers of a section, (n, width); the count n follows the keyword."""
    what = tokens[0].decode("ascii")
    if len(tokens) == 1 and len(section):
        tokens, section = [*tokens, *section.content(0).split()], section[1:]
    n_rows = as_count(tokens[1], f"the number of {what}") if len(tokens) == 2 else -1
    n_found = int(section.counts.sum())
    if n_found != n_rows * width:
        declared = counted(n_rows, "row") if n_rows >= 0 else "one count"
        raise MeshError(
            f"{what} must have {declared} of {counted(width, 'number')}, got"
            f" {counted(n_found, 'number')}: the file may be truncated"
        )
    values = section.parse(dtype) if dtype is np.float64 else section.parse_integers_or_floats()
    return values.reshape(n_rows, width)
