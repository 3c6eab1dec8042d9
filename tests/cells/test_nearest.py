"""The nearest face, point or tetrahedron, compared with values by hand and the reference."""

import itertools
import math

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from reference.spatial import nearest_faces, nearest_in_tet, nearest_on_triangle, nearest_tets

import superfacets as sf
from superfacets import _core

TRIANGLE = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


@pytest.mark.parametrize(("point", "nearest"), [
    ([1, 1, 5], [1, 1, 0]),  # above
    ([1, 1, 0], [1, 1, 0]),  # in it
    ([2, -3, 1], [2, 0, 0]),  # beyond each side
    ([-3, 2, -1], [0, 2, 0]),
    ([4, 4, 2], [2, 2, 0]),
    ([-1, -2, 3], [0, 0, 0]),  # beyond each corner
    ([9, -1, 0], [4, 0, 0]),
    ([-1, 9, 7], [0, 4, 0]),
    ([2, 0, 0], [2, 0, 0]),  # on a side, and at a corner
    ([0, 4, 0], [0, 4, 0]),
])  # fmt: skip
def test_the_nearest_point_of_a_triangle_by_hand(point, nearest):
    point = np.array(point, float)
    for corners in itertools.permutations(TRIANGLE):
        assert nearest_on_triangle(point, np.array(corners)).tolist() == nearest
        found = sf.nearest_faces((np.array(corners), [[0, 1, 2]]), [point])
        assert found.points.tolist() == [nearest]
        assert found.faces.tolist() == [0]
        assert found.distances[0] == math.dist(point, nearest)


@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_a_triangle_is_nearer(seed):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(3, 3)) * [[1], [1], [10.0 ** -rng.integers(0, 12)]]
    a, b = np.sort(rng.random((2, 20_000)), axis=0)
    samples = np.stack([a, b - a, 1 - b], axis=1) @ corners
    for point in 2 * rng.normal(size=(20, 3)):
        nearest = nearest_on_triangle(point, corners)
        best = np.linalg.norm(samples - point, axis=1).min()
        assert best - 0.1 <= math.dist(point, nearest) <= best + 1e-12
        # The nearest point is in the triangle.
        shares, *_ = np.linalg.lstsq(np.vstack([corners.T, np.ones(3)]), [*nearest, 1], rcond=None)
        assert_allclose(shares @ corners, nearest, atol=1e-12)
        assert shares.min() > -1e-3


@pytest.mark.parametrize("seed", range(4))
def test_faces_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, 4, (30, 3)) if seed % 2 else rng.normal(size=(30, 3))
    faces = rng.integers(0, 30, (60, 3))  # some faces are segments or points
    points = np.concatenate([rng.normal(0, 3, (30, 3)), vertices[:10], rng.integers(0, 4, (10, 3))])
    expected = nearest_faces(vertices, faces, points)
    found = sf.nearest_faces((vertices, faces), points)
    for ours, theirs in zip(found, expected, strict=True):
        assert_array_equal(ours, theirs)


@pytest.mark.parametrize("seed", range(4))
def test_tetrahedra_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, 4, (14, 3)) if seed % 2 else rng.normal(size=(14, 3))
    tets = rng.integers(0, 14, (16, 4)).astype(np.int32)  # some are flat
    vertices = vertices.astype(float)
    points = np.concatenate([rng.normal(0, 2, (20, 3)), vertices, vertices[tets].mean(axis=1)])
    expected = nearest_tets(vertices, tets, points)
    for ours, theirs in zip(_core.nearest_tets(vertices, tets, points, math.inf, 2), expected,
                            strict=True):  # fmt: skip
        assert_array_equal(ours, theirs)


def test_a_point_inside_of_a_tetrahedron_is_its_own_nearest():
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    inside, outside = np.array([0.5, 0.5, 0.5]), np.array([2.0, 2, 2])
    for order in itertools.permutations(corners):
        assert_array_equal(nearest_in_tet(inside, np.array(order)), inside)
        assert_allclose(nearest_in_tet(outside, np.array(order)), [1, 1, 1])


def test_points_of_a_cloud_are_those_that_a_comparison_finds():
    rng = np.random.default_rng(0)
    cloud, points = rng.integers(0, 9, (400, 3)) / 8, rng.random((300, 3))
    squared = ((points[:, np.newaxis] - cloud) ** 2).sum(axis=2)
    found, distances, nearest = _core.nearest_points(cloud, points, math.inf, 1)
    assert_array_equal(found, squared.argmin(axis=1))
    assert_allclose(distances, np.sqrt(squared.min(axis=1)))
    assert_array_equal(nearest, cloud[found])


@pytest.mark.parametrize("n_threads", [1, 2, 3, 8])
def test_the_number_of_threads_does_not_matter(n_threads):
    rng = np.random.default_rng(1)
    mesh = sf.sample_mesh(5_000)
    points = np.concatenate([mesh.vertices, rng.normal(0, 1, (9_000, 3))])
    one = sf.nearest_faces(mesh, points, n_threads=1)
    for ours, theirs in zip(sf.nearest_faces(mesh, points, n_threads=n_threads), one, strict=True):
        assert_array_equal(ours, theirs)


def test_of_equally_near_faces_the_lowest_is_found():
    cube = shapes.cube()
    middles = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = sf.nearest_faces(cube, middles).faces
    for corner, face in enumerate(faces):
        assert face == np.flatnonzero((cube.faces == corner).any(axis=1)).min()
    twice = sf.Mesh(cube.vertices, np.concatenate([cube.faces, cube.faces]))
    beyond = np.random.default_rng(0).normal(0, 4, (500, 3))
    assert_array_equal(sf.nearest_faces(twice, beyond).faces, sf.nearest_faces(cube, beyond).faces)


def test_faces_beyond_the_limit_are_not_found():
    mesh = sf.Mesh(TRIANGLE, [[0, 1, 2]])
    points = [[1, 1, 2], [1, 1, 2.5], [1, 1, 0]]
    found = sf.nearest_faces(mesh, points, max_distance=2)
    assert found.faces.tolist() == [0, -1, 0]
    assert found.distances.tolist() == [2, math.inf, 0]
    assert_array_equal(found.points, [[1, 1, 0], [np.nan] * 3, [1, 1, 0]])
    assert sf.nearest_faces(mesh, points, max_distance=0).faces.tolist() == [-1, -1, 0]
    rng = np.random.default_rng(0)
    sheet, points = shapes.bumpy_sheet(10), rng.normal(0, 1, (500, 3))
    unlimited = sf.nearest_faces(sheet, points)
    limited = sf.nearest_faces(sheet, points, max_distance=0.7)
    is_near = unlimited.distances <= 0.7
    assert 0 < is_near.sum() < 500
    assert_array_equal(limited.faces, np.where(is_near, unlimited.faces, -1))


def test_polygons_are_found_through_their_triangles():
    house = shapes.house()
    points = [[0.9, 0.1, 1], [0.1, 0.9, 1], [0.5, 1.5, 1], [0.5, 9, 0], [0.5, 1, 0], [9, 9, 99]]
    found = sf.nearest_faces(house, points, max_distance=50)
    assert found.faces.tolist() == [0, 0, 1, 1, 0, -1]


def test_far_points_small_meshes_and_large_ones():
    mesh = shapes.cube()
    found = sf.nearest_faces(mesh, [[1e12, 0.5, 0.25], [0.3, 0.2, -1e40], [1e150, 0, 0]])
    assert found.points[0, 0] == 1.0  # up to rounding, all points of that side are equally far
    assert_allclose(found.distances, [1e12 - 1, 1e40, 1e150], rtol=1e-15)
    points = np.random.default_rng(0).random((50, 3)) + 1
    expected = sf.nearest_faces(mesh, points)
    for scale in (2.0**-48, 2.0**48):
        scaled = sf.nearest_faces((mesh.vertices * scale, mesh.faces), points * scale)
        assert_array_equal(scaled.faces, expected.faces)
        assert_array_equal(scaled.points, expected.points * scale)


def test_there_may_be_no_points():
    found = sf.nearest_faces(shapes.cube(), np.empty((0, 3)))
    assert [array.shape for array in found] == [(0,), (0,), (0, 3)]


def test_clouds_are_points_too():
    cloud = sf.PointCloud([[0.5, 0.5, 2], [2, 0.5, 0.5]])
    assert sf.nearest_faces(shapes.cube(), cloud).distances.tolist() == [1, 1]


def test_distances_are_those_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(3)
    mesh = sf.sample_mesh(5_000)
    points = rng.normal(0, 0.7, (60, 3))
    found = sf.nearest_faces(mesh, points)
    theirs = trimesh.proximity.closest_point_naive(
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), points
    )
    assert_allclose(found.distances, theirs[1], rtol=1e-9)
    assert_allclose(found.points, theirs[0], atol=1e-9)


def test_what_is_wrong_is_refused():
    cube = shapes.cube()
    for points, message in [
        ([[0, 0, np.nan]], r"points\[0\] must be finite, got \[0.0, 0.0, nan\]"),
        ([[0, 0, 0], [np.inf, 0, 0]], r"points\[1\] must be finite, got \[inf, 0.0, 0.0\]"),
        ([[0, 0]], r"points must have shape \(N, 3\), got \(1, 2\)"),
        (
            [[1e160, 0, 0]],
            r"coordinates of points must be at most 1e\+150, got 1e\+160: rescale the points",
        ),
    ]:
        with pytest.raises(sf.MeshError, match=message):
            sf.nearest_faces(cube, points)
    with pytest.raises(ValueError, match="max_distance must be finite and not negative, got -1"):
        sf.nearest_faces(cube, [[0, 0, 0]], max_distance=-1)
    with pytest.raises(
        sf.MeshError, match="expected a surface mesh, got a PointCloud, which has no faces"
    ):
        sf.nearest_faces(sf.PointCloud(cube.vertices), [[0, 0, 0]])
    with pytest.raises(
        TypeError,
        match="expected a PointCloud, an array of points, a path, or a cloud of trimesh,"
        " PyVista, Open3D or meshio, got dict",
    ):
        sf.nearest_faces(cube, {})


def test_nothing_is_nearest_among_no_cells():
    queries = np.zeros((2, 3))
    nothing = np.empty((0, 3))
    for cells, distances, points in (
        _core.nearest_points(nothing, queries, math.inf, 1),
        _core.nearest_triangles(nothing, np.empty((0, 3), np.int32), queries, math.inf, 1),
        _core.nearest_tets(nothing, np.empty((0, 4), np.int32), queries, math.inf, 1),
    ):
        assert_array_equal(cells, [-1, -1])
        assert_array_equal(distances, [math.inf, math.inf])
        assert np.isnan(points).all()
