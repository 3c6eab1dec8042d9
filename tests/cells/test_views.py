"""Triangles that cameras see, compared with values by hand and the reference, bit for bit."""

import numpy as np
import pytest
import reference
import shapes
from looking import camera_at, see
from numpy.testing import assert_allclose, assert_array_equal

import superfacets as sf
from superfacets.kit import kind_of

SQUARE = sf.Mesh([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])


def above(height, size=(4, 4), focal=None, at=(2, 2)):
    """Return a camera above a point of the plane z = 0 that looks down, with y up in pictures."""
    pose = np.diag([1.0, -1, -1, 1])
    pose[:3, 3] = [*at, height]
    focal = height if focal is None else focal
    return sf.PinholeCamera(pose, (focal, focal, size[0] / 2, size[1] / 2), size)


def test_a_square_seen_from_above_by_hand():
    # A pixel is one unit wide. Pixels on the diagonal are in both faces, and show the lower index.
    triangles, areas, is_seen = see(SQUARE, [above(10.0)])
    assert triangles.reshape(4, 4).tolist() == [[1, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 0], [0] * 4]
    assert_allclose(areas, 1, rtol=1e-14)
    assert is_seen.tolist() == [1, 1]


def test_areas_add_up_to_that_of_the_surface_also_when_it_is_tilted():
    camera = camera_at([9, 2, 8], [2, 2, 0], (400, 300), 300)
    triangles, areas, _ = see(SQUARE, [camera])
    for face in (0, 1):
        assert_allclose(areas[triangles == face].sum(), 8, rtol=0.01)


def test_a_pixel_shows_one_triangle_and_neighbors_leave_no_gap():
    # Pixel centers are on edges and vertices, and cameras at unusual positions.
    grid = np.stack(np.meshgrid(range(9), range(9), [0.0]), axis=-1).reshape(-1, 3)
    first = np.array([row * 9 + column for row in range(8) for column in range(8)])
    faces = np.concatenate([
        np.stack([first, first + 1, first + 10], axis=1),
        np.stack([first + 10, first + 9, first], axis=1),
    ])  # fmt: skip
    mesh = sf.Mesh(grid, faces)
    for camera in (
        above(8.0, (16, 16), 16.0, (4, 4)),
        above(8.0, (7, 7), 8.0, (4, 4)),
        camera_at([3.1, -2, 1.7], [4, 4, 0], (64, 48), 300),
    ):
        triangles, *_ = see(mesh, [camera])
        assert (triangles >= 0).all()


def test_what_is_nearer_hides_what_is_behind_from_both_sides():
    near = sf.Mesh([[1, 1, 5], [3, 1, 5], [2, 3, 5]], [[0, 1, 2]])
    for faces in ([[0, 1, 2]], [[2, 1, 0]]):
        mesh = shapes.together([SQUARE, sf.Mesh(near.vertices, faces)])
        triangles, *_ = see(mesh, [above(10.0)])
        assert 2 in triangles
        triangles, _, is_seen = see(mesh, [above(4.0)])
        assert 2 not in triangles
        assert is_seen.tolist() == [1, 1, 0]


def test_a_triangle_that_reaches_behind_the_camera_is_seen_in_front_of_it():
    floor = sf.Mesh([[-100, -100, 0], [100, -100, 0], [0, 100, 0]], [[0, 1, 2]])
    camera = camera_at([0, 0, 1], [5, 0, 0], (40, 30), 20)
    triangles, *_ = see(floor, [camera])
    horizon = np.flatnonzero((triangles.reshape(30, 40) >= 0).all(axis=1))
    assert len(horizon) > 15
    assert horizon.max() == 29  # down to the lower border
    assert not (see(floor, [camera_at([0, 0, 1], [0, 0, 9])])[0] >= 0).any()


def test_grazing_surface_hides_but_has_no_area():
    wall = sf.Mesh([[0, 0, 0], [50, 0, 0], [50, 4, 0]], [[0, 1, 2]])
    behind = sf.Mesh([[0, -9, -3], [90, -9, -3], [60, 30, -3]], [[0, 1, 2]])
    camera = camera_at([-1, 1, 0.2], [50, 1, 0], (64, 48), 100)
    triangles, areas, is_seen = see(shapes.together([wall, behind]), [camera])
    assert (triangles == 0).any()
    assert not areas[triangles == 0].any()
    assert is_seen[0] == 0


def test_small_triangles_between_pixel_centers_are_seen():
    mesh = shapes.bumpy_sheet(40)
    camera = camera_at(mesh.vertices.mean(axis=0) + [0, 0, 30], mesh.vertices.mean(axis=0))
    triangles, _, is_seen = see(mesh, [camera])
    assert len(np.unique(triangles)) < 0.2 * mesh.n_faces
    assert is_seen.all()


AWKWARD = {
    "cube": shapes.cube, "islands": shapes.two_islands, "moebius": shapes.moebius,
    "slivers": shapes.slivers, "fins": lambda: shapes.fins(5), "bowl": lambda: shapes.bowl(10),
    "sheet": lambda: shapes.bumpy_sheet(6),
}  # fmt: skip


@pytest.mark.parametrize("name", AWKWARD)
def test_the_kernel_equals_its_twin(name):
    mesh = AWKWARD[name]()
    low, high = mesh.bounds
    middle, extent = (low + high) / 2, float((high - low).max())
    rng = np.random.default_rng(0)
    cameras = [
        camera_at(middle + distance * extent * rng.normal(size=3), middle, (23, 17), 15)
        for distance in (1.5, 0.6, 0.1)
    ]
    found = see(mesh, cameras)
    expected = [reference.see_surface(mesh, camera) for camera in cameras]
    assert_array_equal(found[0], np.concatenate([one[0].ravel() for one in expected]))
    assert_array_equal(found[1], np.concatenate([one[1].ravel() for one in expected]))
    assert_array_equal(found[2], np.any([one[2] for one in expected], axis=0))
    assert (found[0] >= 0).any()


def test_the_result_does_not_depend_on_the_number_of_threads():
    mesh = sf.sample_mesh(60_000)
    cameras = [camera_at(3 * np.eye(3)[axis], [0, 0, 0]) for axis in (0, 1, 2, 0, 1, 2, 0)]
    expected = see(mesh, cameras, 1)
    for n_threads in (2, 3, 8):
        for one, other in zip(see(mesh, cameras, n_threads), expected, strict=True):
            assert_array_equal(one, other)


def test_polygons_are_seen_as_cells():
    quad = sf.PolygonMesh.of_faces(SQUARE.vertices, [[0, 1, 2, 3]])
    camera, kind = above(10.0, at=(0, 2)), kind_of(quad)
    drawn = kind.drawn_faces(quad)
    row = np.array([[*camera.projection.ravel(), np.prod(camera.intrinsics[:2])]])
    cells, areas, _ = kind.seen_cells(drawn, row, np.array([camera.size], np.int32), 1)
    assert cells.tolist() == [-1, -1, 0, 0] * 4  # the left half shows nothing
    assert_allclose(areas, [0, 0, 1, 1] * 4)
    with pytest.raises(ValueError, match="views and sizes must have a row of 13 and of 2 numbers"):
        kind.seen_cells(drawn, row[:, 1:], np.array([camera.size], np.int32), 1)
