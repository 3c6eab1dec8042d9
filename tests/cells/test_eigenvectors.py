"""Eigenvectors of graphs, compared with analytic solutions and with a dense eigensolver."""

import math

import numpy as np
import shapes
from reference import smallest_eigenpairs

from superfacets import _core


def found(graph, n_wanted, conductances=None, measures=None):
    """Return eigenvalues, eigenvectors (N, m), and the number of components."""
    if conductances is None:
        conductances = np.ones(graph.n_arcs)
    measures = graph.measures if measures is None else measures
    arcs = (graph.offsets, graph.neighbors)
    components, n = _core.find_components(*arcs, np.zeros(graph.n_cells, np.int32))
    values, vectors = _core.smallest_eigenpairs(
        *arcs, conductances, measures, components, n, n_wanted
    )
    return values, vectors.reshape(graph.n_cells, -1), n


def symmetric(graph, rng):
    """Return a random conductance for each arc, equal in both directions."""
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    pairs = np.sort(np.stack([sources, graph.neighbors], 1), axis=1) @ [graph.n_cells, 1]
    _, which = np.unique(pairs, return_inverse=True)
    return np.exp(3 * rng.normal(size=which.max() + 1))[which]


def grid_graph(nx, ny):
    """Return the cells of a rectangular grid, with arcs to the four neighbors of each cell."""
    import superfacets as sf

    at = np.stack(np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"), -1).reshape(-1, 2)
    ways = np.abs(at[:, None] - at[None]).sum(axis=2) == 1
    positions = np.column_stack([at, np.zeros(len(at))])
    offsets = np.concatenate([[0], np.cumsum(ways.sum(axis=1))])
    neighbors = np.nonzero(ways)[1].astype(np.int32)
    return sf.CellGraph(positions, np.ones(len(at)), offsets, neighbors, np.ones(len(neighbors)))


def test_a_line_vibrates_in_cosines():
    n = 60
    values, vectors, _ = found(shapes.line_graph([1.0] * (n - 1)), 6)
    q = np.arange(1, 7)
    assert np.allclose(values, 2 - 2 * np.cos(math.pi * q / n), rtol=1e-5)
    cosines = np.sqrt(2 / n) * np.cos(math.pi * np.outer(np.arange(n) + 0.5, q) / n)
    assert np.allclose(np.abs(vectors), np.abs(cosines), atol=1e-3)
    assert (vectors.max(axis=0) > 0.999 * np.abs(vectors).max(axis=0)).all()


def test_they_are_those_of_a_dense_solver():
    rng = np.random.default_rng(0)
    graph = grid_graph(17, 9)
    conductances, measures = symmetric(graph, rng), rng.uniform(0.1, 3, graph.n_cells)
    values, vectors, _ = found(graph, 8, conductances, measures)
    arcs = (graph.offsets, graph.neighbors)
    twin, basis = smallest_eigenpairs(*arcs, conductances, measures, 1, 8)
    assert np.allclose(values, twin, rtol=1e-4)
    overlap = np.abs(vectors.T @ (measures[:, None] * basis))
    assert np.allclose(overlap, np.eye(8), atol=0.02)


def test_of_equal_eigenvalues_all_vectors_are_found():
    values, vectors, _ = found(grid_graph(12, 12), 5)
    assert np.allclose(values[0], values[1], rtol=1e-5)
    assert np.allclose(values[3], values[4], rtol=1e-5)
    assert np.allclose(vectors.T @ vectors, np.eye(5), atol=1e-6)


def test_constants_of_components_are_left_out():
    two = shapes.two_islands()
    import superfacets as sf

    graph = sf.build_face_graph(two)
    values, vectors, n_components = found(graph, 20)
    assert n_components == 2
    assert len(values) == 6
    assert values.min() > 0.1
    assert np.allclose(vectors[:4].T @ graph.measures[:4], 0, atol=1e-9)


def test_a_graph_of_single_cells_has_none():
    graph = shapes.line_graph([])
    values, vectors, _ = found(graph, 3)
    assert values.shape == (0,)
    assert vectors.shape == (1, 0)
