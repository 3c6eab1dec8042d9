"""Cameras: named views, and orbiting cameras."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shapes import bumpy_sheet, table

from superfacets import View
from superfacets_show.camera import VIEW_NAMES, orbiting_cameras, place_camera, view_axes

TOWARD = {
    "front": [0, 0, 1], "back": [0, 0, -1], "left": [-1, 0, 0], "right": [1, 0, 0],
    "top": [0, 1, 0], "bottom": [0, -1, 0], "iso": np.full(3, 3**-0.5),
}  # fmt: skip


@pytest.mark.parametrize("name", VIEW_NAMES)
def test_views_with_a_name_look_from_that_side(name):
    assert_allclose(view_axes(View.named(name, up="y"))[1], TOWARD[name], atol=1e-12)


def test_the_front_is_minus_y_where_z_points_up():
    view = View.named("front", up="z", zoom=2)
    assert_allclose(view_axes(view)[1], [0, -1, 0], atol=1e-12)
    assert view.zoom == 2


def centered(mesh):
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return (mesh.vertices - (low + high) / 2) / np.linalg.norm(high - low)


def heights_and_widths(points, camera, aspect):
    """Return positions of points in the picture, in which the frame is at 1."""
    toward = camera.position - camera.target
    toward /= np.linalg.norm(toward)
    right = np.cross(camera.up, toward)
    sight = points - camera.position
    depth = -(sight @ toward) * camera.half_slope
    return sight @ camera.up / depth, sight @ right / depth / aspect


@pytest.mark.parametrize("up", ["x", "y", "z"])
@pytest.mark.parametrize("elevation", [-30, 0, 15, 80])
def test_a_turn_just_fits_the_frame(up, elevation):
    points = centered(table())
    view = View(azimuth=20, elevation=elevation, up=up)
    cameras = orbiting_cameras(points, view, 4 / 3, 36)
    reach = [np.abs(heights_and_widths(points, camera, 4 / 3)).max() for camera in cameras]
    assert 0.8 < max(reach) < 1


def test_a_turn_begins_at_the_azimuth_and_goes_around_to_the_right():
    points = centered(bumpy_sheet())
    view = View(azimuth=20, elevation=15, up="y")
    cameras = orbiting_cameras(points, view, 1.0, 4)
    still = place_camera(points, view, 1.0)
    ahead = [(c.position - c.target) / np.linalg.norm(c.position - c.target) for c in cameras]
    assert_allclose(ahead[0], view_axes(view)[1], atol=1e-12)
    assert_allclose(cameras[0].up, still.up, atol=1e-12)
    assert_allclose(ahead[1], view_axes(View(azimuth=110, elevation=15, up="y"))[1], atol=1e-12)
    distances = [np.linalg.norm(c.position - c.target) for c in cameras]
    assert_allclose(distances, distances[0])


def test_points_on_the_axis_can_be_turned():
    points = np.array([[0, -0.5, 0], [0, 0.5, 0]])
    for camera in orbiting_cameras(points, View(up="y"), 1.0, 3):
        assert np.isfinite(camera.position).all()
