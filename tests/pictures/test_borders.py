"""Border lines: their positions, and widths below the size of regions."""

import numpy as np
import pytest
from shapes import strip

from superfacets import build_face_graph
from superfacets_show.camera import Camera
from superfacets_show.scene import border_edges, default_border_width


def camera(half_slope=0.5):
    """Return a camera at distance 2, so that a picture is 4 * half_slope units high."""
    return Camera(np.array([0.0, 0.0, 2.0]), np.zeros(3), np.array([0.0, 1.0, 0.0]), half_slope)


def area(diameter):
    return np.pi / 4 * diameter**2


def test_borders_run_between_faces_of_different_labels_only():
    mesh = strip(4)
    edges = border_edges(mesh, build_face_graph(mesh), np.array([0, 0, 1, 1]))
    assert [sorted(edge) for edge in edges.tolist()] == [
        sorted(set(mesh.faces[1]) & set(mesh.faces[2]))
    ]


@pytest.mark.parametrize(
    ("diameter", "height", "expected"),
    [
        (0.1, 1000, 1.0),  # 50 pixels
        (0.15, 1000, 1.5),
        (1.0, 1000, 4.0),  # the maximum width
        (1.0, 500, 2.0),
        (0.01, 1000, 0.6),  # the minimum width
        (1.0, 20, 0.6),
    ],
)
def test_borders_are_two_percent_of_the_diameter_of_regions(diameter, height, expected):
    assert default_border_width(area(diameter), camera(), height) == pytest.approx(expected)


def test_borders_get_wider_with_the_regions_when_zoomed():
    assert default_border_width(area(0.08), camera(0.25), 1000) == pytest.approx(1.6)
    assert default_border_width(area(0.08), camera(0.5), 1000) == pytest.approx(0.8)
