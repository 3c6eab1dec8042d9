"""Stage 0: meshes of polygons, their checks, measures, and the triangles they can be cut into."""

import copy
import pickle
import types

import numpy as np
import pytest
import shapes

from superfacets import Mesh, MeshError, PolygonMesh, _core
from superfacets.mesh import faces as of_mesh
from superfacets.mesh.convert import as_mesh

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]

# An arrow: five corners in the plane z = 2, of which one is not convex.
ARROW = PolygonMesh.of_faces(
    [[0, 0, 2], [4, 0, 2], [4, 4, 2], [2, 1, 2], [0, 4, 2]], [[0, 1, 2, 3, 4]]
)

# An L of three unit squares, seen from above.
L_SHAPE = PolygonMesh.of_faces(
    [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], [[0, 1, 2, 3, 4, 5]]
)


def turned(mesh, first):
    """Return the mesh of one face with another corner as the first."""
    return PolygonMesh(mesh.vertices, mesh.offsets, np.roll(mesh.indices, -first))


@pytest.mark.parametrize("first", range(6))
def test_an_l_has_the_area_and_centroid_of_its_three_squares(first):
    centroids, areas = of_mesh.measure_faces(turned(L_SHAPE, first), 1)
    assert areas == pytest.approx([3.0], rel=1e-15)
    assert centroids == pytest.approx(np.array([[5 / 6, 5 / 6, 0.0]]), rel=1e-15)
    assert of_mesh.area_vectors(turned(L_SHAPE, first), 1) == pytest.approx(np.array([[0, 0, 3.0]]))


@pytest.mark.parametrize("first", range(5))
def test_an_arrow_has_the_area_and_centroid_of_a_square_less_a_triangle(first):
    """A square of side 4 minus a triangle of base 4 and height 3, whose centroid is at y = 3."""
    centroids, areas = of_mesh.measure_faces(turned(ARROW, first), 1)
    assert areas == pytest.approx([10.0], rel=1e-15)
    assert centroids == pytest.approx(np.array([[2.0, (16 * 2 - 6 * 3) / 10, 2.0]]), rel=1e-15)


def test_a_bent_quad_has_the_area_that_is_seen_along_its_normal():
    """Two right triangles of area 1/2 with a right angle between them."""
    bent = PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[0, 1, 2, 3]])
    assert of_mesh.area_vectors(bent, 1) == pytest.approx(np.array([[-0.5, -0.5, 0.0]]))
    assert of_mesh.measure_faces(bent, 1)[1] == pytest.approx([np.sqrt(0.5)])


def test_a_bow_tie_has_no_area_and_the_mean_of_its_corners():
    tie = PolygonMesh.of_faces(SQUARE, [[0, 1, 3, 2]])
    centroids, areas = of_mesh.measure_faces(tie, 1)
    assert (centroids.tolist(), areas.tolist()) == ([[0.5, 0.5, 0.0]], [0.0])
    assert of_mesh.count_degenerate(tie, 1) == 1


def test_the_centroid_of_a_face_that_crosses_itself_stays_in_its_box():
    """The areas of the two loops nearly cancel, so moment / area is far from the face."""
    tie = PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1.001, 1, 0]], [[0, 1, 2, 3]])
    ((x, y, z),), (area,) = of_mesh.measure_faces(tie, 1)
    assert 0 < area < 1e-3
    assert 0 <= x <= 1.001
    assert 0 <= y <= 1
    assert z == 0


def test_corners_that_repeat_change_nothing():
    plain = of_mesh.measure_faces(PolygonMesh.of_faces(SQUARE, [[0, 1, 2, 3]]), 1)
    for face in ([0, 0, 1, 2, 3], [0, 1, 1, 2, 2, 3], [0, 1, 2, 3, 3, 0]):
        centroids, areas = of_mesh.measure_faces(PolygonMesh.of_faces(SQUARE, [face]), 1)
        assert np.array_equal(centroids, plain[0])
        assert np.array_equal(areas, plain[1])


def test_triangles_are_measured_as_those_of_a_mesh():
    mesh = shapes.bumpy_sheet(8)
    polygons = PolygonMesh.of_faces(mesh.vertices, mesh.faces)
    for one, other in zip(
        of_mesh.measure_faces(mesh, 1), of_mesh.measure_faces(polygons, 1), strict=True
    ):
        assert np.array_equal(one, other)
    assert of_mesh.area_vectors(polygons, 1) == pytest.approx(of_mesh.area_vectors(mesh, 1))
    areas = of_mesh.measure_faces(mesh, 1)[1]
    *_, longest = _core.measure_faces(mesh.vertices, mesh.faces, 1)
    for length in (0.0, 0.05, 0.2):
        slivers = [of_mesh.sliver_area(m, areas, longest, length, 0.1, 1) for m in (mesh, polygons)]
        assert slivers[0] == slivers[1]


def test_a_long_rectangle_is_a_sliver_by_its_width():
    plank = PolygonMesh.of_faces([[0, 0, 0], [8, 0, 0], [8, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    areas = of_mesh.measure_faces(plank, 1)[1]
    assert of_mesh.sliver_area(plank, areas, None, 4.0, 1.1, 1) == 8.0
    assert of_mesh.sliver_area(plank, areas, None, 4.0, 0.9, 1) == 0.0
    assert of_mesh.sliver_area(plank, areas, None, 9.0, 1.1, 1) == 0.0


def test_triangles_of_convex_faces_are_their_fans():
    mesh = PolygonMesh.of_faces([*SQUARE, [0.5, 2, 0]], [[0, 1, 2, 3], [3, 2, 4], [1, 2, 4, 3, 0]])
    cut = mesh.triangulate()
    assert cut.mesh.faces.tolist() == [
        [0, 1, 2], [0, 2, 3], [3, 2, 4], [1, 2, 4], [1, 4, 3], [1, 3, 0],
    ]  # fmt: skip
    assert cut.sources.tolist() == [0, 0, 1, 2, 2, 2]


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("shape", [L_SHAPE, ARROW], ids=["l", "arrow"])
def test_triangles_of_concave_faces_do_not_overlap(shape, first):
    cut = turned(shape, first % len(shape.indices)).triangulate()
    vectors = of_mesh.area_vectors(cut.mesh, 1)
    assert (vectors[:, 2] > 0).all()
    assert vectors[:, 2].sum() == pytest.approx(of_mesh.measure_faces(shape, 1)[1][0])


def test_triangles_of_a_comb_do_not_overlap():
    """A comb of teeth 1 wide, 9 high and 1 apart, on a back 1 high."""
    n = 40
    teeth = [[[2 * i, 0], [2 * i, 10], [2 * i + 1, 10], [2 * i + 1, 1]] for i in range(n)]
    gaps = [[[2 * i + 2, 1]] for i in range(n)]
    rim = [corner for tooth, gap in zip(teeth, gaps, strict=True) for corner in (*tooth[1:], *gap)]
    flat = np.array([[0, 0], *rim[:-1], [2 * n - 1, 0]], dtype=float)
    keep = [0]
    for i in range(1, len(flat)):
        if (flat[i] != flat[keep[-1]]).any():
            keep.append(i)
    corners = np.column_stack([flat[keep], np.zeros(len(keep))])[::-1]
    comb = PolygonMesh.of_faces(corners, [list(range(len(corners)))])
    cut = comb.triangulate()
    assert cut.mesh.n_faces == len(corners) - 2
    heights = of_mesh.area_vectors(cut.mesh, 1)[:, 2]
    assert (heights >= 0).all()
    assert heights.sum() == pytest.approx(of_mesh.measure_faces(comb, 1)[1][0])


def test_a_face_without_ears_is_cut_all_the_same():
    star = [[np.cos(a), np.sin(a), 0] for a in 2 * np.pi * 2 * np.arange(5) / 5]  # winds twice
    assert PolygonMesh.of_faces(star, [range(5)]).triangulate().mesh.n_faces == 3
    assert PolygonMesh.of_faces(SQUARE, [[0, 1, 3, 2]]).triangulate().mesh.n_faces == 2


def test_faces_with_many_corners_are_cut_in_time():
    angles = 2 * np.pi * np.arange(100_000) / 100_000
    radii = np.where(np.arange(100_000) % 2, 1.0, 0.9)  # too many corners for a search of ears
    points = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 0 * angles])
    assert PolygonMesh.of_faces(points, [range(100_000)]).triangulate().mesh.n_faces == 99_998


def test_a_mesh_says_what_it_holds():
    mesh = PolygonMesh.of_faces([*SQUARE, [9, 9, 9]], [[0, 1, 2, 3], [0, 2, 3]])
    assert repr(mesh) == "PolygonMesh(5 vertices, 2 faces)"
    assert (mesh.n_faces, mesh.n_vertices, mesh.sizes.tolist()) == (2, 5, [4, 3])
    assert mesh.face(1).tolist() == [0, 2, 3]
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
    for face in (-1, 2):
        with pytest.raises(IndexError, match=f"there is no face {face}: the number of faces is 2"):
            mesh.face(face)


def test_arrays_are_copied_and_read_only():
    offsets, indices = np.array([0, 4]), np.arange(4, dtype=np.int32)
    mesh = PolygonMesh(SQUARE, offsets, indices)
    offsets[1] = indices[0] = 9
    assert mesh.face(0).tolist() == [0, 1, 2, 3]
    for array in (mesh.vertices, mesh.offsets, mesh.indices, mesh.bounds):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))]
)
def test_copies_are_checked_and_read_only(copied):
    other = copied(L_SHAPE)
    assert of_mesh.is_same_mesh(other, L_SHAPE)
    assert not other.indices.flags.writeable
    with pytest.raises(
        ValueError,
        match="the copy or pickle is damaged: it must have the fields vertices, offsets, indices",
    ):
        L_SHAPE.__class__.__setstate__(object.__new__(PolygonMesh), {"vertices": SQUARE})


@pytest.mark.parametrize(("offsets", "indices", "message"), [
    ([0], [], "the mesh has no faces"),
    ([], [], "the mesh has no faces"),
    ([0, 2], [0, 1], r"faces\[0\] must have at least 3 corners, got 2"),
    ([0, 4, 4], [0, 1, 2, 3], r"faces\[1\] must have at least 3 corners, got 0"),
    ([0, 4, 3, 7], [0, 1, 2, 3, 0, 1, 2], r"faces\[1\] must have at least 3 corners, got -1"),
    ([0, 3], [0, 1, 2, 3], "end at the number of corners, 4, got 0 and 3"),
    ([1, 4], [0, 1, 2, 3], "offsets must start at 0 .* got 1 and 4"),
    ([0, 2**62, 4], [0, 1, 2, 3],
     r"faces\[0\] must have at least 3 corners, got 4611686018427387904"),
    ([0, 4], [0, 1, 2, 4], r"faces\[0\] refers to vertex 4 but the mesh has 4 vertices"),
    ([0, 3, 6], [0, 1, 2, 0, -1, 2], r"faces\[1\] refers to vertex -1"),
    ([0, 4], [0, 1, 2, 2**40], r"faces\[0\] refers to vertex 1099511627776"),
    ([0.0, 4.0], [0, 1, 2, 3], "offsets must contain integers, got float64"),
    ([0, 4], [0.0, 1.0, 2.0, 3.0], "indices must contain integers, got float64"),
    ([[0, 4]], [0, 1, 2, 3], r"offsets must be one-dimensional, got shape \(1, 2\)"),
    ([0, 4], [[0, 1, 2, 3]], r"indices must be one-dimensional, got shape \(1, 4\)"),
])  # fmt: skip
def test_invalid_arrays_are_refused_by_a_message_that_says_where(offsets, indices, message):
    with pytest.raises(MeshError, match=message):
        PolygonMesh(SQUARE, offsets, indices)


@pytest.mark.parametrize(("faces", "message"), [
    ([[0, 1]], r"faces\[0\] must have at least 3 corners, got 2"),
    ([[0, 1, 2], []], r"faces\[1\] must have at least 3 corners, got 0"),
    ([], "the mesh has no faces"),
    ([[0, 1, 2.5]], "a face must contain integers, got float64"),
    ([[0, 1, 2], 3], r"a face must be one-dimensional, got shape \(\)"),
    (np.zeros((2, 2, 2), int), r"lists of vertices or an array of shape \(F, n\)"),
    (np.ma.masked_equal([[0, 1, 2, 3]], 3),
     "faces must not have masked entries: fill or remove these entries"),
])  # fmt: skip
def test_invalid_lists_of_faces_are_refused(faces, message):
    with pytest.raises(MeshError, match=message):
        PolygonMesh.of_faces(SQUARE, faces)


def test_vertices_are_checked_as_those_of_triangles():
    with pytest.raises(MeshError, match=r"vertices\[1\] must be finite, got \[1.0, nan, 0.0\]"):
        PolygonMesh.of_faces([[0, 0, 0], [1, np.nan, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    with pytest.raises(MeshError, match="all faces lie at one point"):
        PolygonMesh.of_faces([[1, 1, 1]] * 4, [[0, 1, 2, 3]])


def test_pairs_of_arrays_are_triangles_where_all_faces_are():
    assert isinstance(as_mesh((SQUARE, [[0, 1, 2], [0, 2, 3]])), Mesh)
    assert as_mesh((SQUARE, np.array([[0, 1, 2, 3]]))).offsets.tolist() == [0, 4]
    assert as_mesh((SQUARE, [[0, 1, 2, 3]])).offsets.tolist() == [0, 4]
    assert as_mesh((SQUARE, [[0, 1, 2], [3, 2, 1, 0]])).offsets.tolist() == [0, 3, 7]
    ragged = np.array([[0, 1, 2], [3, 2, 1, 0]], dtype=object)
    assert as_mesh((SQUARE, ragged)).offsets.tolist() == [0, 3, 7]
    assert as_mesh(L_SHAPE) is L_SHAPE


def test_quads_and_mixed_polydata_of_pyvista_keep_their_faces_in_order():
    pyvista = pytest.importorskip("pyvista")
    plane = as_mesh(pyvista.Plane(i_resolution=3, j_resolution=2))
    assert (plane.n_faces, set(plane.sizes.tolist())) == (6, {4})
    foreign = pyvista.PolyData(np.array([*SQUARE, [0.5, 2, 0]], float), [4, 0, 1, 2, 3, 3, 3, 2, 4])
    assert as_mesh(foreign).indices.tolist() == [0, 1, 2, 3, 3, 2, 4]


@pytest.mark.parametrize(("flat", "message"), [
    ([4, 0, 1, 2, 3, 3, 0, 1],
     "of a PolyData has 3 corners, but the array of faces has only 2 more values"),
    ([3, 0, 1, 2, -1],
     "of a PolyData has -1 corners, but the array of faces has only 0 more values"),
    ([3, 0, 1, 2, 0], "must have at least 3 corners, got 0"),
])  # fmt: skip
def test_flat_faces_that_run_beyond_their_end_are_refused(flat, message):
    odd = types.SimpleNamespace(points=np.array(SQUARE, float), faces=np.array(flat))
    with pytest.raises(MeshError, match=rf"faces\[1\] {message}"):
        as_mesh(odd)


def test_faces_of_another_mesh_differ():
    assert of_mesh.is_same_mesh(L_SHAPE, L_SHAPE)
    assert not of_mesh.is_same_mesh(L_SHAPE, turned(L_SHAPE, 1))
    mesh = Mesh(SQUARE, [[0, 1, 2], [0, 2, 3]])
    assert of_mesh.is_same_mesh(mesh, Mesh(SQUARE, [[0, 1, 2], [0, 2, 3]]))
    assert not of_mesh.is_same_mesh(mesh, PolygonMesh.of_faces(SQUARE, mesh.faces))
    two = PolygonMesh(L_SHAPE.vertices, [0, 3, 7], [0, 1, 2, 3, 4, 5, 0])
    assert not of_mesh.is_same_mesh(two, PolygonMesh(two.vertices, [0, 4, 7], two.indices))
