"""Stage 4a on graphs of many chunks, on several threads, and with centers that move."""

import math

import numpy as np
import pytest
import reference
import shapes

import superfacets as sf
from superfacets import CellGraph, _core
from superfacets.clustering.update import update_centers
from superfacets.paper import superfacet_weights

THREADS = (1, 2, 5)
REACHES = (math.inf, 0.08)


def weighted_sheet(n_quads=110, seed=0):
    """Return the graph of 24,200 faces, which several threads divide into three chunks."""
    mesh = shapes.bumpy_sheet(n_quads)
    return sf.build_face_graph(mesh).with_weights(
        superfacet_weights(mesh, sf.build_face_graph(mesh))
    )


def lattice_graph(n=30):
    """Return a cubic lattice of cells with six neighbors each, and many paths of equal length."""
    cells = np.arange(n**3).reshape(n, n, n)
    pairs = [
        np.stack([np.delete(cells, -1, a).ravel(), np.delete(cells, 0, a).ravel()], 1)
        for a in range(3)
    ]
    pairs = np.concatenate([*pairs, *(pair[:, ::-1] for pair in pairs)])
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0]))])
    positions = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return CellGraph(positions, np.ones(n**3), offsets, pairs[:, 1], np.ones(len(pairs)))


GRAPHS = {"sheet": weighted_sheet, "lattice": lattice_graph}


def check_exact(graph, result):
    """Check that paths are shortest: no arc improves a path, and each path ends with an arc."""
    lengths = np.rint(result.distances / graph.unit).astype(np.int64)
    origin = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    longer = lengths[origin] + graph.lengths.astype(np.int64)
    to, label = graph.neighbors, result.labels[origin]
    is_equal = longer == lengths[to]
    assert np.all(longer >= lengths[to])
    assert np.all(result.labels[to][is_equal] <= label[is_equal])
    has_path = np.zeros(graph.n_cells, dtype=bool)
    has_path[to[is_equal & (result.labels[to] == label)]] = True
    has_path[result.centers] = True
    assert has_path.all()
    assert np.all(lengths[result.centers] == 0)
    assert np.array_equal(result.labels[result.centers], np.arange(len(result.centers)))


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("n_threads", THREADS)
def test_no_arc_improves_a_path_of_the_exact_classification(name, n_threads):
    graph = GRAPHS[name]()
    centers = np.random.default_rng(1).choice(graph.n_cells, 40, replace=False)
    check_exact(graph, sf.classify(graph, centers, n_threads=n_threads))
    check_exact(graph, sf.classify(graph, centers[:1], n_threads=n_threads))


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("n_threads", THREADS)
@pytest.mark.parametrize("reach", REACHES)
def test_centers_that_move_give_what_they_would_give_at_once(name, n_threads, reach):
    """Some centers move a little, some across the mesh, some stay, and two swap places."""
    graph = GRAPHS[name]()
    rng = np.random.default_rng(2)
    centers = rng.choice(graph.n_cells, 30, replace=False).astype(np.int32)
    cells = graph.ordered(n_threads)
    if math.isfinite(reach):
        reach *= graph.diagonal
    clustering = _core.Clustering(cells, centers, reach, n_threads)
    for _ in range(4):
        centers = clustering.centers()
        clustering.update()
        centers[:10] = graph.neighbors[graph.offsets[centers[:10]]]
        centers[10:13] = np.setdiff1d(rng.choice(graph.n_cells, 200), centers)[:3]
        centers[13:15] = centers[[14, 13]]
        assert len(np.unique(centers)) == len(centers)
        clustering.classify(centers)
        at_once = _core.Clustering(cells, centers, reach, 1)
        assert np.array_equal(clustering.labels(), at_once.labels())
        assert np.array_equal(clustering.lengths(), at_once.lengths())
        assert np.array_equal(clustering.centers(), at_once.centers())
        assert np.array_equal(clustering.update(), at_once.update())
        twin = reference.update_centers(graph, clustering.labels())
        assert clustering.update().tolist() == twin


@pytest.mark.parametrize("part", [0.03, 0.08, 0.3])
def test_halted_expansions_equal_the_twin_where_they_cross_chunks(part):
    graph = weighted_sheet()
    centers = np.random.default_rng(3).choice(graph.n_cells, 60, replace=False)
    reach = part * graph.diagonal
    labels, all_centers = reference.classify_halted(graph, centers.tolist(), reach)
    for n_threads in THREADS:  # the reference takes seconds
        result = sf.classify(graph, centers, reach=reach, n_threads=n_threads)
        assert result.labels.tolist() == labels
        assert result.centers.tolist() == all_centers


@pytest.mark.parametrize("n_threads", THREADS)
def test_many_components_each_get_a_center_in_the_order_of_their_lowest_cells(n_threads):
    n = 20_000
    offsets = np.concatenate([np.arange(n), [n]])
    pairs = CellGraph(
        np.random.default_rng(0).uniform(size=(n, 3)), np.ones(n), offsets,
        np.arange(n).reshape(-1, 2)[:, ::-1].ravel(), np.ones(n),
    )  # fmt: skip
    for reach in (None, 0.5):
        result = sf.classify(pairs, [5], reach=reach, n_threads=n_threads)
        others = np.setdiff1d(np.arange(0, n, 2), [4])
        assert result.centers.tolist() == [5, *others.tolist()]
        assert np.array_equal(result.centers[result.labels] // 2, np.arange(n) // 2)


def test_arcs_are_known_to_lead_back_from_cells_with_very_many():
    """The middle of a star has 100,000 arcs. Searching all of them for each would take minutes."""
    n = 100_000
    offsets = np.concatenate([[0], n + np.arange(n + 1)])
    neighbors = np.concatenate([np.arange(1, n + 1), np.zeros(n, dtype=int)])
    positions = np.random.default_rng(0).uniform(size=(n + 1, 3))
    star = CellGraph(positions, np.ones(n + 1), offsets, neighbors, np.ones(2 * n))
    result = sf.segment_graph(star, 3, max_num_iter=3)
    check_exact(star, sf.classify(star, result.centers))
    assert np.array_equal(result.labels, sf.classify(star, result.centers).labels)


def test_a_region_with_next_to_no_area_beside_a_vast_one_has_its_own_mean():
    """The last five cells have 2^-80 of the area, which vanishes in a sum with the other areas."""
    measures = [1.0] * 5 + [2.0**-80] * 4 + [2.0**-78]
    line = shapes.line_graph([1.0] * 9, measures=measures)
    labels = np.repeat([0, 1], 5)
    assert update_centers(line, labels).tolist() == [2, 8]
    assert reference.update_centers(line, labels) == [2, 8]
