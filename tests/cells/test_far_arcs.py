"""Arcs to cells up to three arcs away, compared with a slow reference that lists all walks."""

import numpy as np
import pytest
import shapes
from straight_graphs import StraightGraph, all_paths, distances, far_arcs

import superfacets as sf
from superfacets import _core


def polygons(n=12):
    """Return quads, which have four neighbors each, so that walks have two arcs."""
    rng = np.random.default_rng(1)
    corners = [[x, y, rng.uniform(0, 0.3)] for y in range(n + 1) for x in range(n + 1)]
    firsts = [y * (n + 1) + x for y in range(n) for x in range(n)]
    return sf.PolygonMesh.of_faces(corners, [[v, v + 1, v + n + 2, v + n + 1] for v in firsts])


def random_graph(n, n_edges, seed=0):
    """Return random edges, some of them twice; with few edges, there are many components."""
    rng = np.random.default_rng(seed)
    edges = rng.integers(0, n, (n_edges, 2))
    edges = edges[edges[:, 0] != edges[:, 1]]
    prices = rng.choice([0.0, 10.0, 2_000.0], len(edges))
    return StraightGraph(rng.random((n, 3)), edges, prices)


def star(n_arms=30):
    """Return a cell with too many arcs for walks through it, and arms of two cells each."""
    arms = 1 + np.arange(n_arms)
    edges = [[0, arm] for arm in arms] + [[arm, arm + n_arms] for arm in arms]
    positions = np.random.default_rng(0).random((2 * n_arms + 1, 3))
    return StraightGraph(positions, edges, np.zeros(len(edges)))


GRAPHS = {
    "triangles": lambda: StraightGraph.of_mesh(sf.build_face_graph(shapes.bumpy_sheet(10))),
    "quads": lambda: StraightGraph.of_mesh(sf.build_face_graph(polygons())),
    "islands": lambda: StraightGraph.of_mesh(sf.build_face_graph(shapes.two_islands())),
    "few arcs": lambda: random_graph(80, 60), "some arcs": lambda: random_graph(80, 200),
    "many arcs": lambda: random_graph(60, 400), "star": star,
}  # fmt: skip
N_STEPS = {"triangles": 3, "quads": 2, "few arcs": 3, "some arcs": 2, "many arcs": 1}


@pytest.mark.parametrize("n_threads", [1, 4])
@pytest.mark.parametrize("name", GRAPHS)
def test_arcs_lead_where_short_walks_lead_and_cost_as_much(name, n_threads):
    graph = GRAPHS[name]()
    ordered = graph.ordered(n_threads)
    ordered.add_far_arcs(n_threads)
    expected = far_arcs(graph)
    offsets, neighbors, *_ = _core.conducting_arcs(ordered, 0.0, 0.0, 1)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(offsets))
    assert set(zip(sources.tolist(), neighbors.tolist(), strict=True)) == set(expected)
    assert np.array_equal(distances(ordered), all_paths(graph.n_cells, expected))


@pytest.mark.parametrize("name", N_STEPS)
def test_cells_with_fewer_arcs_have_longer_walks(name):
    """Check that each graph has the number of steps for which it was chosen."""
    graph = GRAPHS[name]()
    steps = all_paths(graph.n_cells, dict.fromkeys(graph.arcs(), 1.0))
    assert max([steps[pair] for pair in far_arcs(graph)]) == N_STEPS[name]


@pytest.mark.parametrize("price", [300.0, 1e9])
@pytest.mark.parametrize("make", [lambda: shapes.bumpy_sheet(8), polygons])
def test_far_arcs_are_as_long_both_ways_bit_for_bit(make, price):
    """This holds even if sums of prices need more bits than a float has, as on meshes."""
    graph = StraightGraph.of_mesh(sf.build_face_graph(make()), price, unit=1e-9)
    ordered = graph.ordered(2)
    ordered.add_far_arcs(2)
    found = distances(ordered)
    assert np.array_equal(found, found.T)


def test_straight_arcs_lead_around_a_vertex_at_no_detour():
    """In a strip of right triangles, the path to a cell three arcs away is a straight line."""
    graph = StraightGraph.of_mesh(sf.build_face_graph(shapes.strip(4)), price=0.0)
    ordered = graph.ordered()
    before = distances(ordered)[0, 3]
    ordered.add_far_arcs(1)
    straight = graph.straight([0], [3])[0]
    assert distances(ordered)[0, 3] == np.rint(straight)
    assert before > 1.05 * straight
