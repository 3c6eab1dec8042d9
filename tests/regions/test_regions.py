"""Stage 5: each region is connected, and none is too small."""

import numpy as np
import pytest
import shapes
from models import read_off
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets.cleanup.edit import read_labeled


def roof(*angles):
    """Return a strip of squares of two triangles, bent by an angle (degrees) after each square."""
    return shapes.halved(shapes.row(*angles))


def check_edit(edit, labels, sources, n_joined, n_islands):
    assert edit.labels.tolist() == labels
    assert edit.sources.tolist() == sources
    assert (edit.n_joined, edit.n_islands) == (n_joined, n_islands)
    assert edit.labels.dtype == edit.sources.dtype == np.int32


def test_a_region_keeps_its_largest_piece():
    edit = sf.enforce_connectivity(shapes.strip(6), [0, 1, 1, 1, 0, 0])
    check_edit(edit, [1, 1, 1, 1, 0, 0], [0, 1], 1, 0)


def test_a_region_keeps_the_piece_of_its_center():
    edit = sf.enforce_connectivity(shapes.strip(6), [0, 1, 1, 1, 0, 0], centers=[0, 2])
    check_edit(edit, [0, 1, 1, 1, 1, 1], [0, 1], 1, 0)


def test_of_pieces_as_large_the_first_is_kept():
    edit = sf.enforce_connectivity(shapes.strip(4), [0, 1, 1, 0])
    check_edit(edit, [0, 1, 1, 1], [0, 1], 1, 0)


@pytest.mark.parametrize(("angles", "joined"), [((0, 0, 60, 0), 2), ((0, 0, 0, 60), 1)])
def test_a_piece_joins_over_a_plane_rather_than_a_crease(angles, joined):
    edit = sf.enforce_connectivity(roof(*angles), [0, 0, 0, 0, 1, 1, 0, 0, 2, 2])
    check_edit(edit, [0, 0, 0, 0, 1, 1, joined, joined, 2, 2], [0, 1, 2], 1, 0)


def test_pieces_inside_pieces_join_one_after_the_other():
    edit = sf.enforce_connectivity(shapes.strip(8), [0, 0, 0, 1, 2, 1, 1, 2], centers=[0, 6, 7])
    assert shapes.count_pieces(sf.build_face_graph(shapes.strip(8)), edit.labels) == 3
    assert edit.n_joined == 2


def test_a_piece_on_an_island_becomes_a_region():
    edit = sf.enforce_connectivity(shapes.two_islands(), [0, 0, 1, 1, 0, 0, 0, 0], centers=[0, 2])
    check_edit(edit, [0, 0, 1, 1, 2, 2, 2, 2], [0, 1, 0], 0, 1)


def test_connected_regions_stay_as_they_are():
    mesh = shapes.bumpy_sheet(8)
    labels = sf.segment(mesh, 9, smooth=False).labels
    edit = sf.enforce_connectivity(mesh, labels)
    check_edit(edit, labels.tolist(), list(range(9)), 0, 0)


@pytest.mark.parametrize(("angles", "joined"), [((0, 60, 0, 0), 1), ((0, 0, 60, 0), 0)])
def test_a_small_region_joins_over_a_plane_rather_than_a_crease(angles, joined):
    edit = sf.merge_small_regions(roof(*angles), [0, 0, 0, 0, 1, 1, 2, 2, 2, 2], 0.7)
    check_edit(edit, [0, 0, 0, 0, joined, joined, 1, 1, 1, 1], [0, 2], 1, 0)


def test_a_ridge_counts_as_a_plane():
    labels = [0, 0, 0, 0, 1, 1, 2, 2, 2, 2]
    edit = sf.merge_small_regions(roof(0, -60, 60, 0), labels, 0.7)
    assert edit.labels.tolist() == [0] * 6 + [1] * 4


def test_small_regions_join_until_they_are_large_enough():
    edit = sf.merge_small_regions(shapes.strip(8), [0, 1, 2, 3, 4, 4, 4, 4], 1.0)
    counts = np.bincount(edit.labels)
    assert (counts >= 8 / 5).all()
    assert edit.n_joined == 5 - len(counts)


def test_no_region_is_too_small_for_a_size_of_zero():
    mesh = shapes.bumpy_sheet(3)
    check_edit(sf.merge_small_regions(mesh, range(18), 0.0), list(range(18)), list(range(18)), 0, 0)


def test_all_regions_of_a_component_may_become_one():
    edit = sf.merge_small_regions(shapes.strip(5), [0, 1, 2, 3, 4], 100.0)
    assert edit.labels.tolist() == [0] * 5
    assert (edit.n_joined, edit.n_islands) == (4, 1)


def test_small_islands_stay_or_join_the_nearest_region():
    big = shapes.strip(8)
    speck = sf.Mesh([[9, 0, 0], [9.1, 0, 0], [9, 0.1, 0]], [[0, 1, 2]])
    mesh = shapes.together([big, speck])
    labels = [0] * 4 + [2] * 4 + [1]
    check_edit(sf.merge_small_regions(mesh, labels, 0.5), labels, [0, 1, 2], 0, 1)
    edit = sf.merge_small_regions(mesh, labels, 0.5, islands="nearest")
    check_edit(edit, [0] * 4 + [1] * 5, [0, 2], 1, 0)


def test_many_islands_join_the_nearest_region():
    """Compare with a search of all pairs: the lowest of the nearest."""
    rng = np.random.default_rng(0)
    n, positions = 400, rng.integers(0, 12, (400, 3)).astype(float)
    is_small = rng.uniform(size=n) < 0.5
    graph = sf.CellGraph(
        positions, np.where(is_small, 0.1, 1.0), np.zeros(n + 1, int), [], [],
        arc_measures=sf.ArcMeasures([]),
    )  # fmt: skip
    labels = rng.permutation(n)
    edit = sf.merge_small_regions(graph, labels, 0.5, islands="nearest")
    roots = labels.copy()
    for cell in np.flatnonzero(is_small):
        squares = np.square(positions - positions[cell]).sum(axis=1)
        roots[cell] = labels[np.argmin(np.where(is_small, np.inf, squares))]
    assert (edit.n_islands, edit.n_joined) == (0, np.count_nonzero(is_small))
    assert np.array_equal(edit.sources[edit.labels], roots)


def test_where_there_are_only_small_islands_they_stay():
    labels = [0] * 4 + [1] * 4
    edit = sf.merge_small_regions(shapes.two_islands(), labels, 2.0, islands="nearest")
    check_edit(edit, labels, [0, 1], 0, 2)


def test_faces_without_area_are_in_regions_too():
    mesh = shapes.slivers()
    assert sf.enforce_connectivity(mesh, [0, 0, 0, 0]).n_islands == 1
    line = sf.Mesh([[x, 0, 0] for x in range(4)], [[0, 1, 2], [1, 2, 3]])
    assert sf.merge_small_regions(line, [0, 1], 1.0).labels.tolist() == [0, 1]


def test_borders_are_the_same_for_any_number_of_threads():
    mesh = shapes.bumpy_sheet(128)
    labels = sf.segment(mesh, 50, smooth=False).labels
    tables = []
    for n_threads in (1, 3):
        _, costs, array, _ = read_labeled(mesh, labels, None, True, n_threads)
        tables.append(sf._core.region_borders(*costs.args, array, n_threads))
    for one, other in zip(*tables, strict=True):
        assert np.array_equal(one, other)


def test_borders_on_a_plane_are_as_long_as_their_edges():
    mesh = roof(0, 0)
    _, costs, labels, _ = read_labeled(mesh, [0, 0, 1, 1, 2, 2], None, True, 1)
    low, high, lengths = sf._core.region_borders(*costs.args, labels, 1)
    assert (low.tolist(), high.tolist()) == ([0, 1], [1, 2])
    assert lengths == pytest.approx([1.0, 1.0])


def test_of_regions_of_one_size_the_lowest_label_joins_first():
    """Each face of a strip joins the one across its longest side: 0 joins 1, 2 joins 3, ..."""
    edit = sf.merge_small_regions(shapes.strip(6), list(range(6)), 1.5)
    assert edit.labels.tolist() == [0, 0, 1, 1, 2, 2]
    assert edit.sources.tolist() == [1, 3, 5]


def test_random_labels_of_real_meshes_end_up_in_one_piece_each(benchmark_paths):
    for path in benchmark_paths[::24]:
        mesh = read_off(path)
        rng = np.random.default_rng(0)
        labels = sf.segment(mesh, 40, smooth=False).labels.copy()
        wrong = rng.random(mesh.n_faces) < 0.2
        labels[wrong] = rng.integers(0, 40, int(wrong.sum()))
        edit = sf.enforce_connectivity(mesh, labels)
        graph = sf.build_face_graph(mesh)
        assert shapes.count_pieces(graph, edit.labels) == len(edit.sources)
        merged = sf.merge_small_regions(mesh, edit.labels, 0.5)
        areas = np.bincount(merged.labels, graph.measures)
        n_small = np.count_nonzero(areas < 0.5 * graph.measures.sum() / len(edit.sources))
        assert n_small == merged.n_islands
        assert shapes.count_pieces(graph, merged.labels) == len(areas)


@pytest.mark.parametrize(("parameters", "error", "message"), [
    ({"labels": [0, 2, 0, 0]}, ValueError, "no cell has label 1"),
    ({"centers": [0]}, ValueError, r"centers must have one cell per region \(2\), got 1 cell"),
    ({"centers": [0, 1]}, ValueError,
     r"centers\[1\] must be a cell of region 1, got cell 1 of region 0"),
    ({"centers": [0, 7]}, ValueError, r"centers\[1\] must be 0 to 3, got 7"),
    ({"weights": [-1.0] * 6}, ValueError,
     r"weights\[0\] must be finite and not negative, got -1.0"),
])  # fmt: skip
def test_faults_in_what_is_to_be_connected_are_found(parameters, error, message):
    arguments = {"labels": [0, 0, 1, 1]} | parameters
    with pytest.raises(error, match=message):
        sf.enforce_connectivity(shapes.strip(4), arguments.pop("labels"), **arguments)


@pytest.mark.parametrize(("parameters", "error", "message"), [
    ({"min_size": -1.0}, ValueError, "min_size must be finite and not negative"),
    ({"min_size": "1"}, TypeError, "min_size must be a number"),
    ({"islands": "drown"}, ValueError, "islands must be one of keep, nearest"),
    ({"labels": [0.5] * 4}, TypeError, "labels must contain integers, got float64"),
])  # fmt: skip
def test_faults_in_what_is_to_be_merged_are_found(parameters, error, message):
    arguments = {"labels": [0, 0, 1, 1], "min_size": 0.5} | parameters
    with pytest.raises(error, match=message):
        sf.merge_small_regions(shapes.strip(4), **arguments)


def half_labeled(n=24):
    """Return a sheet labeled where x < 0.5, and that half as a mesh with labels and indices."""
    mesh = shapes.bumpy_sheet(n)
    faces = np.flatnonzero(mesh.vertices[mesh.faces].mean(axis=1)[:, 0] < 0.5)
    half = sf.Mesh(mesh.vertices, mesh.faces[faces])
    labels = np.random.default_rng(3).integers(0, 12, half.n_faces).astype(np.int32)
    whole = np.full(mesh.n_faces, -1, np.int32)
    whole[faces] = labels
    return mesh, whole, half, labels, faces


@pytest.mark.parametrize("has_centers", [False, True])
def test_cells_without_a_label_are_left_alone(has_centers):
    mesh, whole, half, labels, faces = half_labeled()
    centers = np.unique(labels, return_index=True)[1] if has_centers else None
    of_whole = None if centers is None else faces[centers]
    arcs = sf.build_face_graph(mesh)
    sources = np.repeat(np.arange(mesh.n_faces), np.diff(arcs.offsets))
    is_kept = (whole[sources] >= 0) & (whole[arcs.neighbors] >= 0)
    weights = np.random.default_rng(4).random(arcs.n_arcs)
    in_half = weights[is_kept] * arcs.diagonal / sf.build_face_graph(half).diagonal
    given = {"weights": weights}, {"weights": in_half}
    found = sf.enforce_connectivity(mesh, whole, centers=of_whole, **given[0])
    expected = sf.enforce_connectivity(half, labels, centers=centers, **given[1])
    assert_array_equal(found.labels[faces], expected.labels)
    assert found.n_joined == expected.n_joined > 0
    merged = sf.merge_small_regions(mesh, found.labels, 0.9, **given[0])
    of_half = sf.merge_small_regions(half, expected.labels, 0.9, **given[1])
    assert_array_equal(merged.labels[faces], of_half.labels)
    smooth = sf.smooth_borders(mesh, merged.labels, **given[0])
    assert_array_equal(smooth[faces], sf.smooth_borders(half, of_half.labels, **given[1]))
    for edited in (found.labels, merged.labels, smooth):
        assert_array_equal(edited < 0, whole < 0)


@pytest.mark.parametrize("function", [sf.enforce_connectivity, sf.smooth_borders])
def test_labels_that_are_all_missing_are_refused(function):
    with pytest.raises(
        ValueError, match="labels must contain at least one region, but all labels are -1"
    ):
        function(shapes.strip(4), [-1] * 4)
