"""Conductances, their sums between coarse cells, and relaxation: against a few lines of numpy."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.cells.surface import Surface

LEAST = 1e-6


@pytest.fixture
def sheet():
    """The graph of a bumpy sheet, its arcs, the cell each leads from, and numbers for the arcs."""
    graph = sf.build_face_graph(shapes.bumpy_sheet(8))
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    rng = np.random.default_rng(0)
    return graph, (graph.offsets, graph.neighbors), sources, rng.uniform(0.1, 2, graph.n_arcs)


def test_concave_creases_conduct_less():
    valley, ridge = shapes.fold(90), shapes.fold(-90)
    found = {}
    for name, mesh in (("valley", valley), ("ridge", ridge)):
        graph = sf.build_face_graph(mesh)
        surface = Surface.of_faces(mesh, graph, 1)
        weights = sf.crease_weights(mesh, graph, 0.5, alpha=10, ridges=0)
        steps, found[name] = _core.crease_conductances(
            surface.handle, graph.measures, weights, graph.diagonal, 10 * 0.5, 20.0, 1
        )
        assert np.allclose(steps, 2.0)
        open_width = np.sqrt(graph.measures.sum()) / 2.0
    assert np.allclose(found["ridge"], open_width + LEAST)
    assert np.allclose(found["valley"], open_width * np.exp(-20 * 0.5) + LEAST)


def test_differences_of_values_hinder(sheet):
    graph, arcs, sources, conductances = sheet
    values = np.random.default_rng(1).normal(size=graph.n_cells)
    ours = _core.hindered_conductances(*arcs, conductances, values, 3.0, 2)
    differences = np.abs(values[sources] - values[graph.neighbors])
    assert np.allclose(ours, conductances * np.exp(-3 * differences) + LEAST, rtol=1e-12)


def test_between_coarse_cells_conductance_times_step_is_summed(sheet):
    graph, arcs, sources, conductances = sheet
    steps = np.random.default_rng(2).random(graph.n_arcs)
    n = 7
    coarse_of = (np.arange(graph.n_cells) // (graph.n_cells // n + 1)).astype(np.int32)
    sums = np.zeros((n, n))
    np.add.at(sums, (coarse_of[sources], coarse_of[graph.neighbors]), conductances * steps)
    np.fill_diagonal(sums, 0)
    offsets = np.concatenate([[0], np.cumsum((sums > 0).sum(axis=1))])
    neighbors = np.nonzero(sums)[1].astype(np.int32)
    ours = _core.sum_between(*arcs, conductances, steps, coarse_of, offsets, neighbors)
    assert np.allclose(ours, sums[sums > 0], rtol=1e-12)


@pytest.mark.parametrize("width", [1, 3, 8])
@pytest.mark.parametrize("n_sweeps", [0, 1, 4])
def test_relaxed_values_come_near_the_mean_of_neighbors(sheet, width, n_sweeps):
    graph, arcs, sources, conductances = sheet
    rows = np.random.default_rng(3).normal(size=(graph.n_cells, width)).astype(np.float32)
    ours = _core.relax(*arcs, conductances, rows, n_sweeps, 2).reshape(rows.shape)
    shares = np.zeros((graph.n_cells, graph.n_cells))
    np.add.at(shares, (sources, graph.neighbors), conductances)
    shares /= shares.sum(axis=1, keepdims=True)
    true = rows.astype(float)
    for _ in range(n_sweeps):
        true = 0.25 * true + 0.75 * shares @ true
    assert np.allclose(ours, true, atol=1e-5)
