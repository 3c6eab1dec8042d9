"""Triangles split in four."""

import numpy as np
import pytest
from shapes import cube, strip

from superfacets import build_face_graph
from superfacets.tools.sample import split_in_four


def test_neighbors_share_the_middles_of_their_edges():
    square = strip(2)
    vertices, faces = split_in_four(square.vertices, square.faces)
    assert len(faces) == 8
    assert len(vertices) == 4 + 5  # one more for each edge
    assert faces.dtype == np.int32
    np.testing.assert_allclose(build_face_graph((vertices, faces)).measures, 1 / 8)


def test_a_closed_mesh_stays_closed_and_as_oriented_as_before():
    vertices, faces = cube().vertices, cube().faces
    for _ in range(3):
        vertices, faces = split_in_four(vertices, faces)
    graph = build_face_graph((vertices, faces), weld=False)
    assert graph.edge_counts == (12 * 64 * 3 // 2, 0, 0, 0)
    assert graph.measures.sum() == pytest.approx(6.0)
    assert np.linalg.det(vertices[faces]).sum() / 6 == pytest.approx(1.0)  # the volume: outward


def test_the_four_lie_in_the_one():
    vertices, faces = split_in_four(cube().vertices, cube().faces)
    centroids = vertices[faces].mean(axis=1).reshape(-1, 4, 3).mean(axis=1)
    np.testing.assert_allclose(centroids, cube().vertices[cube().faces].mean(axis=1))
