"""The study of the quality of regions measures correctly, on a benchmark of two small models."""

import csv
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from research.__main__ import commands
from research.quality import study as quality_study
from research.quality.measure import (
    RESOLUTION_VARIANTS,
    VARIANTS,
    Subject,
    coarsened,
    creases,
    refined,
)
from research.quality.study import StudyOptions, study
from research.quality.tables import dominators, means
from shapes import cube

import superfacets as sf
from superfacets import metrics
from superfacets.tools.sample import split_in_four
from superfacets_cli.main import run as run_group


@pytest.fixture(scope="module")
def subject():
    """Return a cube of 192 faces; its sides are the segments of one of two people."""
    vertices, faces = split_in_four(*split_in_four(cube().vertices, cube().faces))
    vectors = np.cross(*np.diff(vertices[faces], axis=1).transpose(1, 0, 2))
    axis = np.abs(vectors).argmax(axis=1)
    sides = 2 * axis + (vectors[np.arange(len(axis)), axis] > 0)
    return Subject(sf.Mesh(vertices, faces), (sides, axis))


@pytest.fixture(scope="module")
def folder(subject, tmp_path_factory):
    """Return a folder with models 3 and 7, and model 9 without segments."""
    root = tmp_path_factory.mktemp("psb")
    (root / "off").mkdir()
    mesh = subject.mesh
    rows = [*mesh.vertices.tolist(), *([3, *face] for face in mesh.faces.tolist())]
    lines = [f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0", *(" ".join(map(str, row)) for row in rows)]
    for number in (3, 7, 9):
        (root / "off" / f"{number}.off").write_text("\n".join(lines) + "\n")
    for number in (3, 7):
        truths = root / "seg" / "Benchmark" / str(number)
        truths.mkdir(parents=True)
        for j, truth in enumerate(subject.truths):
            sf.write_labels(truths / f"{number}_{j}.seg", truth)
    return root


@pytest.fixture(scope="module")
def options(folder, tmp_path_factory):
    output = tmp_path_factory.mktemp("quality")
    return StudyOptions(benchmark=folder, output=output, ks=(6, 12), n_finer=1, n_jobs=2)


@pytest.fixture(scope="module")
def results(options):
    return study(options)


def areas_of_segments(mesh, truth):
    return np.bincount(truth, sf.build_face_graph(mesh).measures)


def test_subdividing_keeps_the_true_segments_in_place(subject):
    finer = refined(subject, 2)
    assert finer.mesh.n_faces == 16 * 192
    for old, new in zip(subject.truths, finer.truths, strict=True):
        expected = areas_of_segments(subject.mesh, old)
        np.testing.assert_allclose(areas_of_segments(finer.mesh, new), expected)


def test_decimating_keeps_the_true_segments_in_place(subject):
    pytest.importorskip("scipy")
    pytest.importorskip("pyvista")
    coarser = coarsened(subject)
    assert coarser.mesh.n_faces == 48
    shares = areas_of_segments(coarser.mesh, coarser.truths[0])
    np.testing.assert_allclose(shares, np.ones(6), rtol=0.25)


def test_creases_of_a_cube_are_its_edges_and_convex(subject):
    valleys, ridges = creases(subject.mesh)
    assert len(valleys.lengths) == 0
    assert ridges.lengths.sum() == pytest.approx(2 * 12)  # each in both directions
    sides, _ = subject.truths
    assert ridges.share_between(sides) == 1.0
    assert ridges.share_between(np.zeros(192, dtype=np.int32)) == 0.0
    assert valleys.share_between(sides) is None


def test_creases_of_a_cube_that_is_inside_out_are_still_convex(subject):
    mesh = sf.Mesh(subject.mesh.vertices, subject.mesh.faces[:, ::-1])
    valleys, ridges = creases(mesh)
    assert (len(valleys.lengths), len(ridges.lengths)) == (0, 2 * 12 * 4)


def test_each_variant_is_measured_on_each_model_at_each_k(results):
    cases = {(row["model"], row["variant"], row["k"]) for row in results.rows}
    assert cases == {(n, name, k) for n in (3, 7) for name in VARIANTS for k in (6, 12)}
    assert len(results.rows) == len(cases)
    assert [line for line in results.problems if "no coarser" not in line][-1] == (
        "model 9 is left out: it has no ground truth"
    )


def test_the_numbers_are_those_of_the_metrics(subject, results):
    row = next(row for row in results.rows if row["variant"] == "plain, smooth")
    labels = sf.segment(subject.mesh, row["k"], **VARIANTS["plain, smooth"]).labels
    values = metrics.evaluate(subject.mesh, labels, subject.truths)
    assert row["ue"] == pytest.approx(values["undersegmentation_error"], abs=1e-12)
    assert row["compactness"] == pytest.approx(values["compactness"])
    assert (row["regions"], row["extra_pieces"]) == (row["k"], 0)


def test_resolutions_are_compared_at_the_middle_k(results):
    rows = results.resolution
    assert {row["k"] for row in rows} == {12}
    assert {row["model"] for row in rows} == {3}
    faces = {row["scale"]: row["faces"] for row in rows}
    assert (faces["x1"], faces["x4"], faces["x16"]) == (192, 768, 3072)


def test_only_what_is_no_worse_at_every_k_dominates():
    rows = [
        {"variant": variant, "k": k, "ue": ue, "compactness": compactness}
        for variant, values in {
            "plain": [(0.2, 5.0), (0.1, 6.0)],
            "better": [(0.2, 4.0), (0.05, 6.0)],
            "rounder, but leaks": [(0.2, 4.0), (0.11, 4.0)],
            "the same at one k": [(0.2, 5.0), (0.1, 5.0)],
        }.items()
        for k, (ue, compactness) in zip((50, 100), values, strict=True)
    ]
    assert dominators(means(rows)) == ["better"]


def test_means_are_over_models():
    rows = [
        {"variant": "plain", "k": 5, "ue": ue, "compactness": 10 * ue} for ue in (0.1, 0.2, 0.6)
    ]
    assert means(rows)["plain", 5] == pytest.approx((0.3, 3.0))


def test_the_tables_are_as_wide_as_their_headers(results):
    sections = results.tables.split("###")[1:]
    assert len(sections) == 4
    for section in sections:
        lines = [line for line in section.splitlines() if line.startswith("|")]
        assert len({line.count("|") for line in lines}) == 1
        assert len(lines) > 2


def test_rows_and_tables_are_written(options, results):
    with (options.output / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    n_scales = len({row["scale"] for row in results.resolution}) - 1  # x1 is in both parts
    assert len(rows) == len(results.rows) + len(RESOLUTION_VARIANTS) * n_scales
    assert (options.output / "tables.md").read_text() == results.tables + "\n"


def untimed(rows):
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]


def test_a_second_start_does_only_what_is_missing(options, results):
    paths = {path: path.stat().st_mtime_ns for path in options.output.rglob("*.json")}
    gone, damaged, *_ = paths
    gone.unlink()
    damaged.write_text(damaged.read_text().replace('"ue": 0', '"ue": 1'))
    again = study(options)
    after = {path: path.stat().st_mtime_ns for path in paths}
    assert {path for path in paths if paths[path] != after[path]} == {gone, damaged}
    assert untimed(again.rows) == untimed(results.rows)
    assert untimed(again.resolution) == untimed(results.resolution)


def test_a_model_of_which_a_run_failed_is_left_out_and_named(folder, tmp_path):
    blocked = tmp_path / "records" / "x1" / "7" / "default_k-6.json"
    blocked.mkdir(parents=True)
    options = StudyOptions(benchmark=folder, output=tmp_path, ks=(6,), n_finer=0)
    report = study(options)
    assert {row["model"] for row in report.rows} == {3}
    assert report.problems[-1].startswith(
        "model 7, x1, default, k = 6: the record could not be written"
    )
    with pytest.raises(
        sf.MeshError, match="all models failed; the first failure: model 7, x1, default, k = 6: the"
    ):
        study(replace(options, models=(7,)))


def test_a_model_that_is_not_there_is_refused(folder, tmp_path):
    with pytest.raises(ValueError, match="has no model 4"):
        study(StudyOptions(benchmark=folder, output=tmp_path, models=(3, 4), ks=(6,)))


def test_a_benchmark_that_nobody_has_cut_is_refused(folder, tmp_path):
    with pytest.raises(sf.MeshError, match=r"no model can be used: .*there are no ground truths"):
        study(StudyOptions(benchmark=folder, output=tmp_path, models=(9,), ks=(6,)))


def test_what_is_not_installed_is_named(folder, tmp_path, monkeypatch):
    for name in ("tabulate", "pyvista", "scipy"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(sf.MissingExtraError, match="quality without tabulate"):
        study(StudyOptions(benchmark=folder, output=tmp_path / "out"))
    assert not (tmp_path / "out").exists()
    assert quality_study._usable_scales() == (
        ["x1", "x4", "x16"],
        ("coarser meshes are left out: PyVista and SciPy are not installed",),
    )


@pytest.fixture
def run(run_main):
    """Run the command in this process; return exit status, stdout and stderr."""
    return partial(
        run_main, partial(run_group, commands, "python -m research"), "research", "quality"
    )


def test_the_command_prints_tables_and_finds_the_same_numbers(run, folder, results, tmp_path):
    out = tmp_path / "out"
    status, stdout, stderr = run(
        folder, "-o", out, "--models", "3,9", "--ks", "6", "--finer", "0", "--jobs", "1"
    )
    assert status == 0
    assert stdout.startswith("### UE / compactness by k\n\n| variant ")
    assert "(not measured)" in stdout  # other resolutions
    assert stderr.endswith("superfacets: note: model 9 is left out: it has no ground truth\n")
    with (out / "runs.csv").open(newline="") as file:
        found = {row["variant"]: float(row["ue"]) for row in csv.DictReader(file)}
    expected = {r["variant"]: r["ue"] for r in results.rows if (r["model"], r["k"]) == (3, 6)}
    assert found == expected
    assert [path.name for path in (out / "records").iterdir()] == ["x1"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--ks", "5,x"), "'x' is not a whole number of 1 or more"),
        (("--models", "0"), "'0' is not a whole number of 1 or more"),
        (("--every", "0"), "'0' is not a whole number of 1 or more"),
        (("--finer", "-1"), "'-1' is not a whole number of 0 or more"),
        (("--jobs", "two"), "'two' is not a whole number of 1 or more"),
    ],
)
def test_bad_options_are_one_line(run, folder, tmp_path, options, message):
    status, stdout, stderr = run(folder, "-o", tmp_path / "out", *options)
    assert (status, stdout, stderr.count("\n")) == (2, "", 1)
    assert message in stderr
    assert not (tmp_path / "out").exists()
