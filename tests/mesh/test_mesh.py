"""Stage 0: inputs that are accepted as a mesh, and errors for other inputs."""

import types

import numpy as np
import pytest
import shapes

from superfacets import Mesh, MeshError, segment
from superfacets.mesh.convert import as_mesh

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_vertices_of_the_right_type_are_not_copied_and_faces_always_are():
    vertices = np.array(TRIANGLE, dtype=np.float64)
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    mesh = Mesh(vertices, faces)
    assert np.shares_memory(mesh.vertices, vertices)
    assert not np.shares_memory(mesh.faces, faces)


def test_faces_that_a_reader_has_made_are_not_copied_again():
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    mesh = Mesh._of_new(np.array(TRIANGLE, dtype=np.float64), faces)
    assert np.shares_memory(mesh.faces, faces)
    with pytest.raises(MeshError, match="refers to vertex 3"):
        Mesh._of_new(np.array(TRIANGLE, dtype=np.float64), faces + 1)


def test_what_was_checked_cannot_be_changed():
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    mesh = Mesh(TRIANGLE, faces)
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 9
    faces[0, 0] = 1  # the caller's own array stays writable


def test_more_vertices_than_int32_counts_are_refused():
    many = np.broadcast_to(np.zeros(3), (2**31, 3))
    with pytest.raises(MeshError, match="2147483648 vertices; at most 2147483647"):
        Mesh(many, [[0, 1, 2]])
    with pytest.raises(MeshError, match="2147483648 faces; at most 2147483647"):
        Mesh(TRIANGLE, np.broadcast_to(np.arange(3), (2**31, 3)))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32, np.int64, np.uint64])
def test_faces_of_any_integer_type_become_int32(dtype):
    mesh = Mesh(TRIANGLE, np.array([[0, 1, 2]], dtype=dtype))
    assert mesh.faces.dtype == np.int32
    assert mesh.faces.tolist() == [[0, 1, 2]]


def test_fortran_order_float32_and_read_only_arrays_are_taken():
    vertices = np.asfortranarray(np.array(TRIANGLE, dtype=np.float32))
    vertices.setflags(write=False)
    assert Mesh(vertices, [[0, 1, 2]]).vertices.tolist() == TRIANGLE


def test_callers_arrays_are_never_changed():
    mesh = shapes.bumpy_sheet(8)
    vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
    segment((mesh.vertices, mesh.faces), 5)
    assert np.array_equal(mesh.vertices, vertices)
    assert np.array_equal(mesh.faces, faces)


def test_a_signaling_nan_is_refused_without_a_warning():
    vertices = np.array(TRIANGLE, dtype=np.float32)
    vertices.view(np.uint32)[1, 0] = 0x7FA00000
    with pytest.raises(MeshError, match=r"vertices\[1\] must be finite, got \[nan, 0.0, 0.0\]"):
        Mesh(vertices, [[0, 1, 2]])


@pytest.mark.parametrize(("vertices", "faces", "message"), [
    (TRIANGLE, np.zeros((0, 3), int), "the mesh has no faces"),
    (TRIANGLE, [], "the mesh has no faces"),
    (np.zeros((0, 3)), [[0, 1, 2]], r"faces\[0\] refers to vertex 0 but the mesh has 0 vert"),
    (TRIANGLE, [[0, 1, 2], [0, 1, 3]], r"faces\[1\] refers to vertex 3 but the mesh has 3 v"),
    (TRIANGLE, [[0, -1, 2]], r"faces\[0\] refers to vertex -1"),
    (TRIANGLE, [[0, 1, 2**40]], r"faces\[0\] refers to vertex 1099511627776"),
    (TRIANGLE, [[0, 1, 2, 0]],
     "faces of a Mesh must have 3 corners, got 4: use a PolygonMesh instead"),
    (TRIANGLE, [[0, 1]], r"faces must have shape \(F, 3\), got \(1, 2\)"),
    (TRIANGLE, [0, 1, 2], r"faces must have shape \(F, 3\), got \(3,\)"),
    (TRIANGLE, [[0.0, 1.0, 2.0]], "faces must contain integers, got float64"),
    (TRIANGLE, [[True, False, True]], "faces must contain numbers, got bool"),
    (TRIANGLE, [[0, 1, 2], [0, 1]], "faces must be a rectangular array"),
    ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], r"vertices must have shape \(V, 3\), got \(3, 2\)"),
    ([["a", "b", "c"]], [[0, 0, 0]], "vertices must contain numbers, got <U1"),
    ([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]], [[0, 1, 2]],
     r"vertices\[1\] must be finite, got \[1.0, nan, 0.0\]"),
    ([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], [[0, 1, 2]],
     r"vertices\[2\] must be finite, got \[0.0, inf, 0.0\]"),
    ([[1, 1, 1]] * 3, [[0, 1, 2]], "all faces lie at one point"),
    (np.array(TRIANGLE) * 1e-17, [[0, 1, 2]],
     r"the longest side of the bounding box must be 1e-15 to 1e\+15, got 1e-17: rescale the"
     r" mesh"),
    (np.array(TRIANGLE) * 1e300, [[0, 1, 2]],
     r"the longest side of the bounding box must be 1e-15 to 1e\+15, got 1e\+300: rescale the"
     r" mesh"),
    ([[0, 0, 0], [-1e308, 0, 0], [1e308, 1, 0]], [[0, 1, 2]],
     r"the longest side of the bounding box must be 1e-15 to 1e\+15, got inf: rescale the mesh"),
])  # fmt: skip
def test_invalid_arrays_are_refused_by_a_message_that_says_where(vertices, faces, message):
    with pytest.raises(MeshError, match=message):
        Mesh(vertices, faces)


def test_an_unused_vertex_far_away_is_no_fault():
    mesh = Mesh([*TRIANGLE, [1e200, 0, 0]], [[0, 1, 2]])
    assert segment(mesh, 1).labels.tolist() == [0]


def test_the_bounds_are_those_of_the_vertices_that_faces_use():
    mesh = Mesh([*TRIANGLE, [1e200, 0, 0]], [[0, 1, 2]])
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
    with pytest.raises(ValueError, match="read-only"):
        mesh.bounds[0, 0] = 9


@pytest.mark.parametrize("dtype", [np.int32, np.int64, np.uint64])
@pytest.mark.parametrize("n_threads", ["1", "3"])
def test_the_first_offender_of_a_large_mesh_is_named(monkeypatch, dtype, n_threads):
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", n_threads)
    n = 70_000
    vertices = np.random.default_rng(0).normal(size=(n, 3))
    faces = np.arange(3 * n).reshape(n, 3) % n
    assert np.array_equal(Mesh(vertices, faces.astype(dtype)).bounds[1], vertices.max(axis=0))
    broken = faces.astype(dtype)
    broken[[50_001, 65_000], 1] = n
    with pytest.raises(MeshError, match=r"faces\[50001\] refers to vertex 70000 but the mesh"):
        Mesh(vertices, broken)
    vertices[[40_002, 69_999], 2] = np.nan
    with pytest.raises(MeshError, match=r"vertices\[40002\] must be finite, got \[-0.46.*, nan\]"):
        Mesh(vertices, faces.astype(dtype))


@pytest.mark.parametrize("index", [2**32, 2**32 + 1, 2**63, 2**64 - 1])
def test_indices_that_would_wrap_around_are_out_of_range(index):
    with pytest.raises(
        MeshError, match=rf"faces\[0\] refers to vertex {index} but the mesh has 3 vertices"
    ):
        Mesh(TRIANGLE, np.array([[0, index, 2]], dtype=np.uint64))


def test_objects_that_are_no_meshes_are_refused_with_what_is_accepted():
    with pytest.raises(
        TypeError, match=r"expected a mesh of superfacets, .* or meshio, got dict: convert a"
    ):
        as_mesh({})
    with pytest.raises(TypeError, match=r"a mesh must be a \(vertices, faces\) pair, got 3 items"):
        as_mesh(([1], [2], [3]))


def test_a_scene_is_refused_with_the_way_to_a_mesh():
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene(trimesh.creation.box())
    with pytest.raises(
        TypeError, match=r"expected a mesh of superfacets, .* or meshio, got Scene: convert a"
    ):
        as_mesh(scene)


def test_a_mesh_of_trimesh_keeps_its_faces_in_order():
    trimesh = pytest.importorskip("trimesh")
    original = shapes.bumpy_sheet(6)
    foreign = trimesh.Trimesh(original.vertices, original.faces, process=False)
    assert np.array_equal(as_mesh(foreign).faces, original.faces)
    assert np.array_equal(segment(foreign, 4).labels, segment(original, 4).labels)


def test_polydata_of_pyvista_keeps_its_faces_in_order():
    pyvista = pytest.importorskip("pyvista")
    original = shapes.bumpy_sheet(6)
    foreign = pyvista.PolyData.from_regular_faces(original.vertices, original.faces)
    assert np.array_equal(as_mesh(foreign).faces, original.faces)
    assert np.array_equal(segment(foreign, 4).labels, segment(original, 4).labels)


def test_polydata_of_strips_or_points_is_refused():
    pyvista = pytest.importorskip("pyvista")
    with pytest.raises(
        MeshError,
        match=r"a PolyData must not have triangle strips: call \.triangulate\(\) on it first",
    ):
        as_mesh(pyvista.Sphere().strip())
    with pytest.raises(MeshError, match="no faces"):
        as_mesh(pyvista.PolyData(np.random.default_rng(0).uniform(size=(5, 3))))


def test_an_unstructured_grid_is_no_surface():
    pyvista = pytest.importorskip("pyvista")
    with pytest.raises(
        TypeError,
        match=r"expected a mesh of superfacets, .* or meshio, got UnstructuredGrid: convert a",
    ):
        as_mesh(pyvista.Sphere().cast_to_unstructured_grid())


def test_faces_of_a_polydata_look_alike_must_be_flat():
    odd = types.SimpleNamespace(points=np.array(TRIANGLE), faces=np.zeros((2, 2, 2), int))
    with pytest.raises(
        MeshError, match=r"faces of a PolyData must have shape \(n,\), got shape \(2, 2, 2\)"
    ):
        as_mesh(odd)


def test_a_legacy_mesh_of_open3d_is_known_by_its_attributes():
    foreign = types.SimpleNamespace(
        vertices=np.array(TRIANGLE, float), triangles=np.array([[0, 1, 2]], np.int32)
    )
    assert as_mesh(foreign).faces.tolist() == [[0, 1, 2]]


class _Tensor:
    """The part of an Open3D tensor that is used."""

    def __init__(self, values):
        self._values = np.array(values)

    def cpu(self):
        return self

    def numpy(self):
        return self._values


class _TensorMap(dict):
    __getattr__ = dict.__getitem__


def test_a_tensor_mesh_of_open3d_is_known_by_its_attributes():
    vertex = _TensorMap(positions=_Tensor(np.array(TRIANGLE, np.float32)))
    faces = _TensorMap(indices=_Tensor(np.array([[0, 1, 2]])))
    foreign = types.SimpleNamespace(vertex=vertex, triangle=faces)
    assert as_mesh(foreign).faces.tolist() == [[0, 1, 2]]
    with pytest.raises(MeshError, match="no faces"):
        as_mesh(types.SimpleNamespace(vertex=vertex, triangle=_TensorMap()))


def test_arrays_that_begin_at_odd_bytes_are_copied():
    vertices = np.frombuffer(b"#" + shapes.cube().vertices.tobytes(), np.float64, offset=1)
    faces = np.frombuffer(b"#" + shapes.cube().faces.tobytes(), np.int32, offset=1)
    mesh = Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3))
    assert mesh.vertices.flags.aligned
    assert mesh.faces.flags.aligned
    assert np.array_equal(mesh.faces, shapes.cube().faces)
