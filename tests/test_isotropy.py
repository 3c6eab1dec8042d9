"""Regions on surfaces without creases are round for any pattern of faces."""

from itertools import combinations

import numpy as np
import pytest
import shapes
from level_sets import level_set, turned_up

import superfacets as sf
from superfacets.tools.sample import split_in_four

pytestmark = pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")


def alternating_diagonals():
    squares = shapes.squares(100)
    y, x = np.divmod(np.arange(squares.n_faces), 100)
    corners = squares.indices.reshape(-1, 4)
    one, other = corners[:, [[0, 1, 2], [0, 2, 3]]], corners[:, [[0, 1, 3], [1, 2, 3]]]
    is_odd = (x + y)[:, np.newaxis, np.newaxis] % 2 == 1
    return sf.Mesh(squares.vertices, np.where(is_odd, one, other).reshape(-1, 3))


def plane(*normal):
    """Return a plane cut through a grid of cubes, turned so that its normal is z."""
    normal = np.array(normal) / np.linalg.norm(normal)
    mesh = level_set(lambda at: at @ normal + 0.013, 48)
    axes = np.linalg.svd(normal[None])[2][[1, 2, 0]]
    return sf.Mesh(mesh.vertices @ axes.T, mesh.faces)


GRIDS = {
    "equal diagonals": lambda: shapes.flat(100), "alternating diagonals": alternating_diagonals,
    "quads": lambda: shapes.squares(100),
}  # fmt: skip
CUTS = {
    "level plane": lambda: plane(0, 0, 1), "oblique plane": lambda: plane(1, 0.5, 1),
    "steep plane": lambda: plane(0, 0.577, 1),
}  # fmt: skip


def icosphere(n_times=5):
    """Return a sphere of 20 * 4**n_times nearly equal triangles."""
    turns = np.arange(5) * 2 * np.pi / 5
    ring = np.stack([2 * np.cos(turns), 2 * np.sin(turns), np.ones(5)], axis=1)
    corners = np.concatenate([ring, ring * [-1, -1, -1]]) / np.sqrt(5)
    vertices = np.concatenate([corners, [[0, 0, 1], [0, 0, -1]]])
    steps = np.linalg.norm(vertices[:, None] - vertices, axis=2)
    near = np.isclose(steps, np.sort(steps[0])[1])
    faces = [f for f in combinations(range(12), 3) if near[np.ix_(f, f)].sum() == 6]
    for _ in range(n_times):
        vertices, faces = split_in_four(vertices, np.array(faces, np.int32))
        vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    return turned_up(vertices, faces, distance)


def distance(at):
    """Return the distance to the origin; no point of the grid below has a distance of 0.873."""
    return np.linalg.norm(at, axis=-1)


SPHERES = {
    "of like triangles": icosphere,
    "out of a grid": lambda: level_set(lambda at: distance(at) - 0.873, 40),
}


def inner_regions(graph, labels):
    """Return regions without a face at the boundary, where faces have fewer neighbors."""
    n_arcs = np.diff(graph.offsets)
    return np.setdiff1d(labels, labels[n_arcs < n_arcs.max()])


def elongations_and_axes(mesh, **options):
    """Return elongations and long axes of all inner regions, for several numbers of regions.

    The elongation is the ratio of the standard deviations along the long and the short axis in the
    plane of a region.
    """
    graph = sf.build_face_graph(mesh)
    ratios, axes = [], []
    for k in (60, 90, 120, 150):
        labels = sf.segment(mesh, k, **options).labels
        for label in inner_regions(graph, labels):
            of_region = labels == label
            weights = graph.measures[of_region]
            steps = graph.positions[of_region]
            steps = steps - np.average(steps, axis=0, weights=weights)
            (_, low, high), vectors = np.linalg.eigh((weights[:, None] * steps).T @ steps)
            ratios.append(np.sqrt(high / low))
            axes.append(vectors[:, 2])
    assert len(ratios) > 200
    return np.array(ratios), np.array(axes)


def alignment(axes):
    """Return 1 if all axes in the plane z = 0 are parallel, and about 0 for random directions."""
    return abs(np.mean((axes[:, 0] + 1j * axes[:, 1]) ** 2))


@pytest.mark.parametrize("name", [*GRIDS, *CUTS])
def test_regions_of_a_plane_are_round_and_lean_nowhere(name):
    """Measured: 1.17 to 1.19 on grids, 1.22 on cuts; by creases up to 1.36, alignments 0.8."""
    ratios, axes = elongations_and_axes((GRIDS | CUTS)[name]())
    assert np.median(ratios) < (1.2 if name in GRIDS else 1.25)
    assert alignment(axes) < 0.25


@pytest.mark.parametrize("name", SPHERES)
def test_regions_of_a_sphere_are_round(name):
    """Measured: 1.24, and 1.27 for the level set of a grid; by creases 1.24 and 1.39."""
    ratios, _ = elongations_and_axes(SPHERES[name]())
    assert np.median(ratios) < 1.3


def height_field(noise):
    """Return a plane on a regular grid with noise in the heights, in units of edges."""
    mesh = shapes.flat(100)
    heights = noise * np.random.default_rng(0).normal(size=(mesh.n_vertices, 1))
    return sf.Mesh(mesh.vertices + heights * [0, 0, 1], mesh.faces)


@pytest.mark.parametrize("noise", [0.01, 0.03, 0.05, 0.1, 0.2, 0.5])
def test_regions_of_a_noisy_height_field_are_round_and_lean_nowhere(noise):
    """Measured: elongations of at most 1.19, alignments of at most 0.16."""
    ratios, axes = elongations_and_axes(height_field(noise))
    assert np.median(ratios) < 1.2
    assert alignment(axes) < 0.3


def test_noise_stretches_regions_of_a_height_field_without_enough_smoothing():
    """Five steps of smoothing are not enough: small creases remain and affect the weights."""
    for n_steps in (0, 5):
        ratios, axes = elongations_and_axes(height_field(0.1), denoise=n_steps)
        assert np.median(ratios) > 1.3
        assert alignment(axes) > 0.5


def test_paths_over_shared_borders_alone_lean_along_the_diagonals():
    """With weights by creases, the former default, the measurement finds elongated regions."""
    ratios, axes = elongations_and_axes(shapes.flat(100), weights="creases")
    assert np.median(ratios) > 1.3
    assert alignment(axes) > 0.7


@pytest.mark.parametrize("name", [*GRIDS, *CUTS])
def test_no_region_of_a_plane_is_tiny(name):
    mesh = (GRIDS | CUTS)[name]()
    areas = sf.build_face_graph(mesh).measures
    for k in range(50, 200, 24):
        of_regions = np.bincount(sf.segment(mesh, k).labels, areas)
        assert of_regions.min() > 0.1 * areas.sum() / k, k
