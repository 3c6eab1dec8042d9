"""`Grid`: the cells of several types in a file of volumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._types import Array, Bools, Floats, Longs
from ...errors import MeshError
from ..guards import counted
from .text import runs

__all__ = ["Grid", "sizes_between"]

TETS = {10: 4, 24: 10}
"""VTK's types of tetrahedra, and their numbers of nodes; the first four nodes are corners."""

_FLAT = (*range(10), 21, 22, 23, 28, 30, 34, 35, 36)
"""VTK's types of cells without a volume."""

_SIZES = {1: 1, 3: 2, 5: 3, 9: 4}
"""Numbers of corners of flat cells, to find files that end within the last block of them."""

_NAMES = {
    1: "vertex", 3: "line", 5: "triangle", 7: "polygon", 9: "quad", 10: "tetra", 11: "voxel",
    12: "hexahedron", 24: "tetra10",
    13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 32: "wedge18",
    42: "polyhedron",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Grid:
    """Vertices and cells in the order of a file.

    Parameters
    ----------
    vertices : (V, 3) float64
    kinds : (C,) integers
        What each cell is, as VTK numbers kinds.
    sizes : (C,) integers
        Corners of each cell.
    corners : (S,) integers
        The corners of all cells in a row; S is the sum of `sizes`.
    values : ndarray or None
        The value of each cell that was asked for by name; None if there are none of that name.
    """

    vertices: Floats
    kinds: Array
    sizes: Array
    corners: Array
    values: Array | None

    def tets(self) -> Array:
        """The corners of tetrahedra, (N, 4); a MeshError if there are none, or other volumes."""
        kinds = np.unique(self.kinds).tolist()
        others = [kind for kind in kinds if kind not in (*TETS, *_FLAT)]
        if others:
            raise MeshError(f"the file holds cells that are no tetrahedra: {_named(others)}")
        chosen = self.is_tet()
        if not chosen.any():
            raise MeshError(
                f"the file has no tetrahedra{': it has ' if kinds else ''}{_named(kinds)}"
            )
        for kind, n_corners in (*_SIZES.items(), *TETS.items()):
            wrong = np.flatnonzero((self.kinds == kind) & (self.sizes != n_corners))
            if len(wrong):
                n_found = counted(int(self.sizes[wrong[0]]), "corner")
                raise MeshError(f"cells[{wrong[0]}] is of kind {_named([kind])}, with {n_found}")
        if chosen.all() and (self.sizes == 4).all():
            return self.corners.reshape(-1, 4)
        starts = np.cumsum(self.sizes, dtype=np.int64) - self.sizes
        return self.corners[runs(starts[chosen], np.full(int(chosen.sum()), 4))].reshape(-1, 4)

    def is_tet(self) -> Bools:
        """Which cells are tetrahedra."""
        return np.isin(self.kinds, list(TETS))


def _named(kinds: list[int]) -> str:
    return ", ".join(sorted(_NAMES.get(kind, f"kind {kind} of VTK") for kind in kinds[:10]))


def sizes_between(offsets: Array, what: str) -> Longs:
    """Sizes of lists from their end offsets."""
    offsets = offsets.astype(np.int64, copy=False)
    sizes = np.diff(offsets, prepend=0)
    if (offsets < 0).any() or (sizes < 0).any():
        raise MeshError(f"the offsets of {what} must be whole numbers that do not fall")
    return sizes
