"""Labels of vertices: small meshes, and the rule applied to one vertex at a time."""

from functools import partial

import numpy as np
import pytest
import shapes
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets.graph.sums import weighted_majority
from superfacets.regions.vertices import MIN_IN_FILES, vertex_ids
from superfacets_formats.tet_mesh import signed_volumes
from superfacets_scans import project_labels

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def naive_vertex_labels(n_vertices, cells, measures, labels):
    """Reference: apply the rule to one vertex at a time."""
    found = []
    for vertex in range(n_vertices):
        weights = {}
        for cell, measure, label in zip(cells, measures, labels, strict=True):
            if vertex in cell and label >= 0:
                weights[label] = weights.get(label, 0.0) + measure
        found.append(min(weights, key=lambda x: (-weights[x], x), default=-1))
    return found


def test_the_label_with_the_larger_area_wins_and_the_lower_of_equals():
    #  3---2      4
    #  | / |  \
    #  0---1----- 5 (far to the right): the face 1 5 2 is larger than both others
    mesh = sf.Mesh([*SQUARE, [9, 9, 9], [3, 0, 0]], [[0, 1, 2], [0, 2, 3], [1, 5, 2]])
    assert sf.vertex_labels(mesh, [7, 4, 9], method="majority").tolist() == [4, 9, 9, 4, -1, 9]
    # The two halves of the square together are as large as the third face: a tie at vertex 2.
    assert sf.vertex_labels(mesh, [7, 7, 9], method="majority").tolist() == [7, 9, 7, 7, -1, 9]


def test_faces_without_a_label_do_not_count():
    mesh = sf.Mesh([*SQUARE, [3, 0, 0]], [[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    assert sf.vertex_labels(mesh, [7, -1, -1], method="majority").tolist() == [7, 7, 7, -1, -1]


def test_faces_without_an_area_count_where_there_are_no_others():
    mesh = sf.Mesh([*SQUARE, [2, 0, 0]], [[0, 1, 2], [0, 2, 3], [1, 4, 4], [4, 1, 4]])
    assert sf.vertex_labels(mesh, [7, 7, 5, 3], method="majority").tolist() == [7, 7, 7, 7, 3]


def test_vertices_at_one_position_are_two():
    soup = shapes.soup(shapes.strip(4))
    assert (
        sf.vertex_labels(soup, [3, 2, 1, 0], method="majority").tolist()
        == [3] * 3 + [2] * 3 + [1] * 3 + [0] * 3
    )


def test_polygons_and_tetrahedra_vote_by_area_and_volume():
    assert sf.vertex_labels(shapes.house(), [5, 2], method="majority").tolist() == [5, 5, 5, 5, 2]
    tets = sf.TetMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -2], [5, 5, 5]],
        [[0, 1, 2, 3], [0, 1, 2, 4]],  # volumes 1/6, and 1/3 inside out
    )
    assert sf.vertex_labels(tets, [1, 2], method="majority").tolist() == [2, 2, 2, 1, 2, -1]


def test_points_keep_their_labels():
    assert sf.vertex_labels(np.array(SQUARE, float), [3, -1, 3, 0], method="majority").tolist() == [
        3, -1, 3, 0,
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_rule_on_random_labels(seed):
    rng = np.random.default_rng(seed)
    sheet = shapes.bumpy_sheet(8, seed)
    areas = sf.build_face_graph(sheet).measures
    labels = rng.integers(-1, 4, sheet.n_faces)
    expected = naive_vertex_labels(sheet.n_vertices, sheet.faces.tolist(), areas, labels)
    assert sf.vertex_labels(sheet, labels, method="majority").tolist() == expected
    tets = sf.TetMesh(
        rng.normal(size=(12, 3)), rng.permuted(np.tile(range(12), (30, 1)), axis=1)[:, :4]
    )
    labels = rng.integers(-1, 3, 30)
    volumes = np.abs(signed_volumes(tets))
    expected = naive_vertex_labels(12, tets.tets.tolist(), volumes, labels)
    assert sf.vertex_labels(tets, labels, method="majority").tolist() == expected


def test_each_region_has_an_id_while_there_are_vertices():
    sheet = shapes.bumpy_sheet(6)
    labels = np.full(sheet.n_faces, 2**31 - 1)
    labels[[10, 40]] = 5, 9  # all other faces at their vertices have the largest label
    ids = vertex_ids(sheet, labels.astype(np.int32))
    assert [*np.unique(ids)] == [5, 9, 2**31 - 1]
    # The 49 vertices suffice for two regions of 20: the largest keeps 28, and region 5 gets 20.
    assert [np.count_nonzero(ids == region) for region in (5, 9)] == [MIN_IN_FILES, 1]
    assert {*sheet.faces[10]} & {*np.flatnonzero(ids == 5)}
    assert np.flatnonzero(ids == 9)[0] in sheet.faces[40]


def test_ids_of_polygons_tetrahedra_and_points_are_alike():
    quads = shapes.squares(4)
    labels = np.zeros(quads.n_faces, np.int32)
    labels[5] = 1
    assert 1 not in sf.vertex_labels(quads, labels, method="majority")
    assert np.count_nonzero(vertex_ids(quads, labels) == 1) == 1
    tets = sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [3, 3, 3]],
                      [[1, 2, 3, 4], [0, 1, 2, 3]])  # fmt: skip
    assert {*vertex_ids(tets, np.array([3, 8], np.int32)).tolist()} == {3, 8}
    cloud = sf.PointCloud(quads.vertices)
    assert_array_equal(vertex_ids(cloud, np.arange(25, dtype=np.int32)), np.arange(25))


def test_labels_are_checked():
    mesh = shapes.strip(3)
    with pytest.raises(
        ValueError, match=r"labels must have one value per cell \(3\), got 2 values"
    ):
        sf.vertex_labels(mesh, [0, 1], method="majority")
    with pytest.raises(ValueError, match=r"labels\[1\] must be -1 to 2147483647, got -2"):
        sf.vertex_labels(mesh, [0, -2, 1], method="majority")
    with pytest.raises(ValueError, match=r"labels\[2\] must be -1 to 2147483647, got 4294967296"):
        sf.vertex_labels(mesh, [0, 1, 2**32], method="majority")
    with pytest.raises(TypeError, match="labels must contain integers, got float64"):
        sf.vertex_labels(mesh, [0.0, 1.0, 2.0], method="majority")


def test_a_majority_takes_labels_up_to_the_largest():
    groups, labels = np.array([0, 0, 1, 1, 1]), np.array([2**31 - 1, -1, 5, 2**31 - 1, 5])
    weights = np.array([2.0, 1.0, 1.0, 1.5, 1.0])
    found = weighted_majority(groups, labels.astype(np.int32), weights, 2).winners
    assert found.tolist() == [2**31 - 1, 5]


def test_a_face_gets_the_most_frequent_label_of_its_corners():
    mesh = shapes.strip(3)
    of_vertices = np.arange(mesh.n_vertices) // 2 + 5
    a, b, c = of_vertices[mesh.faces].T
    expected = np.where(b == c, b, np.where((a == b) | (a == c), a, of_vertices[mesh.faces].min(1)))
    found = sf.face_labels(mesh, of_vertices)
    assert found.dtype == np.int32
    assert_array_equal(found, expected)
    assert sf.face_labels(mesh, [-1, -1, -1, 4, 4]).tolist() == [-1, -1, 4]


def test_labels_of_vertices_of_polygons_tetrahedra_and_points_are_converted():
    quad = sf.PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    assert sf.face_labels(quad, [3, 2, 3, 2]).tolist() == [2]
    tet = sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    assert sf.face_labels(tet, [3, 3, 3, 2]).tolist() == [3]
    assert sf.face_labels(np.eye(3), [3, -1, 2]).tolist() == [3, -1, 2]


def test_labels_of_vertices_are_checked():
    mesh = shapes.strip(3)
    with pytest.raises(
        ValueError, match=r"vertex_labels must have one value per vertex \(5\), got 3 values"
    ):
        sf.face_labels(mesh, [0, 1, 0])
    with pytest.raises(ValueError, match=r"vertex_labels\[1\] must be -1 to 2147483647, got -2"):
        sf.face_labels(mesh, [0, -2, 1, 0, 0])


def test_the_graph_of_superpoints_has_their_pairs():
    mesh = shapes.bumpy_sheet(24)
    regions = sf.segment(mesh, 9).labels
    of_vertices = sf.vertex_labels(mesh, regions, method="creases", min_vertices=20)
    graph = sf.region_graph(mesh, of_vertices)
    assert_array_equal(graph.labels, sf.face_labels(mesh, of_vertices))
    ends = of_vertices[np.concatenate([np.roll(mesh.faces, i, 1)[:, :2] for i in range(3)])]
    expected = {tuple(pair) for pair in np.sort(ends).tolist() if pair[0] != pair[1]}
    assert {tuple(pair) for pair in graph.edge_index.T.tolist()} == expected
    assert graph.areas.sum() == pytest.approx(sf.region_graph(mesh, regions).areas.sum())


def test_each_superpoint_is_a_node_even_if_no_face_has_most_of_its_corners():
    mesh = shapes.bumpy_sheet(6)
    superpoints = np.zeros(49, int)
    superpoints[[24, 30, 33]], superpoints[42:] = (1, 2, 3), 4
    with pytest.raises(ValueError, match="or pass labels of vertices to superfacets"):
        sf.region_graph(mesh, sf.face_labels(mesh, superpoints))  # no face has label 1
    graph = sf.region_graph(mesh, superpoints)
    assert graph.cell_counts.tolist() == [63, 1, 1, 1, 6]
    assert graph.neighbors(0).tolist() == [1, 2, 3, 4]
    assert all(i in mesh.faces[graph.labels == k] for k, i in ((1, 24), (2, 30), (3, 33)))


@pytest.mark.parametrize("make", [sf.Mesh, sf.PolygonMesh.of_faces, sf.TetMesh])
def test_a_superpoint_that_gets_no_cell_has_the_mean_of_its_vertices(make):
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1], [4, 0, 0], [6, 0, 0]]
    graph = sf.region_graph(make(points, [range(3 + (make != sf.Mesh))]), [0, 0, 0, 2, 1, 1])
    n_pairs = int(make != sf.Mesh)  # the last corner has the label 2, but no cell
    assert (graph.labels.tolist(), graph.n_arcs) == ([0], n_pairs)
    assert (graph.border_lengths.tolist(), graph.neighbors(2).size) == ([0.0] * n_pairs, n_pairs)
    assert np.isnan([graph.mean_angles, graph.max_angles, graph.concavities]).all()
    assert graph.centroids[1:].tolist() == [[5, 0, 0], [0, 1, 1]]
    assert [*graph.cell_counts, *graph.centers, *graph.measures[1:]] == [1, 0, 0, 0, -1, -1, 0, 0]


def test_images_of_labels_of_vertices_name_labels_of_faces():
    mesh = shapes.bumpy_sheet(4)
    with pytest.raises(ValueError, match=r"For one label per vertex, .* superfacets.face_labels"):
        project_labels(mesh, np.zeros(mesh.n_vertices, int), [])


def test_the_default_is_what_files_get(tmp_path):
    mesh = sf.sample_mesh(5000)
    labels = sf.segment(mesh, 100).labels  # some regions have to grow to 20 vertices
    sf.write_mesh(tmp_path / "a.segs.json", mesh, labels)
    assert np.array_equal(sf.vertex_labels(mesh, labels), sf.read_labels(tmp_path / "a.segs.json"))
    sf.write_mesh(tmp_path / "a.ply", mesh, labels, vertex_labels=True)
    stored = sf.read_attributes(tmp_path / "a.ply").vertex["label"]
    assert np.array_equal(stored, sf.vertex_labels(mesh, labels))


@pytest.mark.parametrize("method", ["creases", "majority"])
def test_vertices_keep_to_the_cells_on_their_side_of_barriers(method, tmp_path):
    mesh = sf.sample_mesh(5000)
    areas = np.digitize(mesh.vertices[:, 2], [-0.3, 0, 0.3]) - 1
    parcels = sf.segment(mesh, 40, barriers=areas, mask=areas >= 0, islands="nearest")
    labeled = partial(sf.vertex_labels, mesh, method=method)
    found = labeled(parcels)
    assert np.array_equal(labeled(parcels.labels, barriers=areas.tolist()), found)
    area_of = sf.pool(parcels, sf.face_labels(mesh, areas), how="majority", mesh=mesh)
    assert np.array_equal(area_of[found[found >= 0]], areas[found >= 0])
    if method != "majority":  # where faces vote, a region may win no vertex
        assert np.array_equal(np.unique(found[found >= 0]), np.arange(parcels.n_segments))
    assert (labeled(parcels.labels) != found).any()
    for ending in ("annot", "ply"):
        sf.write_mesh(tmp_path / f"a.{ending}", mesh, parcels, vertex_labels=ending == "ply")
    stored = sf.read_attributes(tmp_path / "a.ply").vertex["label"]
    masked = labeled(parcels.labels, barriers=areas >= 0)
    for labels in (found, masked, stored, sf.read_labels(tmp_path / "a.annot")):
        assert np.array_equal(labels >= 0, areas >= 0)
    with pytest.raises(ValueError, match="barriers must have one value per vertex"):
        sf.vertex_labels(mesh, parcels, barriers=area_of)


@pytest.mark.parametrize("ending", [".annot", ".label.gii", ".segs.json", ".bin"])
def test_labels_of_vertices_are_written_as_given_where_files_store_them(tmp_path, ending):
    mesh = sf.sample_mesh(3000)
    labels = np.arange(mesh.n_vertices) // 500 - (ending in (".annot", ".label.gii"))
    path = tmp_path / f"a{ending}"
    sf.write_mesh(path, mesh, labels)
    found = np.fromfile(path, "<i8") if ending == ".bin" else sf.read_labels(path)
    assert np.array_equal(found, labels)
    with pytest.raises(sf.MeshError, match="labels must have one value per cell"):
        sf.write_mesh(tmp_path / "a.ply", mesh, labels)
