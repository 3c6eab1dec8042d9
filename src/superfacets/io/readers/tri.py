"""The .tri format: vertex count, a line per vertex, triangle count, a line per triangle."""

from __future__ import annotations

import numpy as np

from ..._types import Array
from ...errors import MeshError
from ..guards import Arrays, Content, counted
from .text import Lines, split_lines

__all__ = ["read_tri"]


def read_tri(data: Content) -> Arrays:
    """Vertices and faces of a .tri file; indices count from 0."""
    lines = split_lines(data)
    vertices, rest = _read_block(lines, "vertex", np.float64)
    faces, rest = _read_block(rest, "triangle", np.int64)
    if len(rest):
        raise MeshError(f"line {rest.number(0)} comes after the last declared triangle")
    return vertices, faces


def _read_block(
    lines: Lines, thing: str, dtype: type[np.float64] | type[np.int64]
) -> tuple[Array, Lines]:
    """The rows of a count and that many lines of three numbers, and the lines that follow."""
    first = lines.content(0).strip() if len(lines) else b""
    if not first.isdigit():
        where = f"line {lines.number(0)}" if len(lines) else "the end of the file"
        raise MeshError(f"expected a {thing} count at {where}: is this a .tri file, and whole?")
    n_rows = int(first[:30])  # longer than any count: int() refuses thousands of digits
    if len(lines) - 1 < n_rows:
        raise MeshError(
            f"the file declares {counted(n_rows, thing)} but only"
            f" {counted(len(lines) - 1, 'line')} follow: is it cut?"
        )
    rows = lines[1 : 1 + n_rows]
    wrong = np.flatnonzero(rows.counts != 3)
    if len(wrong):
        number, n_tokens = rows.number(wrong[0]), int(rows.counts[wrong[0]])
        raise MeshError(f"line {number}: a {thing} needs 3 numbers, got {n_tokens}")
    return rows.parse(dtype).reshape(-1, 3), lines[1 + n_rows :]
