"""Longest-edge bisection: exact results on small meshes, and properties of all results."""

import math
import pickle

import numpy as np
import pytest
import reference
import shapes
from hypothesis import given, settings
from hypothesis import strategies as st

from superfacets import Mesh, MeshError, build_face_graph, mesh_info
from superfacets import subdivide as bisect
from superfacets.tools.subdivision import Subdivision

MESHES = {
    "strip": lambda: shapes.strip(5), "cube": shapes.cube,
    "soup": lambda: shapes.soup(shapes.cube()), "drilled block": lambda: shapes.drilled_block(16),
    "fins": lambda: shapes.fins(4), "moebius": shapes.moebius, "slivers": shapes.slivers,
    "sheet": lambda: shapes.bumpy_sheet(6), "two islands": shapes.two_islands,
}  # fmt: skip


def edge_lengths(mesh):
    corners = mesh.vertices[mesh.faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def areas(mesh):
    return reference.measure_faces(mesh)[1]


def test_a_face_is_cut_at_the_middle_of_its_longest_edge():
    """The longest side, from (4, 0) to (0, 3), gets vertex 3:

    2
    |\\
    | 3
    |/ \\
    0---1
    """
    parts = bisect(([[0, 0, 0], [4, 0, 0], [0, 3, 0]], [[0, 1, 2]]), 4.0)
    assert parts.mesh.vertices[3:].tolist() == [[2, 1.5, 0]]
    assert parts.mesh.faces.tolist() == [[0, 1, 3], [0, 3, 2]]
    assert parts.sources.tolist() == [0, 0]
    assert parts.depths.tolist() == [1, 1]


def test_what_was_cut_is_cut_again_until_it_is_short_enough():
    """First at 5, the middle of 1-2; then the halves at 3 and 4, the middles of 0-1 and 0-2."""
    parts = bisect(([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]), 3.0)
    # Midpoints are in the order of the vertices of their sides: 0-1, 0-2, 1-2.
    assert parts.mesh.vertices[3:].tolist() == [[2, 0, 0], [0, 2, 0], [2, 2, 0]]
    assert parts.mesh.faces.tolist() == [[0, 3, 5], [3, 1, 5], [4, 5, 2], [0, 5, 4]]
    assert parts.depths.tolist() == [2, 2, 2, 2]


def test_neighbors_share_the_new_vertex():
    square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    parts = bisect(square, 1.0)
    assert parts.mesh.n_vertices == 5
    assert parts.mesh.faces.tolist() == [[4, 1, 2], [0, 1, 4], [0, 4, 3], [4, 2, 3]]
    assert parts.sources.tolist() == [0, 0, 1, 1]


def test_all_faces_on_a_non_manifold_edge_share_the_new_vertex():
    parts = bisect(shapes.fins(5), 1.12)
    assert parts.mesh.n_faces == 5
    parts = bisect(shapes.fins(5), 0.9)
    counts = build_face_graph(parts.mesh).edge_counts
    halves = [[0, 7], [1, 7]]
    assert parts.mesh.vertices[7].tolist() == [0, 0, 0.5]
    for half in halves:
        assert np.isin(parts.mesh.faces, half).sum(axis=1).tolist().count(2) == 5
    assert counts.non_manifold == 2


def test_seams_stay_seams_without_gaps():
    """Two triangles meet at an edge, but have separate vertices."""
    square = shapes.soup(Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]))
    parts = bisect(square, 0.3)
    assert not np.intersect1d(parts.mesh.faces[parts.sources == 0],
                              parts.mesh.faces[parts.sources == 1]).size  # fmt: skip
    welded = build_face_graph(parts.mesh).edge_counts
    shared = bisect(Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]), 0.3)
    assert welded == build_face_graph(shared.mesh).edge_counts


@pytest.mark.parametrize("name", MESHES)
def test_an_infinite_or_sufficient_length_changes_nothing(name):
    mesh = MESHES[name]()
    for length in (math.inf, np.float64(edge_lengths(mesh).max())):
        parts = bisect(mesh, length)
        assert np.array_equal(parts.mesh.vertices, mesh.vertices)
        assert np.array_equal(parts.mesh.faces, mesh.faces)
        assert parts.sources.tolist() == list(range(mesh.n_faces))
        assert not parts.depths.any()


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("share", [0.6, 0.23, 0.05])
def test_parts_equal_those_of_the_twin(name, share):
    mesh = MESHES[name]()
    max_edge = share * float(edge_lengths(mesh).max())
    vertices, parts = reference.subdivide(mesh, max_edge)
    found = bisect(mesh, max_edge)
    assert np.array_equal(found.mesh.vertices, vertices)
    expected = [(*p.corners, p.depth, face) for face, of in enumerate(parts) for p in of]
    columns = (found.mesh.faces, found.depths[:, None], found.sources[:, None])
    assert list(map(tuple, np.concatenate(columns, axis=1).tolist())) == expected


@pytest.mark.parametrize("name", MESHES)
def test_what_holds_for_every_mesh(name):
    mesh = MESHES[name]()
    max_edge = 0.21 * float(edge_lengths(mesh).max())
    parts = bisect(mesh, max_edge)
    assert edge_lengths(parts.mesh).max() <= max_edge
    assert np.array_equal(parts.mesh.vertices[: mesh.n_vertices], mesh.vertices)
    assert np.all(np.diff(parts.sources) >= 0)
    assert np.unique(parts.sources).tolist() == list(range(mesh.n_faces))
    shares = np.exp2(-parts.depths.astype(float))
    assert np.array_equal(np.bincount(parts.sources, shares), np.ones(mesh.n_faces))
    assert np.allclose(areas(parts.mesh), shares * areas(mesh)[parts.sources], rtol=1e-9)
    # Rosenberg and Stenger
    bound = 0.5 * shapes.smallest_angles(mesh)[parts.sources]
    assert np.all(shapes.smallest_angles(parts.mesh) >= bound * (1 - 1e-9))


@pytest.mark.parametrize(
    "name", ["cube", "soup", "drilled block", "two islands", "moebius", "fins"]
)
def test_no_boundary_appears(name):
    """A T-junction would make a boundary edge inside an old face or on a shared edge."""
    mesh = MESHES[name]()
    before = build_face_graph(mesh).edge_counts
    parts = bisect(mesh, 0.3)
    after = build_face_graph(parts.mesh).edge_counts
    assert mesh_info(parts.mesh).n_components == mesh_info(mesh).n_components
    if before.boundary == 0:
        assert after.boundary == 0
        assert after.edges == 3 * parts.mesh.n_faces // 2
    corners = np.sort(parts.mesh.vertices[parts.mesh.faces], axis=1)
    assert len(corners) == parts.mesh.n_faces > mesh.n_faces
    assert after.inconsistent == 0 if before.inconsistent == 0 else after.inconsistent > 0
    assert (after.non_manifold > 0) == (before.non_manifold > 0)


def test_the_boundary_of_an_open_mesh_keeps_its_length():
    mesh = shapes.strip(6)
    parts = bisect(mesh, 0.4)
    counts = build_face_graph(parts.mesh).edge_counts
    # The boundary has 8 sides of length 1, each cut into four of length 1/4.
    assert counts.boundary == 32


@pytest.mark.parametrize("name", MESHES)
def test_subdividing_again_changes_nothing(name):
    once = bisect(MESHES[name](), 0.17)
    again = bisect(once.mesh, 0.17)
    assert np.array_equal(again.mesh.faces, once.mesh.faces)
    assert np.array_equal(again.mesh.vertices, once.mesh.vertices)


def test_the_result_does_not_depend_on_the_number_of_threads():
    mesh = shapes.bumpy_sheet(60)
    one, *others = (bisect(mesh, 0.006, n_threads=n) for n in (1, 2, 3, 8))
    assert one.mesh.n_faces > 50_000
    for other in others:
        assert np.array_equal(other.mesh.vertices, one.mesh.vertices)
        assert np.array_equal(other.mesh.faces, one.mesh.faces)
        assert np.array_equal(other.sources, one.sources)
        assert np.array_equal(other.depths, one.depths)


def test_lengths_scale_with_the_mesh():
    mesh = shapes.drilled_block(12)
    one = bisect(mesh, 0.11)
    other = bisect(Mesh(1024.0 * mesh.vertices, mesh.faces), 0.11 * 1024)
    assert np.array_equal(other.mesh.faces, one.mesh.faces)
    assert np.array_equal(other.mesh.vertices, 1024 * one.mesh.vertices)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(3, 9), st.integers(1, 12), st.floats(0.08, 2.0))
def test_tangles_equal_the_twin(seed, n_vertices, n_faces, max_edge):
    """Random faces have repeated corners, duplicate faces and equal positions."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(-3, 4, (n_vertices, 3)) / 4
    vertices[0] = [0.75, 0, 0.1]
    vertices[1] = [-0.75, -0.0, 0.1]
    faces = rng.integers(0, n_vertices, (n_faces, 3))
    faces[0] = [0, 1, 2]
    mesh = Mesh(vertices, faces)
    found = bisect(mesh, max_edge)
    points, parts = reference.subdivide(mesh, max_edge)
    assert np.array_equal(found.mesh.vertices, points)
    assert found.mesh.faces.tolist() == [list(p.corners) for of in parts for p in of]
    assert edge_lengths(found.mesh).max() <= max_edge


def test_unused_vertices_stay():
    mesh = Mesh([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 2, 3]])
    parts = bisect(mesh, 1.2)
    assert parts.mesh.vertices.tolist() == [*mesh.vertices.tolist(), [0.5, 0.5, 0]]


def test_labels_come_back_by_area():
    #  4 parts of 1/4 each for face 0; face 1 stays whole
    mesh = Mesh([[0, 0, 0], [4, 0, 0], [0, 4, 0], [9, 0, 0], [9, 1, 0], [9, 0, 1]],
                [[0, 1, 2], [3, 4, 5]])  # fmt: skip
    parts = bisect(mesh, 3.0)
    assert parts.sources.tolist() == [0, 0, 0, 0, 1]
    assert parts.labels_back([5, 7, 7, 6, -1]).tolist() == [7, -1]
    assert parts.labels_back([7, 5, 7, 5, 2]).tolist() == [5, 2]  # a tie
    assert parts.labels_back([2**40, 0, 2**40, 0, 2]).tolist() == [0, 2]
    assert parts.labels_back([8, 8, 8, 8, 2]).dtype == np.int64


def test_labels_come_back_by_exact_shares():
    """Parts are 1/2, 1/4, 1/8, ... of a face; sums of these fractions per label are compared."""
    parts = bisect(shapes.drilled_block(8), 0.13)
    rng = np.random.default_rng(1)
    labels = rng.integers(0, 3, len(parts.sources))
    totals = np.zeros((parts.n_sources, 3))
    np.add.at(totals, (parts.sources, labels), np.exp2(-parts.depths.astype(float)))
    assert len(np.unique(parts.depths)) > 1
    assert np.array_equal(parts.labels_back(labels), np.argmax(totals, axis=1))


def test_labels_of_old_faces_go_there_and_back():
    parts = bisect(shapes.drilled_block(8), 0.13)
    labels = np.random.default_rng(2).permutation(parts.n_sources)
    assert np.array_equal(parts.labels_back(labels[parts.sources]), labels)


def test_wrong_labels_are_refused():
    parts = bisect(shapes.cube(), 0.5)
    with pytest.raises(
        ValueError, match=r"labels must have one value per cell \(96\), got 3 values"
    ):
        parts.labels_back([0, 1, 2])
    with pytest.raises(TypeError, match="labels must contain integers, got float64"):
        parts.labels_back(np.zeros(parts.mesh.n_faces))


def test_a_subdivision_says_what_it_is_and_is_read_only():
    parts = bisect(shapes.cube(), 1.2)
    assert repr(parts) == "Subdivision(12 faces into 24)"
    for array in (parts.sources, parts.depths, parts.mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    again = pickle.loads(pickle.dumps(parts))
    assert isinstance(again, Subdivision)
    assert np.array_equal(again.labels_back(again.sources), np.arange(12))


@pytest.mark.parametrize(("max_edge", "error", "message"), [
    (0.0, ValueError, "max_edge must be finite and positive"),
    (-1.0, ValueError, "max_edge must be finite and positive"),
    (-math.inf, ValueError, "max_edge must be finite and positive"),
    (math.nan, ValueError, "max_edge must be finite and positive"),
    ("1", TypeError, "max_edge must be a number"),
    (True, TypeError, "max_edge must be a number"),
    (1e-13, ValueError,
     "max_edge must be at least 1e-12 for coordinates of 1, got 1e-13: use a larger max_edge,"
     " or move the mesh to the origin"),
])  # fmt: skip
def test_wrong_lengths_are_refused(max_edge, error, message):
    with pytest.raises(error, match=message):
        bisect(shapes.cube(), max_edge)


def test_a_mesh_far_from_the_origin_ends_in_a_message_not_in_a_loop():
    mesh = Mesh(shapes.cube().vertices + 1e13, shapes.cube().faces)
    with pytest.raises(
        ValueError,
        match=r"max_edge must be at least 10 for coordinates of 1e\+13, got 0\.5: use a"
        r" larger max_edge, or move the mesh to the origin",
    ):
        bisect(mesh, 0.5)
    assert bisect(Mesh(shapes.cube().vertices + 1e11, shapes.cube().faces), 0.5).mesh.n_faces > 12


def test_more_faces_than_allowed_are_refused_before_memory_is_taken():
    with pytest.raises(ValueError, match="max_edge=1e-06 would make more than 10000000 faces"):
        bisect(shapes.cube(), 1e-6)
    with pytest.raises(ValueError, match=r"would make more than 23 faces: .* a larger max_faces"):
        bisect(shapes.cube(), 1.2, max_faces=23)
    assert bisect(shapes.cube(), 1.2, max_faces=24).mesh.n_faces == 24
    assert bisect(shapes.cube(), math.inf, max_faces=12).mesh.n_faces == 12
    with pytest.raises(ValueError, match="would make more than 11 faces"):
        bisect(shapes.cube(), math.inf, max_faces=11)
    with pytest.raises(ValueError, match="max_faces must be at least 1"):
        bisect(shapes.cube(), 1.0, max_faces=0)


def test_what_is_no_mesh_is_refused():
    with pytest.raises(MeshError, match="the mesh has no faces"):
        bisect(([[0, 0, 0]], np.zeros((0, 3), int)), 1.0)
