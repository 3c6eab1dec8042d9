"""Centers that move between runs of the loop, and properties that must not change."""

import math

import loops
import numpy as np
import pytest
import reference
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.clustering.loop import ITERATIONS_PER_ROUND, RELOCATED_FRACTIONS

KEEP = _core.Islands.KEEP


def relocated(graph, centers, n_moves, n_threads=1, crease_limit=math.inf):
    """Return the centers before and after relocation, including centers of orphans."""
    cells = graph.ordered(n_threads)
    cells.crease_limit = crease_limit
    clustering = _core.Clustering(cells, np.asarray(centers, np.int32), math.inf, n_threads, KEEP)
    return clustering.centers().tolist(), clustering.relocate(n_moves, n_threads).tolist()


def random_case(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 150))
    values = None if seed % 3 == 0 else [0.0, 1.0, 2.0][: 1 + seed % 3]
    if seed % 5 == 4:
        graph = shapes.random_one_way_graph(n, int(rng.integers(1, 4 * n)), seed)
    else:
        graph = shapes.random_graph(n, int(rng.integers(1, 4 * n)), seed, weight_values=values)
    k = int(rng.integers(1, min(n, 30) + 1))
    return graph, rng.permutation(n)[:k].tolist()


@pytest.mark.parametrize("seed", range(60))
def test_moves_on_random_graphs_equal_their_twin(seed):
    graph, seeds = random_case(seed)
    has_crease_limit = seed % 2 == 1
    for n_moves in (1, 3, len(seeds)):
        before, after = relocated(
            graph, seeds, n_moves, crease_limit=9.0 if has_crease_limit else math.inf
        )
        order = graph.ordered(1).order()
        assert after == reference.relocate_centers(graph, order, before, n_moves, has_crease_limit)
        assert sum(a != b for a, b in zip(after, before, strict=True)) <= n_moves


@pytest.mark.parametrize("seed", range(60))
def test_no_cell_loses_its_way_and_no_two_centers_meet(seed):
    graph, seeds = random_case(seed)
    before, after = relocated(graph, seeds, len(seeds))
    assert len(set(after)) == len(before)
    labels, centers = reference.classify_exact(graph, after)
    assert centers == after  # no orphans
    assert set(labels) == set(range(len(after)))


@pytest.mark.parametrize("seed", range(5))
def test_moves_do_not_depend_on_the_number_of_threads(seed):
    mesh = shapes.bumpy_sheet(110, seed)
    graph = sf.build_face_graph(mesh)
    graph = graph.with_weights(sf.crease_weights(mesh, graph, 0.1))
    seeds = np.random.default_rng(seed).permutation(graph.n_cells)[:80]
    one, *others = (relocated(graph, seeds, 12, n_threads) for n_threads in (1, 2, 8))
    assert one[0] != one[1]
    assert all(other == one for other in others)


def test_a_center_that_is_hardly_needed_divides_the_largest_region():
    """In a row of eleven cells, the first three are regions; the fourth is the center of others."""
    line = shapes.line_graph([1.0] * 10)
    assert relocated(line, [0, 1, 2, 3], 1) == ([0, 1, 2, 3], [10, 1, 2, 3])
    # The next cheapest center is 1, but cell 0 now needs it; then 2.
    assert relocated(line, [0, 1, 2, 3], 4) == ([0, 1, 2, 3], [10, 1, 2, 3])


def test_nothing_moves_where_regions_are_alike():
    line = shapes.line_graph([1.0] * 8)
    assert relocated(line, [1, 4, 7], 3) == ([1, 4, 7], [1, 4, 7])


def test_a_pocket_behind_expensive_arcs_does_not_hold_its_center():
    """Cell 0 is all that its center has; cells 1 to 40 have one center at their end."""
    line = shapes.line_graph([1000.0] + [1.0] * 39)
    assert relocated(line, [0, 1], 1) == ([0, 1], [40, 1])


def test_a_center_alone_in_its_component_stays():
    """A pair of cells and a line are separate components."""
    line = shapes.line_graph([1.0] * 20)
    offsets = np.concatenate([line.offsets, line.offsets[-1] + [1, 2]])
    graph = sf.CellGraph(
        np.concatenate([line.positions, [[50, 0, 0], [51, 0, 0]]]),
        np.concatenate([line.measures, [1, 1]]), offsets,
        np.concatenate([line.neighbors, [22, 21]]).astype(np.int32),
        np.concatenate([line.weights, [1, 1]]),
    )  # fmt: skip
    before, after = relocated(graph, [0, 21], 2)
    assert before == after == [0, 21]
    before, after = relocated(graph, [0, 21, 22], 2)
    assert after == [0, 20, 22]  # one of the two centers of the pair moves


def test_cells_without_an_area_move_nothing():
    line = shapes.line_graph([1.0] * 10, np.zeros(11))
    assert relocated(line, [0, 1, 2], 3) == ([0, 1, 2], [0, 1, 2])


@pytest.mark.parametrize("seed", range(6))
def test_the_number_of_regions_stays(seed):
    graph, seeds = random_case(seed)
    for changed in ({}, {"tol": 0.0}, {"islands": "nearest"}, {"init": seeds}):
        options = changed if "init" in changed else {"n_segments": len(seeds), **changed}
        moved = loops.segment_graph(graph, relocates=True, **options)
        if seed != 4:  # with one-way arcs, moving a center may leave orphans
            assert moved.n_segments == sf.segment_graph(graph, **options).n_segments
        assert moved.n_segments >= len(seeds)
        assert set(moved.labels.tolist()) == set(range(moved.n_segments))
        assert moved.labels[moved.centers].tolist() == list(range(moved.n_segments))


def energy(graph, result):
    """Return the mean squared path length to the nearest center."""
    clustering = _core.Clustering(graph.ordered(1), result.centers, math.inf, 1, KEEP)
    return float(np.average(clustering.lengths() ** 2.0, weights=graph.measures))


@pytest.mark.parametrize("options", [{}, {"init": "farthest"}, {"init": "grid"}, {"tol": 0.0}])
def test_regions_are_nearer_to_their_centers(options):
    mesh = shapes.bumpy_sheet(60)
    graph = sf.build_face_graph(mesh)
    radius = math.sqrt(graph.measures.sum() / (40 * math.pi))
    graph = graph.with_weights(sf.crease_weights(mesh, graph, radius))
    usual, moved = (loops.segment_graph(graph, 40, relocates=on, **options) for on in (False, True))
    assert energy(graph, moved) < energy(graph, usual)
    n_most = usual.n_iter + len(RELOCATED_FRACTIONS) * ITERATIONS_PER_ROUND
    assert usual.n_iter <= moved.n_iter <= n_most + len(moved.levels) * 50


def test_labels_keep_under_scaling_and_follow_the_order_of_faces():
    mesh = shapes.bumpy_sheet(40)
    options = {"smooth": False}  # smoothing depends on the order of faces
    labels = sf.segment(mesh, 40, **options).labels
    larger = sf.Mesh(4.0 * mesh.vertices, mesh.faces)
    assert np.array_equal(sf.segment(larger, 40, **options).labels, labels)
    order = np.random.default_rng(3).permutation(mesh.n_faces)
    shuffled = sf.segment(sf.Mesh(mesh.vertices, mesh.faces[order]), 40, **options).labels
    assert len(set(zip(shuffled.tolist(), labels[order].tolist(), strict=True))) == 40


def test_all_kinds_of_cells_relocate():
    mesh = shapes.bumpy_sheet(20)
    polygons = sf.PolygonMesh(
        mesh.vertices, 3 * np.arange(mesh.n_faces + 1), mesh.faces.reshape(-1)
    )
    points = np.random.default_rng(1).uniform(size=(900, 3)) * [1, 1, 0]
    for cells in (mesh, polygons, points):
        result = sf.segment(cells, 15)
        assert (result.n_segments, result.params["relocates"]) == (15, True)


def test_masks_and_barriers_hold():
    mesh = shapes.bumpy_sheet(30)
    centroids = mesh.vertices[mesh.faces].mean(axis=1)
    half = (centroids[:, 0] > np.median(centroids[:, 0])).astype(int)
    mask = centroids[:, 1] > np.quantile(centroids[:, 1], 0.3)
    result = sf.segment(mesh, 24, mask=mask, barriers=half)
    assert np.array_equal(result.labels >= 0, mask)
    assert all(len(set(half[result.labels == label])) == 1 for label in range(24))
    assert result.n_segments == 24


def test_centers_relocate_with_the_default_weights_unless_seeds_or_a_limit_are_given():
    mesh = shapes.bumpy_sheet(12)
    n_arcs = sf.build_face_graph(mesh).n_arcs
    for options, is_on in (
        ({}, True), ({"init": "farthest"}, True), ({"init": [0, 9, 99]}, False),
        ({"radius_factor": 2.0}, False), ({"weights": "creases"}, False),
        ({"weights": np.ones(n_arcs)}, False),
    ):  # fmt: skip
        n_segments = None if options.get("init") == [0, 9, 99] else 3
        assert loops.segment(mesh, n_segments, **options).params["relocates"] is is_on


def test_no_iterations_no_moves():
    mesh = shapes.bumpy_sheet(30)
    still = [loops.segment(mesh, 20, max_num_iter=0, relocates=on).labels for on in (False, True)]
    assert np.array_equal(*still)


def test_a_cancelled_run_does_not_relocate():
    result = sf.segment(shapes.bumpy_sheet(30), 20, callback=lambda *_: False)
    assert (result.n_iter, result.stop_reason) == (1, "cancelled")


def test_the_callback_counts_on():
    counted = []
    result = sf.segment(
        shapes.bumpy_sheet(30), 20, tol=0.0,
        callback=lambda stage, n_iter, n_moved: counted.append(n_iter),
    )  # fmt: skip
    assert [n_iter for n_iter in counted if n_iter] == list(range(1, result.n_iter + 1))


def test_the_limit_after_relocation_is_not_called_the_maximum():
    result = sf.segment(sf.sample_mesh(20_000), 300, tol=0.002)
    assert result.n_iter < 50
    assert result.stop_reason == "enough"


def test_a_third_of_the_iterations_is_kept_for_relocation():
    mesh = shapes.bumpy_sheet(60)
    graph = sf.build_face_graph(mesh)
    graph = graph.with_weights(sf.crease_weights(mesh, graph, 0.1))
    moved = loops.segment_graph(graph, 40, relocates=True, max_num_iter=6, tol=0.0)
    assert (moved.n_iter, moved.stop_reason) == (6, "max_num_iter")
    for n_iter in (4, 6):  # the loop does not converge in either
        usual = loops.segment_graph(graph, 40, max_num_iter=n_iter, tol=0.0)
        assert (usual.n_iter, usual.stop_reason) == (n_iter, "max_num_iter")
        assert not np.array_equal(moved.labels, usual.labels)
