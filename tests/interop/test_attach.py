"""Labels and colors in objects of the real libraries, read as users of the libraries do."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets_show.colors import NO_COLOR

SHEET = shapes.bumpy_sheet(8)
LABELS = sf.segment(SHEET, 5)
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
GRID = np.array([[x, y, 0] for y in range(3) for x in range(3)], float)


def trimesh_sheet(trimesh):
    return trimesh.Trimesh(SHEET.vertices, SHEET.faces, process=False)


def test_a_mesh_of_trimesh_gets_face_attributes_and_colors():
    mesh = trimesh_sheet(pytest.importorskip("trimesh"))
    sf.attach_labels(mesh, LABELS, colors=True)
    assert mesh.face_attributes["superfacets"].dtype == np.int32
    assert np.array_equal(mesh.face_attributes["superfacets"], LABELS.labels)
    expected = sf.face_colors(SHEET, LABELS.labels)
    assert np.array_equal(mesh.visual.face_colors[:, :3], expected)
    assert mesh.visual.kind == "face"


def test_a_texture_of_trimesh_makes_room_for_colors():
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh_sheet(trimesh)
    mesh.visual = trimesh.visual.TextureVisuals(uv=SHEET.vertices[:, :2])
    sf.attach_labels(mesh, LABELS)
    assert mesh.visual.kind == "texture"
    sf.attach_labels(mesh, LABELS, colors=True)
    assert np.array_equal(mesh.visual.face_colors[:, :3], sf.face_colors(SHEET, LABELS.labels))


def test_vertices_of_trimesh_get_labels_and_given_colors():
    mesh = trimesh_sheet(pytest.importorskip("trimesh"))
    of_vertices = np.arange(SHEET.n_vertices) // 9
    colors = np.repeat([[10, 20, 30]], SHEET.n_vertices, axis=0).astype(np.uint8)
    sf.attach_labels(mesh, of_vertices, location="points", name="row", colors=colors)
    assert np.array_equal(mesh.vertex_attributes["row"], of_vertices)
    assert np.array_equal(mesh.visual.vertex_colors[:, :3], colors)


def test_a_cloud_of_trimesh_gets_metadata_and_colors():
    trimesh = pytest.importorskip("trimesh")
    cloud = trimesh.PointCloud(SHEET.vertices)
    result = sf.segment(cloud, 4)
    sf.attach_labels(cloud, result, colors=True)
    assert np.array_equal(cloud.metadata["superfacets"], result.labels)
    assert np.array_equal(cloud.colors[:, :3], sf.face_colors(cloud, result.labels))


def test_a_surface_of_pyvista_gets_cell_data():
    pyvista = pytest.importorskip("pyvista")
    surface = pyvista.PolyData.from_regular_faces(SHEET.vertices, SHEET.faces)
    sf.attach_labels(surface, LABELS, name="Label", colors=True)
    assert np.array_equal(surface.cell_data["Label"], LABELS.labels)
    expected = sf.face_colors(SHEET, LABELS.labels)
    assert np.array_equal(surface.cell_data["Label_colors"], expected)
    of_vertices = np.arange(SHEET.n_vertices)
    sf.attach_labels(surface, of_vertices, location="points")
    assert np.array_equal(surface.point_data["superfacets"], of_vertices)


def test_vertices_and_lines_of_pyvista_have_no_label():
    pyvista = pytest.importorskip("pyvista")
    surface = pyvista.PolyData(
        GRID, verts=[1, 8], lines=[2, 0, 8, 2, 6, 8], faces=[4, *QUADS[0], 4, *QUADS[1]]
    )
    sf.attach_labels(surface, [1, 0], colors=True)
    assert surface.cell_data["superfacets"].tolist() == [-1, -1, -1, 1, 0]
    colors = surface.cell_data["superfacets_colors"]
    assert colors[:3].tolist() == [list(NO_COLOR)] * 3
    assert not np.array_equal(colors[3], colors[4])
    faces = surface.extract_cells(surface.cell_data["superfacets"] == 0).cells
    assert faces.tolist()[:1] == [4]


def test_points_and_tetrahedra_of_pyvista():
    pyvista = pytest.importorskip("pyvista")
    cloud = pyvista.PolyData(SHEET.vertices)
    result = sf.segment(cloud, 4)
    sf.attach_labels(cloud, result)
    assert np.array_equal(cloud.point_data["superfacets"], result.labels)
    two = shapes.two_tets()
    tets = pyvista.UnstructuredGrid({10: two.tets}, two.vertices)
    sf.attach_labels(tets, [1, 0])
    assert tets.cell_data["superfacets"].tolist() == [1, 0]


def test_blocks_of_meshio_get_their_parts(tmp_path):
    meshio = pytest.importorskip("meshio")
    blocks = [
        ("triangle", [[3, 4, 7], [3, 7, 6]]), ("line", [[0, 8]]), ("quad", QUADS),
        ("triangle", [[4, 5, 8]]),
    ]  # fmt: skip
    mesh = meshio.Mesh(GRID, blocks)
    sf.attach_labels(mesh, [4, 3, 2, 1, 0], colors=True)
    mesh.write(tmp_path / "mixed.vtu")
    read = meshio.read(tmp_path / "mixed.vtu")
    parts = [part.tolist() for part in read.cell_data["superfacets"]]
    assert parts == [[4, 3], [-1], [2, 1], [0]]
    assert read.cell_data["superfacets_colors"][1].tolist() == [list(NO_COLOR)]
    assert len(np.unique(np.concatenate(read.cell_data["superfacets_colors"]), axis=0)) > 2


def test_points_and_tetrahedra_of_meshio():
    meshio = pytest.importorskip("meshio")
    two = shapes.two_tets()
    mesh = meshio.Mesh(two.vertices, [("triangle", [[0, 1, 2]]), ("tetra", two.tets)])
    sf.attach_labels(mesh, [1, 0])
    assert [part.tolist() for part in mesh.cell_data["superfacets"]] == [[-1], [1, 0]]
    sf.attach_labels(mesh, range(5), location="points")
    assert mesh.point_data["superfacets"].tolist() == [0, 1, 2, 3, 4]
    cloud = meshio.Mesh(SHEET.vertices, [])
    sf.attach_labels(cloud, np.zeros(SHEET.n_vertices, int))
    assert len(cloud.point_data["superfacets"]) == SHEET.n_vertices


def test_a_tensor_mesh_of_open3d_gets_attributes_of_triangles():
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed")
    mesh = open3d.t.geometry.TriangleMesh(
        open3d.core.Tensor(SHEET.vertices), open3d.core.Tensor(SHEET.faces)
    )
    sf.attach_labels(mesh, LABELS, colors=True)
    assert np.array_equal(mesh.triangle["superfacets"].numpy(), LABELS.labels)
    expected = sf.face_colors(SHEET, LABELS.labels) / np.float32(255)
    assert np.array_equal(mesh.triangle.colors.numpy(), expected)
    # A selection of triangles keeps the attributes of triangles.
    part = mesh.select_faces_by_mask(open3d.core.Tensor(LABELS.labels == 3))
    assert set(part.triangle["superfacets"].numpy().tolist()) == {3}
    sf.attach_labels(mesh, range(SHEET.n_vertices), location="points")
    assert np.array_equal(mesh.vertex["superfacets"].numpy(), np.arange(SHEET.n_vertices))


def test_a_tensor_cloud_of_open3d_gets_attributes_of_points():
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed")
    cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(SHEET.vertices))
    result = sf.segment(cloud, 4)
    sf.attach_labels(cloud, result, colors=True)
    assert np.array_equal(cloud.point["superfacets"].numpy(), result.labels)
    assert cloud.point.colors.numpy().max() <= 1
    part = cloud.select_by_mask(open3d.core.Tensor(result.labels == 2))
    assert set(part.point["superfacets"].numpy().tolist()) == {2}


def test_legacy_classes_of_open3d_have_no_place_for_labels():
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed")
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(SHEET.vertices.copy()),
        open3d.utility.Vector3iVector(SHEET.faces.copy()),
    )
    cloud = open3d.geometry.PointCloud(mesh.vertices)
    for target, labels in ((mesh, LABELS), (cloud, np.zeros(SHEET.n_vertices, int))):
        with pytest.raises(TypeError, match="from_legacy"):
            sf.attach_labels(target, labels)


class _Tensor:
    """The part of an Open3D tensor that is used."""

    def __init__(self, values, device="CPU:0"):
        self.values, self.device = np.asarray(values), device

    def cpu(self):
        return self

    def numpy(self):
        return self.values


class _Attributes(dict):
    __getattr__ = dict.__getitem__


def test_tensors_are_made_on_the_device_of_the_mesh():
    mesh = SimpleNamespace(
        vertex=_Attributes(positions=_Tensor(SHEET.vertices, "CUDA:0")),
        triangle=_Attributes(indices=_Tensor(SHEET.faces, "CUDA:0")),
    )
    sf.attach_labels(mesh, LABELS)
    assert mesh.triangle["superfacets"].device == "CUDA:0"
    assert np.array_equal(mesh.triangle["superfacets"].values, LABELS.labels)


def test_the_labels_of_the_target_are_its_own():
    mesh, labels = trimesh_sheet(pytest.importorskip("trimesh")), LABELS.labels.copy()
    sf.attach_labels(mesh, labels)
    labels[:] = 0
    assert np.array_equal(mesh.face_attributes["superfacets"], LABELS.labels)


def test_cells_without_a_label_are_gray():
    mesh = trimesh_sheet(pytest.importorskip("trimesh"))
    labels = np.where(LABELS.labels == 2, -1, LABELS.labels)
    sf.attach_labels(mesh, labels, colors=True)
    assert set(mesh.face_attributes["superfacets"].tolist()) == {-1, 0, 1, 3, 4}
    gray = (mesh.visual.face_colors[:, :3] == NO_COLOR).all(axis=1)
    assert np.array_equal(gray, labels == -1)


@pytest.mark.parametrize(("change", "error", "message"), [
    ({"labels": [0, 1]}, ValueError,
     r"labels must have one value per cell \(128\), got 2 values"),
    ({"labels": np.full(128, 0.5)}, TypeError, "integers"),
    ({"labels": np.full(128, 2**40)}, ValueError,
     r"labels\[0\] must be -1 to 2147483647, got 1099511627776"),
    ({"location": "points"}, ValueError,
     r"labels must have one value per cell \(81\), got 128 values"),
    ({"location": "edges"}, ValueError, "location must be"),
    ({"name": ""}, TypeError, "name must be a non-empty string"),
    ({"name": 3}, TypeError, "name must be a non-empty string"),
    ({"colors": np.zeros((5, 3), np.uint8)}, ValueError, "colors must have shape"),
    ({"colors": np.zeros((128, 3))}, TypeError, "colors must be uint8"),
    ({"labels": np.zeros(81, int), "location": "points", "colors": True}, ValueError,
     "colors of vertices"),
])  # fmt: skip
def test_wrong_arguments_are_refused_before_anything_is_written(change, error, message):
    mesh = trimesh_sheet(pytest.importorskip("trimesh"))
    arguments = {"labels": LABELS.labels, **change}
    with pytest.raises(error, match=message):
        sf.attach_labels(mesh, arguments.pop("labels"), **arguments)
    assert dict(mesh.face_attributes) == {}
    assert dict(mesh.vertex_attributes) == {}


def test_a_target_needs_a_place_for_labels():
    with pytest.raises(
        TypeError,
        match="labels can be stored in meshes and point clouds of trimesh, PyVista,"
        " meshio and Open3D, got Mesh",
    ):
        sf.attach_labels(SHEET, LABELS)
