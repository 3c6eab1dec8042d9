"""Stage 0: sort the cells of a mesh along a space-filling curve, if their order is bad."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Floats, Ints, Longs
from ..mesh.cells import lowest_vertices
from ..mesh.faces import Corners, spread_indices

MIN_CELLS = 1 << 17
"""Smallest number of cells that are sorted. Fewer cells fit into the cache in any order."""

MOST_FAR = 1 / 3
"""Largest fraction of far steps, between cells or vertices, in a good order. For a million faces,
relative to the run time with sorted faces, the run time is 1.7 with shuffled faces, 1.4 with
shuffled pairs of faces and 1.3 with shuffled vertices; sorting takes 0.15. Files from scanners and
subdivision have less than 0.3."""

N_STEPS = 512
"""Number of sampled steps; the standard error of the fraction is below 0.023."""


class SortedCorners(NamedTuple):
    """Vertices and corners of cells, both sorted along a space-filling curve."""

    vertices: Floats  # welded
    corners: Ints  # flat
    offsets: Longs  # first corner of each cell; empty if all cells have equally many corners
    order: Ints  # (N,) index of each cell in the input


def is_scattered(vertices: Floats, corners: Corners) -> bool:
    """Return whether consecutive cells or vertices are far apart; False for small meshes."""
    n_cells = corners.n_cells
    if n_cells < MIN_CELLS:
        return False
    far = far_steps(lambda cells: _means(vertices, *corners.of(cells)), n_cells)
    return max(far, far_steps(lambda some: vertices[some], len(vertices))) > MOST_FAR


def sorted_corners(vertices: Floats, corners: Corners, weld: bool, n_threads: int) -> SortedCorners:
    """Sort the cells of a mesh; `weld` its vertices first.

    The corners of a cell keep their order. Expected time O(V + C).
    """
    lowest = lowest_vertices(vertices, weld, n_threads)
    return SortedCorners(*_core.sort_mesh(vertices, lowest, *corners.lists, n_threads))


def far_steps(positions_of: Callable[[Longs], Floats], n: int) -> float:
    """Estimate the fraction of far steps between consecutive elements, 0 to 1, from a sample.

    A step is far if it is longer than a quarter of the median distance of two random elements.
    """
    firsts = spread_indices(N_STEPS, n - 1)
    here = positions_of(firsts)
    steps = _squared_lengths(positions_of(firsts + 1) - here)
    anywhere = _squared_lengths(here[::-1] - here)
    median = np.sort(anywhere)[N_STEPS // 2]  # np.median imports numpy.ma
    return float(np.mean(steps > median / 4**2))


def _means(vertices: Floats, corners: Ints, offsets: Longs) -> Floats:
    sums = np.add.reduceat(vertices[corners], offsets[:-1], axis=0)
    return np.asarray(sums / np.diff(offsets)[:, np.newaxis])


def _squared_lengths(vectors: Floats) -> Floats:
    x, y, z = vectors.T
    return np.asarray(x * x + y * y + z * z)
