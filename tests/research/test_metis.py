"""METIS on the weighted face graph: shapes with a known best cut, components, odd meshes."""

import sys

import numpy as np
import pytest
import shapes
from models import read_off
from research.baselines import metis_partition
from research.baselines.face_cells import Component
from research.baselines.metis import _cap, _merge_pairs, _parts_of_components, _whole_numbers

from superfacets import Mesh, MeshError, MissingExtraError, build_face_graph


def valley(n):
    """Return two squares of 2 n^2 faces that meet in the line x = 0 at a concave right angle."""
    x, y = np.meshgrid(np.arange(-n, n + 1.0), np.arange(n + 1.0), indexing="ij")
    vertices = np.stack([np.minimum(x, 0), y, np.maximum(x, 0)], axis=-1).reshape(-1, 3)
    corner = (np.arange(2 * n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return Mesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def test_two_blobs_are_cut_at_the_neck():
    mesh = shapes.dumbbell()
    is_left = build_face_graph(mesh).positions[:, 0] < 0
    labels = metis_partition(mesh, 2).labels
    assert set(labels[is_left]).isdisjoint(labels[~is_left])


def test_two_walls_are_cut_in_the_valley():
    mesh = valley(8)
    is_floor = build_face_graph(mesh).positions[:, 2] == 0
    labels = metis_partition(mesh, 2).labels
    assert set(labels[is_floor]).isdisjoint(labels[~is_floor])


def test_parts_are_numbered_without_gaps_and_own_their_centers():
    result = metis_partition(shapes.bumpy_sheet(20), 40)
    assert result.labels.dtype == result.centers.dtype == np.int32
    assert np.array_equal(result.labels[result.centers], np.arange(40))
    assert (result.n_iter, result.stop_reason) == (1, "converged")
    assert list(result.timings) == ["mesh", "face_graph", "weights", "partition", "update"]
    assert result.params["method"] == "metis"
    assert result.params["weights"] == "superfacets"
    assert result.params["alpha"] == 200.0


def test_parts_have_about_the_same_area():
    mesh = shapes.bumpy_sheet(30)
    areas = build_face_graph(mesh).measures
    sizes = np.bincount(metis_partition(mesh, 20).labels, areas)
    assert sizes.max() < 1.6 * sizes.mean()


def test_labels_are_the_same_each_time():
    mesh = shapes.bumpy_sheet(16)
    first = metis_partition(mesh, 30, n_threads=1).labels
    assert np.array_equal(first, metis_partition(mesh, 30, n_threads=3).labels)


def test_one_part_is_the_whole_mesh_and_as_many_as_faces_are_single_faces():
    mesh = shapes.bumpy_sheet(5)
    assert not metis_partition(mesh, 1).labels.any()
    assert np.array_equal(np.sort(metis_partition(mesh, mesh.n_faces).labels), np.arange(50))
    assert metis_partition(mesh).n_segments == 50  # one part per face, as k is 150 by default


@pytest.mark.parametrize("k", [1, 2, 3, 5, 8])
def test_two_islands_never_share_a_part(k):
    result = metis_partition(shapes.two_islands(), k)
    assert set(result.labels[:4]).isdisjoint(result.labels[4:])
    assert result.n_segments <= max(k, 2)


def test_more_components_than_parts_are_one_part_each():
    mesh = shapes.soup(shapes.cube())
    result = metis_partition(mesh, 5, weld=False)
    assert result.labels.tolist() == list(range(12))


def test_the_next_part_goes_to_the_component_of_most_area_per_part():
    assert _parts_of_components([6.0, 3.0, 1.0], [90, 90, 90], 10) == [6, 3, 1]
    assert _parts_of_components([6.0, 3.0, 1.0], [90, 90, 90], 2) == [1, 1, 1]
    assert _parts_of_components([6.0, 3.0, 1.0], [2, 90, 90], 8) == [2, 4, 2]
    assert _parts_of_components([0.0, 0.0], [3, 3], 5) == [3, 2]


def test_faces_that_share_several_edges_have_one_arc():
    pillow = Component(
        faces=np.arange(2),
        arcs=np.arange(6),
        offsets=np.array([0, 3, 6]),
        neighbors=np.array([1, 1, 1, 0, 0, 0], dtype=np.int32),
    )
    pairs = _merge_pairs(pillow, np.array([1, 2, 4, 4, 2, 1]))
    assert pairs.indptr.tolist() == [0, 1, 2]
    assert pairs.indices.tolist() == [1, 0]
    assert pairs.data.tolist() == [7, 7]


def test_faces_count_for_a_quarter_of_the_mean_part_at_most():
    areas = np.array([90.0, 1, 2, 1] + [1.0] * 20)
    capped = _cap(areas, 3)
    assert capped[1:].tolist() == areas[1:].tolist()
    assert capped[0] == pytest.approx(0.25 * capped.sum() / 3)
    assert _cap(areas[1:], 2).tolist() == areas[1:].tolist()
    assert _cap(areas, 6).tolist() == [1.0] * 24
    assert not _cap(np.zeros(24), 4).any()


def test_weights_become_whole_numbers_that_fit_into_31_bits():
    assert _whole_numbers(np.array([1.0, 3.0, 0.0])).tolist() == [750, 2250, 1]
    assert _whole_numbers(np.zeros(3)).tolist() == [1, 1, 1]
    assert _whole_numbers(np.ones(10_000_000)).sum() < 2**31


@pytest.mark.parametrize("shape", [shapes.slivers, shapes.fins, shapes.moebius, shapes.bowtie])
def test_odd_meshes_are_divided_too(shape):
    mesh = shape()
    for k in range(1, mesh.n_faces + 1):
        result = metis_partition(mesh, k)
        assert np.array_equal(np.unique(result.labels), np.arange(result.n_segments))


def test_faces_larger_than_a_part_leave_no_part_empty_and_the_terminal_clean(capfd):
    mesh = shapes.bumpy_sheet(24)
    stretched = Mesh(mesh.vertices * [1, 1, 0] + [0, 0, 0] + 40 * mesh.vertices**9, mesh.faces)
    areas = build_face_graph(stretched).measures
    assert areas.max() > 3 * areas.mean() * mesh.n_faces / 200
    assert metis_partition(stretched, 200).n_segments == 200
    assert capfd.readouterr() == ("", "")


def test_weights_can_be_given_and_both_ways_count():
    mesh = valley(6)
    graph = build_face_graph(mesh)
    x, y = graph.positions[:, 0] - graph.positions[:, 2], graph.positions[:, 1]
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    weights = np.where(((y[sources] < 3) != (y[graph.neighbors] < 3)), 50.0, 1.0)
    labels = metis_partition(mesh, 2, weights=weights).labels
    assert set(labels[y < 3]).isdisjoint(labels[y > 3])
    one_way = np.where(x[sources] + y[sources] < x[graph.neighbors] + y[graph.neighbors], 1.5, 0.5)
    assert np.array_equal(labels, metis_partition(mesh, 2, weights=weights * one_way).labels)
    assert metis_partition(mesh, 2, weights=np.zeros(graph.n_arcs)).n_segments == 2


def test_other_weights_go_by_name():
    mesh = valley(4)
    for name in ("parts", "creases"):
        assert metis_partition(mesh, 2, weights=name).params["weights"] == name


def test_a_small_benchmark_model(benchmark_paths):
    result = metis_partition(read_off(benchmark_paths[0]), 100)
    assert result.n_segments == 100


def test_wrong_arguments_are_refused():
    mesh = shapes.cube()
    with pytest.raises(
        ValueError, match="n_segments must be at most 12, the number of faces, got 13"
    ):
        metis_partition(mesh, 13)
    with pytest.raises(ValueError, match="alpha must be finite and not negative"):
        metis_partition(mesh, 2, alpha=-1)
    with pytest.raises(MeshError):
        metis_partition(([[0, 0, 0]], [[0, 0, 1]]), 1)


def test_without_pymetis_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymetis", None)
    with pytest.raises(MissingExtraError, match="pip install --group research"):
        metis_partition(shapes.cube(), 2)


def test_edges_whose_lengths_underflow_cost_nothing_without_a_warning():
    tiny = 1e-170
    vertices = [[0, 0, 0], [tiny, 0, 0], [0, 1, 0], [0, -1, 0], [0, -1, 1]]
    assert metis_partition(Mesh(vertices, [[0, 1, 2], [1, 0, 3]]), 2).n_segments == 2
    mixed = Mesh(vertices, [[0, 1, 2], [1, 0, 3], [0, 4, 3]])
    assert len(metis_partition(mixed, 2).labels) == 3  # METIS may leave a part empty
