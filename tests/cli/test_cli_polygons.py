"""Every command on meshes of quads, mixed polygons and triangle strips."""

import json

import numpy as np
import pytest

import superfacets as sf

FILES = {"suzanne.obj": 500, "beast.obj": 32364, "igea_tristrips.ply": 268686}


@pytest.fixture(scope="module", params=FILES)
def labeled(request, data_dir, tmp_path_factory):
    """Return the paths of a polygon mesh and of its labels."""
    path = data_dir / "meshes" / request.param
    labels = tmp_path_factory.mktemp("labels") / "labels.npy"
    mesh = sf.read_mesh(path)
    sf.write_labels(labels, np.arange(mesh.n_faces) % 5)
    return path, labels


def test_segment_writes_a_label_for_each_face(run, labeled, tmp_path):
    path, _ = labeled
    mesh = sf.read_mesh(path)
    outputs = [tmp_path / "a.ply", tmp_path / "a.npy"]
    status, _, err = run("segment", path, "-n", 30, "-o", outputs[0], "-o", outputs[1])
    assert status == 0, err
    labels = np.load(outputs[1])
    assert len(labels) == mesh.n_faces == FILES[path.name]
    written = sf.read_mesh(outputs[0])
    assert type(written) is type(mesh)
    assert np.array_equal(sf.read_labels(outputs[0]), labels)
    assert np.array_equal(written.vertices, mesh.vertices)
    if isinstance(mesh, sf.PolygonMesh):
        assert np.array_equal(written.offsets, mesh.offsets)
        assert np.array_equal(written.indices, mesh.indices)


def test_evaluate_measures_labels(run, labeled):
    path, labels = labeled
    status, out, err = run("evaluate", path, labels, "--gt", labels, "--json")
    assert status == 0, err
    values = json.loads(out)
    assert values["undersegmentation_error"] == 0
    assert values["boundary_recall"] == values["boundary_precision"] == 1


def test_render_draws_polygons(run, labeled, tmp_path):
    pytest.importorskip("pyvista", reason="PyVista is not installed")
    path, labels = labeled
    status, _, err = run("render", path, "--labels", labels, "-o", tmp_path / "a.png")
    assert status == 0, err
    assert (tmp_path / "a.png").stat().st_size > 10_000
