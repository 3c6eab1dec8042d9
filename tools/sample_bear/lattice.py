"""Find the grid points inside the bear, such that the surface around these points is manifold."""

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
    """A regular grid, with a mark for each point inside the bear.

    The points of the two outermost layers on each side are not inside.
    """

    inside: npt.NDArray[np.bool_]  # whether each point is inside, shape (Z, Y, X), contiguous
    origin: FloatArray  # position x, y, z of the first point, shape (3,)
    spacing: float

    @property
    def strides(self) -> tuple[int, int, int]:
        """Change of the flat index for a step along x, y and z."""
        _, n_y, n_x = self.inside.shape
        return 1, n_x, n_x * n_y

    def positions(self, flat: IndexArray) -> FloatArray:
        """Return the positions of grid points with the flat indices `flat`, (N, 3)."""
        z, y, x = np.unravel_index(flat, self.inside.shape)
        return self.origin + self.spacing * np.stack([x, y, z], axis=1)


def fill_lattice(spacing: float) -> Lattice:
    """Return a grid in which the points inside any solid are marked."""
    solids = ellipsoids()
    origin = (solids.centers - solids.reach).min(axis=0) - 2 * spacing
    extent = (solids.centers + solids.reach).max(axis=0) - origin
    n_x, n_y, n_z = np.ceil(extent / spacing).astype(int) + 3
    # Change, from one point to the next along x, of the number of solids that contain the point.
    # The prefix sum along x is the number of solids.
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
    """Return the grid rows along x that cross a solid, and the range of inside points in each row.

    The four arrays are z, y, first x, and last x + 1, as grid indices.
    """
    # A point of a row is inside if a x^2 + 2 b x + c <= 0, where x is relative to the center.
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
    """Return the edges of the grid that cross the surface, in one array for each of x, y and z.

    An edge is identified by the flat index of its lower end.
    """
    flat = lattice.inside.ravel()
    return [np.flatnonzero(flat[step:] != flat[:-step]) for step in lattice.strides]


def cells_around(lattice: Lattice, axis: int, edges: IndexArray) -> IndexArray:
    """Return the cells around each edge, (E, 4), counterclockwise as seen from its upper end.

    A cell is identified by the flat index of its lowest corner.
    """
    second = lattice.strides[(axis + 1) % 3]
    third = lattice.strides[(axis + 2) % 3]
    return np.stack([edges - second - third, edges - third, edges, edges - second], axis=1)


def without_pinches(lattice: Lattice) -> Lattice:
    """Return the lattice with more points inside, so that the surface around them is manifold.

    The surface is manifold if the inside is well-composed (Latecki, Eckhardt and Rosenfeld 1995):
    no face of a cell has exactly two inside corners, on a diagonal; and no cell has two opposite
    corners on one side of the surface and six corners on the other side. The loop ends, because
    points are only added.
    """
    repaired = replace(lattice, inside=lattice.inside.copy())
    inside = repaired.inside.reshape(-1)  # a view, so that changes apply to the lattice
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
    """Return, for each code of a cell, the code after adding points that make it well-composed.

    Bit 4 z + 2 y + x of a code is set if the corner (x, y, z) of the cell is inside.
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
