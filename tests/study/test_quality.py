"""The study of regions' quality measures what it says, on a benchmark of two small models."""

import json

import numpy as np
import pytest
from benchmarks import meshes, quality
from benchmarks.cli import commands
from click.testing import CliRunner
from shapes import cube

import superfacets as sf
from superfacets import metrics


@pytest.fixture(scope="module")
def subject():
    """A cube of 192 faces whose six sides are the true segments, as one of two people sees it."""
    arrays = meshes.Arrays(cube().vertices, cube().faces)
    arrays = meshes.subdivide(meshes.subdivide(arrays))
    vectors = np.cross(*np.diff(arrays.vertices[arrays.faces], axis=1).transpose(1, 0, 2))
    axis = np.abs(vectors).argmax(axis=1)
    sides = 2 * axis + (vectors[np.arange(len(axis)), axis] > 0)
    return quality.Subject(sf.Mesh(*arrays), (sides, axis))


@pytest.fixture(scope="module")
def folder(subject, tmp_path_factory):
    """Models 3 and 7, and 9 that nobody has cut."""
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
def results(folder):
    return quality.study(folder, (3, 7, 9), (6, 12), 1, lambda _: None)


def areas_of_segments(mesh, truth):
    return np.bincount(truth, sf.build_face_graph(mesh).measures)


def test_subdividing_keeps_the_true_segments_in_place(subject):
    finer = quality.refined(subject, 2)
    assert finer.mesh.n_faces == 16 * 192
    for old, new in zip(subject.truths, finer.truths, strict=True):
        expected = areas_of_segments(subject.mesh, old)
        np.testing.assert_allclose(areas_of_segments(finer.mesh, new), expected)


def test_decimating_keeps_the_true_segments_in_place(subject):
    pytest.importorskip("scipy")
    pytest.importorskip("pyvista")
    coarser = quality.coarsened(subject)
    assert coarser.mesh.n_faces == 48
    shares = areas_of_segments(coarser.mesh, coarser.truths[0])
    np.testing.assert_allclose(shares, np.ones(6), rtol=0.25)


def test_creases_of_a_cube_are_its_edges_and_convex(subject):
    valleys, ridges = quality.creases(subject.mesh)
    assert len(valleys.lengths) == 0
    assert ridges.lengths.sum() == pytest.approx(2 * 12)  # each both ways around
    sides, _ = subject.truths
    assert ridges.share_between(sides) == 1.0
    assert ridges.share_between(np.zeros(192, dtype=np.int32)) == 0.0
    assert valleys.share_between(sides) is None


def test_creases_of_a_cube_that_is_inside_out_are_still_convex(subject):
    mesh = sf.Mesh(subject.mesh.vertices, subject.mesh.faces[:, ::-1])
    valleys, ridges = quality.creases(mesh)
    assert (len(valleys.lengths), len(ridges.lengths)) == (0, 2 * 12 * 4)


def test_each_variant_is_measured_on_each_model_at_each_k(results):
    cases = {(row["model"], row["variant"], row["k"]) for row in results["rows"]}
    assert cases == {(n, name, k) for n in (3, 7) for name in quality.VARIANTS for k in (6, 12)}
    assert len(results["rows"]) == len(cases)
    (problem,) = results["problems"]
    assert problem.endswith("9: there are no ground truths")


def test_the_numbers_are_those_of_the_metrics(subject, results):
    row = next(row for row in results["rows"] if row["variant"] == "plain, smooth")
    keywords = quality.VARIANTS["plain, smooth"]
    labels = sf.segment(subject.mesh, row["k"], **keywords).labels
    values = metrics.evaluate(subject.mesh, labels, subject.truths)
    assert row["ue"] == pytest.approx(values["undersegmentation_error"], abs=1e-12)
    assert row["compactness"] == pytest.approx(values["compactness"])
    assert (row["regions"], row["extra_pieces"]) == (row["k"], 0)


def test_resolutions_are_compared_at_the_middle_k(results):
    rows = results["resolution"]
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
    assert quality.dominators(quality.means(rows)) == ["better"]


def test_means_are_over_models():
    rows = [
        {"variant": "plain", "k": 5, "ue": ue, "compactness": 10 * ue} for ue in (0.1, 0.2, 0.6)
    ]
    assert quality.means(rows)["plain", 5] == pytest.approx((0.3, 3.0))


def test_the_tables_are_as_wide_as_their_headers(results):
    for section in quality.render_quality(results).split("###")[1:]:
        lines = [line for line in section.splitlines() if line.startswith("|")]
        assert len({line.count("|") for line in lines}) == 1
        assert len(lines) > 2


def test_a_model_that_is_not_there_is_refused(folder):
    with pytest.raises(ValueError, match="has no model 4"):
        quality.study(folder, (3, 4), (6,), 0, lambda _: None)


def test_a_benchmark_that_nobody_has_cut_is_refused(folder):
    with pytest.raises(ValueError, match="there are no ground truths"):
        quality.study(folder, (9,), (6,), 0, lambda _: None)


def untimed(rows):
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]


def test_the_command_prints_tables_and_writes_the_same_results_again(folder, results, tmp_path):
    output = tmp_path / "quality.json"
    arguments = ["quality", str(folder), "--models", "3", "--ks", "6", "--finer", "0"]
    result = CliRunner().invoke(commands, [*arguments, "--json", str(output)])
    assert result.exit_code == 0, result.output
    assert "| variant | k = 6 |" in result.output
    assert "(not measured)" in result.output  # other resolutions
    expected = [row for row in results["rows"] if (row["model"], row["k"]) == (3, 6)]
    assert untimed(json.loads(output.read_text())["rows"]) == untimed(expected)


def test_lists_that_are_none_and_missing_folders_are_one_line(folder, monkeypatch, tmp_path):
    for option in ("--ks", "--models"):
        result = CliRunner().invoke(commands, ["quality", str(folder), option, "5,x"])
        assert (result.exit_code, result.exception.__class__) == (1, SystemExit)
        assert "'5,x' are no numbers" in result.output
    monkeypatch.setenv("SUPERFACETS_DATA", str(tmp_path))
    result = CliRunner().invoke(commands, ["quality"])
    assert "no folder of models is given" in result.output
