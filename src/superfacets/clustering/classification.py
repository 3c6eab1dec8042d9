"""Stage 4a of the algorithm: label each cell with the center that has the shortest path to it.

The loop of `segment` does not use this module. It calls `_core.Clustering`; see `loop.py`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_number, checked_seeds, checked_threads
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph, checked_graph


class Classification(NamedTuple):
    """Result of `superfacets.classify`: the label of each cell, and its distance from the center.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Label of each cell, from 0 to K - 1: the index in ``centers`` of the center with the
        shortest path to the cell.
    centers : ndarray of int32, shape (K,)
        The given centers, followed by unreached cells that were made centers.
    distances : ndarray of float64, shape (N,)
        Length of the shortest path from the center to each cell, in the unit of the weights.
    """

    labels: Ints
    centers: Ints
    distances: Floats


def classify(
    graph: CellGraph, centers: npt.ArrayLike, *, reach: float | None = None,
    n_threads: int | None = None,
) -> Classification:  # fmt: skip
    """Label each cell with the index of the center that has the shortest path to the cell.

    Parameters
    ----------
    graph : CellGraph
    centers : array_like of int, shape (K,)
        Indices of distinct cells.
    reach : float, optional
        Euclidean distance from a center at which its paths end, in the unit of the positions. By
        default, paths have no limit, and the classification is *exact*: Dijkstra's algorithm runs
        once, from all centers simultaneously. Regions are then connected. Time is at most
        O((N + M) log N). With `reach`, the classification is *halted*, as in the paper: Dijkstra's
        algorithm runs from each center separately. Cells farther from the center than `reach` are
        labeled, but paths do not continue from these cells. Regions may then be disconnected.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    Classification
        If two centers have equally short paths, the lower label is used. While there are unreached
        cells, the unreached cell with the lowest index becomes an additional center, from which
        paths are computed in the same way.

    Raises
    ------
    ValueError, TypeError
        If centers are out of range, repeated or not integers, or if `reach` is negative.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, section 3.1.

    Examples
    --------
    >>> line = CellGraph([[x, 0, 0] for x in range(5)], [1] * 5, [0, 1, 3, 5, 7, 8],
    ...                  [1, 0, 2, 1, 3, 2, 4, 3], [1] * 8)
    >>> classify(line, [0, 4]).labels
    array([0, 0, 0, 1, 1], dtype=int32)
    """
    checked_graph(graph)
    array = checked_seeds(centers, graph.n_cells)
    if reach is not None:
        reach = checked_number(reach, "reach", zero=True)
    n_threads = checked_threads(n_threads)
    clustering = _core.Clustering(
        graph.ordered(n_threads), array, math.inf if reach is None else reach, n_threads
    )
    distances = clustering.lengths().astype(np.float64) * graph.unit
    return Classification(clustering.labels(), clustering.centers(), distances)
