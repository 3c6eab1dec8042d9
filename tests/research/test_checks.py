"""Checks of arguments of the methods for comparison."""

import numpy as np
import pytest
from research.checks import as_triangles, checked_generator

from superfacets import MeshError, PolygonMesh

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_polygons_with_three_corners_are_triangles_and_others_are_refused():
    triangles = PolygonMesh.of_faces(SQUARE, [[0, 1, 2], [0, 2, 3]])
    assert as_triangles(triangles).faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    with pytest.raises(MeshError, match=r"must be triangles, but faces\[0\] has 4 corners: call"):
        as_triangles(PolygonMesh.of_faces(SQUARE, [[0, 1, 2, 3]]))


def test_a_seed_makes_a_generator_and_a_generator_stays():
    generator = np.random.default_rng(1)
    assert checked_generator(generator, "rng") is generator
    assert checked_generator(1, "rng").random() == np.random.default_rng(1).random()
    with pytest.raises(TypeError, match=r"rng must be an integer or a Generator, got 1\.5"):
        checked_generator(1.5, "rng")
    with pytest.raises(ValueError, match="rng must not be negative, got -1"):
        checked_generator(-1, "rng")
