"""Read .tri files: vertex count, one line per vertex, triangle count, one line per triangle."""

from __future__ import annotations

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Input, Lines, Read, counted


def read_tri(source: Input) -> Read:
    """Read a .tri file, in which indices are counted from 0."""
    lines = Lines.of(source.data)
    vertices, rest = _read_block(lines, "vertex", np.float64)
    faces, rest = _read_block(rest, "triangle", np.int64)
    if len(rest):
        raise MeshError(f"line {rest.number(0)}: there are more lines than declared triangles")
    return source.mesh(vertices, faces)


def _read_block(
    lines: Lines, thing: str, dtype: type[np.float64] | type[np.int64]
) -> tuple[Array, Lines]:
    """Read a count n, and n lines of three numbers; return the numbers and the remaining lines."""
    first = lines.content(0).strip() if len(lines) else b""
    if not first.isdigit():
        where = f"line {lines.number(0)}" if len(lines) else "the end of the file"
        raise MeshError(f"expected a {thing} count at {where}: the .tri file may be truncated")
    n_rows = int(first[:30])  # `int` raises a ValueError for more than 4,300 digits
    if len(lines) - 1 < n_rows:
        raise MeshError(
            f"the file declares {counted(n_rows, thing)} but has only"
            f" {counted(len(lines) - 1, 'more line')}: it may be truncated"
        )
    rows = lines[1 : 1 + n_rows]
    rows.refuse(rows.counts != 3, f"a {thing} needs 3 numbers")
    return rows.parse(dtype).reshape(-1, 3), lines[1 + n_rows :]
