"""The generator of the sample mesh makes a closed surface, with creases where solids meet."""

import math

import numpy as np
import pytest
from tools.sample_bear import PART_NAMES, lattice, make_bear, net, parts_of
from tools.sample_bear import bear as creature

from superfacets import Mesh

COUNTS = [3_000, 5_000, 20_000, 100_000]


def made(n_faces):
    return Mesh(*make_bear(n_faces))


def parts_in(mesh):
    return parts_of(mesh.vertices, mesh.faces)


@pytest.fixture(scope="module", params=COUNTS)
def bear(request):
    return made(request.param)


@pytest.fixture(scope="module")
def default_bear():
    return made(60_000)


@pytest.fixture
def make_solids(monkeypatch):
    """Return a function that replaces the solids of the bear."""

    def replace(*solids):
        monkeypatch.setattr(creature, "SOLIDS", solids)
        creature.ellipsoids.cache_clear()

    yield replace
    monkeypatch.undo()
    creature.ellipsoids.cache_clear()


def ball(x, radius):
    return creature.Solid("ball", (x, 0.0, 0.0), (radius, radius, radius))


def directed_sides(faces):
    """Return both ends of each side of each face, (3 F, 2), in the order of faces and sides."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)


def twins(faces):
    """Return for each directed side the index of the opposite one."""
    sides = directed_sides(faces)
    key, opposite = sides @ [2**32, 1], sides @ [1, 2**32]
    order = np.argsort(key)
    return order[np.searchsorted(key[order], opposite)]


def pieces(n, ones, others):
    """Return the number of connected components of a graph of n nodes."""
    root = np.arange(n)
    while True:
        least = root.copy()
        np.minimum.at(least, ones, root[others])
        np.minimum.at(least, others, root[ones])
        least = least[least]
        if np.array_equal(least, root):
            return len(np.unique(root))
        root = least


def normals(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def signed_volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def smallest_angles(mesh):
    """Return the smallest angle of each face, in degrees."""
    corners = mesh.vertices[mesh.faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    ahead /= np.linalg.norm(ahead, axis=2, keepdims=True)
    cosines = -np.einsum("fci,fci->fc", ahead, np.roll(ahead, 1, axis=1))
    return np.degrees(np.arccos(cosines.clip(-1, 1))).min(axis=1)


def test_every_edge_has_two_faces_that_run_through_it_in_opposite_directions(bear):
    sides = directed_sides(bear.faces)
    key, opposite = sides @ [2**32, 1], sides @ [1, 2**32]
    assert len(np.unique(key)) == len(key)
    assert np.array_equal(np.sort(key), np.sort(opposite))


def test_the_faces_around_each_vertex_form_one_fan(bear):
    """Linked across their edges, the corners of faces at a vertex form one chain per vertex."""
    twin = twins(bear.faces)
    start = np.arange(3 * bear.n_faces)
    end = np.roll(start.reshape(-1, 3), -1, axis=1).ravel()
    assert pieces(3 * bear.n_faces, start, end[twin]) == bear.n_vertices


def test_the_surface_is_one_piece_without_holes_or_handles(bear):
    twin = twins(bear.faces)
    assert pieces(bear.n_faces, np.arange(len(twin)) // 3, twin // 3) == 1
    assert bear.n_vertices - 3 * bear.n_faces // 2 + bear.n_faces == 2


def test_the_mesh_has_about_as_many_faces_as_asked_for(bear, request):
    assert bear.n_faces == pytest.approx(request.node.callspec.params["bear"], rel=0.1)


def test_every_vertex_is_used(bear):
    assert np.array_equal(np.unique(bear.faces), np.arange(bear.n_vertices))


def test_normals_point_outward(bear):
    assert signed_volume(bear) == pytest.approx(1.892, rel=0.05)


def test_vertices_lie_on_the_union_of_the_solids(default_bear):
    solids = creature.ellipsoids()
    levels = [solids.levels(s, default_bear.vertices)[0] for s in range(len(PART_NAMES))]
    np.testing.assert_allclose(np.min(levels, axis=0), 0, atol=1e-9)


def test_no_face_is_flat_or_folded(default_bear):
    assert smallest_angles(default_bear).min() > 5
    assert np.median(smallest_angles(default_bear)) > 40
    parts = parts_in(default_bear)
    centroids = default_bear.vertices[default_bear.faces].mean(axis=1)
    gradients = np.empty_like(centroids)
    for part in range(len(PART_NAMES)):
        gradients[parts == part] = creature.ellipsoids().levels(part, centroids[parts == part])[1]
    gradients /= np.linalg.norm(gradients, axis=1, keepdims=True)
    assert np.einsum("fi,fi->f", gradients, normals(default_bear)).min() > 0.9


@pytest.mark.parametrize("n_faces", [12_000, 25_000, 90_000])
def test_less_than_one_face_in_2000_is_a_sliver(n_faces):
    angles = smallest_angles(made(n_faces))
    assert angles.min() > 0
    assert (angles < 5).sum() < n_faces / 2000


def test_parts_meet_in_concave_creases_and_are_smooth_elsewhere(default_bear):
    parts, normal = parts_in(default_bear), normals(default_bear)
    twin = twins(default_bear.faces)
    face, neighbor = np.arange(len(twin)) // 3, twin // 3
    cosines = np.einsum("ei,ei->e", normal[face], normal[neighbor])
    bends = np.degrees(np.arccos(cosines.clip(-1, 1)))
    across = parts[face] != parts[neighbor]
    assert bends[~across].max() < 35
    assert np.median(bends[~across]) < 4
    assert bends[across].min() > 35
    centroids = default_bear.vertices[default_bear.faces].mean(axis=1)
    heights = np.einsum("ei,ei->e", normal[face], centroids[neighbor] - centroids[face])
    assert heights[across].min() > 0  # the neighbor is above the plane of the face: concave


def test_every_part_is_one_piece(default_bear):
    parts = parts_in(default_bear)
    assert parts.dtype == np.int32
    assert parts.shape == (default_bear.n_faces,)
    twin = twins(default_bear.faces)
    face, neighbor = np.arange(len(twin)) // 3, twin // 3
    within = parts[face] == parts[neighbor]
    assert pieces(default_bear.n_faces, face[within], neighbor[within]) == len(PART_NAMES)


def test_parts_are_named_after_their_solids(default_bear):
    centroids = default_bear.vertices[default_bear.faces].mean(axis=1)
    names = np.array(PART_NAMES)[parts_in(default_bear)]
    assert names[centroids[:, 1].argmax()] == "right ear"
    assert names[centroids[:, 0].argmin()] == "right paw"
    assert names[centroids[:, 0].argmax()] == "left paw"
    assert names[centroids[:, 2].argmin()] == "tail"
    assert names[centroids[:, 2].argmax()] == "right foot"


def test_the_same_request_gives_the_same_mesh():
    one, other = made(5_000), made(5_000)
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)


def test_a_ball_is_round(make_solids):
    make_solids(ball(0.3, 2.0))
    sphere = made(20_000)
    distances = np.linalg.norm(sphere.vertices - [0.3, 0, 0], axis=1)
    np.testing.assert_allclose(distances, 2, rtol=1e-9)
    assert signed_volume(sphere) == pytest.approx(4 / 3 * math.pi * 2**3, rel=2e-3)
    assert set(parts_in(sphere)) == {0}


def test_two_balls_meet_in_a_sharp_circle(make_solids):
    """Balls of radius 1, 1 apart, meet at x = 1/2, at a distance of sqrt(3)/2 from the axis."""
    make_solids(ball(0.0, 1.0), ball(1.0, 1.0))
    mesh = made(20_000)
    np.testing.assert_array_equal(parts_in(mesh), mesh.vertices[mesh.faces, 0].mean(1) > 0.5)
    twin = twins(mesh.faces)
    across = parts_in(mesh)[np.arange(len(twin)) // 3] != parts_in(mesh)[twin // 3]
    crease = mesh.vertices[np.unique(directed_sides(mesh.faces)[across])]
    assert len(crease) > 50
    np.testing.assert_allclose(crease[:, 0], 0.5, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(crease[:, 1:], axis=1), math.sqrt(3) / 2, rtol=1e-9)
    both = 2 * 4 / 3 * math.pi - 5 / 12 * math.pi  # two balls minus their lens
    assert signed_volume(mesh) == pytest.approx(both, rel=2e-3)


@pytest.mark.parametrize("seed", range(20))
def test_any_set_of_grid_points_gets_a_manifold_border(seed):
    inside = np.zeros((12, 11, 10), dtype=bool)
    inside[2:-2, 2:-2, 2:-2] = np.random.default_rng(seed).random((8, 7, 6)) < 0.3
    inside[5, 5, 5] = True
    repaired = lattice.without_pinches(lattice.Lattice(inside, np.zeros(3), 1.0))
    assert (repaired.inside >= inside).all()
    quads = net.surface_net(repaired).quads
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    assert len(np.unique(sides, axis=0)) == len(sides)
    start = np.arange(4 * len(quads))
    end = np.roll(start.reshape(-1, 4), -1, axis=1).ravel()
    key, opposite = sides @ [2**32, 1], sides @ [1, 2**32]
    order = np.argsort(key)
    twin = order[np.searchsorted(key[order], opposite)]
    assert np.array_equal(key[twin], opposite)
    assert pieces(len(start), start, end[twin]) == quads.max() + 1


@pytest.mark.parametrize("n_faces", [0, -5, 2_999])
def test_too_few_faces_are_refused(n_faces):
    with pytest.raises(ValueError, match=f"n_faces must be at least 3000, got {n_faces}"):
        make_bear(n_faces)
