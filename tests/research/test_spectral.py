"""Normalized cuts: shapes with a known cut, stages against SciPy, components, bad arguments."""

import heapq
import sys
from itertools import pairwise

import numpy as np
import pytest
import shapes
from models import read_off
from research.baselines import affinity_embedding, normalized_cuts
from research.baselines.spectral import _discretize, _leading_eigenvectors, near_path_lengths
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from superfacets import CellGraph, Mesh, MissingExtraError, build_face_graph
from superfacets.paper import superfacet_weights

REACHES = [None, 3.0]
every_reach = pytest.mark.parametrize("reach", REACHES)


def path_lengths(graph, sources):
    return dense_path_lengths(graph, 1e9)[sources]


def dense_path_lengths(graph, reach):
    """Return the lengths as a dense matrix, with infinity where there is no path."""
    offsets, columns, values = near_path_lengths(graph, reach)
    dense = np.full((graph.n_cells, graph.n_cells), np.inf, np.float32)
    rows = np.repeat(np.arange(graph.n_cells), np.diff(offsets))
    assert all(np.all(np.diff(columns[a:b]) > 0) for a, b in pairwise(offsets))
    dense[rows, columns] = values
    return dense


def scipy_path_lengths(graph):
    """Return path lengths by SciPy, from rounded weights and the shortest of parallel arcs."""
    matrix = np.full((graph.n_cells, graph.n_cells), np.inf)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    np.minimum.at(matrix, (sources, graph.neighbors), graph.lengths)
    is_arc = np.isfinite(matrix)
    rows, columns = np.nonzero(is_arc)  # int32: SciPy 1.11 takes no other indices here
    places = rows.astype(np.int32), columns.astype(np.int32)
    arcs = csr_array((matrix[is_arc], places), shape=matrix.shape)
    return (dijkstra(arcs) * graph.unit).astype(np.float32)


def halted_lengths(graph, source, reach):
    """Return path lengths from a cell to those within reach, not expanding cells out of reach."""
    gaps = np.linalg.norm(graph.positions - graph.positions[source], axis=1)
    best = {}
    queue = [(0, source)]
    while queue:
        length, cell = heapq.heappop(queue)
        if cell in best:
            continue
        best[cell] = length
        if gaps[cell] <= reach:
            for arc in range(graph.offsets[cell], graph.offsets[cell + 1]):
                step = int(graph.lengths[arc])
                heapq.heappush(queue, (length + step, int(graph.neighbors[arc])))
    row = np.full(graph.n_cells, np.inf, np.float32)
    for cell, length in best.items():
        if gaps[cell] <= reach:
            row[cell] = np.float32(length * graph.unit)
    return row


@pytest.fixture(scope="module")
def sheet():
    return shapes.bumpy_sheet(20)


@pytest.fixture(scope="module")
def sheet_graph(sheet):
    graph = build_face_graph(sheet)
    return graph.with_weights(superfacet_weights(sheet, graph, alpha=100))


@pytest.mark.parametrize("seed", range(4))
def test_path_lengths_are_those_of_scipy(seed):
    graph = shapes.random_graph(150, 180, seed)
    assert np.array_equal(path_lengths(graph, np.arange(150)), scipy_path_lengths(graph))
    sources = [149, 3, 3, 77]
    assert np.array_equal(path_lengths(graph, sources), scipy_path_lengths(graph)[sources])


def test_path_lengths_are_right_where_a_few_weights_are_huge(sheet_graph):
    weights = np.array(sheet_graph.weights)
    weights[np.random.default_rng(0).uniform(size=len(weights)) < 0.01] *= 1e6
    graph = CellGraph(
        sheet_graph.positions, sheet_graph.measures, sheet_graph.offsets, sheet_graph.neighbors,
        weights,
    )  # fmt: skip
    assert np.array_equal(path_lengths(graph, np.arange(800)), scipy_path_lengths(graph))


def test_paths_of_one_way_arcs_lead_one_way():
    chain = CellGraph([[x, 0, 0] for x in range(3)], [1] * 3, [0, 1, 2, 2], [1, 2], [1.0, 2.0])
    assert path_lengths(chain, [0, 1, 2]).tolist() == [
        [0, 1, 3],
        [np.inf, 0, 2],
        [np.inf, np.inf, 0],
    ]


@pytest.mark.parametrize("seed", range(3))
def test_near_path_lengths_are_those_of_halted_expansions(seed):
    graph = shapes.random_graph(120, 300, seed)
    for reach in (0.0, 0.5, 1.0):
        expected = [halted_lengths(graph, cell, reach) for cell in range(120)]
        assert np.array_equal(dense_path_lengths(graph, reach), expected)
    assert np.array_equal(dense_path_lengths(graph, 10.0), scipy_path_lengths(graph))


def test_path_lengths_from_no_cell_are_an_empty_array(sheet_graph):
    assert path_lengths(sheet_graph, []).shape == (0, 800)


@pytest.mark.parametrize("n", [300, 700])
def test_leading_eigenvectors_are_right_where_eigenvalues_are_shared(n):
    """In 700 dimensions, the 20 vectors come from a Krylov space; in 300, from all vectors."""
    rng = np.random.default_rng(1)
    values = np.repeat(1 / (1 + np.arange(n // 5)), 5)[:n]  # each five times
    basis = np.linalg.qr(rng.standard_normal((n, n)))[0]
    matrix = ((basis * values) @ basis.T).astype(np.float32)
    found, vectors = _leading_eigenvectors(matrix, 20)
    assert vectors.dtype == np.float32
    assert found == pytest.approx(values[:20], abs=2e-6)
    assert vectors.T @ vectors == pytest.approx(np.eye(20), abs=1e-5)
    assert matrix @ vectors == pytest.approx(vectors * found, abs=1e-4)


def test_eigenvalues_are_those_of_the_affinities(sheet, sheet_graph):
    lengths = scipy_path_lengths(sheet_graph).astype(np.float64)
    width = 0.1 * lengths[np.arange(256) * 800 // 256].mean()
    affinities = np.exp(-lengths / width)
    scale = 1 / np.sqrt(affinities.sum(axis=1))
    expected = np.linalg.eigvalsh(scale[:, None] * affinities * scale)[::-1][:20]
    embedding = affinity_embedding(sheet, 20)
    assert embedding.params["sigma_length"] == pytest.approx(width)
    assert embedding.eigenvalues == pytest.approx(expected, abs=1e-5)


def test_rows_are_labeled_by_the_axis_they_are_nearest_to_once_turned():
    labels = np.repeat([2, 0, 1], [5, 9, 6])
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    lengths = np.random.default_rng(1).uniform(0.1, 2, (20, 1))
    found = _discretize((lengths * np.eye(3)[labels] @ turn).astype(np.float32))
    assert len(np.unique(found)) == 3
    assert len(np.unique(3 * found + labels)) == 3


@every_reach
def test_two_blobs_are_cut_at_the_neck(reach):
    mesh = shapes.dumbbell()
    is_left = build_face_graph(mesh).positions[:, 0] < 0
    labels = normalized_cuts(mesh, 2, reach=reach).labels
    assert set(labels[is_left]).isdisjoint(labels[~is_left])


@every_reach
@pytest.mark.parametrize("k", [1, 2, 9, 40])
def test_k_regions_come_out_and_own_their_centers(sheet, reach, k):
    result = normalized_cuts(sheet, k, reach=reach)
    assert result.labels.dtype == result.centers.dtype == np.int32
    assert np.array_equal(result.labels[result.centers], np.arange(k))
    assert (result.n_iter, result.stop_reason) == (1, "converged")


@every_reach
def test_regions_are_compact(sheet, reach):
    """For most faces, at most two centers are nearer than that of their region."""
    result = normalized_cuts(sheet, 30, reach=reach)
    positions = build_face_graph(sheet).positions
    gaps = np.linalg.norm(positions[:, None] - positions[result.centers], axis=2)
    own = np.take_along_axis(gaps, result.labels[:, None].astype(np.int64), axis=1)
    assert np.mean(np.sum(gaps < own, axis=1) <= 2) > 0.95


def test_an_embedding_serves_every_number_of_regions():
    mesh = shapes.bumpy_sheet(8)  # all eigenvectors are computed, for any number of them
    embedding = affinity_embedding(mesh, 30)
    assert embedding.n_vectors == 30
    for k in (1, 7, 30):
        result = embedding.segment(k)
        assert np.array_equal(result.labels, normalized_cuts(mesh, k).labels)
        assert result.params["n_segments"] == k
    assert embedding.segment().n_segments == embedding.params["n_segments"] == 30
    assert "discretize" not in embedding.timings
    with pytest.raises(
        ValueError, match="n_segments must be at most 30, the number of eigenvectors, got 31"
    ):
        embedding.segment(31)


def test_stages_and_parameters_are_told(sheet):
    result = normalized_cuts(sheet, 5, sigma=0.2, reach=2)
    assert list(result.timings) == [
        "mesh", "face_graph", "weights", "distances", "eigenvectors", "discretize", "update",
    ]  # fmt: skip
    assert {**result.params, "sigma_length": None} == {
        "n_segments": 5, "weld": True, "weights": "superfacets", "alpha": 100.0, "eta_convex": 0.2,
        "method": "ncuts", "sigma": 0.2, "sigma_length": None, "reach": 2.0,
    }  # fmt: skip
    assert normalized_cuts(sheet, 5, weights="creases").params["alpha"] == 20


@every_reach
def test_labels_are_the_same_each_time_and_at_every_scale(sheet, reach):
    first = normalized_cuts(sheet, 20, reach=reach).labels
    assert np.array_equal(first, normalized_cuts(sheet, 20, reach=reach, n_threads=3).labels)
    scaled = Mesh(1024 * sheet.vertices, sheet.faces)
    assert np.array_equal(first, normalized_cuts(scaled, 20, reach=reach).labels)


@every_reach
@pytest.mark.parametrize("k", [1, 2, 3, 8])
def test_two_islands_never_share_a_region(k, reach):
    result = normalized_cuts(shapes.two_islands(), k, reach=reach)
    assert set(result.labels[:4]).isdisjoint(result.labels[4:])
    assert result.n_segments == max(k, 2)


@every_reach
def test_faces_without_neighbors_are_regions_of_their_own(reach):
    mesh = shapes.soup(shapes.cube())
    result = normalized_cuts(mesh, 5, weld=False, reach=reach)
    assert result.labels.tolist() == list(range(12))
    embedding = affinity_embedding(mesh, 5, weld=False, reach=reach)
    assert embedding.eigenvalues.tolist() == [1.0] * 12


@every_reach
@pytest.mark.parametrize("shape", [shapes.slivers, shapes.fins, shapes.moebius, shapes.bowtie])
def test_odd_meshes_are_divided_too(shape, reach):
    mesh = shape()
    for k in range(1, mesh.n_faces + 1):
        result = normalized_cuts(mesh, k, reach=reach)
        assert np.array_equal(np.unique(result.labels), np.arange(result.n_segments))


def test_as_many_regions_as_faces_are_single_faces():
    mesh = shapes.bumpy_sheet(4)
    assert np.array_equal(np.sort(normalized_cuts(mesh, 32).labels), np.arange(32))
    assert normalized_cuts(mesh).n_segments == 32  # fewer faces than the usual 150


def test_given_weights_count_both_ways(sheet, sheet_graph):
    sources = np.repeat(np.arange(800), np.diff(sheet_graph.offsets))
    one_way = np.where(sources < sheet_graph.neighbors, 1.5, 0.5)
    expected = normalized_cuts(sheet, 12).labels
    given = normalized_cuts(sheet, 12, weights=sheet_graph.weights * one_way)
    assert np.array_equal(given.labels, expected)
    assert given.params["weights"] == "given"


def test_all_weights_may_be_zero(sheet, sheet_graph):
    assert normalized_cuts(sheet, 3, weights=np.zeros(sheet_graph.n_arcs)).n_segments == 3


def test_a_small_benchmark_model_comes_in_30_regions(benchmark_paths):
    mesh = read_off(benchmark_paths[0])
    for reach in REACHES:
        assert normalized_cuts(mesh, 30, reach=reach).n_segments == 30


def test_too_much_memory_is_refused_with_the_size_it_would_take(sheet):
    with pytest.raises(ValueError, match=r"of 800 faces need 0\.00371 GB .* use reach=3"):
        normalized_cuts(sheet, 5, max_memory=2e6)
    with pytest.raises(ValueError, match=r"with reach=3 need .* use a smaller reach"):
        normalized_cuts(sheet, 5, reach=3, max_memory=2e6)
    assert normalized_cuts(sheet, 5, max_memory=1e7).n_segments == 5


def test_wrong_arguments_are_refused(sheet):
    with pytest.raises(
        ValueError, match="n_segments must be at most 800, the number of faces, got 801"
    ):
        normalized_cuts(sheet, 801)
    with pytest.raises(ValueError, match="sigma must be finite and positive"):
        normalized_cuts(sheet, 5, sigma=0)
    with pytest.raises(ValueError, match="reach must be finite and positive"):
        normalized_cuts(sheet, 5, reach=0)
    with pytest.raises(ValueError, match="max_memory must be finite and positive"):
        normalized_cuts(sheet, 5, max_memory=0)
    with pytest.raises(ValueError, match="alpha must be finite and not negative"):
        normalized_cuts(sheet, 5, alpha=-1)


def test_without_scipy_the_extra_is_named(monkeypatch, sheet):
    monkeypatch.setitem(sys.modules, "scipy.linalg", None)
    with pytest.raises(MissingExtraError, match="pip install --group research"):
        normalized_cuts(sheet, 5)
