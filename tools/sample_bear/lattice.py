"""Which points of a grid are inside the bear, such that the border of the inside is manifold."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from .bear import FloatArray, ellipsoids

IndexArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Lattice:
    """Which points of a regular grid are inside; the outermost two layers are outside."""

    inside: npt.NDArray[np.bool_]  # (Z, Y, X), contiguous
    origin: FloatArray  # (3,), x, y, z of the first point
    spacing: float

    @property
    def strides(self) -> tuple[int, int, int]:
        """Steps in the flat array along x, y and z."""
        _, n_y, n_x = self.inside.shape
        return 1, n_x, n_x * n_y

    def positions(self, flat: IndexArray) -> FloatArray:
        """Positions, (N, 3), of grid points given by their flat index."""
        z, y, x = np.unravel_index(flat, self.inside.shape)
        return self.origin + self.spacing * np.stack([x, y, z], axis=1)


def fill_lattice(spacing: float) -> Lattice:
    """Mark the grid points inside any solid."""
    solids = ellipsoids()
    origin = (solids.centers - solids.reach).min(axis=0) - 2 * spacing
    extent = (solids.centers + solids.reach).max(axis=0) - origin
    n_x, n_y, n_z = np.ceil(extent / spacing).astype(int) + 3
    # Difference along x of the number of solids around a point; the sum along x gives the number.
    steps = np.zeros((n_z, n_y, n_x), dtype=np.int8)
    for solid in range(len(solids.centers)):
        z, y, first, last = _rows_inside(solid, origin, spacing)
        steps[z, y, first] += 1
        steps[z, y, last] -= 1
    depth = np.cumsum(steps, axis=2, dtype=np.int8, out=steps)
    return Lattice(depth > 0, origin, spacing)


def _rows_inside(
    solid: int, origin: FloatArray, spacing: float
) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Rows of the grid that run through a solid, and the points in it: z, y, first x, last x + 1.

    Along a row a x^2 + 2 b x + c <= 0 inside, x counted from the solid's center.
    """
    solids = ellipsoids()
    center, frame, reach = solids.centers[solid], solids.frames[solid], solids.reach[solid]
    low = np.floor((center - reach - origin) / spacing).astype(np.int64)
    high = np.ceil((center + reach - origin) / spacing).astype(np.int64)
    rows_y, rows_z = (np.arange(low[axis], high[axis] + 1) for axis in (1, 2))
    across_y = np.outer(origin[1] + spacing * rows_y - center[1], frame[:, 1])
    across_z = np.outer(origin[2] + spacing * rows_z - center[2], frame[:, 2])
    across = across_z[:, None, :] + across_y[None, :, :]
    a = frame[:, 0] @ frame[:, 0]
    b = across @ frame[:, 0]
    discriminant = b**2 - a * ((across**2).sum(axis=2) - 1.0)
    z, y = np.nonzero(discriminant > 0)
    root = np.sqrt(discriminant[z, y])
    start = center[0] - origin[0]
    first = np.ceil((start - (b[z, y] + root) / a) / spacing).astype(np.int64)
    last = np.floor((start - (b[z, y] - root) / a) / spacing).astype(np.int64) + 1
    kept = first < last
    return rows_z[z[kept]], rows_y[y[kept]], first[kept], last[kept]


def crossed_edges(lattice: Lattice) -> list[IndexArray]:
    """Edges of the grid that cross the surface, for x, y and z: the flat index of the lower end."""
    flat = lattice.inside.ravel()
    return [np.flatnonzero(flat[step:] != flat[:-step]) for step in lattice.strides]


def cells_around(lattice: Lattice, axis: int, edges: IndexArray) -> IndexArray:
    """Cells around each edge, (E, 4), counterclockwise seen from its upper end.

    A cell is named by its lowest corner.
    """
    second = lattice.strides[(axis + 1) % 3]
    third = lattice.strides[(axis + 2) % 3]
    return np.stack([edges - second - third, edges - third, edges, edges - second], axis=1)


def without_pinches(lattice: Lattice) -> Lattice:
    """Lattice with points added until the surface between inside and outside is manifold.

    It is if no cell's face has its two inside corners on one diagonal, and no cell has two
    opposite corners on one side and the other six on the other: the inside is then well-composed
    (Latecki, Eckhardt and Rosenfeld 1995). Points are only added, so this ends.
    """
    repaired = replace(lattice, inside=lattice.inside.copy())
    inside = repaired.inside.reshape(-1)  # a view
    corners = np.array([0, 1])
    for step in lattice.strides[1:]:
        corners = np.concatenate([corners, corners + step])
    while True:
        edges = crossed_edges(repaired)
        around = [cells_around(lattice, axis, edges[axis]).ravel() for axis in range(3)]
        cells = np.unique(np.concatenate(around))
        codes = np.packbits(inside[cells[:, None] + corners], axis=1, bitorder="little")[:, 0]
        wanted = _well_composed_codes()[codes]
        pinched = np.flatnonzero(wanted != codes)
        if len(pinched) == 0:
            return repaired
        added = np.unpackbits(wanted[pinched, None], axis=1, bitorder="little").astype(bool)
        inside[(cells[pinched, None] + corners)[added]] = True


@cache
def _well_composed_codes() -> npt.NDArray[np.uint8]:
    """For the corners inside a cell, as 8 bits: those bits, and the corners that must be added.

    Bit 4 z + 2 y + x stands for corner (x, y, z).
    """
    codes = np.arange(256)
    wanted = codes.copy()
    for axis, side in itertools.product(range(3), (0, 1)):
        corners = [corner for corner in range(8) if (corner >> axis & 1) == side]
        first, second, third, fourth = (1 << corner for corner in corners)
        face = first | second | third | fourth
        for diagonal in (first | fourth, second | third):
            wanted[codes & face == diagonal] |= face
    for corner in range(4):
        opposite = 1 << corner | 1 << (7 - corner)
        wanted[[opposite, 255 - opposite]] = 255
    return wanted.astype(np.uint8)
