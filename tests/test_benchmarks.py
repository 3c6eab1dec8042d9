"""The benchmark measures correctly, and notices wrong labels. No test depends on a time."""

import json
import re
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from benchmarks import (
    batch,
    checks,
    clock,
    machine,
    memory,
    meshes,
    pages,
    report,
    rivals,
    runs,
    targets,
)
from benchmarks import plan as plans
from benchmarks.cli import commands
from click.testing import CliRunner
from shapes import strip

import superfacets as sf

BEAR = "bear5k"
NOTHING_STORED = {"meshes": {}}


@pytest.fixture(scope="module")
def bear():
    return meshes.build(BEAR, None)


@pytest.fixture
def no_data(monkeypatch, tmp_path):
    monkeypatch.setenv("SUPERFACETS_DATA", str(tmp_path))


# meshes


def test_the_icosahedron_is_regular_and_outward():
    arrays = meshes.icosahedron()
    assert arrays.faces.shape == (20, 3)
    assert sf.build_face_graph(tuple(arrays)).edge_counts == (30, 0, 0, 0)
    corners = arrays.vertices[arrays.faces]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(2.53615, abs=1e-5)


def test_noise_is_small_seeded_and_leaves_the_given_mesh_alone():
    ball = meshes.subdivide(meshes.icosahedron())
    before = ball.vertices.copy()
    noisy, again = meshes.perturb(ball), meshes.perturb(ball)
    assert np.array_equal(ball.vertices, before)
    assert np.array_equal(noisy.vertices, again.vertices)
    shift = np.abs(noisy.vertices - before).max()
    assert 0 < shift <= 0.05 * 1.05 * np.sqrt(2)  # in edge lengths; their mean is rounded to 2**n


@pytest.mark.parametrize(
    ("name", "n_faces"),
    [("sphere", 20), ("sphere-x16", 320), ("bear5k", 4_892), ("bear60k", 60_220)],
)
def test_meshes_are_made_by_name(name, n_faces):
    assert len(meshes.build(name, None).faces) == meshes.count_faces(name, None) == n_faces


@pytest.mark.parametrize("name", ["bunny-x8", "bunny-x0", "-x4", "a/b"])
def test_a_name_that_means_nothing_is_refused(name):
    with pytest.raises(ValueError, match="is not the name of a mesh"):
        meshes.split_name(name)


def test_a_mesh_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no mesh 'nowhere'"):
        meshes.build("nowhere", tmp_path)


def test_the_catalog_runs_from_ten_thousand_to_seven_million_faces(data_dir):
    counts = plans.make_plan(data=data_dir).meshes.values()
    assert min(counts) < 20_000
    assert max(counts) == 6_775_040
    assert 1_310_720 in counts


# clock


def test_jobs_take_turns_and_the_warm_up_is_checked_but_not_counted():
    seen = []
    jobs = {"a": lambda: seen.append("a"), "b": lambda: seen.append("b")}
    checked = []
    samples = clock.interleaved(jobs, 2, lambda key, _: checked.append(key))
    assert seen == checked == ["a", "b", "b", "a", "a", "b"]
    assert [len(samples[key]) for key in jobs] == [2, 2]


def test_a_refused_result_ends_the_run():
    def refuse(*_):
        raise checks.WrongLabelsError("no")

    with pytest.raises(checks.WrongLabelsError):
        clock.interleaved({"a": int}, 1, refuse)


# rows for runs


def run_row(mesh, faces, seconds, k=150, threads=2, settings="defaults"):
    return {
        "mesh": mesh, "faces": faces, "k": k, "settings": settings, "threads": threads,
        "iterations": 10, "seconds": seconds, "fastest": seconds, "slowest": seconds,
        "levels": [(faces // 16, 8), (faces, 2)],
        "stages": {"classify": seconds / 2, "mesh": 0.0}, "checked": "stored hash",
    }  # fmt: skip


def test_a_speedup_compares_runs_that_differ_in_threads_alone():
    rows = [run_row("hand", 105_860, 3.0, threads=1), run_row("hand", 105_860, 2.0)]
    (row,) = runs.speedups([*rows, run_row("bunny", 69_451, 1.0)])
    assert row["speedup"] == 1.5
    assert row["stages"] == {"classify": 1.5}


# checks


def stored(bear, labels):
    run = {"run": checks.hash_labels(labels)}
    return {"meshes": {BEAR: {"mesh": checks.hash_mesh(bear), "labels": run}}}


def test_a_hash_of_another_mesh_falls_back_to_what_must_hold(bear):
    result = sf.segment(tuple(bear), 20)
    expected = stored(meshes.perturb(bear), result.labels[::-1].copy())
    verdict = checks.check_labels(expected, (BEAR, "run"), bear, result, lambda: result)
    assert verdict == "invariants, 1 thread (another mesh than hashed)"
    verdict = checks.check_labels(NOTHING_STORED, (BEAR, "run"), bear, result, lambda: result)
    assert verdict == "invariants, 1 thread (no hash)"


def changed_result(result, **changes):
    fields = ("labels", "centers", "n_iter", "stop_reason", "timings", "params")
    return sf.Segmentation(**({name: getattr(result, name) for name in fields} | changes))


def test_labels_that_break_an_invariant_are_refused(bear):
    result = sf.segment(tuple(bear), 20)
    swapped = result.labels.copy()
    far = int(np.flatnonzero(swapped != swapped[result.centers[0]])[0])
    swapped[result.centers[0]] = swapped[far]
    wrong = {
        "not one label per face": {"labels": result.labels[1:]},
        "int64, not int32": {"labels": result.labels.astype(np.int64)},
        "have gaps": {"labels": np.zeros_like(result.labels)},
        "is in another region": {"labels": swapped},
        "20 regions, 19 requested": {"params": result.params | {"n_segments": 19}},
    }
    for message, changes in wrong.items():
        with pytest.raises(checks.WrongLabelsError, match=message):
            checks.check_invariants(bear, changed_result(result, **changes))


def test_a_region_in_pieces_is_refused(bear):
    result = sf.segment(tuple(bear), 20)
    graph = sf.build_face_graph(tuple(bear))
    inner = [
        face
        for face in range(100)
        if face not in result.centers
        and len(set(result.labels[graph.neighbors[3 * face : 3 * face + 3]])) == 1
    ]
    labels = result.labels.copy()
    labels[inner[0]] = (labels[inner[0]] + 10) % 20
    with pytest.raises(checks.WrongLabelsError, match="20 regions are in 21 pieces"):
        checks.check_invariants(bear, changed_result(result, labels=labels))
    halted = result.params | {"radius_factor": 2.0}  # may leave pieces, but not too few regions
    checks.check_invariants(bear, changed_result(result, labels=labels, params=halted))
    fewer = changed_result(result, params=halted | {"n_segments": 21})
    with pytest.raises(checks.WrongLabelsError, match="20 regions, 21 requested"):
        checks.check_invariants(bear, fewer)


# measurements


def test_orders_are_of_the_same_faces(bear):
    for vertices in (False, True):
        shuffled = meshes.shuffle(bear, vertices=vertices)
        assert not np.array_equal(shuffled.faces, bear.faces)
        assert np.array_equal(shuffled.vertices, bear.vertices) == (not vertices)
        corners = [np.sort(a.vertices[a.faces].reshape(-1, 9), axis=0) for a in (shuffled, bear)]
        assert np.array_equal(*corners)


def test_orders_have_a_row_each_and_the_first_is_the_unit(bear):
    rows = runs.measure_orders(BEAR, bear, 20, 2)
    assert [row["order"] for row in rows] == [
        "as it is", "faces shuffled", "faces and vertices shuffled"
    ]  # fmt: skip
    assert rows[0]["ratio"] == rows[0]["cpu"] == 1
    assert all(row["ratio"] > 0 and row["cpu"] > 0 for row in rows)
    assert "| faces shuffled " in report.render(results_of(orders=rows))


def test_labels_that_depend_on_threads_end_the_benchmark(bear, monkeypatch):
    right = runs.SETTINGS["plain"]

    def wrong_on_two(mesh, n_segments, *, n_threads):
        return right(mesh, n_segments + (n_threads == 2), n_threads=n_threads)

    monkeypatch.setitem(runs.SETTINGS, "plain", wrong_on_two)
    cases = [runs.Case(BEAR, 20, "plain", n) for n in (1, 2)]
    with pytest.raises(checks.WrongLabelsError, match="number of threads"):
        runs.measure(bear, cases, 1, NOTHING_STORED)


def test_memory_is_measured_in_another_process(bear):
    finer = meshes.subdivide(meshes.subdivide(bear))
    row = memory.measure("bear", finer, 20)
    assert row["labels"] == checks.hash_labels(sf.segment(tuple(finer), 20).labels)
    assert row["input_bytes_per_face"] == pytest.approx(24, rel=0.01)
    assert 4 <= row["bytes_per_face"] < 2_000
    of_points = memory.measure("bear", meshes.Arrays(finer.vertices, finer.faces[:0]), 20)
    assert of_points["labels"] == checks.hash_labels(sf.segment(finer.vertices, 20).labels)
    assert of_points["faces"] == len(finer.vertices)


def test_facts_tell_nothing_of_whose_machine_it_is():
    facts = machine.facts()
    assert facts["cores"] >= 1
    assert facts["versions"].keys() >= {"superfacets", "numpy"}
    import platform

    assert platform.node() not in json.dumps(facts).split('"')
    assert str(Path.home()) not in json.dumps(facts)


# other implementations


def test_the_numpy_adjacency_is_that_of_the_face_graph(bear):
    offsets, neighbors = rivals.face_adjacency(bear)
    graph = sf.build_face_graph(tuple(bear))
    assert np.array_equal(offsets, graph.offsets)
    assert np.array_equal(neighbors, graph.neighbors)


def test_the_numpy_adjacency_leaves_out_boundary_edges():
    offsets, neighbors = rivals.face_adjacency(meshes.Arrays(strip(3).vertices, strip(3).faces))
    assert offsets.tolist() == [0, 1, 3, 4]
    assert sorted(neighbors.tolist()) == [0, 1, 1, 2]


@pytest.mark.parametrize("rival", rivals.RIVALS, ids=lambda rival: f"{rival.name} {rival.settings}")
def test_each_rival_labels_all_its_elements(rival, bear):
    if not rivals.is_installed(rival.module):
        pytest.skip(f"{rival.module} is not installed: it is in the dependency group `bench`")
    outcome = rival.run(rival.prepare(bear), 50)
    n_elements = {"faces": len(bear.faces), "vertices": len(bear.vertices)}
    assert len(outcome.labels) == pytest.approx(
        n_elements.get(rival.elements, len(bear.faces)), rel=0.02
    )
    assert 40 <= len(np.unique(outcome.labels)) <= 60
    assert all(seconds > 0 for seconds in outcome.seconds.values())


# reports


def results_of(**changes):
    empty = {
        "machine": machine.facts() | {"cores": 2},
        "runs": [], "passes": [], "orders": [], "label_races": [], "pass_races": [], "memory": [],
        "speedups": [],
    }  # fmt: skip
    return empty | changes


def test_tables_hold_times_and_documents_ratios():
    row = run_row("bunny", 69_451, 0.06)
    text = report.render(results_of(runs=[row]))
    assert re.search(
        r"\| bunny +\| +69,451 \| +150 \| defaults +\| +2 \| 8 \+ 2 +\| +0.06 \|", text
    )
    bunny = {"what": "bunny", "now": 0.06, "target": 0.05, "floor": 0.0, "unit": "s"}
    results = results_of(targets=[bunny])
    document = "before\n<!-- table: targets -->\nold\n<!-- end -->\nafter\n"
    filled = report.fill(document, results)
    assert re.search(r"\| bunny +\| +0.06 +\| +0.05 +\|", filled)
    assert filled.startswith("before\n<!-- table: targets -->\n\n|  ")
    assert filled.endswith("\n<!-- end -->\nafter\n")
    assert "old" not in filled
    assert report.fill(filled, results) == filled


def test_a_mark_that_names_no_table_is_an_error():
    with pytest.raises(KeyError):
        report.fill("<!-- table: nothing -->\n<!-- end -->", results_of())


def test_the_page_of_the_documentation_has_a_mark_for_each_table(request):
    page = (request.config.rootpath / "docs" / "benchmarks.md").read_text()
    assert all(f"<!-- table: {name} -->" in page for name in report.DOC_TABLES)
    report.fill(page, results_of())


# command


def run(*arguments):
    return CliRunner().invoke(commands, list(arguments))


def test_all_runs_on_a_small_mesh_and_writes_json(no_data, tmp_path):
    output = tmp_path / "bench.json"
    done = run("all", "--quick", "--meshes", "sphere-x64", "--repeats", "1", "--json", str(output))
    assert done.exit_code == 0, done.output
    assert "using sample meshes" in done.output
    results = json.loads(output.read_text())
    assert {row["checked"] for row in results["runs"]} == {"invariants, 1 thread (no hash)"}
    assert results["imports"]["numpy"]["seconds"] > 0
    for title in ("Arrays to labels", "One full classification", "Rivals", "Processes"):
        assert f"## {title}\n" in done.output
    again = run("report", str(output))
    assert again.exit_code == 0
    assert "## Threads\n" in again.output


def test_targets_are_a_table_of_the_terminal_and_of_the_documentation(
    no_data, tmp_path, monkeypatch
):
    names = ("sphere-x16", "sphere-x64")
    monkeypatch.setattr(targets, "Meshes", partial(targets.Meshes, names, *names, *names))
    monkeypatch.setattr(targets, "_memory_speeds", partial(targets._memory_speeds, 1 << 24))
    output = tmp_path / "bench.json"
    done = run("targets", "--repeats", "1", "--json", str(output))
    assert done.exit_code == 0, done.output
    assert "## Targets\n" in done.output
    results = json.loads(output.read_text())
    rows = {row["what"]: row for row in results["targets"]}
    assert all(row["now"] > 0 for what, row in rows.items() if not what.startswith("smoothing"))
    assert rows["METIS (contiguous=True) over ours, 1,280 faces, noisy, k = 320"]["target"] == 4.0
    assert rows["shuffled faces over sorted ones"]["target"] == 1.25
    assert rows["1,280 faces, k = 150"]["floor"] > 0
    document = "<!-- table: targets -->\n<!-- end -->\n<!-- table: rivals -->\n<!-- end -->"
    filled = report.fill(document, results)
    assert "| memory of a mesh, per face " in filled
    assert len(re.findall(r"^\| +(?:320|1,280)(?:, noisy)? +\|", filled, re.MULTILINE)) == 4


def test_tables_without_rows_stay():
    document = "<!-- table: rivals -->\n\n| old |\n\n<!-- end -->"
    assert report.fill(document, results_of()) == document


@pytest.fixture
def expected(monkeypatch):
    """Return a function that replaces the stored hashes."""
    return lambda hashes: monkeypatch.setattr("benchmarks.cli.load_expected", lambda: hashes)


def test_hashes_that_expect_stores_are_found_by_later_runs(no_data, tmp_path, expected):
    path = tmp_path / "expected.json"
    done = run("expect", "--meshes", "sphere-x64", "--output", str(path))
    assert done.exit_code == 0, done.output
    expected(checks.load_expected(path))
    output = tmp_path / "bench.json"
    done = run("stages", "--meshes", "sphere-x64", "--repeats", "1", "--json", str(output))
    assert done.exit_code == 0, done.output
    rows = json.loads(output.read_text())["runs"]
    assert {row["checked"] for row in rows} == {"stored hash"}


def test_wrong_labels_print_no_times(no_data, expected):
    mesh = checks.hash_mesh(meshes.build("sphere-x64", None))
    wrong = {"mesh": mesh, "labels": {"k=150, plain": "0"}}
    expected({"meshes": {"sphere-x64": wrong}})
    done = run("stages", "--meshes", "sphere-x64", "--repeats", "1")
    assert done.exit_code == 1
    assert "no times: sphere-x64, k=150, plain: the labels do not have" in done.output
    assert "seconds" not in done.output


@pytest.mark.parametrize("arguments", [("--meshes", "nothing"), ("--max-faces", "5")])
def test_a_selection_without_meshes_is_one_line(no_data, arguments):
    done = run("stages", *arguments)
    assert done.exit_code == 1
    assert done.output.count("\n") == 1


def test_the_table_of_the_readme_is_printed(monkeypatch):
    monkeypatch.setattr("benchmarks.cli.README_MESHES", (BEAR,))
    done = run("timings", "--repeats", "1")
    assert done.exit_code == 0, done.output
    assert re.search(r"\| +faces \| +regions \| +iterations \| +seconds \|", done.output)
    assert re.search(r"\| +4,892 \| +2,000 \|", done.output)


def test_batches_on_several_workers_write_the_same(tmp_path):
    for name in ("a/one.ply", "two.ply"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        sf.write_mesh(path, sf.sample_mesh(3_000))
    ran = CliRunner().invoke(commands, ["batch", str(tmp_path), "--repeats", "1", "--files", "5"])
    rows = [line.split("|")[1:-1] for line in ran.output.splitlines()]
    assert [[cell.strip() for cell in row[:2]] for row in rows[2:]] == [["1", "5"], ["2", "5"]]
    assert float(rows[2][5]) == 1.0
    assert all(float(row[4]) > 0 for row in rows[2:])


def test_batches_that_write_something_else_are_given_no_times(tmp_path, monkeypatch):
    def run(folder, output, n_workers):
        output.mkdir()
        (output / "one.npy").write_bytes(bytes([n_workers]))
        return 1.0

    monkeypatch.setattr(batch, "_run", run)
    with pytest.raises(checks.WrongLabelsError, match="2 workers write other results"):
        batch.measure_batch(tmp_path, [1, 2], 1)


# pages


def test_a_knobby_torus_is_closed_and_has_the_faces_asked_for():
    torus = pages.knobby_torus(2_000)
    assert 2_000 <= torus.n_faces <= 2_200
    graph = sf.build_face_graph(torus)
    assert graph.edge_counts == (3 * torus.n_faces // 2, 0, 0, 0)
    corners = torus.vertices[torus.faces]
    assert np.linalg.det(corners).sum() > 0


def test_growth_is_printed_as_a_table():
    done = run("doubling", "--shapes", "star,line", "--jobs", "k = N/2", "--smallest", "64",
               "--doublings", "1", "--repeats", "1")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "| job     |   star |   line |" in done.output
    assert re.search(r"\| k = N/2 \| +-?\d\.\d\d \| +-?\d\.\d\d \|", done.output)


def test_a_shape_that_is_not_known_is_one_line():
    done = run("doubling", "--shapes", "stars")
    assert done.exit_code == 2
    assert "unknown name 'stars': choose from flat grid, star" in done.output


def test_the_page_is_measured_in_a_browser(tmp_path, monkeypatch):
    pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if not (shutil.which("chromium") or shutil.which("google-chrome")):
        pytest.skip("there is no Chromium")
    monkeypatch.setattr(pages, "SIZE", {"width": 640, "height": 400})
    output = tmp_path / "page.json"
    done = run("page", "2000", "--segments", "9", "--frames", "2", "--json", str(output))
    assert done.exit_code == 0, done.output
    found = json.loads(output.read_text())
    assert f"| {found['faces']:,}; 9 " in done.output
    assert found["corners"] == 3 * found["faces"]
    assert found["gpu_bytes"] > 20 * found["faces"]
    for kind in ("fine", "moving"):
        assert found[kind]["fps"] > 0
        assert (found[kind]["calls"], found[kind]["sent_bytes"]) == (2, 0)
    assert found["hover"]["picks"] == 1


def test_a_page_without_a_browser_is_one_line(monkeypatch):
    pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    monkeypatch.setenv("PATH", "")
    done = run("page", "200")
    assert done.exit_code == 1
    assert "Chromium was not found" in done.output
    assert done.output.count("\n") == 1
