"""Coarse cells of graphs with straight steps: arcs, prices, means, and paths spread to cells."""

import math

import numpy as np
import pytest
import shapes
from straight_graphs import StraightGraph, all_paths, distances, far_arcs, paths

import superfacets as sf
from superfacets import _core
from superfacets.graph.constraints import NO_GROUPS

THREADS = (1, 3)


def sheet(n=16):
    return StraightGraph.of_mesh(sf.build_face_graph(shapes.bumpy_sheet(n)))


def islands():
    """Return two separate sheets of different sizes, and three specks."""
    small = shapes.bumpy_sheet(6, seed=1)
    speck = shapes.strip(3)
    parts = [shapes.bumpy_sheet(10), sf.Mesh(small.vertices + [3, 0, 0], small.faces)]
    parts += [sf.Mesh(0.01 * speck.vertices + [5 + x, 0, 0], speck.faces) for x in range(3)]
    return StraightGraph.of_mesh(sf.build_face_graph(shapes.together(parts)))


GRAPHS = {"sheet": sheet, "islands": islands}


def arcs_of(coarse):
    """Return the length of each arc, keyed by its two cells."""
    offsets, neighbors, lengths = coarse.arcs()
    sources = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    pairs = zip(sources.tolist(), neighbors.tolist(), strict=True)
    return dict(zip(pairs, lengths.tolist(), strict=True))


def coarse_arcs(graph, coarse):
    """Reference: straight distance plus the lowest price of a path across the common border."""
    of, centers = coarse.coarse_cells(1), coarse.centers()
    positions, _ = coarse.cells()
    least, fine = {}, graph.arcs()
    steps = dict(zip(zip(graph.sources.tolist(), graph.neighbors.tolist(), strict=True),
                     graph.prices().tolist(), strict=True))  # fmt: skip
    within = {pair: length for pair, length in fine.items() if of[pair[0]] == of[pair[1]]}
    price_to = {int(center): 0.0 for center in centers}
    for center in centers.tolist():  # prices along shortest paths
        lengths = paths(graph.n_cells, within, [(0, 0, center)])
        for cell in sorted(np.flatnonzero(of == of[center]), key=lambda cell: lengths[cell]):
            for (a, b), length in within.items():
                if b == cell and lengths[a][0] + length == lengths[cell][0]:
                    price_to[cell] = price_to[a] + steps[a, b]
    for a, b in fine:
        pair = (int(of[a]), int(of[b]))
        if pair[0] != pair[1]:
            price = price_to[a] + price_to[b] + steps[a, b]
            least[pair] = min(price, least.get(pair, math.inf))
    return {
        (a, b): np.linalg.norm(positions[a] - positions[b]) / graph.unit + price
        for (a, b), price in least.items()
    }


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("size", [1, 6, 16])
def test_coarse_arcs_are_straight_lines_plus_the_lowest_price(name, size):
    graph = GRAPHS[name]()
    expected = coarse_arcs(graph, _core.CoarseGraph(graph.ordered(), size, 1))
    for n_threads in THREADS:
        ordered = graph.ordered(n_threads)
        found = arcs_of(_core.CoarseGraph(ordered, size, n_threads))
        assert found.keys() == expected.keys()
        assert all(abs(found[pair] - expected[pair]) <= 0.51 for pair in found)
        assert all(found[b, a] == length for (a, b), length in found.items())


def test_coarse_cells_are_where_their_cells_are():
    graph = sheet()
    coarse = _core.CoarseGraph(graph.ordered(), 6, 2)
    positions, measures = coarse.cells()
    of = coarse.coarse_cells(1)
    assert np.allclose(measures, np.bincount(of, weights=graph.measures))
    moments = np.zeros_like(positions)
    np.add.at(moments, of, graph.measures[:, None] * graph.positions)
    assert np.allclose(positions, moments / measures[:, None])


def test_steps_between_coarse_cells_are_straight():
    coarse = _core.CoarseGraph(sheet().ordered(), 6, 1)
    positions, _ = coarse.cells()
    ends, others = np.array(list(arcs_of(coarse))).T
    ways = np.linalg.norm(positions[ends] - positions[others], axis=1)
    assert np.allclose(_core.straight_steps(coarse.graph, 2), ways)


def test_steps_between_coarse_cells_at_one_place_are_not_0():
    """Two cells at one position, as on a thin sheet; without area, the step is one unit."""
    for measure, expected in ((0.5, 0.2), (0.0, 0.125)):
        placed = _core.PlacedCells(np.zeros((2, 3)), np.full(2, measure), 1)
        arcs = (np.array([0, 1, 2]), np.array([1, 0], np.int32), np.ones(2, np.float32))
        ordered = _core.OrderedGraph(placed, *arcs, 1, True, 0.125)
        coarse = _core.CoarseGraph(ordered, 1, 1).graph
        assert np.allclose(_core.straight_steps(coarse, 1), expected)


@pytest.mark.parametrize("width", [0, 1, 8])
def test_means_are_weighted_by_measures(width):
    graph = islands()
    rng = np.random.default_rng(2)
    graph.measures = graph.measures * rng.integers(0, 3, graph.n_cells)  # some have no area
    rows = rng.normal(size=(graph.n_cells, width)).astype(np.float32)
    ordered = graph.ordered()
    for n_threads in THREADS:
        coarse = _core.CoarseGraph(ordered, 5, n_threads)
        of, n_coarse = coarse.coarse_cells(1), coarse.graph.n_cells
        found = coarse.means_of(rows, NO_GROUPS, n_threads).reshape(n_coarse, width)
        sums, weights = np.zeros((n_coarse, width)), np.bincount(of, weights=graph.measures)
        np.add.at(sums, of, graph.measures[:, None] * rows)
        has_area = weights > 0
        assert np.count_nonzero(has_area) > 0
        assert np.allclose(found[has_area], sums[has_area] / weights[has_area, None], atol=1e-5)
        for cell in np.flatnonzero(~has_area):
            assert np.allclose(found[cell], rows[of == cell].mean(axis=0), atol=1e-5)


@pytest.mark.parametrize("width", [0, 2])
@pytest.mark.parametrize("far", [False, True])
def test_prices_of_parts_are_added_to_all_arcs(width, far):
    """Prices are added to fine arcs, to far arcs, and to arcs of coarse cells."""
    graph = sheet(8)
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(graph.n_cells, width)).astype(np.float32)
    arcs = far_arcs(graph) if far else graph.arcs()
    for n_threads in THREADS:
        ordered = graph.ordered(n_threads)
        if far:
            ordered.add_far_arcs(n_threads)
        ordered.add_part_costs(NO_GROUPS, rows, 123.4, n_threads)
        expected = all_paths(graph.n_cells, priced(arcs, rows, 123.4))
        assert np.array_equal(distances(ordered), expected)
        fine = graph.ordered(n_threads)
        coarse = _core.CoarseGraph(fine, 4, n_threads)
        before, coarse_rows = arcs_of(coarse), rows[coarse.centers()]
        if not far:
            coarse.add_part_costs(coarse_rows, 123.4, n_threads)
            assert arcs_of(coarse) == priced(before, coarse_rows, 123.4)


def priced(arcs, rows, factor):
    """Reference: lengths plus the factor times the distance of rows, rounded to integers."""
    wide = rows.astype(float)
    return {
        (a, b): float(np.float32(np.rint(length + factor * np.linalg.norm(wide[a] - wide[b]))))
        for (a, b), length in arcs.items()
    }


def test_within_a_group_steps_cost_nothing():
    graph = sheet(6)
    rng = np.random.default_rng(4)
    group_of = rng.integers(0, 9, graph.n_cells).astype(np.int32)
    rows = rng.normal(size=(9, 3)).astype(np.float32)
    arcs = (graph.offsets, graph.neighbors, graph.lengths)
    ours = _core.add_part_costs(*arcs, group_of, rows, 50.0, 2)
    differences = rows[group_of[graph.sources]] - rows[group_of[graph.neighbors]].astype(float)
    true = np.rint(graph.lengths + 50.0 * np.linalg.norm(differences, axis=1))
    assert np.array_equal(ours, true.astype(np.float32))
    same = group_of[graph.sources] == group_of[graph.neighbors]
    assert 0 < np.count_nonzero(same) < len(same)
    assert np.array_equal(ours[same], graph.lengths[same])


@pytest.mark.parametrize("n_regions", [2, 12])
@pytest.mark.parametrize("name", GRAPHS)
def test_paths_spread_from_coarse_cells_and_from_centers(name, n_regions):
    graph = GRAPHS[name]()
    ordered = graph.ordered()
    rng = np.random.default_rng(n_regions)
    for n_threads in THREADS:
        coarse = _core.CoarseGraph(ordered, 8, n_threads)
        coarse.add_far_arcs(n_threads)
        seeds = rng.permutation(coarse.graph.n_cells)[:n_regions].astype(np.int32)
        clustering = _core.Clustering(
            coarse.graph, seeds, math.inf, n_threads, _core.Islands.NEAREST
        )
        labels, lengths = clustering.labels(), clustering.lengths()
        centers = coarse.refine(labels, seeds, n_threads)
        found = coarse.spread(lengths, labels, centers, n_threads)
        starts = [(0, label, int(center)) for label, center in enumerate(centers)]
        starts += [
            (int(length), int(label), int(center))
            for length, label, center in zip(lengths, labels, coarse.centers(), strict=True)
            if label >= 0
        ]
        twin = paths(graph.n_cells, graph.arcs(), starts)
        assert found[1].tolist() == [label for _, label in twin]
        reached = found[1] >= 0
        assert found[0][reached].tolist() == [length for length, label in twin if label >= 0]
        last = coarse.spread(lengths, labels, centers, n_threads, needs_lengths=False)
        assert len(last[0]) == 0
        assert np.array_equal(last[1], found[1])
        assert found[1][centers].tolist() == list(range(n_regions))
        assert reached.all() == (name == "sheet")  # islands without a center are not reached
