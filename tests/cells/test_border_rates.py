"""Rates of borders that people draw, from bends and the change of given vectors."""

import numpy as np
import pytest

import superfacets as sf
from superfacets import _core
from superfacets.graph.kinds import kind_of
from superfacets.weights.parts import BORDER_COEFFICIENTS

BEAR = sf.sample_mesh(5_000)


def rates(mesh, vectors, n_threads=1):
    kind = kind_of(mesh)
    graph, _ = kind.build_graph(mesh, True, 1)
    surface = kind.surface(mesh, graph, 1)
    lengths, unit = graph.quantized(surface.arc_measures().step_lengths / graph.diagonal, 1)
    placed = _core.PlacedCells(graph.positions, graph.measures, 1)
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, 1, True, unit * graph.diagonal)
    widths, normals = surface.arc_measures().border_lengths, kind.normals(surface, graph)
    found = _core.border_rates(
        ordered, *surface.arcs, widths, normals, vectors, BORDER_COEFFICIENTS, n_threads
    )
    return graph, found


def test_both_directions_of_a_step_and_any_number_of_threads_give_the_same_rate():
    vectors = np.random.default_rng(0).normal(size=(BEAR.n_faces, 8)).astype(np.float32)
    graph, found = rates(BEAR, vectors)
    assert found.min() > 0
    there = np.lexsort([graph.neighbors, graph.sources])
    back = np.lexsort([graph.sources, graph.neighbors])
    assert np.array_equal(found[there], found[back])
    assert np.array_equal(rates(BEAR, vectors, 3)[1], found)


def test_rates_do_not_depend_on_units():
    vectors = np.zeros((BEAR.n_faces, 8), np.float32)
    large = sf.Mesh(1024 * BEAR.vertices, BEAR.faces)
    assert rates(large, 4 * vectors)[1] == pytest.approx(rates(BEAR, vectors)[1], rel=1e-4)


def test_borders_are_likely_where_vectors_change():
    """The vectors of the faces of the left and the right half of the bear differ."""
    graph, _ = kind_of(BEAR).build_graph(BEAR, True, 1)
    is_left = graph.positions[:, 0] < graph.positions[:, 0].mean()
    vectors = np.repeat(is_left[:, np.newaxis], 8, axis=1).astype(np.float32)
    _, found = rates(BEAR, vectors)
    is_border = is_left[graph.sources] != is_left[graph.neighbors]
    assert found[is_border].mean() > 5 * found[~is_border].mean()
