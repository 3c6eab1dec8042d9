"""Labels transferred to points and to other meshes."""

import warnings

import numpy as np
import pytest
import reference
import shapes
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets.tools.sample import split_in_four

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
HOUSE = shapes.house()
COLUMN = sf.TetMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 1], [0.2, 0.2, -1]], [[0, 1, 2, 3], [0, 1, 2, 4]]
)


def with_labels(n_faces, seed=0, n_labels=5):
    return np.random.default_rng(seed).integers(-1, n_labels, n_faces)


def test_points_get_the_label_of_the_nearest_face():
    square = sf.Mesh(SQUARE, [[0, 1, 2], [0, 2, 3]])
    points = [[0.9, 0.1, 0.5], [0.1, 0.9, -0.5], [3, 0, 0], [0.5, 0.5, 0]]
    for target in (points, np.array(points), tuple(map(tuple, points))):
        assert sf.transfer(square, [7, 4], target).tolist() == [7, 4, 7, 7]
    with pytest.warns(sf.MismatchWarning, match="75% of the target is farther from the mesh than"):
        assert sf.transfer(square, [7, 4], sf.PointCloud(points)).tolist() == [7, 4, 7, 7]
    assert sf.transfer(square, [7, 4], points, max_distance=1).tolist() == [7, 4, -1, 7]
    assert sf.transfer(square, [-1, 4], points).tolist() == [-1, 4, -1, -1]
    assert sf.transfer(square, [7, 4], points[:2]).tolist() == [7, 4]  # a list, not an array
    assert sf.transfer(square, [7, 4], points).dtype == np.int32


def test_there_may_be_no_points():
    assert sf.transfer(shapes.cube(), np.zeros(12, int), np.empty((0, 3))).tolist() == []


@pytest.mark.parametrize(
    "mesh",
    [shapes.bumpy_sheet(12), shapes.cube(), shapes.gears(3), shapes.soup(shapes.cube()),
     shapes.moebius()],
    ids=["sheet", "cube", "gears", "soup", "moebius"],
)  # fmt: skip
def test_a_mesh_gets_its_own_labels_back(mesh):
    labels = with_labels(mesh.n_faces)
    assert_array_equal(sf.transfer(mesh, labels, mesh), labels)
    assert_array_equal(sf.transfer(mesh, labels, (mesh.vertices, mesh.faces)), labels)


def test_a_finer_mesh_and_back():
    mesh = shapes.bumpy_sheet(12)
    labels = with_labels(mesh.n_faces)
    fine = sf.Mesh(*split_in_four(mesh.vertices, mesh.faces))
    carried = sf.transfer(mesh, labels, fine)
    assert_array_equal(carried, np.repeat(labels, 4))
    assert_array_equal(sf.transfer(fine, carried, mesh), labels)


def test_a_coarse_face_gets_the_label_that_most_of_its_area_has():
    # A square of 8 x 8 x 2 faces with label 1 where x > 3/8, which is five eighths of the area.
    squares = shapes.squares(8)
    fine = sf.PolygonMesh(squares.vertices / 8, squares.offsets, squares.indices)
    x = fine.vertices[fine.indices.reshape(-1, 4), 0].mean(axis=1)
    coarse = sf.PolygonMesh.of_faces(SQUARE, [[0, 1, 2, 3]])
    for split, expected in [(3 / 8, 1), (5 / 8, 0), (0.5, 0)]:  # half and half is a tie
        assert sf.transfer(fine, (x > split).astype(int), coarse).tolist() == [expected]
    # The label for what is too far away counts like any other.
    beyond = sf.PolygonMesh.of_faces(np.multiply(SQUARE, [3, 1, 1]), [[0, 1, 2, 3]])
    with pytest.warns(sf.MismatchWarning):
        assert sf.transfer(fine, np.zeros(64, int), beyond).tolist() == [0]
    assert sf.transfer(fine, np.zeros(64, int), beyond, max_distance=0.1).tolist() == [-1]


def test_polygons_clouds_tetrahedra_and_graphs_have_labels_to_give():
    points = [[0.5, 0.5, 0.1], [0.5, 3, 0], [0.3, 0.1, 0.2], [0.3, 0.1, -0.2]]
    assert sf.transfer(HOUSE, [3, 8], points).tolist() == [3, 8, 3, 3]
    cloud = sf.PointCloud(SQUARE)
    assert sf.transfer(cloud, [0, 1, 2, 3], points, max_distance=2.5).tolist() == [0, 2, 0, 0]
    graph = sf.CellGraph(SQUARE, np.ones(4), np.zeros(5, int), [], [])
    assert sf.transfer(graph, [0, 1, 2, 3], points, max_distance=2.5).tolist() == [0, 2, 0, 0]
    assert sf.transfer(COLUMN, [5, 6], points).tolist() == [5, 5, 5, 6]


def test_all_kinds_take_labels():
    large = [[-9, -9, 0.5], [9, -9, 0.5], [0, 9, 0.5]]
    above = sf.Mesh([*large, *np.multiply(large, [1, 1, -1])], [[0, 1, 2], [3, 4, 5]])
    assert sf.transfer(above, [4, 2], COLUMN).tolist() == [4, 2]
    sheet = sf.Mesh(np.multiply(SQUARE, [1, 2, 1]), [[0, 1, 2], [0, 2, 3]])
    assert sf.transfer(sheet, [0, 1], HOUSE).tolist() == [0, 1]
    graph = sf.CellGraph([[0.9, 0.1, 0], [0.1, 0.9, 0]], [1, 1], [0, 0, 0], [], [])
    assert sf.transfer(sheet, [0, 1], graph).tolist() == [0, 1]


def test_tetrahedra_keep_their_labels_and_give_them_to_their_outside():
    rng = np.random.default_rng(0)
    outside = COLUMN.boundary()
    assert_array_equal(sf.transfer(COLUMN, [5, 6], outside.mesh), np.array([5, 6])[outside.sources])
    corners = rng.normal(size=(40, 4, 3)) * 0.1 + 10 * np.arange(40)[:, np.newaxis, np.newaxis]
    tets = sf.TetMesh(corners.reshape(-1, 3), np.arange(160).reshape(-1, 4))
    labels = with_labels(40)
    assert_array_equal(sf.transfer(tets, labels, tets), labels)


@pytest.mark.parametrize("n_threads", [1, 2, 3, 8])
def test_the_number_of_threads_does_not_matter(n_threads):
    fine, coarse = sf.sample_mesh(60_000), sf.sample_mesh(5_000)
    labels = with_labels(fine.n_faces, n_labels=300)
    one = sf.transfer(fine, labels, coarse, max_distance=0.01, n_threads=1)
    assert_array_equal(
        sf.transfer(fine, labels, coarse, max_distance=0.01, n_threads=n_threads), one
    )


def test_regions_of_a_coarse_bear_are_those_of_a_fine_one():
    fine, coarse = sf.sample_mesh(60_000), sf.sample_mesh(5_000)
    labels = sf.segment(coarse, 60).labels
    carried = sf.transfer(coarse, labels, fine)
    assert len(np.unique(carried)) == 60
    back = sf.transfer(fine, carried, coarse)
    areas = sf.build_face_graph(coarse).measures
    assert areas[back == labels].sum() > 0.98 * areas.sum()


def test_labels_of_random_points_are_those_of_a_comparison():
    rng = np.random.default_rng(5)
    mesh = shapes.gears(2)
    labels = with_labels(mesh.n_faces)
    points = rng.uniform(*mesh.bounds, (12, 3))
    expected = reference.nearest_faces(mesh.vertices, mesh.faces, points)[0]
    assert_array_equal(sf.transfer(mesh, labels, points), labels[expected])


def test_what_does_not_fit_is_refused():
    cube = shapes.cube()
    labels = np.zeros(12, int)
    with pytest.raises(
        ValueError, match=r"labels must have one value per cell \(12\), got 3 values"
    ):
        sf.transfer(cube, [0, 1, 2], cube)
    with pytest.raises(ValueError, match=r"labels\[0\] must be -1 to 2147483647, got -2"):
        sf.transfer(cube, labels - 2, cube)
    with pytest.raises(sf.MeshError, match=r"points\[0\] must be finite, got \[0.0, nan, 0.0\]"):
        sf.transfer(cube, labels, [[0, np.nan, 0]])
    with pytest.raises(sf.MeshError, match=r"points must have shape \(N, 3\), got \(0,\)"):
        sf.transfer(cube, labels, [])
    with pytest.raises(ValueError, match="max_distance must be finite and not negative"):
        sf.transfer(cube, labels, cube, max_distance=np.inf)
    with pytest.raises(ValueError, match="n_threads must be at least 1"):
        sf.transfer(cube, labels, cube, n_threads=0)
    with pytest.raises(
        TypeError,
        match=r"expected a mesh of superfacets, a \(vertices, faces\) pair, a path, or a"
        r" mesh of trimesh, PyVista \(PolyData\), Open3D or meshio, got dict",
    ):
        sf.transfer(cube, labels, {})


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_no_distance_is_left_between_a_mesh_and_itself(offset):
    mesh = shapes.bumpy_sheet(12)
    mesh = sf.Mesh(mesh.vertices + offset / 3, mesh.faces)
    labels = with_labels(mesh.n_faces)
    assert_array_equal(sf.transfer(mesh, labels, mesh, max_distance=0), labels)


@pytest.mark.parametrize("move", [0.0, 0.04, 0.2])
def test_a_target_in_another_place_is_warned_of(move):
    mesh = shapes.bumpy_sheet(12)
    labels = with_labels(mesh.n_faces)
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    target = sf.Mesh(mesh.vertices + [0, 0, move * diagonal], mesh.faces)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sf.transfer(mesh, labels, target)
    assert [warning.category for warning in caught] == [sf.MismatchWarning] * (move > 0.1)
    assert all(warning.filename == __file__ for warning in caught)
