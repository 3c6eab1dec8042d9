"""Stage 4b: centers from labels."""

from __future__ import annotations

import math

import numpy as np

from .._types import Array, Floats
from ..cells.cell_graph import CellGraph
from .vectors import dot


def update_centers(graph: CellGraph, labels: Array) -> list[int]:
    """The cell of each region nearest to the weighted mean of its positions; -1 is no region."""
    n_regions = int(labels.max()) + 1
    labels = np.where(labels < 0, n_regions, labels)
    means = _fixed_point_means(graph, labels)
    areas = np.bincount(labels, graph.measures)  # bincount adds in the order of the cells
    weights = np.where(areas[labels] > 0, graph.measures, 1.0)
    totals = np.bincount(labels, weights)
    for axis, coordinates in enumerate(graph.positions.T):
        in_order = np.bincount(labels, weights * coordinates) / totals
        means[:, axis] = np.where(np.isnan(means[:, axis]), in_order, means[:, axis])
    step = graph.positions - means[labels]
    squared = dot(step, step)
    cells = np.arange(graph.n_cells)
    return [int(min(cells[labels == r], key=lambda cell: squared[cell])) for r in range(n_regions)]


def _fixed_point_means(graph: CellGraph, labels: Array) -> Floats:
    """Means whose sums are exact, whatever their order; NaN for regions too small for that.

    Each cell adds whole numbers: its measure, and its measure times its position from the low
    corner, both scaled to just under 2**61 in all, and what rounding leaves of them, times 2**31.
    """
    low = graph.positions.min(axis=0)
    extent = float((graph.positions.max(axis=0) - low).max())
    total = float(graph.measures.sum())
    moments = graph.measures[:, None] * (graph.positions - low)
    scales = [_fixed_point_scale(total * extent)] * 3 + [_fixed_point_scale(total)]
    sums = np.zeros((int(labels.max()) + 1, 4))
    for column, scale in enumerate(scales):
        numbers = scale * (moments[:, column] if column < 3 else graph.measures)
        upper = [[0, 0] for _ in sums]
        for label, number in zip(labels.tolist(), numbers.tolist(), strict=True):
            upper[label][0] += round(number)
            upper[label][1] += round((number - round(number)) * 2**31)
        sums[:, column] = [float(first) + float(second) / 2**31 for first, second in upper]
        if column == 3:
            sums[[first < 2**20 for first, _ in upper]] = np.nan
    with np.errstate(invalid="ignore"):
        means: Floats = low + sums[:, :3] * (scales[3] / scales[0] / sums[:, 3:])
    return means


def _fixed_point_scale(total: float) -> float:
    return 2.0 ** (61 - math.frexp(total)[1]) if total > 0 else 1.0
