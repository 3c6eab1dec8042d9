"""Positions smoothed inside, by which creases are measured."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, _core, sample_mesh, segment
from superfacets.mesh.denoising import AUTO_STEPS, denoised, slack_of
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
    assert segment(noisy(make(), noise), 6, denoise="auto").params["denoise"] == AUTO_STEPS


def test_edges_count_as_flat_after_many_steps_only():
    assert slack_of(0) == slack_of(AUTO_STEPS) == slack_of(9) == 0.0
    assert slack_of(10) == slack_of(20) == pytest.approx(np.radians(2.25))
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
    with pytest.raises(
        ValueError, match="denoise needs a mesh of faces, got points: leave denoise"
    ):
        segment(np.random.default_rng(0).random((50, 3)), 2, denoise=2)
