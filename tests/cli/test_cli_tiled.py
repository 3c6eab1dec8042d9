"""The command `segment --tiled`."""

import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import shapes
from command_line import COMMAND, files_in

from superfacets import Mesh, PointCloud, read_mesh, sample_mesh, segment, write_mesh
from superfacets.cli.progress import TileBar
from superfacets.tiles import segmenting


@pytest.fixture
def bear(tmp_path):
    path = tmp_path / "bear.ply"
    write_mesh(path, sample_mesh(20_000))
    return path


def test_labels_are_those_of_segment(run, bear):
    status, out, err = run("segment", bear, "-n", 40, "--tiled", "--tile-size", 5_000)
    output = bear.with_name("bear.superfacets.npy")
    expected = segment(read_mesh(bear), 40)
    assert (status, err) == (0, "")
    assert files_in(bear.parent) == ["bear.ply", "bear.superfacets.npy"]
    assert np.array_equal(np.load(output), expected.labels)
    first, last = out.splitlines()
    assert first == f"wrote {output} (a label per face)"
    facts = "bear.ply: 40 regions of"
    assert last.startswith(facts)


def test_output_scratch_and_json_are_chosen(run, bear, tmp_path):
    out, scratch = tmp_path / "results" / "labels.npy", tmp_path / "scratch"
    out.parent.mkdir()
    status, printed, err = run(
        "segment", bear, "-r", 0.05, "--tiled", "-o", out, "--scratch", scratch, "--json",
        "--no-smooth", "--weights", "superfacets", "--init", "geodesic",
    )  # fmt: skip
    assert (status, err) == (0, "")
    expected = segment(read_mesh(bear), radius=0.05, weights="superfacets", smooth=False)
    facts = json.loads(printed)
    assert facts["n_segments"] == expected.n_segments
    assert facts["outputs"] == [str(out)]
    assert facts["params"]["smooth"] is False
    assert np.array_equal(np.load(out), expected.labels)
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize(
    ("given", "options"),
    [
        (["--weights", "creases", "--relocate"], {"weights": "creases", "relocate": True}),
        (["--parts"], {}),
        (["--no-relocate"], {"relocate": False}),
        (["--scans"], {"denoise": 5, "alpha": 80.0}),
        (["--denoise", "auto"], {"denoise": "auto"}),
    ],
    ids=str,
)
def test_options_are_those_of_segment(run, bear, given, options):
    assert run("segment", bear, "-n", 40, "--tiled", *given)[0] == 0
    expected = segment(read_mesh(bear), 40, **options)
    assert np.array_equal(np.load(bear.with_name("bear.superfacets.npy")), expected.labels)


def test_clouds_are_seen_from_a_viewpoint(run, tmp_path):
    path = tmp_path / "sheet.npy"
    points = shapes.bumpy_sheet(30).vertices
    np.save(path, points)
    view = ["--viewpoint", 0, 0, 100]
    assert run("segment", path, "-n", 20, "--tiled", "-o", tmp_path / "up.npy", *view)[0] == 0
    assert run("segment", path, "-n", 20, "-o", tmp_path / "whole.npy", *view)[0] == 0
    assert np.array_equal(np.load(tmp_path / "up.npy"), np.load(tmp_path / "whole.npy"))
    status, _, err = run("segment", path.with_name("none.ply"), "--tiled", *view)
    assert (status, err.count("\n")) == (1, 1)


def test_a_viewpoint_of_a_mesh_is_one_line(run, bear):
    status, _, err = run("segment", bear, "-n", 9, "--tiled", "--viewpoint", 0, 0, 1)
    assert (status, err.count("\n")) == (1, 1)
    assert err.endswith(
        "omit viewpoint: it is only for point clouds without normals or viewpoints\n"
    )
    assert files_in(bear.parent) == ["bear.ply"]


@pytest.fixture
def city(tmp_path):
    """Return a folder with the halves of a mesh, and the labels of the whole mesh."""
    mesh, folder = shapes.bumpy_sheet(24), tmp_path / "city"
    folder.mkdir()
    halves = [mesh.faces[:600], mesh.faces[600:]]
    for name, faces in zip(["a.ply", "b.obj"], halves, strict=True):
        used, corners = np.unique(faces, return_inverse=True)
        write_mesh(folder / name, Mesh(mesh.vertices[used], corners.reshape(-1, 3)))
    return folder, segment(mesh, 20).labels


def test_a_folder_of_files_is_one_mesh(run, city, tmp_path):
    folder, wanted = city
    assert run("segment", folder, "-n", 20, "--tiled", "-q")[0] == 0
    assert np.array_equal(np.load(tmp_path / "city.superfacets.npy"), wanted)


def test_a_folder_takes_the_labels_of_each_file(run, city, tmp_path):
    folder, wanted = city
    out = tmp_path / "out"
    status, printed, err = run("segment", folder, "-n", 20, "--tiled", "-o", f"{out}/")
    assert (status, err) == (0, "")
    lines = [f"wrote {out / name} (a label per face)" for name in ("a.npy", "b.npy")]
    assert printed.splitlines()[:2] == lines
    assert files_in(out) == ["a.npy", "b.npy"]
    found = [np.load(out / name) for name in files_in(out)]
    assert [len(labels) for labels in found] == [600, 552]
    assert np.array_equal(np.concatenate(found), wanted)
    (folder / "b.obj").unlink()
    printed = run("segment", folder, "-n", 9, "--tiled", "-o", out, "--to", "npy", "--json")[1]
    assert json.loads(printed)["outputs"] == [str(out / "a.npy")]
    assert len(np.load(out / "a.npy")) == 600


def test_labels_of_files_and_folders_go_to_one_folder(run, city, bear, tmp_path):
    folder, _ = city
    (tmp_path / "empty").mkdir()
    inputs = (folder, tmp_path / "empty", bear)
    out = tmp_path / "out"
    status, _, err = run("segment", *inputs, "-n", 20, "--tiled", "-o", f"{out}/")
    assert status == 1
    assert err.count("has no file that ends in .glb") == 1
    assert err.splitlines()[-1] == "superfacets: error: 1 of 3 files failed"
    assert files_in(out) == ["a.npy", "b.npy", "bear.superfacets.npy"]


def test_labels_that_would_have_one_name_are_refused(run, city, bear, tmp_path):
    folder, _ = city
    other, out = tmp_path / "other", f"{tmp_path}/out/"
    other.mkdir()
    (other / "a.ply").write_bytes(bear.read_bytes())
    status, _, err = run("segment", folder, other, "--tiled", "-o", out)
    message = f"{folder} and {other} would both be written to {out}a.npy"
    assert (status, message in err) == (2, True)
    (folder / "a.off").touch()
    status, _, err = run("segment", folder, "--tiled", "-o", out)
    assert (status, err.count("\n")) == (2, 1)
    assert f"a.off and a.ply in {folder} would both be written to a.npy: rename one" in err
    assert files_in(tmp_path) == ["bear.ply", "city", "other"]


def test_notes_are_those_of_segment(run, tmp_path):
    path = tmp_path / "islands.ply"
    cube = shapes.cube()
    apart = [Mesh(cube.vertices + [3 * place, 0, 0], cube.faces) for place in range(5)]
    write_mesh(path, shapes.together(apart))
    status, _, err = run("segment", path, "-n", 3, "--tiled")
    assert (status, run("segment", path, "-n", 3)[2]) == (0, err)
    assert "2 more regions than requested" in err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tile-size", 5], "--tile-size needs --tiled"),
        (["--scratch", "x"], "--scratch needs --tiled"),
        (["--cache", 5], "--cache needs --tiled"),
        (["--workers", 2], "--workers needs --tiled"),
        (["--scheduler", "tcp://a:1"], "--scheduler needs --tiled"),
        (
            ["--tiled", "--workers", 2, "--scheduler", "tcp://a:1"],
            "give --workers or --scheduler, not both",
        ),
        (["--tiled", "--features", "color"], "--tiled does not support --features"),
        (["--tiled", "--subdivide"], "--tiled does not support --subdivide"),
        (["--tiled", "--min-size", 0.1], "--tiled does not support --min-size"),
        (["--tiled", "--paper"], "--tiled does not support --paper"),
        (["--tiled", "--init", "farthest"], "--tiled does not support --init"),
        (["--tiled", "--weights", "stk02"], "weights must be one of parts, creases, superfacets"),
        (["--tiled", "--min-opacity", 0.5], "--tiled does not support --min-opacity"),
        (["--tiled", "--connect"], "--tiled does not support --connect"),
        (["--tiled", "--mask", "m.npy"], "--tiled does not support --mask: first write the"),
        (["--tiled", "--barriers", "m.npy"], "--tiled does not support --barriers"),
        (["--tiled", "-o", "a.ply"], "with --tiled, give one output"),
        (["--tiled", "-o", "a.npy", "-o", "b.npy"], "with --tiled, give one output"),
        (["--tiled", "--to", "seg"], "with --tiled, give one output"),
        (["--tiled", "-o", "-"], "--tiled does not support standard input and output"),
        (["--tiled", "--cache", "-1"], "'-1' is not a whole number of 0 or more"),
        (
            ["--tiled", "--cache", 1, "--workers", 2],
            "--cache cannot be used with --workers or --scheduler",
        ),
    ],
)
def test_what_is_not_done_in_tiles_is_refused(run, bear, options, message):
    status, out, err = run("segment", bear, *options)
    assert (status, out) == (2, "")
    assert message in err
    assert files_in(bear.parent) == ["bear.ply"]


def test_a_damaged_file_and_a_scheduler_that_is_not_there_are_one_line(run, bear, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("superfacets.batches.cluster.CONNECT_TIMEOUT", 0.3)
    status, _, err = run("segment", bear, "--tiled", "--scheduler", "tcp://127.0.0.1:9")
    assert status == 1
    assert err.startswith(
        "superfacets: error: cannot connect to a Dask scheduler at tcp://127.0.0.1:9: "
    )
    faces = np.array(sample_mesh(20_000).faces)
    content = bear.read_bytes()
    bear.write_bytes(content.replace(faces[-1].tobytes(), np.int32([0, 1, 10**9]).tobytes()))
    status, _, err = run("segment", bear, "--tiled")
    assert status == 1
    assert err.startswith(f"superfacets: error: {bear}: faces[{len(faces) - 1}] refers to vertex")
    assert err.count("\n") == 1
    assert files_in(bear.parent) == ["bear.ply"]


def test_megabytes_that_stay_in_memory(run, bear, monkeypatch):
    given = []
    segment_tiled = segmenting.segment_tiled
    monkeypatch.setattr(
        segmenting,
        "segment_tiled",
        lambda *args, **keywords: given.append(keywords) or segment_tiled(*args, **keywords),
    )
    for options in (["--cache", 3], ["--cache", 0], []):
        assert run("segment", bear, "--tiled", *options)[0] == 0
    assert [keywords.get("cache") for keywords in given] == [3_000_000, 0, None]


def at_work_on_tiles(path, out, before=()):
    """Start a process, and wait until it writes tiles to a scratch folder beside the output."""
    command = [*before, *COMMAND, "segment", str(path), "-o", str(out), "--tiled", "-q"]
    command += ["--tile-size", "50000", "--cache", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not any(out.parent.glob(".superfacets-tiles-*/tile0/cells.npy")):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return process


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_that_ends_the_run_leaves_nothing(large, tmp_path, name):
    process = at_work_on_tiles(large, tmp_path / "out.npy")
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors.strip()) == (130, "superfacets: error: interrupted")
    assert files_in(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_repeated_signals_do_not_keep_a_run_from_removing_its_scratch(large, tmp_path, name):
    process = at_work_on_tiles(large, tmp_path / "out.npy")
    while files_in(tmp_path) and process.poll() is None:
        process.send_signal(getattr(signal, name))
        time.sleep(0.0005)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors.strip()) == (130, "superfacets: error: interrupted")
    assert files_in(tmp_path) == []


@pytest.mark.skipif(shutil.which("nohup") is None, reason="there is no nohup")
def test_a_run_under_nohup_outlives_its_terminal(large, tmp_path):
    process = at_work_on_tiles(large, tmp_path / "out.npy", before=["nohup"])
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=120)
    assert (process.returncode, files_in(tmp_path)) == (0, ["out.npy"])


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_shows_the_stage_and_the_tiles(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with TileBar("bear.ply", is_quiet=False) as bar:
        bar.on_stage("weights")
        bar.on_tile(3, 3)
        bar.on_stage("classify")
        bar.on_iteration(7, 100)
        shown = sys.stderr.getvalue()
    assert "bear.ply: weights 3/3" in shown
    assert "bear.ply: iterations 7/7" in shown
    monkeypatch.setattr(sys, "stderr", Terminal())
    with TileBar("bear.ply", is_quiet=True) as bar:
        bar.on_tile(1, 2)
    assert sys.stderr.getvalue() == ""


def test_point_clouds(run, tmp_path):
    points = np.random.default_rng(0).normal(size=(9_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    path, out = tmp_path / "scan.npy", tmp_path / "labels.npy"
    np.save(path, points)
    status, printed, err = run("segment", path, "-n", 9, "--tiled", "--tile-size", 4096, "-o", out)
    assert (status, err) == (0, "")
    assert np.array_equal(np.load(out), segment(points, 9).labels)
    assert "scan.npy: 9 regions of 9,000 points in " in printed
    folder = tmp_path / "scans"
    folder.mkdir()
    write_mesh(folder / "a.ply", PointCloud(points))
    write_mesh(folder / "b.ply", sample_mesh(3_000))
    status, _, err = run("segment", folder, "-n", 9, "--tiled", "-o", out)
    message = "the folder has both meshes and point clouds: use separate folders"
    assert (status, err) == (1, f"superfacets: error: {folder}: {message}\n")
