"""Which regions are of the same shape as another, whatever their size and where they lie."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._validate import checked_share
from ..cells.region_adjacency import RegionGraph

FEATURES = (
    "linearity", "planarity", "sphericity", "spread", "crease",
    "normal_x", "normal_y", "normal_z",
)  # fmt: skip
"""The columns of `features_of`. Those of shape come first; similar regions may face any way."""

_N_OF_SHAPE = 5

Floats = npt.NDArray[np.float64]


def features_of(graph: RegionGraph) -> Floats:
    """Features of regions, shape (K, 8); 0 where there is none.

    ``linearity``, ``planarity``, ``sphericity``: how a region extends, each 0 to 1. ``spread``: how
    far it is from flat, 0 to 1, three times its `curvature`. ``crease``: mean signed angle at its
    border in units of pi, -1 (ridges) to 1 (grooves). Then the mean normal.
    """
    shape = (graph.linearity, graph.planarity, graph.sphericity, 3.0 * graph.curvature)
    columns = np.stack([*shape, _creases(graph)], axis=1)
    features: Floats = np.nan_to_num(np.concatenate([columns, graph.normals], axis=1))
    return features


def similar_regions(graph: RegionGraph, region: int, tolerance: float) -> list[int]:
    """Regions whose features of shape are near those of one, which is among them.

    Parameters
    ----------
    graph : RegionGraph
    region : int
    tolerance : float
        0 (the same) to 1 (all): the largest distance, as a share of the largest there is.

    Raises
    ------
    ValueError, TypeError
        If there is no such region, or the tolerance is not 0 to 1.
    """
    limit = checked_share(tolerance, "tolerance")
    if not 0 <= region < graph.n_regions:
        raise ValueError(f"there is no region {region}: there are {graph.n_regions}")
    features = features_of(graph)[:, :_N_OF_SHAPE]
    scale = features.std(axis=0)
    steps = (features - features[region]) / np.where(scale > 0, scale, 1.0)
    distances = np.sqrt((steps * steps).sum(axis=1))
    found: list[int] = np.flatnonzero(distances <= limit * distances.max()).tolist()
    return found


def _creases(graph: RegionGraph) -> Floats:
    """Mean over the border to other regions of the signed angle, in units of pi."""
    n, ends = graph.n_regions, graph.edge_index.ravel()
    lengths = np.tile(graph.border_lengths, 2)
    angles = np.tile(graph.concavities, 2)
    sums = np.bincount(ends, lengths * angles, n)
    totals = np.bincount(ends, lengths, n)
    means: Floats = np.divide(sums, np.pi * totals, out=np.zeros(n), where=totals > 0)
    return means
