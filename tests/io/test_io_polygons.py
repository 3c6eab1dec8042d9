"""Polygons, written and read again in each format that supports them."""

import numpy as np
import pytest

import superfacets as sf
from superfacets import MeshAttributes, MeshError, PolygonMesh

POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1], [0.5, 2, 1 / 3]]
MIXED = PolygonMesh.of_faces(POINTS, [[0, 1, 2, 3], [3, 2, 4], [1, 2, 4, 3, 0], [4, 2, 3]])
QUADS = PolygonMesh.of_faces(POINTS, [[0, 1, 2, 3], [3, 2, 1, 4]])
LABELS = {4: [0, 2, 1, 2], 2: [1, 0]}


@pytest.fixture(params=[MIXED, QUADS], ids=["mixed", "quads"])
def mesh(request):
    return request.param


def faces_of(mesh):
    return [mesh.face(i).tolist() for i in range(mesh.n_faces)]


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("ending", [".ply", ".vtp"])
def test_polygons_keep_labels_colors_and_attributes(tmp_path, mesh, ending, ascii):
    path = tmp_path / f"a{ending}"
    labels = LABELS[mesh.n_faces]
    weights, pairs = np.arange(mesh.n_faces) / 3, np.ones((mesh.n_faces, 2))
    attributes = MeshAttributes({"n": np.eye(5)[:, :2]}, {"weight": weights, "uv": pairs})
    sf.write_mesh(path, mesh, labels, attributes=attributes, ascii=ascii)
    found = sf.read_mesh(path)
    assert faces_of(found) == faces_of(mesh)
    assert np.array_equal(found.vertices, mesh.vertices)
    assert sf.read_labels(path, mesh.n_faces).tolist() == labels
    kept = sf.read_attributes(path)
    assert np.array_equal(kept.vertex["n"], np.eye(5)[:, :2])
    assert np.array_equal(kept.face["weight"], weights)
    assert np.array_equal(kept.face["uv"], pairs)
    expected = sf.face_colors(mesh, labels)
    if ending == ".ply":
        colors = np.stack([kept.face[name] for name in ("red", "green", "blue")], axis=1)
        assert np.array_equal(colors, expected)
        return
    other = pytest.importorskip("pyvista").read(path)
    assert other.cell_data["label"].tolist() == labels
    assert np.array_equal(other.cell_data["weight"], weights)
    assert np.array_equal(other.point_data["n"], np.eye(5)[:, :2])
    assert np.array_equal(other.cell_data["colors"], expected)


@pytest.mark.parametrize("ascii", [False, True])
def test_ply_keeps_many_rows_and_many_corners(tmp_path, ascii):
    """The file has more rows than one block, and a face with more corners than a byte can count."""
    rng = np.random.default_rng(0)
    sizes = np.append(rng.integers(3, 9, 20_000), 300)
    indices = rng.integers(0, 5, sizes.sum())
    mesh = PolygonMesh(POINTS, np.concatenate([[0], np.cumsum(sizes)]), indices)
    sf.write_mesh(tmp_path / "a.ply", mesh, ascii=ascii)
    found = sf.read_mesh(tmp_path / "a.ply")
    assert np.array_equal(found.offsets, mesh.offsets)
    assert np.array_equal(found.indices, mesh.indices)


def test_vtp_that_is_wrong_is_refused_without_a_word(tmp_path, capfd):
    pyvista = pytest.importorskip("pyvista")
    path = tmp_path / "a.vtp"
    sf.write_mesh(path, MIXED)
    whole = path.read_bytes()
    for n_bytes in range(120, len(whole) - 20, 97):
        path.write_bytes(whole[:n_bytes])
        with pytest.raises(MeshError, match=r"a\.vtp: "):
            sf.read_mesh(path)
    path.write_bytes(whole.replace(b"PolyData", b"ImageData"))
    with pytest.raises(MeshError, match="not a VTP file"):
        sf.read_mesh(path)
    sphere = pyvista.Sphere()
    sphere.strip().save(path)
    assert sf.read_mesh(path).n_faces == sphere.n_cells
    pyvista.PolyData(np.eye(3)).save(path)
    with pytest.raises(MeshError, match="the file contains points, but no faces: use read_cloud"):
        sf.read_mesh(path)
    assert np.array_equal(sf.read_cloud(path).points, np.eye(3))
    plane = pyvista.Plane(i_resolution=1, j_resolution=1)
    plane.cell_data["label"] = [0.5]
    plane.save(path)
    with pytest.raises(MeshError, match="labels must be integers"):
        sf.read_labels(path)
    assert capfd.readouterr() == ("", "")
