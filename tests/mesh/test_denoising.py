"""Positions smoothed inside, by which creases are measured."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, _core, sample_mesh, segment
from superfacets.mesh.cells import lowest_vertices
from superfacets.mesh.denoising import (
    LEAST_STEPS,
    denoised,
    noise_products,
    slack_of,
)
from superfacets.mesh.faces import vertex_graph


def noisy(mesh, noise, seed=0):
    """The mesh with noise in each coordinate, in edge lengths."""
    corners = mesh.vertices[mesh.faces]
    edge = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean()
    steps = np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return Mesh(mesh.vertices + noise * edge * steps, mesh.faces)


def taubin(mesh, n_steps):
    """A readable twin of the kernel."""
    neighbors = [set() for _ in mesh.vertices]
    for a, b, c in mesh.faces.tolist():
        for one, other in ((a, b), (b, c), (c, a)):
            neighbors[one].add(other)
            neighbors[other].add(one)
    positions = mesh.vertices.copy()
    for factor in n_steps * [0.5, -0.53]:
        means = [positions[sorted(near)].mean(axis=0) for near in neighbors]
        positions = positions + factor * (np.array(means) - positions)
    return positions


def test_the_kernel_equals_its_twin_on_any_number_of_threads():
    mesh = noisy(shapes.bumpy_sheet(40), 0.2)
    lowest = np.arange(mesh.n_vertices, dtype=np.int32)
    graph = vertex_graph(mesh, lowest, 1)
    one, two = (
        _core.taubin_smooth(mesh.vertices, graph.offsets, graph.neighbors, 4, n) for n in (1, 2)
    )
    assert np.array_equal(one, two)
    assert np.allclose(one, taubin(mesh, 4), atol=1e-12)


def test_smoothed_positions_are_nearer_to_the_mesh_without_noise():
    mesh = sample_mesh(20_000)
    rough = noisy(mesh, 0.2)
    smooth, n_steps = denoised(rough, 5, weld=True, n_threads=1)
    before, after = (
        np.linalg.norm(m.vertices - mesh.vertices, axis=1).mean() for m in (rough, smooth)
    )
    assert n_steps == 5
    assert after < 0.6 * before


@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize(
    "make", [lambda: sample_mesh(20_000), shapes.drilled_block, shapes.dumbbell, shapes.cube]
)
def test_auto_leaves_meshes_with_little_noise_alone(make, noise):
    mesh = noisy(make(), noise)
    result = segment(mesh, 6, denoise="auto")
    assert result.params["denoise"] == 0
    assert np.array_equal(result.labels, segment(mesh, 6).labels)


@pytest.mark.parametrize("noise", [0.1, 0.3])
@pytest.mark.parametrize("make", [lambda: sample_mesh(20_000), shapes.bumpy_sheet])
def test_auto_smooths_noise(make, noise):
    taken = segment(noisy(make(), noise), 6, denoise="auto").params["denoise"]
    assert taken == pytest.approx(200 * noise, rel=0.3)


def found_products(mesh, sample, *, weld=True):
    lowest = lowest_vertices(mesh.vertices, weld, 1)
    return noise_products(mesh, lowest, np.array(sample, np.int32), 1)


def expected_products(mesh, sample):
    """A readable twin of `noise_products`, for welded triangles."""
    heights, products = mesh.vertices - taubin(mesh, 1), []
    for face in mesh.faces[sample]:
        a, b, c = mesh.vertices[face]
        normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        offs = heights[face] @ normal
        length = np.mean([np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c)])
        products.append(-np.mean(offs * np.roll(offs, -1)) / length**2)
    return np.array(products)


def test_noise_of_a_sample_equals_its_twin():
    mesh = noisy(shapes.bumpy_sheet(24), 0.1)
    sample = np.arange(0, mesh.n_faces, 7)
    found = found_products(mesh, sample)
    assert np.allclose(found, expected_products(mesh, sample), rtol=1e-9, atol=1e-15)
    assert np.allclose(found_products(shapes.soup(mesh), sample), found, rtol=1e-9)
    polygons = sf.PolygonMesh.of_faces(mesh.vertices, mesh.faces)
    assert np.allclose(found_products(polygons, sample), found, rtol=1e-9)


def test_faces_without_area_and_loose_faces_are_no_noise():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
    assert len(found_products(mesh, [0])) == 0
    assert np.allclose(found_products(mesh, [0, 1]), 0.0)
    assert np.allclose(found_products(shapes.soup(noisy(mesh, 0.3)), [1], weld=False), 0.0)


@pytest.mark.parametrize("make", [lambda: sample_mesh(5_000), shapes.bumpy_sheet])
def test_the_number_of_steps_repeats_the_labels(make):
    mesh = noisy(make(), 0.1)
    result = segment(mesh, 20, denoise="auto")
    n_steps = result.params["denoise"]
    assert n_steps >= LEAST_STEPS
    for scaled, denoise in ((mesh, n_steps), (Mesh(mesh.vertices * 2.0**-40, mesh.faces), "auto")):
        labels = segment(scaled, 20, denoise=denoise, n_threads=1).labels
        assert np.array_equal(labels, result.labels)


def test_small_meshes_are_their_shape():
    mesh = noisy(shapes.bumpy_sheet(22), 0.1)
    assert segment(mesh, 20, denoise="auto").params["denoise"] == 0


def test_edges_count_as_flat_after_many_steps_only():
    assert slack_of(0) == slack_of(LEAST_STEPS - 1) == 0.0
    assert slack_of(LEAST_STEPS) == slack_of(20) == pytest.approx(np.radians(2.25))
    assert slack_of(60) == pytest.approx(np.radians(6))


def test_with_noise_regions_keep_to_parts_and_results_belong_to_the_mesh():
    mesh = sample_mesh(20_000)
    truth = segment(mesh, 30).labels
    rough = noisy(mesh, 0.3)
    errors = []
    for steps in (0, 5):
        result = segment(rough, 100, denoise=steps)
        assert result.cells is rough
        errors.append(sf.metrics.undersegmentation_error(mesh, result.labels, truth))
    assert errors[1] < 0.8 * errors[0]


def test_soup_is_smoothed_as_the_mesh_it_is():
    mesh = noisy(shapes.bumpy_sheet(24), 0.2)
    one, other = (segment(m, 12, denoise=5).labels for m in (mesh, shapes.soup(mesh)))
    assert np.array_equal(one, other)


def test_polygons_are_smoothed():
    mesh = noisy(shapes.bumpy_sheet(24), 0.2)
    polygons = sf.PolygonMesh.of_faces(mesh.vertices, mesh.faces)
    assert np.array_equal(
        segment(mesh, 9, denoise=3).labels, segment(polygons, 9, denoise=3).labels
    )


def test_steps_are_checked():
    mesh = shapes.cube()
    for wrong, error in (
        (-1, ValueError),
        (1001, ValueError),
        ("much", ValueError),
        (1.5, TypeError),
    ):
        with pytest.raises(error, match="denoise"):
            segment(mesh, 2, denoise=wrong)
    with pytest.raises(ValueError, match="denoise needs a mesh of faces, not points"):
        segment(np.random.default_rng(0).random((50, 3)), 2, denoise=2)
