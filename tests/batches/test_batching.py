"""Batches of files: records, second runs, and errors that do or do not stop a batch."""

import errno
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import gallery_meshes
import numpy as np
import pytest
import shapes
from batch_folders import lines_of, records_of, results_in

import superfacets as sf
from superfacets.kit import locked
from superfacets_batch import batching, jobs


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def test_a_record_says_what_was_done(scan, out):
    result = sf.batch(scan, out, formats=["npy", "ply"], n_segments=np.int64(20), n_threads=2)
    labels = sf.segment(scan, 20).labels
    assert np.array_equal(np.load(out / "one.superfacets.npy"), labels)
    assert np.array_equal(sf.read_labels(out / "one.superfacets.ply"), labels)
    (record,) = map(json.loads, lines_of(out))
    assert result.records == (record,)
    assert set(record.pop("seconds")) > {"mesh", "classify", "export"}
    assert record == {
        "name": "one.ply", "input": str(scan), "version": sf.__version__,
        "params": {"formats": ["npy", "ply"], "n_segments": 20},
        "sha256": jobs.hash_of(scan), "cells": len(labels), "regions": 20, "notes": {},
        "outputs": {
            name: hashlib.sha256(data).hexdigest() for name, data in results_in(out).items()
        },
    }  # fmt: skip
    assert (result.n_done, result.n_kept, result.n_failed) == (1, 0, 0)
    assert result.n_cells == len(labels)
    assert result.seconds > 0


CHANGES = {
    "nothing": lambda scan, out, keywords, patch: None,
    "defaults": lambda scan, out, keywords, patch: keywords.update(max_num_iter=50, alpha=None),
    "threads": lambda scan, out, keywords, patch: keywords.update(n_threads=2),
    "times": lambda scan, out, keywords, patch: os.utime(scan, (1, 1)),
    "file": lambda scan, out, keywords, patch: sf.write_mesh(scan, shapes.bumpy_sheet(30)),
    "parameter": lambda scan, out, keywords, patch: keywords.update(n_segments=21),
    "formats": lambda scan, out, keywords, patch: keywords.update(formats=["seg"]),
    "version": lambda scan, out, keywords, patch: set_version(patch, "9.9"),
    "result gone": lambda scan, out, keywords, patch: (out / "one.superfacets.npy").unlink(),
    "result cut": lambda scan, out, keywords, patch: (out / "one.superfacets.npy").write_bytes(b""),
    "result damaged": lambda scan, out, keywords, patch: damage(out / "one.superfacets.npy"),
    "result unknown": lambda scan, out, keywords, patch: forget_results(out / "manifest.jsonl"),
    "record cut": lambda scan, out, keywords, patch: os.truncate(out / "manifest.jsonl", 99),
}


def damage(path):
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def forget_results(path):
    path.write_text(json.dumps({**json.loads(path.read_text()), "outputs": {}}) + "\n")


def set_version(patch, version):
    patch.setattr(batching, "__version__", version)
    patch.setattr(jobs, "__version__", version)


@pytest.mark.skipif(os.name == "nt", reason="no pipes and links here")
def test_inputs_that_are_no_regular_files_fail_at_once_at_every_start(tmp_path, out):
    scans = tmp_path / "scans"
    scans.mkdir()
    os.mkfifo(scans / "pipe.ply")
    (scans / "zeros.ply").symlink_to("/dev/zero")
    for _ in range(2):
        result = sf.batch(scans, out)
        assert [record["sha256"] for record in result.records] == [None, None]
        assert all("is not a regular file" in record["error"] for record in result.records)
    assert result.n_failed == 2


@pytest.mark.skipif(os.name == "nt", reason="no pipes here")
def test_an_output_that_became_a_pipe_is_told(scan, out):
    sf.batch(scan, out, formats=["npy"])
    (out / "one.superfacets.npy").unlink()
    os.mkfifo(out / "one.superfacets.npy")
    assert "is not a regular file" in sf.batch(scan, out, formats=["npy"]).records[0]["error"]


ENDLESS = """
import sys, threading
from superfacets_batch import jobs
class Endless:
    def __enter__(self): return self
    def __exit__(self, *_): pass
    def readinto(self, room):
        if not shown.is_set():
            shown.set()
            print("at work", flush=True)
        return 1
    def readable(self): return True
shown = threading.Event()
jobs.open_regular = lambda path: Endless()
"""

STUCK = """
import ctypes, os, signal
from superfacets_batch import batching
def wait(job):
    signal.siginterrupt(signal.SIGTERM, False)
    print("at work", flush=True)
    ctypes.CDLL(None).read(os.pipe()[0], bytes(1), 1)
batching.run_job = wait
"""


@pytest.mark.skipif(os.name == "nt", reason="SIGTERM ends every process there")
@pytest.mark.parametrize("script", [ENDLESS, STUCK], ids=["hashing", "in one call"])
def test_sigterm_ends_a_batch_whatever_it_does(scan, out, script):
    if script is ENDLESS:
        sf.batch(scan, out)
    begin = "import sys; from superfacets.__main__ import main; main()"
    command = [sys.executable, "-c", script + begin, "batch", str(scan), "-o", str(out)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **pipes) as process:
        assert process.stdout.readline() == b"at work\n"
        process.terminate()
        _, errors = process.communicate(timeout=20)
    assert (process.returncode, errors.strip()) == (130, b"superfacets: error: interrupted")


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_links_at_names_of_ours_lead_nowhere(scan, out, tmp_path):
    private = tmp_path / "private"
    private.write_text("mine")
    out.mkdir()
    (out / "one.superfacets.npy").symlink_to(private)
    assert sf.batch(scan, out, formats=["npy"]).n_done == 1
    assert not (out / "one.superfacets.npy").is_symlink()
    for name in ("manifest.jsonl", ".lock"):
        (out / name).unlink()
        (out / name).symlink_to(tmp_path / "made")
        with pytest.raises(OSError, match=f"{name}: expected a file, got a link: remove the link"):
            sf.batch(scan, out, formats=["npy"])
        (out / name).unlink()
    assert private.read_text() == "mine"
    assert not (tmp_path / "made").exists()


def test_a_damaged_line_of_the_manifest_is_noted_and_its_file_done_again(scan, out):
    sf.batch(scan, out, formats=["npy"])
    with (out / "manifest.jsonl").open("a") as file:
        file.write('{"name": "one.ply", "outputs": null}\n')
    result = sf.batch(scan, out, formats=["npy"])
    manifest = out / "manifest.jsonl"
    assert result.notes == (f"{manifest}: line 2 is damaged: its input file is processed again",)
    assert result.n_kept == len(lines_of(out)) == 1


@pytest.mark.parametrize("change", CHANGES)
def test_a_second_start_does_what_has_changed_and_nothing_else(scan, out, monkeypatch, change):
    keywords = {"n_segments": 20, "formats": ["npy"]}
    sf.batch(scan, out, **keywords)
    CHANGES[change](scan, out, keywords, monkeypatch)
    result = sf.batch(scan, out, **keywords)
    is_same = change in ("nothing", "defaults", "threads", "times")
    assert (result.n_done, result.n_kept) == ((0, 1) if is_same else (1, 0))
    assert list(records_of(out).values()) == [without_seconds(result.records[0])]


def without_seconds(record):
    return {name: value for name, value in record.items() if name != "seconds"}


def test_a_file_that_failed_is_tried_again_when_it_changed_or_on_request(scan, out):
    good = scan.read_bytes()
    scan.write_bytes(b"no mesh")
    first = sf.batch(scan, out, formats=["npy"])
    (record,) = first.records
    assert (first.n_done, first.n_kept, first.n_failed) == (0, 0, 1)
    assert record["error"] == "MeshError: not a PLY file: it does not begin with the word ply"
    assert record["sha256"] == jobs.hash_of(scan)
    seen = []
    again = sf.batch(scan, out, formats=["npy"], progress=seen.append)
    assert (again.n_failed, seen) == (1, [])
    sf.batch(scan, out, formats=["npy"], progress=seen.append, retry_failed=True)
    assert len(seen) == 1
    scan.write_bytes(good)
    assert sf.batch(scan, out, formats=["npy"]).n_done == 1
    assert len(records_of(out)) == 1


@pytest.mark.parametrize("content", [None, b""])
def test_a_file_that_is_missing_or_empty_fails_until_it_changes(scan, out, content):
    good = scan.read_bytes()
    scan.unlink() if content is None else scan.write_bytes(content)
    (record,) = sf.batch(scan, out).records
    if content is None:
        assert record["error"] == f"FileNotFoundError: {scan}: no such file"
        assert record["sha256"] is None
    else:
        assert "the file is empty" in record["error"]
        assert record["sha256"] == hashlib.sha256(b"").hexdigest()
    assert sf.batch(scan, out).records == (record,)
    scan.write_bytes(good)
    assert sf.batch(scan, out).n_done == 1


def test_every_kind_of_cells_is_done(tmp_path, out):
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(0).random((500, 3))
    sf.write_mesh(tmp_path / "quads.ply", gallery_meshes.knot())
    sf.write_mesh(tmp_path / "tets.vtu", sf.TetMesh(points, spatial.Delaunay(points).simplices))
    np.save(tmp_path / "points.npy", points)
    for name, ending in {"quads.ply": ".ply", "tets.vtu": ".vtu", "points.npy": ".ply"}.items():
        (record,) = sf.batch(tmp_path / name, out, n_segments=7).records
        assert record["regions"] == 7, name
        output = (out / name).with_suffix(f".superfacets{ending}")
        assert np.array_equal(sf.read_labels(output), sf.segment(tmp_path / name, 7).labels)


def test_files_are_subdivided_and_have_features_and_text(tmp_path, scan, out):
    keywords = {"formats": ["ply", "npy"], "max_edge": 0.02, "features": ("height",), "ascii": True}
    (record,) = sf.batch(scan, out, **keywords).records
    mesh = sf.read_mesh(scan)
    assert record["cells"] == sf.subdivide(mesh, 0.02).mesh.n_faces > mesh.n_faces
    assert len(np.load(out / "one.superfacets.npy")) == mesh.n_faces
    assert (out / "one.superfacets.ply").read_bytes().startswith(b"ply\nformat ascii")
    assert record["params"]["features"] == ["height"]
    assert sf.batch(scan, out, **keywords).n_kept == 1


def test_clouds_with_a_viewpoint_are_kept_by_a_second_start(tmp_path, out):
    np.save(tmp_path / "points.npy", np.random.default_rng(0).random((200, 3)))
    keywords = {"n_segments": 3, "viewpoint": (0.5, 0.5, 9.0)}
    assert sf.batch(tmp_path / "points.npy", out, **keywords).n_done == 1
    assert sf.batch(tmp_path / "points.npy", out, **keywords).n_kept == 1


def test_grouped_options_are_recorded_and_files_are_not_done_again(scan, out):
    grouped = {
        "n_segments": 9, "weights": sf.Weights("creases", ridges=0), "sizes": sf.Sizes(balance=1),
        "features": sf.Features("height", weight=2),
    }  # fmt: skip
    params = {
        "n_segments": 9, "weights": {"name": "creases", "ridges": 0.0}, "sizes": {"balance": 1.0},
        "features": {"table": ["height"], "weight": 2.0},
    }  # fmt: skip
    for keywords, recorded in (
        (grouped, params),
        ({"n_segments": 9, "weights": "creases", "features": "height"},
         {"n_segments": 9, "weights": "creases", "features": ["height"]}),
        ({"radius": 0.1, "paper": True, "init": "grid"},
         {"radius": 0.1, "paper": True, "init": "grid"}),
    ):  # fmt: skip
        result = sf.batch(scan, out, formats=["npy"], **keywords)
        assert (result.n_done, result.n_failed) == (1, 0)
        assert result.records[0]["params"] == {**recorded, "formats": ["npy"]}
        assert sf.batch(scan, out, formats=["npy"], **keywords).n_kept == 1
    labels = np.load(out / result.records[0]["outputs"].popitem()[0])
    assert np.array_equal(labels, sf.paper.segment(scan, radius=0.1, init="grid").labels)


def test_more_regions_than_cells_are_as_many(tmp_path, out):
    sf.write_mesh(tmp_path / "two.ply", ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
                                         [[0, 1, 2], [0, 2, 3]]))  # fmt: skip
    assert sf.batch(tmp_path / "two.ply", out, n_segments=150).records[0]["regions"] == 2


@pytest.mark.parametrize(("keywords", "error", "message"), [
    ({"n_segments": 0}, ValueError, "n_segments must be at least 1"),
    ({"n_segments": 5, "radius": 0.1}, ValueError,
     "n_segments is 5 and radius is 0.1: give only one of them"),
    ({"init": "best"}, ValueError, "init must be one of"),
    ({"init": [1, 2]}, TypeError,
     "init must not be an array, which would fit only one file"),
    ({"weights": np.ones(3)}, TypeError,
     "weights must not be an array, which would fit only one file"),
    ({"segments": 5}, TypeError, "segments is not an option for files: the options are al"),
    ({"on_stage": print}, TypeError, "on_stage is not an option"),
    ({"max_edge": -1}, ValueError, "max_edge must be"),
    ({"subdivide": 1}, TypeError, "subdivide must be True or False"),
    ({"mask_values": ["6"]}, TypeError, "each of mask_values must be an integer, got '6'"),
    ({"mask_values": [-1]}, ValueError, "each of mask_values must be at least 0, got -1"),
    ({"drop_attributes": 1}, TypeError, "drop_attributes must be True or False"),
    ({"ascii": 1}, TypeError, "ascii must be True or False"),
    ({"formats": "npy"}, TypeError, "formats must be a sequence of names, got 'npy'"),
    ({"features": np.ones((3, 1))}, TypeError, "features must be names, because an array"),
    ({"eta_convex": 1}, TypeError, "use weights=superfacets.Weights"),
    ({"paper": True, "features": "color"}, ValueError, "paper.segment has no features"),
    ({"formats": ["npy", "png"]}, ValueError,
     "formats has an unknown name, 'png': use distinct names from ply, "),
    ({"formats": ["npy", "npy"]}, ValueError, "formats has a repeated name, 'npy'"),
    ({"workers": 0}, ValueError, "workers must be at least 1"),
    ({"workers": 2, "scheduler": "tcp://a:1"}, ValueError,
     "pass scheduler or workers, not both: a scheduler has its own workers"),
    ({"progress": 1}, TypeError, "progress"),
    ({"sizes": sf.Sizes(balance=1, weights=[1.0])}, TypeError,
     "Sizes.weights must be None, because an array"),
    ({"balance": True}, TypeError, "balance is not an option for files: use sizes="),
])  # fmt: skip
def test_wrong_parameters_are_found_before_anything_is_made(scan, out, keywords, error, message):
    with pytest.raises(error, match=message):
        sf.batch(scan, out, **keywords)
    assert not out.exists()


def test_progress_counts_files_and_cells(scan, out):
    seen = []
    result = sf.batch(scan, out, progress=seen.append)
    (state,) = seen
    assert (state.n_ended, state.n_files, state.n_cells) == (1, 1, result.n_cells)
    assert state.record == result.records[0]
    assert state.seconds > state.seconds_left == 0


def test_the_time_left_is_that_of_equal_files(scan, out):
    """After each of four equal files, the time left is 3, 1, 1/3 and 0 times the elapsed time."""
    copies = [scan.with_name(f"{name}.ply") for name in "abcd"]
    for copy in copies:
        copy.write_bytes(scan.read_bytes())
    seen = []
    sf.batch(copies, out, workers=1, progress=seen.append)
    assert [state.seconds_left / state.seconds for state in seen] == pytest.approx([3, 1, 1 / 3, 0])


def test_a_full_disk_stops_the_batch_and_blames_no_file(scan, out, monkeypatch, broken):
    broken(
        "superfacets.kit.OutputFiles.write",
        OSError(errno.ENOSPC, "No space left on device", "x.npy"),
    )
    with pytest.raises(OSError, match=r"No space left on device: 'x.npy'"):
        sf.batch(scan, out)
    assert records_of(out) == {}
    monkeypatch.undo()
    assert sf.batch(scan, out).n_done == 1


def test_an_error_of_any_class_is_recorded(scan, out, broken):
    broken("superfacets.tools.segment_file.segment", MemoryError)
    assert sf.batch(scan, out).records[0]["error"] == "MemoryError"


def test_what_killed_processes_left_behind_goes(scan, out):
    out.mkdir()
    left = out / ".one.superfacets.npy.0123456789ab.tmp"
    other = out / ".two.superfacets.npy.0123456789ab.tmp"
    for path in (left, other):
        path.write_text("")
    sf.batch(scan, out, formats=["npy"])
    assert (left.exists(), other.exists()) == (False, True)


def test_two_batches_do_not_share_a_folder(scan, out):
    with locked(out), pytest.raises(ValueError, match="another run is writing to this folder"):
        sf.batch(scan, out)


def test_records_of_other_files_stay(scan, scans, out):
    sf.batch(scan, out, formats=["npy"], n_segments=5)
    sf.batch(scans / "a" / "two.ply", out, formats=["npy"], n_segments=5)
    assert list(records_of(out)) == ["one.ply", "two.ply"]
    assert sf.batch(scan, out, formats=["npy"], n_segments=5).n_kept == 1


def test_relative_paths_are_those_of_the_caller(scans, monkeypatch):
    monkeypatch.chdir(scans)
    assert sf.batch(Path("a", "one.ply"), "out", formats=["npy"]).records[0]["input"] == "a/one.ply"
    assert list(results_in(scans / "out")) == ["one.superfacets.npy"]


def test_cells_that_the_format_cannot_hold_are_refused_before_the_work(tmp_path, out, broken):
    broken("superfacets.tools.segment_file.segment")
    house = sf.PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    sf.write_mesh(tmp_path / "house.ply", house)
    result = sf.batch(tmp_path / "house.ply", out, formats=["sstk.json"], n_segments=1)
    assert ".sstk.json needs labels of triangles" in result.records[0]["error"]
