"""Every command on tetrahedra."""

import json

import numpy as np
import pytest
import shapes

import superfacets as sf

pytest.importorskip("meshio", reason="meshio is not installed")


@pytest.fixture
def tower(tmp_path):
    """Write six unit cubes above each other, of six tetrahedra each."""
    sf.write_mesh(tmp_path / "tower.vtu", shapes.column(6))
    return tmp_path / "tower.vtu"


def test_segment_writes_vtu_beside_the_input(run, tower):
    status, out, err = run("segment", tower, "-n", 3)
    assert status == 0, err
    assert "tower.vtu: 3 regions of 36 tets in" in out
    labeled = tower.with_name("tower.superfacets.vtu")
    assert len(np.unique(sf.read_labels(labeled, 36))) == 3
    status, _, err = run("segment", tower, "-n", 40, "--to", "npy", "--to", "vtk")
    assert status == 0
    assert "40 regions were requested, but there are only 36 tets: each tet became a region" in err
    assert len(np.load(tower.with_name("tower.superfacets.npy"))) == 36


def test_info_evaluate_and_render(run, tower, tmp_path):
    labels = tmp_path / "labels.npy"
    np.save(labels, np.repeat(np.arange(6, dtype=np.int32), 6))
    assert json.loads(run("info", "--json", tower)[1])["n_tets"] == 36
    facts = json.loads(run("segment", "--json", tower, "-n", 3, "-o", tmp_path / "b.npy")[1])
    assert facts["n_tets"] == 36
    assert "n_faces" not in facts
    assert "tetrahedra           36" in run("info", tower)[1]
    status, out, err = run("evaluate", tower, labels, "--gt", labels, "--json")
    assert status == 0, err
    values = json.loads(out)
    assert values["compactness"] == pytest.approx(6.0)  # cubes
    assert values["undersegmentation_error"] == 0.0
    pytest.importorskip("pyvista", reason="PyVista is not installed")
    for more in ([], ["--clip", "-z"]):
        status, _, err = run("render", tower, "--labels", labels, "-o", tmp_path / "a.png", *more)
        assert status == 0, err


@pytest.mark.parametrize(("words", "message"), [
    (["segment", "-o", "a.ply"], "tetrahedra are written as .vtu or .vtk, not as .ply"),
    (["segment", "--subdivide"], "expected a surface mesh, got a TetMesh"),
])  # fmt: skip
def test_what_tetrahedra_do_not_have_is_one_line(run, tower, monkeypatch, words, message):
    monkeypatch.chdir(tower.parent)
    command, *options = words
    status, _, err = run(command, tower, *options)
    assert status == 1
    assert message in err
    assert err.count("\n") == 1
