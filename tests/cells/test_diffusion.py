"""Conductances, their sums between coarse cells, and relaxation, compared with NumPy code."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.cells.surface import Surface
from superfacets.cells.weights import NO_NORMALS, EdgeFactors, weights_of

LEAST = 1e-6


@pytest.fixture
def sheet():
    """Return the graph of a bumpy sheet, its arcs, the source of each arc, and a number per arc."""
    graph = sf.build_face_graph(shapes.bumpy_sheet(8))
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    rng = np.random.default_rng(0)
    return graph, (graph.offsets, graph.neighbors), sources, rng.uniform(0.1, 2, graph.n_arcs)


def straight_graph(mesh, alpha, unit=1e-6):
    """Return a graph with straight steps and crease prices, and the price of a turn by pi."""
    graph = sf.build_face_graph(mesh)
    surface = Surface.of_faces(mesh, graph, 1)
    factors = EdgeFactors.of_radius(0.5, alpha, 0.0)._replace(is_straight=True)
    cells = (graph.positions, graph.measures, NO_NORMALS)
    lengths = _core.round_weights(weights_of(surface, cells, factors) * graph.diagonal, unit, 1)
    placed = _core.PlacedCells(graph.positions, graph.measures, 1)
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, 1, True, unit)
    return graph, ordered, alpha * 0.5 / unit


def test_concave_creases_conduct_less():
    valley, ridge = shapes.fold(90), shapes.fold(-90)
    found = {}
    for name, mesh in (("valley", valley), ("ridge", ridge)):
        graph, ordered, crease_cost = straight_graph(mesh, 10)
        offsets, neighbors, steps, conductances, hindered = _core.conducting_arcs(
            ordered, crease_cost, 20.0, 1
        )
        assert offsets.tolist() == [0, 1, 2]
        assert neighbors.tolist() == [1, 0]
        straight = np.linalg.norm(graph.positions[0] - graph.positions[1])
        assert np.allclose(steps, straight)
        open_width = np.sqrt(graph.measures.sum()) / straight
        found[name] = conductances / open_width, hindered
    assert np.allclose(found["ridge"][0], 1, atol=2 * LEAST)
    assert found["ridge"][1] == pytest.approx(0, abs=1e-4)
    assert np.allclose(found["valley"][0], np.exp(-20 * 0.5), rtol=0.01, atol=2 * LEAST)
    assert found["valley"][1] == pytest.approx(1 - np.exp(-20 * 0.5), abs=1e-4)


def test_steps_between_cells_at_one_place_have_a_length():
    fins = shapes.fins(3)
    positions = np.zeros((fins.n_faces, 3))
    graph = sf.build_face_graph(fins)
    for measures, least in (
        (graph.measures, 0.2 * np.sqrt(2 * graph.measures.min())),
        (0 * graph.measures, 0.5),
    ):
        placed = _core.PlacedCells(positions, measures, 1)
        lengths = np.ones(graph.n_arcs, np.float32)
        ordered = _core.OrderedGraph(placed, graph.offsets, graph.neighbors, lengths, 1, True, 0.5)
        _, _, steps, conductances, _ = _core.conducting_arcs(ordered, 1.0, 20.0, 1)
        assert steps.min() >= least * (1 - 1e-12)
        assert np.isfinite(conductances).all()
        assert conductances.min() >= LEAST


def test_without_creases_conductances_are_widths_over_steps(sheet):
    graph, _, sources, _ = sheet
    surface = Surface.of_faces(shapes.bumpy_sheet(8), graph, 1)
    conductances = _core.step_conductances(surface.handle, graph.measures, 2)
    steps = sf.arc_measures(shapes.bumpy_sheet(8), graph).step_lengths
    widths = np.sqrt(graph.measures[sources] + graph.measures[graph.neighbors])
    assert np.allclose(conductances, widths / steps + LEAST)


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
