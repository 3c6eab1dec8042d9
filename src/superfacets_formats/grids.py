"""Helpers for readers of volume meshes: `Cursor` reads blocks of numbers, `Grid` stores cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Bools, Content, Floats, Lines, Longs, as_integers, counted, shown

TETS = {10: 4, 24: 10}
"""Number of nodes for each VTK type of tetrahedra. The first four nodes are the corners."""

_FLAT = (*range(10), 21, 22, 23, 28, 30, 34, 35, 36)
"""VTK types of cells without volume."""

_SIZES = {1: 1, 3: 2, 5: 3, 9: 4}
"""Number of corners for VTK types of flat cells; a different number indicates a damaged file."""

_NAMES = {
    1: "vertex", 3: "line", 5: "triangle", 7: "polygon", 9: "quad", 10: "tetra", 11: "voxel",
    12: "hexahedron", 24: "tetra10",
    13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 32: "wedge18",
    42: "polyhedron",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Grid:
    """Vertices and cells, in the order of the file."""

    vertices: Floats  # (V, 3) positions of the vertices
    kinds: Array  # (C,) VTK type of each cell
    sizes: Array  # (C,) number of corners of each cell
    corners: Array  # (S,) vertex of each corner, one cell after the other
    values: Array | None  # (C,) cell data with the requested name, or None

    def tets(self) -> Array:
        """Return the corners of tetrahedra, (N, 4).

        Raises a MeshError if there are other volume cells, or if there are no tetrahedra.
        """
        kinds = np.unique(self.kinds).tolist()
        others = [kind for kind in kinds if kind not in (*TETS, *_FLAT)]
        if others:
            raise MeshError(f"all volume cells must be tetrahedra, but there are {_named(others)}")
        chosen = self.is_tet()
        if not chosen.any():
            raise MeshError(
                f"the file has no tetrahedra{', only ' if kinds else ''}{_named(kinds)}"
            )
        for kind, n_corners in (*_SIZES.items(), *TETS.items()):
            wrong = np.flatnonzero((self.kinds == kind) & (self.sizes != n_corners))
            if len(wrong):
                n_found = counted(int(self.sizes[wrong[0]]), "corner")
                raise MeshError(f"cells[{wrong[0]}] has the type {_named([kind])} but {n_found}")
        if chosen.all() and (self.sizes == 4).all():
            return self.corners.reshape(-1, 4)
        starts = np.cumsum(self.sizes, dtype=np.int64) - self.sizes
        return np.asarray(self.corners[starts[chosen][:, np.newaxis] + np.arange(4)])

    def is_tet(self) -> Bools:
        """Return whether each cell is a tetrahedron, (C,)."""
        return np.isin(self.kinds, list(TETS))


def _named(kinds: list[int]) -> str:
    return ", ".join(sorted(_NAMES.get(kind, f"VTK type {kind}") for kind in kinds[:10]))


def as_count(token: bytes | str, what: str) -> int:
    """Parse an integer >= 0 of at most 18 digits; other tokens raise a MeshError."""
    if not token.isdigit() or len(token) > 18 or not token.isascii():
        raise MeshError(f"{what} must be integers >= 0, got {shown(token)}")
    return int(token)


def sizes_between(offsets: Array, what: str) -> Longs:
    """Return the sizes of lists, given the offset of the end of each list."""
    offsets = offsets.astype(np.int64, copy=False)
    sizes = np.diff(offsets, prepend=0)
    if (offsets < 0).any() or (sizes < 0).any():
        raise MeshError(f"the offsets of {what} must be non-negative and ascending")
    return sizes


class Cursor:
    """Position in a file from which header lines and blocks of numbers are read."""

    def __init__(self, data: Content) -> None:
        self.data = data  # content of the file
        self.place = 0  # offset of the next byte to read
        self.byte_order: Literal["", "<", ">"] = ""  # byte order of numbers; empty for text

    @cached_property
    def _lines(self) -> tuple[Lines, Longs]:
        """Lines of a text file, and the number of tokens up to the end of each line."""
        lines = Lines.of(self.data)
        return lines, np.cumsum(lines.counts, dtype=np.int64)

    def any_line(self) -> bytes:
        """Return the next line, which may be blank, without surrounding whitespace."""
        newline = self.data.find(b"\n", self.place)
        end = newline if newline >= 0 else len(self.data)
        line, self.place = self.data[self.place : end], min(end + 1, len(self.data))
        return line.strip()

    def line(self) -> bytes:
        """Return the next line that is not blank, or empty bytes at the end of the file."""
        while self.place < len(self.data):
            if line := self.any_line():
                return line
        return b""

    def counts(self, n: int, what: str) -> list[int]:
        """Return the counts on the next non-blank line, which must have at least `n` counts."""
        tokens = self.line().split()
        if len(tokens) < n:
            raise MeshError(f"{what}: expected {n} or more numbers, got {len(tokens)}")
        return [as_count(token, what) for token in tokens]

    def numbers(self, n: int, dtype: str, what: str, unit: str = "number") -> Array:
        """Return the next `n` numbers, or raise a MeshError if the file has fewer than `n` left.

        Memory is allocated only after this check. In text files, floats are parsed as float64 and
        rounded to `dtype`, and integers are returned with the parsed type.
        """
        stored = np.dtype(dtype)
        if not self.byte_order:
            return self._parsed(n, stored, what)
        n_left = (len(self.data) - self.place) // stored.itemsize
        if n > n_left:
            raise _too_few(n, n_left, what, unit)
        found = np.frombuffer(self.data, stored.newbyteorder(self.byte_order), n, self.place)
        self.place += n * stored.itemsize
        return found.astype(stored)

    def rows(self, n: int, what: str) -> Lines:
        """Return the next `n` lines, or raise a MeshError if the file has fewer lines."""
        lines, _ = self._lines
        first = int(np.searchsorted(lines.starts, self.place))
        if n > len(lines) - first:
            raise MeshError(
                f"the file declares {counted(n, 'line')} of {what}, but has only"
                f" {len(lines) - first}: it may be truncated"
            )
        found = lines[first : first + n]
        if n:
            self.place = int(found.ends[-1])
        return found

    def _parsed(self, n: int, stored: np.dtype[Any], what: str) -> Array:
        lines, totals = self._lines
        first = int(np.searchsorted(lines.starts, self.place))
        before = int(totals[first - 1]) if first else 0
        last = int(np.searchsorted(totals, before + n))
        if n and last == len(lines):
            raise _too_few(n, int(totals[-1]) - before, what)
        if n and totals[last] != before + n:
            raise MeshError(f"line {lines.number(last)}: there are too many numbers for {what}")
        part = self.rows(last + 1 - first if n else 0, what)
        if stored.kind != "f":
            return as_integers(part.parse_integers_or_floats(), what)
        with np.errstate(over="ignore", invalid="ignore"):
            return part.parse(np.float64).astype(stored)


def _too_few(n: int, n_left: int, what: str, unit: str = "number") -> MeshError:
    return MeshError(
        f"the file declares {counted(n, unit)} of {what}, but has at most {n_left}: it may be"
        " truncated"
    )
