"""Sample points of faces: positions, and the areas that they represent."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

import superfacets as sf
from superfacets.regions.nearest_labels import MAX_STEPS, sample_surface


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_parts_of_a_triangle_are_equal_and_cover_it(n):
    triangle = sf.Mesh([[0, 0, 0], [3, 0, 0], [1, 2, 2]], [[0, 1, 2]])
    samples = sample_surface(triangle, n * n, 1)
    assert samples.points.shape == (n * n, 3)
    assert len(np.unique(samples.points.round(9), axis=0)) == n * n
    assert_allclose(samples.areas, samples.areas[0])
    assert_allclose(samples.points.mean(axis=0), triangle.vertices.mean(axis=0))
    # Second moments show whether samples represent equal parts: sample values are slightly lower.
    shares = np.linalg.solve(np.vstack([triangle.vertices[:, :2].T, np.ones(3)]),
                             np.vstack([samples.points[:, :2].T, np.ones(n * n)]))  # fmt: skip
    assert shares.min() == pytest.approx(1 / (3 * n))
    assert_allclose((shares**2).mean(axis=1), 1 / 6 - 1 / (18 * n * n))


def test_larger_faces_get_more_samples_and_none_gets_none():
    mesh = sf.Mesh([[0, 0, 0], [90, 0, 0], [0, 90, 0], [91, 0, 0], [0, 1, 9]],
                   [[0, 1, 2], [1, 3, 2], [4, 4, 4]])  # fmt: skip
    samples = sample_surface(mesh, 1000, 1)
    assert np.bincount(samples.faces).tolist() == [MAX_STEPS**2, 9, 1]
    assert_allclose(np.bincount(samples.faces, samples.areas), [4050, 45, 0])


def test_polygons_are_sampled_by_their_triangles():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    polygons = sf.PolygonMesh.of_faces([*square, [0.5, 2, 0]], [[0, 1, 2, 3], [3, 2, 4]])
    samples = sample_surface(polygons, 1, 1)
    assert samples.faces.tolist() == [0, 0, 1]
    assert_allclose(np.bincount(samples.faces, samples.areas), [1.0, 0.5])


def test_faces_that_all_have_no_area_get_a_sample_each():
    samples = sample_surface(sf.Mesh([[0, 0, 0], [1, 0, 0]], [[0, 1, 1], [1, 0, 0]]), 50, 1)
    assert samples.faces.tolist() == [0, 1]
    assert_array_equal(samples.areas, 0)


def test_the_number_of_samples_is_about_what_was_asked_for():
    sheet = shapes.bumpy_sheet(20)
    for n in (1, sheet.n_faces, 10 * sheet.n_faces):
        n_samples = len(sample_surface(sheet, n, 1).faces)
        most = n + sheet.n_faces + 2 * np.sqrt(n * sheet.n_faces)
        assert max(n, sheet.n_faces) * 0.8 <= n_samples <= most
