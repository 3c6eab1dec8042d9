"""The command `cut`."""

import json

import numpy as np
import pytest
import shapes
from command_line import can_render

import superfacets as sf


@pytest.fixture
def labels(sheet, tmp_path):
    """Write labels 3 and 7 of a sheet, with -1 for one face."""
    centers = shapes.bumpy_sheet(24).vertices[shapes.bumpy_sheet(24).faces].mean(axis=1)
    given = np.where(centers[:, 0] + 0.4 * centers[:, 1] < centers.mean(axis=0)[:2].sum(), 3, 7)
    given[-1] = -1
    np.save(tmp_path / "labels.npy", given.astype(np.int32))
    return tmp_path / "labels.npy"


def test_a_mesh_is_segmented_and_cut(run, sheet, tmp_path):
    out = tmp_path / "cut.ply"
    status, printed, notes = run("cut", sheet, "-n", 20, "-o", out)
    mesh = sf.read_mesh(sheet)
    expected = sf.cut_borders(mesh, sf.segment(mesh, 20).labels)
    assert (status, notes) == (0, "")
    first, second = printed.splitlines()
    assert first == f"wrote {out}"
    assert second.startswith(f"sheet.ply: 1152 faces cut into {expected.mesh.n_faces}, 20 regions")
    cut = sf.read_mesh(out)
    assert np.array_equal(cut.faces, expected.mesh.faces)
    assert np.array_equal(sf.read_labels(out, cut.n_faces), expected.labels)


def test_labels_keep_their_numbers(run, sheet, labels, tmp_path):
    mesh, faces = tmp_path / "cut.obj", tmp_path / "cut.npy"
    status, printed, _ = run(
        "cut", sheet, "--labels", labels, "-o", mesh, "-o", faces, "--json"
    )  # fmt: skip
    assert status == 0
    facts = json.loads(printed)
    written = np.load(faces)
    assert set(written.tolist()) == {-1, 3, 7}
    assert facts["n_faces"] == 1152
    assert facts["n_new_faces"] == len(written) == sf.read_mesh(mesh).n_faces
    assert (facts["n_regions"], facts["outputs"]) == (2, [str(mesh), str(faces)])


def test_labels_in_the_mesh_are_taken(run, tmp_path):
    mesh = shapes.bumpy_sheet(12)
    given = sf.segment(mesh, 5).labels
    sf.write_mesh(tmp_path / "labeled.ply", mesh, given)
    assert run("cut", tmp_path / "labeled.ply", "-o", tmp_path / "cut.npy", "-q")[:2] == (0, "")
    assert np.array_equal(np.load(tmp_path / "cut.npy"), sf.cut_borders(mesh, given).labels)


@pytest.fixture
def named(tmp_path):
    mesh = shapes.bumpy_sheet(12)
    halves = mesh.vertices[mesh.faces[:, 0], 0] > np.median(mesh.vertices[:, 0])
    sf.write_mesh(tmp_path / "in.stl", mesh, halves.astype(int), classes=["inlet", "outlet"])
    return tmp_path / "in.stl"


@pytest.mark.parametrize("command", [["convert"], ["segment", "-n", 40], ["cut", "-n", 40]])
def test_names_of_solids_come_through(run, named, tmp_path, command):
    out = tmp_path / "out.stl"
    status, _, err = run(command[0], named, *command[1:], "-o", out)
    names = [line.split()[1] for line in out.read_text().splitlines() if line[:5] == "solid"]
    found = {name.split("_")[0] for name in names}
    assert (status, found - {"region"}) == (0, {"inlet", "outlet"})
    assert ("some part names, because regions have other names" in err) == ("region" in found)


@pytest.mark.parametrize("ending", [".stl", ".obj"])
@pytest.mark.parametrize("words", ["convert {0}", "cut", "cut {0}", "transfer {0} {0}"])
def test_regions_that_are_solids_have_their_names(run, named, tmp_path, words, ending):
    command, *more = words.format(named).split()
    out = tmp_path / f"out{ending}"
    assert run(command, named, *more, "-o", out)[::2] == (0, "")
    assert [*sf.read_attributes(out).names.values()] == [("inlet", "outlet")]
    if command == "transfer":
        err = run(command, named, *more, "-o", tmp_path / "a.ply")[2]
        assert "names of regions are not stored in .ply" in err


def test_solids_are_regions_where_only_labels_are_wanted(run, named, tmp_path):
    out = tmp_path / "out.npy"
    assert run("convert", named, "-o", out)[0] == 0
    assert np.array_equal(np.load(out), sf.read_labels(named))
    table = run("regions", named)[1].split()
    assert [row.split(",")[-1] for row in table] == ["name", "inlet", "outlet"]
    assert f"or {named} again to use" in run("view", named, "--html", tmp_path / "p.html")[2]
    assert "segment makes the regions" in run("regions", named, "-n", 9)[2]


def test_the_default_output_lies_beside_the_input(run, sheet):
    assert run("cut", sheet, "-n", 4)[0] == 0
    cut = sf.read_mesh(sheet.with_name("sheet.superfacets.ply"))
    assert sf.build_face_graph(cut).edge_counts.non_manifold == 0


def test_regions_are_given_once(run, sheet, labels):
    status, _, err = run("cut", sheet, "-n", 4, "--labels", labels)
    assert status == 2
    assert "give -n or LABELS, not both" in err


def test_labels_of_no_region_are_refused(run, sheet, tmp_path):
    np.save(tmp_path / "none.npy", np.full(1152, -1, np.int32))
    status, _, err = run("cut", sheet, "--labels", tmp_path / "none.npy", "-o", tmp_path / "c.ply")
    assert status == 1
    assert "no cell is in a region" in err


def test_a_mesh_of_few_faces_has_a_region_for_each(run, tmp_path):
    sf.write_mesh(tmp_path / "cube.ply", shapes.cube())
    status, printed, _ = run("cut", tmp_path / "cube.ply", "-o", tmp_path / "cut.ply")
    assert status == 0
    assert "12 faces cut into 12, 12 regions" in printed
    whole = sf.MeshAttributes(face={"solid": np.zeros(12, int)}, names={"solid": ("body",)})
    sf.write_mesh(tmp_path / "cube.ply", shapes.cube(), attributes=whole)
    assert "12 regions" in run("cut", tmp_path / "cube.ply", "-o", tmp_path / "cut.ply")[1]


@pytest.mark.parametrize(("name", "cells"), [
    ("tets.vtu", sf.TetMesh(np.eye(4, 3), [[0, 1, 2, 3]])), ("cloud.ply", sf.PointCloud(np.eye(3))),
])  # fmt: skip
def test_tetrahedra_and_points_have_no_borders_to_cut(run, tmp_path, name, cells):
    sf.write_mesh(tmp_path / name, cells)
    status, _, err = run("cut", tmp_path / name, "-o", tmp_path / "cut.ply")
    assert status == 1
    assert f"{name}: a mesh of faces is needed\n" in err


def test_smooth_borders_are_drawn(run, sheet, labels, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    edges, smooth = tmp_path / "edges.png", tmp_path / "smooth.png"
    assert run("render", sheet, "--labels", labels, "-o", edges)[0] == 0
    assert run("render", sheet, "--labels", labels, "--smooth-borders", "-o", smooth)[0] == 0
    assert edges.read_bytes() != smooth.read_bytes()
