"""Random cell graphs, compared with the reference implementation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import reference
import shapes
from test_twins import check_loop, size_of

import superfacets as sf

from .promises import THREADS, check_number, check_pieces, check_result


def check_graph(rng: np.random.Generator, _folder: Path) -> None:
    """Check a graph with parallel arcs, many components and, in half of the cases, many ties."""
    n = int(rng.integers(1, 80))
    values = None if rng.random() < 0.5 else [0.0, 1.0, 2.0][: rng.integers(1, 4)]
    n_edges = int(rng.integers(0, 3 * n))
    graph = shapes.random_graph(n, n_edges, int(rng.integers(2**31)), weight_values=values)
    k = int(rng.integers(1, n + 1))
    _check_seeds(graph, k)
    check_loop(graph, k, tol=float(rng.choice([0.0, 0.02])))
    check_loop(graph, k, tol=0.0, radius_factor=float(rng.uniform(0.1, 2)))
    _check_threads(graph, k)


def _check_seeds(graph: sf.CellGraph, k: int) -> None:
    radius = size_of(graph, k).radius
    assert sf.place_seeds(graph, k).tolist() == reference.geodesic_seeds(graph, k)
    order = graph.ordered(1).order()
    assert sf.place_seeds(graph, k, init="curve").tolist() == reference.curve_seeds(graph, order, k)
    farthest = sf.place_seeds(graph, k, init="farthest").tolist()
    assert farthest == reference.farthest_seeds(graph, k)
    if radius > 0:
        flood = sf.place_seeds(graph, k, init="flood").tolist()
        assert flood == reference.flood_seeds(graph, radius)
        assert sf.place_seeds(graph, k, init="grid").tolist() == reference.grid_seeds(graph, radius)


def _check_threads(graph: sf.CellGraph, k: int) -> None:
    results = [sf.segment_graph(graph, k, n_threads=n_threads) for n_threads in THREADS]
    check_result(results[0], graph)
    check_number(results[0], graph, k)
    check_pieces(results[0].labels, graph)
    for other in results[1:]:
        assert np.array_equal(other.labels, results[0].labels)
