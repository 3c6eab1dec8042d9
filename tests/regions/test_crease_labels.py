"""Labels of vertices that follow creases: their properties on scans, and each step of the rule."""

import warnings

import numpy as np
import pytest
import reference
import shapes
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets import _core
from superfacets.mesh.faces import mean_normals, vertex_graph


def along_creases(mesh, labels, **options):
    return sf.vertex_labels(mesh, labels, method="creases", **{"min_vertices": 1} | options)


def regions_of(mesh, n_regions):
    """Return the labels of `segment`, in which each speck is a region too."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        return sf.segment(mesh, n_regions).labels


def sides_of(mesh):
    """Return the edges as pairs (a, b) with a < b."""
    ends = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return [*map(tuple, np.unique(np.sort(ends, axis=1), axis=0).tolist())]


def pieces_of(mesh, of_vertices):
    """Return the number of connected pieces of all labels, counting only vertices of faces."""
    graph = vertex_graph(mesh, np.arange(mesh.n_vertices, dtype=np.int32), 1)
    n_unused = mesh.n_vertices - len(np.unique(mesh.faces))
    return shapes.count_pieces(graph, of_vertices) - n_unused


def sheet_of(n, height=0.0):
    """Return a sheet of 2 n^2 faces around x = 0 that rises with slope `height` where x > 0."""
    sheet = shapes.bumpy_sheet(n)
    y, x = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1))
    z = height * np.maximum(x, 0)
    return sf.Mesh(np.stack([x, y, z], axis=2).reshape(-1, 3), sheet.faces)


def test_a_border_beside_a_concave_crease_moves_into_it():
    sheet = sheet_of(16, height=2.0)
    x, y = sheet.vertices[sheet.faces].mean(axis=1)[:, :2].T
    labels = (x > np.where(y > 0, 0.15, -0.15)).astype(int)
    off_crease = np.abs(sheet.vertices[:, 0]) > 0.01
    side = sheet.vertices[off_crease, 0] > 0
    assert (sf.vertex_labels(sheet, labels, method="majority")[off_crease] != side).any()
    assert_array_equal(along_creases(sheet, labels)[off_crease], side)


def test_a_plane_keeps_the_majority_where_it_is_connected():
    sheet = sheet_of(16)
    x, y = sheet.vertices[sheet.faces].mean(axis=1)[:, :2].T
    labels = (x > 0.3 * y) + 2 * (y > 0.2)
    assert_array_equal(
        along_creases(sheet, labels), sf.vertex_labels(sheet, labels, method="majority")
    )


def test_vertices_get_a_label_of_their_faces():
    sheet = shapes.bumpy_sheet(20)
    labels = sf.segment(sheet, 20).labels
    is_own = along_creases(sheet, labels)[sheet.faces] == labels[:, np.newaxis]
    assert_array_equal(np.unique(sheet.faces[is_own]), np.arange(sheet.n_vertices))


@pytest.mark.parametrize("seed", range(12))
def test_regions_of_scans_are_connected_and_none_is_lost(seed):
    mesh = shapes.scan(seed)
    labels = regions_of(mesh, 1 + mesh.n_faces // 20)
    for options in ({}, {"min_vertices": 8}):
        found = along_creases(mesh, labels, **options)
        used = np.unique(mesh.faces)
        assert_array_equal(np.unique(found[used]), np.unique(labels))
        assert (np.delete(found, used) == -1).all()
        assert pieces_of(mesh, found) == labels.max() + 1
        assert_array_equal(found, along_creases(mesh, labels, **options, n_threads=3))


def test_the_majority_loses_and_breaks_regions_that_creases_keep():
    n_lost = n_pieces_more = 0
    for seed in range(12):
        mesh = shapes.scan(seed)
        labels = regions_of(mesh, 1 + mesh.n_faces // 8)
        found = sf.vertex_labels(mesh, labels, method="majority")
        n_labels = len(np.unique(found[found >= 0]))
        n_lost += labels.max() + 1 - n_labels
        n_pieces_more += pieces_of(mesh, found) - n_labels
    assert n_lost > 0
    assert n_pieces_more > 0


@pytest.mark.parametrize("seed", range(6))
def test_labels_spread_as_in_the_twin(seed):
    rng = np.random.default_rng(seed)
    mesh = [shapes.bumpy_sheet(7, seed), sheet_of(7), sheet_of(7, height=1.0)][seed % 3]
    positions, normals = mesh.vertices, reference.mean_normals(mesh)
    identity = np.arange(mesh.n_vertices, dtype=np.int32)
    assert_array_equal(mean_normals(mesh, identity), normals)
    labels = rng.integers(0, 4, mesh.n_vertices).astype(np.int32)
    labels[rng.random(mesh.n_vertices) < 0.8] = -1
    hints = rng.integers(0, 3, mesh.n_vertices).astype(np.int32)
    offsets, neighbors, _ = vertex_graph(mesh, identity, 1)
    chosen = rng.random((mesh.n_vertices, 4)) < 0.8
    keys = np.flatnonzero(chosen)
    found = _core.spread_labels(offsets, neighbors, positions, normals, labels, hints, keys, 4)
    allowed = [set(np.flatnonzero(row).tolist()) for row in chosen]
    expected = reference.spread_labels(sides_of(mesh), positions, normals, labels, hints, allowed)
    assert_array_equal(found, expected)


def test_small_regions_grow_to_the_minimum_or_stay_as_they_are():
    sheet = shapes.bumpy_sheet(20)
    labels = np.zeros(sheet.n_faces, int)
    labels[[10, 333, 700]] = 1, 2, 3
    assert (np.bincount(along_creases(sheet, labels))[1:] < 4).all()
    grown = along_creases(sheet, labels, min_vertices=15)
    assert np.bincount(grown).tolist()[1:] == [15, 15, 15]
    assert pieces_of(sheet, grown) == 4
    # No neighboring label has as many vertices to spare.
    all_of_them = along_creases(sheet, labels, min_vertices=sheet.n_vertices)
    assert_array_equal(all_of_them, along_creases(sheet, labels))


def test_no_region_is_cut_by_another_that_grows():
    # 1 - 2 - 3 - 4 - 5: a line of vertices; without one of the middle ones, it is in two pieces
    offsets, neighbors = np.array([0, 1, 3, 5, 7, 8]), np.array([1, 0, 2, 1, 3, 2, 4, 3], np.int32)
    line = (np.zeros((5, 3)), np.zeros((5, 3)))
    labels = np.array([0, 0, 1, 0, 0], np.int32)
    ones = np.ones(5, np.int32)
    grown = _core.grow_small_regions(offsets, neighbors, *line, labels, ones, 2, 2)
    assert_array_equal(grown, [0, 1, 1, 0, 0])  # region 0 is in two pieces already
    labels = np.array([0, 0, 0, 0, 1], np.int32)
    grown = _core.grow_small_regions(offsets, neighbors, *line, labels, ones, 2, 2)
    assert_array_equal(grown, [0, 0, 0, 1, 1])
    labels = np.array([0, 1, 1, 1, 2], np.int32)
    merged = _core.merge_small_regions(offsets, neighbors, *line, labels, ones, 3, 2)
    assert_array_equal(merged, [0, 0, 0, 0, 0])


def test_pieces_of_one_label_that_share_no_edge_all_stay():
    sheet = sheet_of(12)
    x = sheet.vertices[sheet.faces].mean(axis=1)[:, 0]
    labels = np.where(np.abs(x) < 0.4, 1, 0)  # label 0 on both sides
    found = along_creases(sheet, labels)
    assert {*found[sheet.vertices[:, 0] < -0.8], *found[sheet.vertices[:, 0] > 0.8]} == {0}
    assert pieces_of(sheet, found) == 3


def test_a_region_gives_its_only_vertex_where_it_gets_another():
    #  2---3
    # | \ |  two faces in front, two behind: regions 5 and 7 share three corners, so do 6 and 8
    #  0---1
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    mesh = sf.Mesh(vertices, [[0, 1, 2], [1, 3, 2], [0, 2, 1], [1, 2, 3]])
    assert {*along_creases(mesh, [5, 6, 7, 8])} == {5, 6, 7, 8}
    mesh = sf.Mesh(vertices, [[0, 1, 2], [0, 1, 2], [0, 2, 1], [2, 1, 0]])
    found = along_creases(mesh, [5, 6, 7, 8])
    assert len({*found[:3]}) == 3
    assert found[3] == -1


def test_a_component_that_is_all_border_keeps_the_majority():
    sheet, speck = sheet_of(8), sf.Mesh([[9, 0, 0], [9, 1, 0], [8, 0, 0]], [[0, 1, 2], [0, 1, 2]])
    mesh = shapes.together([sheet, speck])
    labels = np.concatenate([np.arange(sheet.n_faces) // 64, [1, 0]])
    assert_array_equal(along_creases(mesh, labels)[-3:], [0, 0, 0])


def test_cells_without_a_label_take_no_part():
    sheet = sheet_of(8)
    x = sheet.vertices[sheet.faces].mean(axis=1)[:, 0]
    labels = np.where(x < -0.5, 4, np.where(x > 0.5, 9, -1))
    found = along_creases(sheet, labels)
    assert_array_equal(found, sf.vertex_labels(sheet, labels, method="majority"))
    assert {*found} == {-1, 4, 9}
    assert (along_creases(sheet, np.full(sheet.n_faces, -1)) == -1).all()


def test_vertices_at_one_position_have_one_label():
    sheet = shapes.bumpy_sheet(8)
    labels = sf.segment(sheet, 6).labels
    soup = shapes.soup(sheet)
    assert_array_equal(
        along_creases(soup, labels), along_creases(sheet, labels)[sheet.faces.ravel()]
    )


def test_polygons_and_tetrahedra_have_connected_regions():
    squares = shapes.squares(8)
    points = squares.vertices + np.maximum(squares.vertices[:, :1] - 4, 0) * [0, 0, 1]
    quads = sf.PolygonMesh(points, squares.offsets, squares.indices)
    labels = (np.arange(64) % 8 > 3) + 2 * (np.arange(64) > 40)
    found = along_creases(quads, labels)
    assert {*found} == {0, 1, 2, 3}
    assert pieces_of_cells(quads, found) == 4
    tets = sf.TetMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -2], [5, 5, 5]],
        [[0, 1, 2, 3], [0, 1, 2, 4]],
    )
    assert along_creases(tets, [1, 2]).tolist() == [2, 2, 2, 1, 2, -1]
    assert along_creases(points, [3] * 81).tolist() == [3] * 81  # unchanged


def pieces_of_cells(mesh, of_vertices):
    identity = np.arange(mesh.n_vertices, dtype=np.int32)
    return shapes.count_pieces(vertex_graph(mesh, identity, 1), of_vertices)


def test_the_options_are_checked():
    mesh = shapes.strip(3)
    with pytest.raises(ValueError, match="method must be one of creases, majority, got 'crease'"):
        sf.vertex_labels(mesh, [0, 0, 1], method="crease")
    with pytest.raises(
        ValueError,
        match="min_vertices must be 1 with method='majority', got 2: use method='creases'",
    ):
        sf.vertex_labels(mesh, [0, 0, 1], min_vertices=2, method="majority")
    with pytest.raises(ValueError, match="min_vertices must be at least 1, got 0"):
        along_creases(mesh, [0, 0, 1], min_vertices=0)


@pytest.mark.parametrize("seed", range(30))
def test_vertices_are_shared_as_in_the_twin_and_with_as_many_regions_as_possible(seed):
    sparse = pytest.importorskip("scipy.sparse")
    csgraph = pytest.importorskip("scipy.sparse.csgraph")
    rng = np.random.default_rng(seed)
    n, n_vertices = int(rng.integers(1, 60)), int(rng.integers(1, 60))
    pairs = np.unique(rng.integers(0, [n, n_vertices], (int(rng.integers(1, 200)), 2)), axis=0)
    labels, vertices = pairs.astype(np.int32).T.copy()
    winners = np.full(n_vertices, -1, np.int32)
    winners[vertices] = labels  # the highest label at each vertex
    corners = [vertices[labels == region].tolist() for region in range(n)]
    found = _core.share_vertices(vertices, labels, winners, n, 2)
    assert found.tolist() == reference.share_vertices(corners, winners.tolist())
    table = sparse.csr_matrix((np.ones(len(pairs)), (labels, vertices)), (n, n_vertices))
    matched = csgraph.maximum_bipartite_matching(table, perm_type="column")
    assert len({*found.tolist()} - {-1}) == np.count_nonzero(matched >= 0)
