"""The comparison of the paper on a benchmark of four small meshes: records, resuming, options."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import shapes
from research.__main__ import commands
from research.reproduce import figures, gallery, measure, methods, page, plan
from research.reproduce.gallery import Drawing, is_drawn, picture_path, pictures_of, view_of
from research.reproduce.measure import Run, pack_labels, unpack_labels
from research.reproduce.plan import Choice, make_plan
from research.reproduce.results import Curve, RunResults, collect, compare
from research.sources import StudyMesh, StudyMeshes, find_models, load
from research.tasks import _TaskJob, read_item

from superfacets import Mesh
from superfacets.files.atomic import locked
from superfacets_cli.main import run as run_group

MODELS = {1: 10, 2: 12, 21: 11, 400: 13}  # number: squares along a side of the sheet
ROOT = Path(__file__).parents[2]
FAST = ("--ks", "5,20", "--methods", "superfacets,stk02", "--figures", "6", "--jobs", "1")


@pytest.fixture
def run(monkeypatch, run_main):
    """Run the command in this process; return exit status, stdout and stderr.

    Plots take most of the time, so they are empty files unless a test requests them.
    """

    pytest.importorskip("matplotlib")

    def _run(*arguments, plots=False):
        if not plots:
            monkeypatch.setattr(figures, "_save", lambda path, *_: path.write_text("<svg/>"))
        main = partial(run_group, commands, "python -m research")
        return run_main(main, "research", "reproduce", *arguments)

    return _run


def write_off(path, mesh):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["OFF", f"{mesh.n_vertices} {mesh.n_faces} 0"]
    lines += [" ".join(map(str, vertex)) for vertex in mesh.vertices.tolist()]
    lines += [" ".join(map(str, [3, *face])) for face in mesh.faces.tolist()]
    path.write_text("\n".join(lines) + "\n")


def write_truth(path, mesh, cut):
    """Write two parts, cut at a value of x."""
    path.parent.mkdir(parents=True, exist_ok=True)
    parts = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > cut).astype(int)
    path.write_text("".join(f"{part}\n" for part in parts))


@pytest.fixture
def benchmark(tmp_path):
    """Return the folder of four models of three categories, with two ground truths each."""
    root = tmp_path / "psb"
    for number, n in MODELS.items():
        mesh = shapes.bumpy_sheet(n, seed=number)
        write_off(root / "off" / f"{number}.off", mesh)
        for j, cut in enumerate((0.4, 0.5)):
            write_truth(root / "seg" / "Benchmark" / str(number) / f"{number}_{j}.seg", mesh, cut)
    return root


def rows_of(folder):
    with (folder / "runs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def numbers_of(folder):
    """Return all records without their times, which differ between two runs."""
    records = {}
    for path in sorted((folder / "records").rglob("*.json")):
        record = json.loads(path.read_text())["record"]
        del record["seconds"]
        records[str(path.relative_to(folder))] = record
    return records


def test_every_run_has_a_record_and_a_row(run, benchmark, tmp_path):
    out = tmp_path / "out"
    status, stdout, stderr = run(benchmark, "-o", out, *FAST)
    assert (status, stderr) == (0, "")
    n_runs = 4 * 2 * (6 + 5)
    assert re.fullmatch(
        rf"{n_runs} runs done, 0 failed, 0 not started; this start took [\d.]+ seconds\n"
        rf"wrote {re.escape(str(out / 'index.html'))}\n",
        stdout,
    )
    rows = rows_of(out)
    assert len(rows) == n_runs == len(numbers_of(out))
    assert {row["status"] for row in rows} == {"done"}
    ours = next(row for row in rows if (row["model"], row["alpha"]) == ("21", "200.0"))
    assert (ours["category"], ours["faces"], ours["ground_truths"]) == ("Cup", "242", "2")
    assert ours["n_segments"] == "5"
    assert 0 < float(ours["undersegmentation_error"]) < 1
    assert float(ours["seconds_total"]) > float(ours["seconds_seeding"]) > 0
    assert not list(out.rglob(".*.tmp"))


def test_means_are_over_ground_truths_first_and_then_over_models(run, benchmark, tmp_path):
    (benchmark / "seg" / "Benchmark" / "1" / "1_1.seg").unlink()  # one truth here, two elsewhere
    out = tmp_path / "out"
    assert run(benchmark, "-o", out, *FAST)[0] == 0
    values = [
        float(row["undersegmentation_error"])
        for row in rows_of(out)
        if (row["method"], row["alpha"], row["k"]) == ("superfacets", "200.0", "20")
    ]
    assert len(values) == 4
    with (out / "means.csv").open(newline="") as file:
        means = {(r["category"], r["method"], r["alpha"], r["k"]): r for r in csv.DictReader(file)}
    over_all = means["all", "superfacets", "200.0", "20"]
    assert (over_all["models"], means["Human", "superfacets", "200.0", "20"]["models"]) == (
        "4",
        "2",
    )
    assert float(over_all["undersegmentation_error"]) == pytest.approx(np.mean(values))
    with (out / "figure-6.csv").open(newline="") as file:
        points = {(r["method"], r["alpha"], r["k"]): r for r in csv.DictReader(file)}
    assert len(points) == 2 * (6 + 5)
    point = points["superfacets", "200.0", "20"]
    assert float(point["undersegmentation_error"]) == pytest.approx(np.mean(values))


def test_a_second_start_does_only_what_is_missing(run, benchmark, tmp_path):
    out = tmp_path / "out"
    run(benchmark, "-o", out, *FAST)
    before = {path: path.stat().st_mtime_ns for path in (out / "records").rglob("*.json")}
    numbers = numbers_of(out)
    damaged, stale, gone, *_ = sorted(before)
    damaged.write_text(damaged.read_text()[:200])
    record = json.loads(stale.read_text())
    record["key"]["method"] = ["superfacets", 0]
    stale.write_text(json.dumps(record))
    gone.unlink()
    (gone.parent / ".alpha-0_k-5.json.0123456789ab.tmp").write_text("half a rec")
    status, stdout, _ = run(benchmark, "-o", out, *FAST)
    assert status == 0
    assert stdout.startswith("88 runs done, 0 failed")
    after = {path: path.stat().st_mtime_ns for path in before}
    assert {path for path in before if before[path] != after[path]} == {damaged, stale, gone}
    assert numbers_of(out) == numbers
    assert not list(out.rglob(".*.tmp"))


def test_records_of_a_model_that_changed_are_made_again(run, benchmark, tmp_path):
    out = tmp_path / "out"
    run(benchmark, "-o", out, *FAST)
    before = numbers_of(out)
    truth = benchmark / "seg" / "Benchmark" / "21" / "21_0.seg"
    truth.write_text(truth.read_text().replace("1", "2").replace("0", "1", 3))
    run(benchmark, "-o", out, *FAST)
    changed = {name for name, record in numbers_of(out).items() if record != before[name]}
    assert changed == {name for name in before if "/21/" in name}


def test_killed_in_the_middle_it_goes_on_to_the_same_numbers(run, benchmark, tmp_path, broken):
    options = ("--ks", "5,20", "--methods", "superfacets,stk02,vsa-l2-r", "--figures", "6,7")
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert run(benchmark, "-o", whole, *options)[0] == 0
    command = [sys.executable, "-m", "research", "reproduce", benchmark, "-o", broken, *options]
    for n_records in (1, 30):
        process = subprocess.Popen(
            list(map(str, command)),
            cwd=ROOT,
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while len(list(broken.rglob("*.json"))) < n_records:
            assert process.poll() is None, "it ended before it could be killed"
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert not (broken / "index.html").exists()
    assert len(numbers_of(broken)) < len(numbers_of(whole))
    assert run(benchmark, "-o", broken, *options)[0] == 0
    assert numbers_of(broken) == numbers_of(whole)
    assert not list(broken.rglob(".*.tmp"))


def test_ctrl_c_leaves_whole_records_only(benchmark, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "research", "reproduce", benchmark, "-o", out, *FAST]
    process = subprocess.Popen(
        list(map(str, command)), cwd=ROOT, start_new_session=True, stderr=subprocess.PIPE, text=True
    )
    while not list(out.rglob("*.json")):
        assert process.poll() is None
        time.sleep(0.002)
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=60)
    assert (process.returncode, stderr.strip()) == (130, "superfacets: error: interrupted")
    for path in out.rglob("*.json"):
        assert "metrics" in json.loads(path.read_text())["record"]


def test_missing_and_mismatched_files_are_named_and_skipped(run, benchmark, tmp_path):
    truths = benchmark / "seg" / "Benchmark"
    (truths / "1" / "1_0.seg").unlink()
    (truths / "2" / "2_1.seg").write_text("0\n1\n")
    for path in (truths / "21").iterdir():
        path.unlink()
    (benchmark / "off" / "400.off").write_text("OFF\n3 1 0\n")
    (benchmark / "off" / "270.off").write_text("OFF\n")
    out = tmp_path / "out"
    status, stdout, stderr = run(benchmark, "-o", out, *FAST)
    assert status == 0
    assert stdout.startswith("44 runs done, 0 failed")
    notes = stderr.splitlines()
    assert all(line.startswith("superfacets: note: ") for line in notes)
    for text in ("1_0.seg", "2_1.seg", "model 21 is left out", "400 is left out", "model 270"):
        assert sum(text in line for line in notes) == 1, text
    assert {row["model"] for row in rows_of(out)} == {"1", "2"}
    page = (out / "index.html").read_text()
    for text in ("1_0.seg", "2_1.seg", "model 21 is left out", "model 400 is left out"):
        assert text in page


def test_a_run_that_fails_is_named_and_tried_again(run, benchmark, tmp_path):
    out = tmp_path / "out"
    options = ("--methods", "superfacets,stk02", "--figures", "6", "--jobs", "1")
    status, stdout, stderr = run(benchmark, "-o", out, "--ks", "5,250", *options)
    assert status == 0
    assert stdout.startswith("66 runs done, 22 failed, 0 not started")
    lines = stderr.splitlines()
    assert len(lines) == 4  # two methods, two numbers of faces that are too few
    assert lines[0].startswith("superfacets: note: failed: superfacets on 1 (6 runs): ValueError: ")
    failed = [row for row in rows_of(out) if row["status"] == "failed"]
    assert {(row["model"], row["k"]) for row in failed} == {("1", "250"), ("21", "250")}
    assert all("n_segments" in row["reason"] for row in failed)
    assert "Runs that failed (22)" in (out / "index.html").read_text()
    assert "the 2 of 4 models that have a result for every" in (out / "index.html").read_text()
    path = out / "records" / "stk02" / "1" / "alpha-0_k-250.json"
    before = path.stat().st_mtime_ns
    assert run(benchmark, "-o", out, "--ks", "5,250", *options)[0] == 0
    assert path.stat().st_mtime_ns != before


def test_nothing_that_succeeds_is_an_error(run, benchmark, tmp_path):
    status, _, stderr = run(benchmark, "-o", tmp_path / "out", *FAST, "--ks", "1000")
    assert status == 1
    assert re.fullmatch(
        r"superfacets: error: every run failed; the first failure: .*-n must be at most.*\n", stderr
    )


def test_a_budget_ends_the_run_and_what_is_missing_is_named(run, benchmark, tmp_path):
    out = tmp_path / "out"
    status, _, stderr = run(benchmark, "-o", out, *FAST, "--budget-minutes", 0)
    assert (status, stderr) == (
        1,
        "superfacets: error: no run was started within --budget-minutes: allow more minutes\n",
    )
    run(benchmark, "-o", out, *FAST, "--ks", "5")
    status, stdout, stderr = run(benchmark, "-o", out, *FAST, "--budget-minutes", 0)
    assert status == 0
    assert stdout.startswith("44 runs done, 0 failed, 44 not started")
    assert stderr.splitlines() == [
        "superfacets: note: not started because time ran out: superfacets on 1, 21, 400, 2 (24"
        " runs)",
        "superfacets: note: not started because time ran out: stk02 on 1, 21, 400, 2 (20 runs)",
    ]
    assert sum(row["status"] == "missing" for row in rows_of(out)) == 44
    assert "Runs that were not started in time (44)" in (out / "index.html").read_text()


def test_the_page_holds_all_it_shows(run, benchmark, tmp_path):
    out = tmp_path / "out"
    run(benchmark, "-o", out, *FAST, "--figures", "5,6", plots=True)
    page = (out / "index.html").read_text()
    sources = re.findall(r'\b(?:src|href)\s*=\s*"([^"]{1,40})', page)
    assert sources
    assert all(source.startswith(("data:image/", "#")) for source in sources)
    assert not re.search(r"@import|url\(|<script|<link", page)
    for text in ("4 models of 3 categories", "Figure 5", "Figure 6", "Missing results"):
        assert text in page
    for text in ("Figure 4", "Figure 7", "All methods"):
        assert text not in page
    plots = ("5", "6", "6-compactness", "6-undersegmentation-error")
    expected = {f"figure-{plot}.{ending}" for plot in plots for ending in ("png", "svg")}
    assert {path.name for path in (out / "plots").iterdir()} == expected


def test_only_what_the_figures_need_is_run(benchmark):
    models = find_models(benchmark)
    nothing = StudyMeshes((), ())

    def runs_for(*figures, **choice):
        return make_plan(models, nothing, Choice(figures=figures, **choice)).runs

    ours = {"superfacets", "default"}
    assert {run.method for run in runs_for("4")} == {*ours, "ncuts", "ncuts-sparse"}
    assert {run.method for run in runs_for("6")} == {*ours, "stk02"}
    assert {(run.k, run.alpha) for run in runs_for("5") if run.method == "superfacets"} == {
        (150, 200.0)
    }
    assert {run.alpha for run in runs_for("2")} == {0, 200, 1000}
    subset = runs_for("6", is_subset=True, ks=(50,))
    assert {run.source.name for run in subset} == {"1", "21", "400"}
    assert len(runs_for("6", "4")) == len(set(runs_for("6", "4")))


def many_models(*sizes):
    return StudyMeshes(
        tuple(
            StudyMesh(str(n), Path(), "Human", faces, 1, "", n) for n, faces in enumerate(sizes, 1)
        ),
        (),
    )


def test_large_models_are_left_out_of_normalized_cuts_but_for_two_of_a_category_with_the_sparse():
    limits = [methods.METHODS[name].max_faces for name in ("ncuts", "ncuts-sparse")]
    models = many_models(limits[0], limits[0] + 1, limits[1] + 1, limits[1] + 2)
    runs = make_plan(models, StudyMeshes((), ()), Choice(figures=("4",), ks=(50,))).runs
    shown = {name: {r.source.name for r in runs if r.method == name} for name in methods.METHODS}
    assert shown["ncuts"] == {"1"}
    assert shown["ncuts-sparse"] == {"1", "2"}
    assert shown["superfacets"] == {"1", "2", "3", "4"}
    large = many_models(limits[1] + 1, limits[1] + 2, limits[1] + 3)
    runs = make_plan(large, StudyMeshes((), ()), Choice(figures=("4",), ks=(50,))).runs
    assert {run.source.name for run in runs if run.method == "ncuts-sparse"} == {"1", "2"}


def test_curves_are_compared_over_the_models_that_all_have():
    chosen = make_plan(
        many_models(10, 20, 30),
        StudyMeshes((), ()),
        Choice(figures=("6",), methods=("superfacets", "stk02"), ks=(5, 6), is_subset=True),
    )
    chosen = replace(chosen, models=many_models(10, 20, 30).found)
    first, second, third = chosen.models

    def done(lacking):
        runs = (
            Run(model, method, alpha, k)
            for model in chosen.models
            for method in ("superfacets", "stk02")
            for alpha in chosen.choice.alphas(method)
            for k in (5, 6)
        )
        return RunResults(chosen, {run: {} for run in runs if not lacking(run)})

    one_less = compare(done(lambda r: (r.source, r.method, r.k) == (second, "stk02", 6)), "6")
    assert one_less.models == (first, third)
    assert (len(one_less.curves), one_less.left_out) == (6, ())
    no_alpha = compare(done(lambda run: run.alpha == 0.5), "6")
    assert no_alpha.models == chosen.models
    assert no_alpha.left_out == (Curve("stk02", 0.5),)
    assert compare(RunResults(chosen), "6").models == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--figures", "9"), "--figures: '9' is not one of 1, 2, 3, 4, 5, 6, 7, 8, rivals"),
        (("--methods", "magic"), "--methods: 'magic' is not one of superfacets, "),
        (("--ks", "5,many"), "'many' is not a whole number of 1 or more"),
        (("--ks", "0"), "'0' is not a whole number of 1 or more"),
        (("--figures", "6", "--methods", "metis"), "nothing to run: no requested figure"),
        (("--figures", "1"), "nothing to run"),
        (("--jobs", "0"), "'0' is not a whole number of 1 or more"),
        (("--budget-minutes", "-1"), "is not in the range"),
        (("--budget-minutes", "nan"), "'nan' is not a finite number"),
        (("--budget-minutes", "inf"), "'inf' is not a finite number"),
    ],
)
def test_bad_options_are_one_line(run, benchmark, tmp_path, options, message):
    status, stdout, stderr = run(benchmark, "-o", tmp_path / "out", *options)
    assert (status, stdout) == (2, "")
    assert stderr.count("\n") == 1
    assert message in stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_no_benchmark_is_one_line(run, tmp_path):
    status, _, stderr = run(tmp_path, "-o", tmp_path / "out")
    assert status == 1
    assert stderr.count("\n") == 1
    (tmp_path / "off").mkdir()
    (tmp_path / "off" / "3.off").write_text("OFF\n3 1 0\n")
    status, _, stderr = run(tmp_path, "-o", tmp_path / "out")
    assert status == 1
    assert "no model can be used: model 3 is left out" in stderr


def test_what_is_not_installed_is_named_before_anything_runs(run, benchmark, tmp_path, monkeypatch):
    for name in ("jinja2", "matplotlib", "scipy", "vsa_core"):
        monkeypatch.setitem(sys.modules, name, None)
    status, _, stderr = run(benchmark, "-o", tmp_path / "out", *FAST)
    assert status == 1
    assert stderr == (
        "superfacets: error: reproduce without jinja2 and matplotlib needs more packages:"
        " pip install --group research, and pip install research/vsa_core\n"
    )
    _, _, stderr = run(benchmark, "-o", tmp_path / "out", "--figures", "4", "--methods", "ncuts")
    assert "and scipy and matplotlib needs" in stderr
    assert not (tmp_path / "out").exists()


def test_two_starts_do_not_share_a_folder(run, benchmark, tmp_path):
    out = tmp_path / "out"
    with locked(out):
        status, _, stderr = run(benchmark, "-o", out, *FAST)
    assert (status, stderr) == (
        2,
        f"superfacets: error: {out}: another run is writing to this folder\n",
    )


def test_pictures_are_drawn_once(run, benchmark, tmp_path):
    rendering_or_skip()
    meshes = tmp_path / "meshes"
    write_off(meshes / "sheet.off", shapes.bumpy_sheet(20))
    (meshes / "broken.ply").write_text("ply")
    (meshes / "notes.txt").write_text("no mesh")
    out = tmp_path / "out"
    options = ("--figures", "1", "--methods", "superfacets,paper", "--ks", "20", "--jobs", "1")
    status, _, stderr = run(benchmark, "-o", out, "--meshes", meshes, *options)
    assert status == 0
    assert stderr.count("\n") == 1
    assert "broken.ply is left out" in stderr
    (picture,) = (out / "pictures").iterdir()
    assert picture.name == "fig1-sheet.off-superfacets-alpha200-k20.png"
    page = (out / "index.html").read_text()
    assert page.count("data:image/png") == 1
    assert "Table 1" in page
    drawn = picture.stat().st_mtime_ns
    assert run(benchmark, "-o", out, "--meshes", meshes, *options)[0] == 0
    assert picture.stat().st_mtime_ns == drawn


def test_a_picture_counts_as_drawn_only_if_whole_and_of_these_labels(benchmark, tmp_path):
    pytest.importorskip("PIL")
    source = find_models(benchmark).found[0]
    picture = pictures_of("2", (source,), (), 5)[0]
    key = picture.run.key(5)
    drawing = Drawing.of(picture, key, pack_labels(np.zeros(5, dtype=np.int32)), tmp_path)
    assert not is_drawn(drawing)
    path = picture_path(tmp_path, picture)
    gallery._write(path, np.zeros((40, 50, 3), dtype=np.uint8), drawing.key)
    assert is_drawn(drawing)
    others = pack_labels(np.ones(5, dtype=np.int32))
    assert not is_drawn(Drawing.of(picture, key, others, tmp_path))
    path.write_bytes(path.read_bytes()[:90])
    assert not is_drawn(drawing)


def test_a_picture_that_cannot_be_drawn_is_named(benchmark, tmp_path):
    source = find_models(benchmark).found[0]
    picture = pictures_of("2", (source,), (), 5)[0]
    labels = pack_labels(np.zeros(5, dtype=np.int32))
    drawing = Drawing.of(picture, picture.run.key(5), labels, tmp_path)
    assert drawing.run().startswith("ValueError: ")


def rendering_or_skip():
    from superfacets_show.rendering import check_rendering

    try:
        check_rendering()
    except (ImportError, RuntimeError) as error:
        pytest.skip(str(error))


def test_figure_1_without_meshes_is_left_out_and_said(run, benchmark, tmp_path):
    out = tmp_path / "out"
    assert run(benchmark, "-o", out, *FAST, "--figures", "1,6")[0] == 0
    assert "Left out: it needs a folder of large meshes" in (out / "index.html").read_text()


def test_pictures_show_the_smallest_models_of_their_categories():
    one = StudyMesh("9", Path(), "Human", 10, 1, "", 9)
    other = StudyMesh("10", Path(), "Human", 20, 1, "", 10)
    cat = StudyMesh("381", Path(), "Fourleg", 30, 1, "", 381)
    shown = pictures_of("8", (one, other, cat), (), 150)
    assert {picture.run.source for picture in shown} == {one, cat}
    assert {picture.run.method for picture in shown} == {
        "superfacets", "default", "vsa-l2-r", "vsa-l2-i", "vsa-l21-r", "vsa-l21-i",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("size", "shown"),
    [
        ((3, 2, 1), {"azimuth": 25}),
        ((3, 1, 2), {"azimuth": 20, "elevation": 60}),
        ((1, 2, 3), {"azimuth": 65}),
        ((1, 2, 5), {"azimuth": 65, "up": "z"}),
    ],
)
def test_meshes_are_seen_from_their_broad_side(size, shown):
    view = view_of(Mesh(np.diag(size), [[0, 1, 2]]))
    assert {name: getattr(view, name) for name in shown} == shown


def test_labels_survive_their_packing():
    labels = np.array([0, 70_000, 3, 3], dtype=np.int32)
    assert np.array_equal(unpack_labels(pack_labels(labels)), labels)
    assert unpack_labels(pack_labels(labels)).dtype == np.int32


def record_of(task):
    """Run a task in this process, and return the records of its items."""
    assert _TaskJob(task).run() == {}
    return [read_item(item) for item in task.items]


def test_records_hold_what_they_were_made_with(benchmark, tmp_path):
    source = find_models(benchmark).found[0]
    run = Run(source, "vsa-l2-r", None, 5)
    item = run.item(tmp_path, 5)
    assert item.key["settings"] == {"seed": 1}
    (record,) = record_of(measure.RunTask((item,), frozenset([run]), run.setting(5, 0)))
    assert set(record["versions"]) == {"superfacets", "python", "numpy"}
    assert len(unpack_labels(record["labels"])) == source.n_faces
    assert {"params", "stop_reason", "n_iter", "faces", "category"} <= record.keys()


def test_a_mesh_that_cannot_be_loaded_any_more_fails_all_runs_of_its_task(benchmark, tmp_path):
    source = find_models(benchmark).found[0]
    load.cache_clear()
    write_off(benchmark / "off" / f"{source.name}.off", shapes.bumpy_sheet(9))
    runs = tuple(Run(source, "superfacets", 200.0, k) for k in (5, 6))
    items = {run: run.item(tmp_path, 6) for run in runs}
    task = measure.RunTask(tuple(items.values()), frozenset(), runs[0].setting(6, 0))
    for record in record_of(task):
        assert record["reason"].startswith("MeshError: ")
    chosen = replace(
        make_plan(find_models(benchmark), StudyMeshes((), ()), Choice(figures=("6",))), runs=runs
    )
    results = collect(replace(chosen, choice=Choice(ks=(5, 6))), items, frozenset(), {})
    assert set(results.failed) == set(runs)


def changed(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def one_digit_off(path):
    text = path.read_text()
    where = re.search(r'"compactness": \d\.\d{3}', text).end() - 1
    path.write_text(f"{text[:where]}{(int(text[where]) + 1) % 10}{text[where + 1 :]}")


def wrong_shape(path, **parts):
    whole = json.loads(path.read_text())
    whole["record"] |= parts
    path.write_text(json.dumps(whole))


def a_folder(path):
    path.unlink()
    path.mkdir()
    (path / "notes.txt").write_text("mine")


DAMAGES = {
    "a digit": one_digit_off,
    "NaN": lambda path: wrong_shape(path, metrics={"compactness": float("nan")}),
    "no metrics": lambda path: wrong_shape(path, metrics={}),
    "a list": lambda path: wrong_shape(path, seconds=[]),
    "no record": lambda path: changed(path, '"record": {', '"record": null, "other": {'),
    "null": lambda path: path.write_text("null"),
    "brackets": lambda path: path.write_text(100_000 * "[" + 100_000 * "]"),
    "bytes": lambda path: path.write_bytes(b"\xff\xfe"),
    "cut": lambda path: path.write_text(path.read_text()[:-20]),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_record_is_made_again(run, benchmark, tmp_path, damage):
    out = tmp_path / "out"
    options = ("--ks", "5", "--methods", "superfacets", "--figures", "6", "--jobs", "1")
    assert run(benchmark, "-o", out, *options)[0] == 0
    numbers = numbers_of(out)
    damage(out / "records" / "superfacets" / "1" / "alpha-200_k-5.json")
    status, stdout, stderr = run(benchmark, "-o", out, *options)
    assert (status, stderr) == (0, "")
    assert stdout.startswith("24 runs done, 0 failed, 0 not started")
    assert numbers_of(out) == numbers


def test_damaged_labels_are_made_again(benchmark, tmp_path):
    run = Run(find_models(benchmark).found[0], "superfacets", 200.0, 5)
    item = run.item(tmp_path, 5)
    task = measure.RunTask((item,), frozenset([run]), run.setting(5, 0))
    (record,) = record_of(task)
    changed(item.path, record["labels"], "A" * len(record["labels"]))
    assert read_item(item) is None


def test_a_folder_in_the_place_of_a_record_fails_that_run_alone(run, benchmark, tmp_path):
    out = tmp_path / "out"
    options = ("--ks", "5", "--methods", "superfacets", "--figures", "6", "--jobs", "1")
    assert run(benchmark, "-o", out, *options)[0] == 0
    path = out / "records" / "superfacets" / "1" / "alpha-200_k-5.json"
    a_folder(path)
    status, stdout, stderr = run(benchmark, "-o", out, *options)
    assert status == 0
    assert stdout.startswith("23 runs done, 1 failed, 0 not started")
    assert re.fullmatch(
        r"superfacets: note: failed: superfacets on 1 \(1 run\): the record could not be written:"
        r" IsADirectoryError: .*\n",
        stderr,
    )
    assert (path / "notes.txt").read_text() == "mine"


def test_files_of_others_stay(run, benchmark, tmp_path):
    out = tmp_path / "out"
    options = ("--ks", "5", "--methods", "superfacets", "--figures", "6", "--jobs", "1")
    assert run(benchmark, "-o", out, *options)[0] == 0
    folder = out / "records" / "superfacets" / "1"
    others = [
        out / ".notes.tmp",
        out / "thesis" / ".chapter-1.tex.0123456789ab.tmp",
        out / "thesis" / ".runs.csv.0123456789ab.tmp",
        out / ".chapter-1.tex.0123456789ab.tmp",
        folder / ".alpha-200_k-5.json.tmp",
        folder / ".alpha-200_k-5.json.backup.tmp",
    ]
    (out / "thesis").mkdir()
    for path in others:
        path.write_text("mine")
    (folder / ".alpha-200_k-5.json.0123456789ab.tmp").mkdir()
    ours = [folder / ".alpha-0_k-5.json.0123456789ab.tmp", out / ".runs.csv.0123456789ab.tmp"]
    for path in ours:
        path.write_text("half a")
    assert run(benchmark, "-o", out, *options)[0] == 0
    assert all(path.read_text() == "mine" for path in others)
    assert (folder / ".alpha-200_k-5.json.0123456789ab.tmp").is_dir()
    assert not any(path.exists() for path in ours)


def test_every_method_is_shown_somewhere():
    for name, method in methods.METHODS.items():
        assert method.figures, name
        assert set(method.figures) <= set(plan.FIGURES)
        assert method.usual_alpha in method.alphas
        assert set(method.subset_alphas) <= set(method.alphas)


def test_text_in_tables_is_escaped_and_a_row_is_marked():
    table = {"head": ["a<b"], "rows": [["<i>x</i>", "1e5"], ["y", "2"]], "marked": "<i>x</i>"}
    section = {"title": "Means", "template": "summary.html", "k": 3, "table": table}
    text = page._render(title="t", lead="", sections=[section])
    assert "<th>a&lt;b</th>" in text
    assert "<td>&lt;i&gt;x&lt;/i&gt;</td><td>1e5</td>" in text
    assert text.count('<tr class="marked">') == 1
