"""PLY files of this package, read by other libraries."""

import numpy as np
import pytest
from mesh_files import FACES, VERTICES
from numpy.testing import assert_array_equal

from superfacets.files.writers.write import write_mesh

LABELS = [7, 4]

COLORS = np.array([[255, 0, 10], [1, 2, 3]], dtype=np.uint8)


@pytest.fixture(params=["binary", "ascii"])
def path(request, tmp_path):
    path = tmp_path / "a.ply"
    write_mesh(path, (VERTICES, FACES), LABELS, colors=COLORS, ascii=request.param == "ascii")
    return path


def test_lagrange_reads_mesh_labels_and_colors(path):
    lagrange = pytest.importorskip("lagrange")
    mesh = lagrange.io.load_mesh(path, quiet=True)
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.facets, FACES)
    names = {mesh.get_attribute_name(index) for index in mesh.get_matching_attribute_ids()}
    (label,) = [name for name in names if "label" in name]
    (quality,) = [name for name in names if "quality" in name]
    assert_array_equal(mesh.attribute(label).data, LABELS)
    assert_array_equal(mesh.attribute(quality).data, LABELS)


def test_trimesh_reads_mesh_labels_and_colors(path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load_mesh(path, process=False)
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)
    assert_array_equal(mesh.visual.face_colors, np.c_[COLORS, [255, 255]])
    stored = mesh.metadata["_ply_raw"]["face"]["data"]
    assert_array_equal(np.asarray(stored["label"]).ravel(), LABELS)
    assert_array_equal(np.asarray(stored["quality"]).ravel(), LABELS)


def test_pyvista_reads_mesh_and_colors(path):
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.read(path)
    assert_array_equal(mesh.points, VERTICES)
    assert_array_equal(mesh.faces.reshape(-1, 4)[:, 1:], FACES)
    assert_array_equal(mesh.cell_data["RGBA"], np.c_[COLORS, [255, 255]])
