"""The command `transfer`."""

import json

import numpy as np
import pytest
import shapes
from command_line import files_in

import superfacets as sf
from superfacets.tools.sample import split_in_four


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write a mesh with labels in two files, a finer mesh, and points."""
    monkeypatch.chdir(tmp_path)
    coarse = shapes.bumpy_sheet(6)
    labels = np.arange(coarse.n_faces) % 5
    sf.write_mesh("coarse.ply", coarse, labels)
    sf.write_labels("labels.npy", labels)
    fine = sf.Mesh(*split_in_four(coarse.vertices, coarse.faces))
    attributes = sf.MeshAttributes(
        face={"part": np.arange(fine.n_faces)}, comments=("comment by hand",)
    )
    sf.write_mesh("fine.ply", fine, attributes=attributes)
    sf.write_mesh("points.ply", sf.PointCloud([*coarse.vertices, [9.0, 9, 9]]))
    return tmp_path


def test_labels_are_carried_to_a_finer_mesh(run, folder):
    labels = np.load("labels.npy")
    status, out, _ = run("transfer", "coarse.ply", "labels.npy", "fine.ply")
    assert status == 0
    assert out == f"wrote fine.superfacets.ply\nfine.ply: {4 * len(labels)} faces, 5 labels\n"
    carried = sf.read_labels("fine.superfacets.ply")
    assert np.array_equal(carried, np.repeat(labels, 4))
    attributes = sf.read_attributes("fine.superfacets.ply")
    assert np.array_equal(attributes.face["part"], np.arange(len(carried)))
    assert attributes.comments == ("comment by hand",)


def test_a_labeled_file_is_given_twice_and_several_are_written(run, folder):
    outputs = ("-o", "a.npy", "-o", "a.seg", "-o", "a.ply", "--drop-attributes", "-q")
    assert run("transfer", "coarse.ply", "coarse.ply", "fine.ply", *outputs) == (0, "", "")
    expected = sf.transfer("coarse.ply", np.load("labels.npy"), "fine.ply")
    for name in ("a.npy", "a.seg", "a.ply"):
        assert np.array_equal(sf.read_labels(name), expected)
    assert "part" not in sf.read_attributes("a.ply").face


def test_formats_are_named_and_text_is_written(run, folder):
    (folder / "coarse.ply").rename("coarse.mesh")
    (folder / "fine.ply").rename("fine.scan")
    given = ("transfer", "coarse.mesh", "labels.npy", "fine.scan", "-o", "a.ply", "--ascii")
    assert run(*given)[0] == 1
    assert run(*given, "--format", "ply", "--target-format", "ply")[0] == 0
    assert b"format ascii 1.0" in (folder / "a.ply").read_bytes()
    assert len(sf.read_labels("a.ply")) == 4 * len(np.load("labels.npy"))


def test_what_is_too_far_gets_no_label(run, folder):
    status, out, _ = run(
        "transfer", "coarse.ply", "labels.npy", "points.ply", "--max-distance", 0.5,
        "-o", "near.npy", "--threads", 2,
    )  # fmt: skip
    n_points = len(np.load("near.npy"))
    last = f"points.ply: {n_points} points, 5 labels, 1 without a label"
    assert (status, out.splitlines()[-1]) == (0, last)
    assert (np.load("near.npy") == -1).tolist() == [False] * (n_points - 1) + [True]


def test_labels_go_to_standard_output(run, folder):
    status, out, err = run(
        "transfer", "coarse.ply", "labels.npy", "coarse.ply", "-o", "-", "--to", "txt"
    )
    assert (status, out.split()) == (0, [str(label) for label in np.load("labels.npy")])
    assert err == f"coarse.ply: {len(out.split())} faces, 5 labels\n"
    run("transfer", "coarse.ply", "labels.npy", "fine.ply", "-o", "results/", "--to", "seg")
    assert files_in(folder / "results") == ["fine.superfacets.seg"]


def test_labels_that_stay_the_same_replace_nothing(run, folder):
    assert run("transfer", "coarse.ply", "labels.npy", "fine.ply")[2] == ""
    assert run("transfer", "coarse.ply", "labels.npy", "coarse.ply", "-o", "again.ply")[2] == ""


def test_no_input_is_replaced(run, folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    for name in ("coarse.ply", "labels.npy", "fine.ply"):
        status, _, err = run("transfer", "coarse.ply", "labels.npy", "fine.ply", "-o", name)
        assert status == 2
        assert f"{name}: the output would overwrite the input" in err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_what_does_not_fit_is_one_line(run, folder):
    sf.write_labels("short.seg", [0, 1])
    n = len(np.load("labels.npy"))
    cases = [
        (
            ("coarse.ply", "short.seg", "fine.ply"),
            1,
            f"short.seg: labels must have one value per face ({n}) or per vertex (49), got 2",
        ),
        (("coarse.ply", "labels.npy", "missing.ply"), 1, "missing.ply: no such file"),
        (("missing.ply", "labels.npy", "fine.ply"), 1, "missing.ply: no such file"),
        (("coarse.ply", "labels.npy", "fine.ply", "-o", "a.docx"), 2, "expected the ending"),
        (("coarse.ply", "labels.npy", "fine.ply", "--max-distance", "-1"), 2, "-1"),
        (("coarse.ply", "labels.npy"), 2, "Missing argument 'TARGET'"),
        (("coarse.ply", "labels.npy", "points.ply", "-o", "a.vtp"), 1, "points are written as"),
    ]
    for arguments, expected, message in cases:
        status, out, err = run("transfer", *arguments)
        assert (status, out) == (expected, ""), arguments
        assert message in err, arguments
        assert err.count("\n") == 1, arguments


def test_classes_that_lose_their_numbers_are_a_note(run, folder):
    classes = np.where(sf.read_labels("labels.npy") > 1, 40, 5)
    sf.write_labels("classes.npy", classes)
    given = ("coarse.ply", "classes.npy", "fine.ply")
    status, out, err = run("transfer", *given, "-o", "a_sp_label.npy", "-o", "b.npy")
    assert status == 0
    assert out.startswith(
        "wrote a_sp_label.npy (a label per vertex)\nwrote b.npy (a label per face)\n"
    )
    assert "renumbered without gaps in _sp_label.npy; .segs.json keeps the labels 5, 40\n" in err
    assert set(np.load("a_sp_label.npy")) == {0, 1}
    assert run("transfer", *given, "-o", "a.segs.json")[2] == ""
    assert set(json.loads((folder / "a.segs.json").read_text())["segIndices"]) == {5, 40}


def test_the_facts_are_printed_as_json(run, folder):
    options = ("--max-distance", 1, "--json", "-o", "out.ply")
    status, printed, _ = run("transfer", "coarse.ply", "labels.npy", "points.ply", *options)
    assert status == 0
    assert json.loads(printed) == {
        "file": "points.ply", "n_points": 50, "n_labels": 5, "n_without": 1, "outputs": ["out.ply"],
    }  # fmt: skip


def test_what_no_output_can_hold_is_refused_before_the_work(run, folder, broken):
    broken("superfacets_cli.lift.transfer")
    house = sf.PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    sf.write_mesh("house.ply", house)
    status, _, err = run("transfer", "coarse.ply", "labels.npy", "house.ply", "-o", "a.sstk.json")
    assert status == 1
    assert ".sstk.json needs labels of triangles" in err


def test_a_distance_of_nothing_carries_all_labels_to_the_mesh_itself(run, folder):
    options = ("--max-distance", 0, "-o", "same.npy", "-q")
    assert run("transfer", "coarse.ply", "labels.npy", "coarse.ply", *options) == (0, "", "")
    assert np.array_equal(np.load("same.npy"), np.load("labels.npy"))


def test_labels_of_vertices_go_to_the_nearest_vertex(run, folder):
    coarse = sf.read_mesh("coarse.ply")
    np.save("vertices.npy", np.arange(coarse.n_vertices))
    points = coarse.vertices + [0.01, 0.01, 0]
    np.save("near.npy", points)
    status, _, err = run("transfer", "coarse.ply", "vertices.npy", "near.npy", "-o", "out.npy")
    assert (status, err) == (0, "")
    assert np.array_equal(np.load("out.npy"), np.arange(coarse.n_vertices))
    of_faces = sf.transfer(coarse, np.arange(coarse.n_vertices), "fine.ply")
    assert np.isin(of_faces, coarse.faces).all()
