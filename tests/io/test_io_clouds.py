"""Point clouds in files: what is read, what is written, what is refused."""

import sys

import numpy as np
import pytest

from superfacets import (
    MeshAttributes,
    MeshError,
    MissingExtraError,
    PointCloud,
    read_attributes,
    read_cloud,
    read_labels,
    read_mesh,
    sample_mesh,
    segment,
    write_mesh,
)
from superfacets.adapters.convert import as_cells, as_mesh

POINTS = np.array([[0, 0, 0], [1.5, 0, 0], [1, 1, 0.25], [0, 1, -3]])
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 51, 51]], np.uint8)
NORMALS = [[0, 0, 1.0]] * 4
LABELS = [0, 1, 1, 0]


@pytest.fixture
def cloud():
    return PointCloud(POINTS, NORMALS, COLORS)


@pytest.mark.parametrize("ascii", [False, True])
def test_ply_keeps_all(cloud, tmp_path, ascii):
    path = tmp_path / "cloud.ply"
    write_mesh(path, cloud, ascii=ascii)
    again = read_cloud(path)
    assert np.array_equal(again.points, POINTS)
    assert np.array_equal(again.normals, cloud.normals)
    assert np.array_equal(again.colors, cloud.colors)
    assert isinstance(as_cells(path), PointCloud)


@pytest.mark.parametrize("ending", [".ply", ".csv", ".las", ".laz"])
def test_labels_are_properties_of_the_points(cloud, tmp_path, ending):
    if ending in (".las", ".laz"):
        laspy = pytest.importorskip("laspy")
    path = tmp_path / f"cloud{ending}"
    attributes = MeshAttributes(vertex={"intensity": np.array([1, 2, 3, 4], np.uint16)})
    write_mesh(path, cloud, LABELS, attributes=attributes)
    assert read_cloud(path).points == pytest.approx(POINTS, abs=1e-6)
    if ending == ".ply":
        assert read_labels(path).tolist() == LABELS
        assert read_attributes(path).vertex["intensity"].tolist() == [1, 2, 3, 4]
    elif ending == ".csv":
        assert path.read_text().splitlines()[2] == "1.5,0,0,1"
    else:
        las = laspy.read(path)
        assert las["label"].tolist() == LABELS
        assert las.intensity.tolist() == [1, 2, 3, 4]
        assert read_cloud(path).colors == pytest.approx(cloud.colors, abs=1e-4)


def test_text_of_several_kinds(tmp_path):
    path = tmp_path / "cloud.xyz"
    for text, expected in (
        ("0 0 0\n1 2 3\n", "PointCloud(2 points)"),
        ("# made by hand\n0,0,0,255,0,7\n1,2,3,0,1,2\n", "PointCloud(2 points, colors)"),
        ("0;0;0;0;0;1\n1;2;3;1;0;0\n\n", "PointCloud(2 points, colors)"),
        ("0 0 0 0.6 0.8 0\n1 2 3 0 0 1\n", "PointCloud(2 points, normals)"),
        ("0 0 0 0.5 7 9\n1 2 3 0 0 1\n", "PointCloud(2 points)"),
        ("//X Y Z R G B\n0 0 0 1 2 3\n1 1 1 4 5 6\n", "PointCloud(2 points, colors)"),
        ('"x","y","z","nx","ny","nz"\n0,0,0,2,0,0\n1,1,1,0,2,0\n', "PointCloud(2 points, normals)"),
        ("z y x\n3 2 1\n0 0 0\n", "PointCloud(2 points)"),
    ):
        path.write_text(text)
        assert repr(read_cloud(path)) == expected, text
    assert read_cloud(path).points.tolist() == [[1, 2, 3], [0, 0, 0]]


def test_npy(tmp_path):
    path = tmp_path / "cloud.npy"
    np.save(path, POINTS.astype(np.float32))
    assert np.array_equal(read_cloud(path).points, POINTS)
    np.save(path, np.asfortranarray(np.hstack([POINTS, COLORS])))
    again = read_cloud(path)
    assert np.array_equal(again.points, POINTS)
    assert np.array_equal(again.colors, PointCloud(POINTS, colors=COLORS).colors)


def test_colors_of_las_may_have_8_bits(tmp_path):
    laspy = pytest.importorskip("laspy")
    las = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
    las.x, las.y, las.z = POINTS.T
    las.red, las.green, las.blue = COLORS.T
    las.write(tmp_path / "old.las")
    assert read_cloud(tmp_path / "old.las").colors[0].tolist() == [1.0, 0.0, 0.0]


def test_the_vertices_of_a_mesh_are_a_cloud_too(tmp_path):
    mesh = sample_mesh(5000)
    write_mesh(tmp_path / "mesh.ply", mesh)
    assert read_cloud(tmp_path / "mesh.ply").n_points == mesh.n_vertices
    assert as_cells(tmp_path / "mesh.ply").n_faces == mesh.n_faces


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.xyz", b"\n", "the file has no points"),
        ("a.xyz", b"x y z\n", "the file has no points"),
        ("a.xyz", b"1 2\n3 4\n", "a point needs 3 numbers, got 2"),
        ("a.xyz", b"1 2 3\n4 5 6 7\n", "line 2 has 4 numbers, those before 3"),
        ("a.xyz", b"x y z w\n4 5 6\n", "the first line has 4 names, the next 3 numbers"),
        ("a.xyz", b"p q s\n4 5 6\n", "names p, q, s, but not x, y and z"),
        ("a.xyz", b"1 2 3\n4 five 6\n", "line 2: expected a number"),
        ("a.csv", b"1,2,3\n4,nan,6\n", r"points\[1\] is not finite"),
        ("a.npy", b"no array", "header of the .npy file cannot be read"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
         "no vertices with a number y"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no vertices with a number x"),
        ("a.obj", b"v 1 2 3\n", "expected the ending .ply, .xyz"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError, match=message):
        read_cloud(path)


@pytest.mark.parametrize("array", [np.zeros(3), np.zeros((2, 3), complex)])
def test_arrays_of_other_shapes_are_refused(tmp_path, array):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(MeshError, match="expected an"):
        read_cloud(tmp_path / "a.npy")


def test_objects_in_an_array_are_not_loaded(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(MeshError, match="expected an array of numbers"):
        read_cloud(tmp_path / "a.npy")


@pytest.mark.parametrize("content", [b"LASF", b"\0" * 400])
def test_a_damaged_las_file_is_refused(tmp_path, content):
    pytest.importorskip("laspy")
    (tmp_path / "a.las").write_bytes(content)
    with pytest.raises(MeshError, match="the LAS file cannot be read"):
        read_cloud(tmp_path / "a.las")


def _fails(*_):
    raise ValueError("no room")


def test_what_laspy_cannot_write_is_an_error(cloud, tmp_path, monkeypatch):
    laspy = pytest.importorskip("laspy")
    monkeypatch.setattr(laspy.LasData, "write", _fails)
    with pytest.raises(MeshError, match=r"cannot be written as \.las: no room"):
        write_mesh(tmp_path / "a.las", cloud)


def test_without_laspy_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "laspy", None)
    (tmp_path / "a.las").write_bytes(b"LASF")
    with pytest.raises(MissingExtraError, match=r"superfacets\[las\]"):
        read_cloud(tmp_path / "a.las")


def test_clouds_are_no_meshes(cloud, tmp_path):
    write_mesh(tmp_path / "a.ply", cloud)
    with pytest.raises(MeshError, match="read_cloud reads those"):
        read_mesh(tmp_path / "a.ply")
    with pytest.raises(MeshError, match="a point cloud has no faces"):
        as_mesh(cloud)
    with pytest.raises(MeshError, match=r"points are written as \.ply, \.csv, \.las or \.laz"):
        write_mesh(tmp_path / "a.vtp", cloud)
    with pytest.raises(MeshError, match="faces are written as"):
        write_mesh(tmp_path / "a.csv", sample_mesh(5000))
    write_mesh(tmp_path / "b.ply", cloud)
    with pytest.raises(MeshError, match="have no property label"):
        read_labels(tmp_path / "b.ply")


def test_a_path_is_segmented(cloud, tmp_path):
    write_mesh(tmp_path / "a.ply", cloud)
    assert segment(tmp_path / "a.ply", 2).n_segments == 2
