"""Sort cells along a space-filling curve, so that neighbors are close together in memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.types import Floats, Ints, Longs
from ..mesh.faces import Corners, spread_indices
from ..mesh.weld import lowest_vertices

MIN_CELLS = 1 << 17
"""Minimum number of cells for sorting. Smaller meshes fit into the processor cache anyway."""

MAX_FAR = 1 / 3
"""Value of `far_steps` above which cells are sorted. On a mesh of a million faces, the run time is
1.7 times as long with shuffled faces as with sorted faces, 1.4 times with shuffled pairs of faces,
and 1.3 times with shuffled vertices. Sorting takes 15 % of the run time. Meshes from scanners and
from subdivision have values below 0.3, so they are not sorted."""

N_STEPS = 512
"""Number of sampled pairs in `far_steps`. The standard error of its result is then below 0.023."""


class SortedCorners(NamedTuple):
    """Vertices and cells of a mesh, both sorted along a space-filling curve."""

    vertices: Floats  # (V', 3) sorted positions, without duplicates if vertices were welded
    corners: Ints  # (C,) vertex at each corner, as an index in `vertices`, grouped by sorted cell
    offsets: Longs  # (N + 1,) first corner of each sorted cell; empty if `Corners.size` is not None
    order: Ints  # (N,) index in the input of each sorted cell


def is_scattered(vertices: Floats, corners: Corners) -> bool:
    """Return whether consecutive cells, or vertices, of a large mesh are often far apart."""
    n_cells = corners.n_cells
    if n_cells < MIN_CELLS:
        return False

    def means_at(cells: Longs) -> Floats:
        chosen, offsets = corners.of(cells)
        return Corners(chosen, None, offsets).means(vertices)

    far = far_steps(lambda some: vertices[some], len(vertices))
    return max(far_steps(means_at, n_cells), far) > MAX_FAR


def sorted_corners(
    vertices: Floats, corners: Corners, weld: float, n_threads: int
) -> SortedCorners:
    """Sort cells and vertices in O(V + C), after welding; corners of cells keep their order."""
    lowest = lowest_vertices(vertices, weld, n_threads)
    return SortedCorners(*_core.sort_mesh(vertices, lowest, *corners.lists, n_threads))


def far_steps(positions_of: Callable[[Longs], Floats], n: int) -> float:
    """Estimate the fraction, 0 to 1, of pairs of consecutive elements that are far apart.

    Far is more than a quarter of the median distance of random pairs of the `n` elements.
    """
    firsts = spread_indices(N_STEPS, n - 1)
    here = positions_of(firsts)
    steps = _squared_lengths(positions_of(firsts + 1) - here)
    anywhere = _squared_lengths(here[::-1] - here)
    median = np.sort(anywhere)[N_STEPS // 2]  # np.median would import the slow numpy.ma
    return float(np.mean(steps > median / 4**2))


def _squared_lengths(vectors: Floats) -> Floats:
    x, y, z = vectors.T
    return np.asarray(x * x + y * y + z * z)
