"""The command `evaluate`."""

import inspect
import json

import pytest
import shapes

from superfacets import MeshAttributes, metrics, segment, write_labels, write_mesh
from superfacets_cli.options import USUAL_COUNT


@pytest.fixture
def labeled_strip(tmp_path):
    """Write a strip of four faces, its labels and two ground truths."""
    write_mesh(tmp_path / "strip.ply", shapes.strip(4))
    for name, labels in [("labels", "0011"), ("one", "0011"), ("two", "0111")]:
        (tmp_path / f"{name}.seg").write_text("\n".join(labels) + "\n")
    return tmp_path


def test_evaluate_prints_metrics_with_and_without_ground_truth(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    status, printed, _ = run("evaluate", mesh, labels)
    assert status == 0
    assert [line.split() for line in printed.splitlines()] == [
        ["n_regions", "2"], ["n_left_out", "0"], ["n_extra_pieces", "0"], ["compactness", "4"],
        ["explained_variation", "1"],
    ]  # fmt: skip
    status, printed, _ = run("evaluate", mesh, labels, "--gt", labeled_strip / "one.seg")
    assert ["undersegmentation_error", "0"] in [line.split() for line in printed.splitlines()]


def test_evaluate_takes_several_ground_truths_after_one_gt(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    one, two = labeled_strip / "one.seg", labeled_strip / "two.seg"
    _, printed, _ = run("evaluate", mesh, labels, "--gt", one, two, "--json")
    facts = json.loads(printed)
    assert facts["n_ground_truths"] == 2
    assert facts["undersegmentation_error"] == pytest.approx((0 + 0.5) / 2)
    assert printed == run("evaluate", mesh, labels, "--gt", one, "--gt", two, "--json")[1]


def test_evaluate_refuses_what_does_not_fit(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    (labeled_strip / "short.seg").write_text("0\n")
    status, _, error = run("evaluate", mesh, labels, "--gt", labeled_strip / "short.seg")
    assert status == 1
    assert error.endswith(
        "short.seg: labels must have one value per face (4) or per vertex (6), got 1 value\n"
    )
    status, _, error = run("evaluate", mesh, labels, labels)
    assert status == 2
    assert "give ground truth with --gt" in error
    status, _, error = run("evaluate", mesh, labels, "--gt")
    assert status == 2
    assert error.endswith("'--gt' requires an argument. (see superfacets --help)\n")
    status, _, error = run("evaluate", mesh, labels, "--tolerance", "nan")
    assert status == 2
    assert "'nan' is not a finite number" in error


def test_faces_in_no_region_are_left_out_and_counted(run, labeled_strip):
    mesh, hole = labeled_strip / "strip.ply", labeled_strip / "hole.seg"
    hole.write_text("0\n-1\n1\n1\n")
    status, printed, _ = run("evaluate", mesh, hole)
    assert (status, printed.splitlines()[1].split()) == (0, ["n_left_out", "1"])


def test_defaults_in_help_texts_are_the_defaults_of_the_functions(run):
    tolerance = inspect.signature(metrics.evaluate).parameters["tolerance"].default
    assert f"[default: {tolerance}]" in " ".join(run("evaluate", "-h")[1].split())
    assert segment(shapes.bumpy_sheet()).n_segments == USUAL_COUNT


def test_labels_and_truth_of_vertices_are_compared_at_the_vertices(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "v.segs.json"
    write_labels(labels, [0, 0, 0, 1, 1, 2])
    truth = labeled_strip / "truth.labels.txt"
    truth.write_text("0\n0\n1\n1\n-1\n1\n")
    of_vertices = MeshAttributes(vertex={"label": [0, 0, 1, 1, -1, 1]})
    write_mesh(truth.with_suffix(".ply"), shapes.strip(4), attributes=of_vertices)
    status, printed, err = run("evaluate", mesh, labels, "--gt", truth, "--json")
    assert run("evaluate", mesh, labels, "--gt", truth.with_suffix(".ply"), "--json")[1] == printed
    assert (status, "converted" in err) == (0, False)
    assert "truth.labels.txt: 0 counts as a class; if it means no class, add --ignore 0," in err
    assert "note: labels are compared at the vertices, without metrics of borders" in err
    facts = json.loads(printed)
    expected = metrics.evaluate_vertices(shapes.strip(4), [0, 0, 0, 1, 1, 2], [[0, 0, 1, 1, -1, 1]])
    assert {name: facts[name] for name in expected} == expected
    _, printed, err = run("evaluate", mesh, labels, "--gt", truth, "--json", "--ignore", "0,7")
    assert "counts as a class" not in err
    facts, truth_of_vertices = json.loads(printed), [-1, -1, 1, 1, -1, 1]
    expected = metrics.evaluate_vertices(shapes.strip(4), [0, 0, 0, 1, 1, 2], [truth_of_vertices])
    assert {name: facts[name] for name in expected} == expected
    assert facts["n_left_out"] == 3
    assert "--ignore needs ground truth" in run("evaluate", mesh, labels, "--ignore", 0)[2]


def test_a_note_tells_that_labels_of_vertices_were_converted(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "v.segs.json"
    write_labels(labels, [0, 0, 0, 1, 1, 1])
    assert "converted" not in run("regions", mesh, labels)[2]  # no region is split
    write_labels(labels, [0, 0, 1, 1, 0, 0])
    status, printed, err = run("evaluate", mesh, labels, "--gt", labeled_strip / "one.seg")
    assert (status, "boundary_recall" in printed) == (0, True)
    assert f"superfacets: note: {labels}: labels of vertices were converted to labels of" in err
    assert ": 1 piece apart from the rest of a region" in run("regions", mesh, labels)[2]
    assert "piece apart" not in run("regions", mesh, labels, "-q")[2]
