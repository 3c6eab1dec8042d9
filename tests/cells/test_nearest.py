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
from superfacets.graph.kinds import kind_of

TRIANGLE = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


def nearest(mesh, points, max_distance=math.inf, n_threads=1):
    """Return the nearest face of each point, and its distance."""
    return kind_of(mesh).nearest(mesh, np.asarray(points, float), max_distance, n_threads)


@pytest.mark.parametrize(("point", "expected"), [
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
def test_the_nearest_point_of_a_triangle_by_hand(point, expected):
    point = np.array(point, float)
    for corners in itertools.permutations(TRIANGLE):
        assert nearest_on_triangle(point, np.array(corners)).tolist() == expected
        faces, distances = nearest(sf.Mesh(np.array(corners), [[0, 1, 2]]), [point])
        assert (faces.tolist(), distances.tolist()) == ([0], [math.dist(point, expected)])


@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_a_triangle_is_nearer(seed):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(3, 3)) * [[1], [1], [10.0 ** -rng.integers(0, 12)]]
    a, b = np.sort(rng.random((2, 20_000)), axis=0)
    samples = np.stack([a, b - a, 1 - b], axis=1) @ corners
    for point in 2 * rng.normal(size=(20, 3)):
        place = nearest_on_triangle(point, corners)
        best = np.linalg.norm(samples - point, axis=1).min()
        assert best - 0.1 <= math.dist(point, place) <= best + 1e-12
        # The nearest point is in the triangle.
        shares, *_ = np.linalg.lstsq(np.vstack([corners.T, np.ones(3)]), [*place, 1], rcond=None)
        assert_allclose(shares @ corners, place, atol=1e-12)
        assert shares.min() > -1e-3


@pytest.mark.parametrize("seed", range(4))
def test_faces_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, 4, (30, 3)) if seed % 2 else rng.normal(size=(30, 3))
    faces = rng.integers(0, 30, (60, 3))  # some faces are segments or points
    points = np.concatenate([rng.normal(0, 3, (30, 3)), vertices[:10], rng.integers(0, 4, (10, 3))])
    expected = nearest_faces(vertices, faces, points)
    for ours, theirs in zip(nearest(sf.Mesh(vertices, faces), points), expected, strict=False):
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
                            strict=False):  # fmt: skip
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
    found, distances = _core.nearest_points(cloud, points, math.inf, 1)
    assert_array_equal(found, squared.argmin(axis=1))
    assert_allclose(distances, np.sqrt(squared.min(axis=1)))


@pytest.mark.parametrize("n_threads", [1, 2, 3, 8])
def test_the_number_of_threads_does_not_matter(n_threads):
    rng = np.random.default_rng(1)
    mesh = sf.sample_mesh(5_000)
    points = np.concatenate([mesh.vertices, rng.normal(0, 1, (9_000, 3))])
    one = nearest(mesh, points)
    for ours, theirs in zip(nearest(mesh, points, n_threads=n_threads), one, strict=True):
        assert_array_equal(ours, theirs)


def test_of_equally_near_faces_the_lowest_is_found():
    cube = shapes.cube()
    middles = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    for corner, face in enumerate(nearest(cube, middles)[0]):
        assert face == np.flatnonzero((cube.faces == corner).any(axis=1)).min()
    twice = sf.Mesh(cube.vertices, np.concatenate([cube.faces, cube.faces]))
    beyond = np.random.default_rng(0).normal(0, 4, (500, 3))
    assert_array_equal(nearest(twice, beyond)[0], nearest(cube, beyond)[0])


def test_faces_beyond_the_limit_are_not_found():
    mesh = sf.Mesh(TRIANGLE, [[0, 1, 2]])
    points = [[1, 1, 2], [1, 1, 2.5], [1, 1, 0]]
    faces, distances = nearest(mesh, points, max_distance=2)
    assert (faces.tolist(), distances.tolist()) == ([0, -1, 0], [2, math.inf, 0])
    assert nearest(mesh, points, max_distance=0)[0].tolist() == [-1, -1, 0]
    rng = np.random.default_rng(0)
    sheet, points = shapes.bumpy_sheet(10), rng.normal(0, 1, (500, 3))
    faces, distances = nearest(sheet, points)
    is_near = distances <= 0.7
    assert 0 < is_near.sum() < 500
    limited, _ = nearest(sheet, points, max_distance=0.7)
    assert_array_equal(limited, np.where(is_near, faces, -1))


def test_polygons_are_found_through_their_triangles():
    house = shapes.house()
    points = [[0.9, 0.1, 1], [0.1, 0.9, 1], [0.5, 1.5, 1], [0.5, 9, 0], [0.5, 1, 0], [9, 9, 99]]
    assert nearest(house, points, max_distance=50)[0].tolist() == [0, 0, 1, 1, 0, -1]


def test_far_points_small_meshes_and_large_ones():
    mesh = shapes.cube()
    _, distances = nearest(mesh, [[1e12, 0.5, 0.25], [0.3, 0.2, -1e40], [1e150, 0, 0]])
    assert_allclose(distances, [1e12 - 1, 1e40, 1e150], rtol=1e-15)
    points = np.random.default_rng(0).random((50, 3)) + 1
    faces, distances = nearest(mesh, points)
    for scale in (2.0**-48, 2.0**48):
        scaled = nearest(sf.Mesh(mesh.vertices * scale, mesh.faces), points * scale)
        assert_array_equal(scaled[0], faces)
        assert_array_equal(scaled[1], distances * scale)


def test_there_may_be_no_points():
    assert [array.shape for array in nearest(shapes.cube(), np.empty((0, 3)))] == [(0,), (0,)]


def test_distances_are_those_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(3)
    mesh = sf.sample_mesh(5_000)
    points = rng.normal(0, 0.7, (60, 3))
    _, theirs, _ = trimesh.proximity.closest_point_naive(
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), points
    )
    assert_allclose(nearest(mesh, points)[1], theirs, rtol=1e-9)


def test_nothing_is_nearest_among_no_cells():
    queries = np.zeros((2, 3))
    nothing = np.empty((0, 3))
    for cells, distances in (
        _core.nearest_points(nothing, queries, math.inf, 1),
        _core.nearest_triangles(nothing, np.empty((0, 3), np.int32), queries, math.inf, 1),
        _core.nearest_tets(nothing, np.empty((0, 4), np.int32), queries, math.inf, 1),
    ):
        assert_array_equal(cells, [-1, -1])
        assert_array_equal(distances, [math.inf, math.inf])
