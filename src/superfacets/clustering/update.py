"""Stage 4b of the algorithm: move each center to the cell nearest to the centroid of its region.

The loop of `segment` does not use this module. It calls `_core.Clustering`; see `loop.py`.
"""

from __future__ import annotations

import numpy.typing as npt

from .. import _core
from ..base.checks import checked_partial_labels, checked_threads
from ..base.types import Ints
from ..graph.cell_graph import CellGraph, checked_graph


def update_centers(
    graph: CellGraph, labels: npt.ArrayLike, *, n_threads: int | None = None
) -> Ints:
    """Return the center of each region: the cell nearest to the centroid of the region.

    The centroid is the mean position of the cells of the region, weighted by their measures
    (unweighted if all measures are 0). If several cells are equally near, the cell with the lowest
    index is used. Time is O(N + K).

    Parameters
    ----------
    graph : CellGraph
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    ndarray of int32, shape (K,)
        Index of the center of each region.

    Raises
    ------
    ValueError, TypeError
        If labels are not one integer >= 0 per cell, or if a label from 0 to K - 1 is missing.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, section 3.1.

    Examples
    --------
    >>> line = CellGraph([[x, 0, 0] for x in range(5)], [1] * 5, [0, 1, 3, 5, 7, 8],
    ...                  [1, 0, 2, 1, 3, 2, 4, 3], [1] * 8)
    >>> update_centers(line, [0, 0, 0, 1, 1])
    array([1, 3], dtype=int32)
    """
    checked_graph(graph)
    array, n_regions = checked_partial_labels(labels, graph.n_cells, least=0)
    threads = checked_threads(n_threads)
    return _core.update_centers(graph.ordered(threads), array, n_regions, threads)
