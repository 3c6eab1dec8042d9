"""Stage 2: weights that keep regions within the parts of a shape."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._options import WeightOptions
from ..cells.cell_graph import checked_weights
from ..cells.surface import Surface
from .embedding import Embedding, embed

__all__ = ["SMOOTH_DISTANCE", "with_parts"]

SMOOTH_DISTANCE = 2.3
"""In r: how far borders may move when they are smoothed by these weights. With 2 compactness is
0.02 higher at the same undersegmentation error; with 3 it is 0.05 lower, at an error that is higher
by 0.002."""

THICKNESS_POWER = 0.125
"""Arcs are longer by (s_i s_j / s_mean^2)^(1/8): thin parts get smaller regions."""

Floats = npt.NDArray[np.float64]


def with_parts(
    cells: Any,
    graph: Any,
    surface: Surface,
    given: npt.ArrayLike,
    radius: float,
    options: WeightOptions,
) -> tuple[Floats, _core.PlacedCells | None]:
    """Return crease weights with what differs between parts added, and the cells in order.

    That is gamma times the distance between the cells in the spectral embedding, in a unit in which
    the sum over all arcs is that of their steps; the sum then grows with the thickness. With a
    radius of 0 (no cell has an area) weights stay as they are, and cells are not ordered.
    """
    weights = checked_weights(given, surface.n_arcs, surface.n_threads)
    if radius == 0.0:
        return weights, None
    alpha, gamma = options.params["alpha"], options.params["gamma"]
    embedding = embed(cells, graph, surface, weights, (radius, alpha * radius))
    return _core.part_weights(
        *surface.arcs,
        weights,
        embedding.group_of,
        embedding.vectors,
        _exponents(embedding, surface.n_threads),
        gamma * embedding.unit / graph.diagonal,
        surface.n_threads,
    ), embedding.graph


def _exponents(embedding: Embedding, n_threads: int) -> Floats:
    """Of the factors that weights have from the thickness on either side; 0 where there is none."""
    logs, measures = embedding.logs, embedding.measures
    if logs is None:
        return np.zeros(len(measures))
    known = np.isfinite(logs)
    logs = np.where(known, logs, 0.0)
    total = _core.sum_of(np.where(known, measures, 0.0), n_threads)
    if total == 0.0:
        return np.zeros(len(measures))
    mean = _core.sum_of(measures * logs, n_threads) / total
    return np.where(known, THICKNESS_POWER * (logs - mean), 0.0)
