"""Batches in worker processes on this machine: results are the same if processes are killed."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
from batch_folders import records_of, results_in
from local_workers import worker_processes
from superfacets._memory import usable_memory
from superfacets.workers import calls

import superfacets as sf
from superfacets.batches import batching, jobs
from superfacets.batches.jobs import run_job

OPTIONS = {"n_segments": 20, "formats": ["npy", "ply"]}

COMMAND = [sys.executable, "-m", "superfacets", "batch"]


@pytest.fixture
def alone(scans, tmp_path):
    """Return the folder of results that are made file by file, without Dask."""
    for path in sorted(scans.rglob("*.ply")):
        sf.batch(path, tmp_path / "alone" / path.parent.relative_to(scans), **OPTIONS)
    for path in (tmp_path / "alone").rglob("manifest.jsonl"):
        path.unlink()
    return tmp_path / "alone"


def test_workers_do_what_one_process_does(scans, alone, tmp_path):
    seen = []
    result = sf.batch(scans, tmp_path / "out", workers=2, progress=seen.append, **OPTIONS)
    assert results_in(tmp_path / "out") == results_in(alone)
    assert (result.n_done, result.n_failed) == (4, 1)
    names = [record["name"] for record in result.records]
    assert names == ["bad.ply", "a/one.ply", "a/two.ply", "b/one.ply", "b/c/three.ply"]
    assert "not a PLY file" in result.records[0]["error"]
    assert [state.n_ended for state in seen] == [1, 2, 3, 4, 5]
    assert seen[-1].seconds_left == 0
    assert worker_processes() == []


def test_a_worker_that_is_killed_loses_nothing(scans, alone, tmp_path):
    killed = []

    def kill(_):
        if len(killed) < 3 and (processes := worker_processes()):  # empty if all were killed
            processes[0].kill()
            killed.append(processes[0].pid)

    result = sf.batch(scans, tmp_path / "out", workers=2, progress=kill, **OPTIONS)
    assert len(killed) == 3
    assert (result.n_done, result.n_failed) == (4, 1)
    assert results_in(tmp_path / "out") == results_in(alone)


class Unreadable:
    def __reduce__(self):
        raise ValueError("cannot be pickled")


def deadly_job(job):
    """Kill this process, as if memory ran out, or return an object that cannot be pickled."""
    if job.name == "a/two.ply":
        os.kill(os.getpid(), signal.SIGKILL)
    return Unreadable() if job.name == "a/one.ply" else run_job(job)


def test_a_file_that_kills_workers_is_recorded_and_the_others_are_done(
    scans, tmp_path, monkeypatch
):
    monkeypatch.setattr(batching, "run_job", deadly_job)
    monkeypatch.setattr(calls, "ALLOWED_KILLS", 0)
    result = sf.batch(scans, tmp_path / "out", workers=2, **OPTIONS)
    assert (result.n_done, result.n_failed) == (2, 3)
    nonsense, killed = result.records[1:3]
    assert killed["error"] == "KilledWorker: 1 worker died during this call (out of memory?)"
    assert nonsense["error"]
    assert None not in (nonsense["sha256"], killed["sha256"])
    monkeypatch.undo()
    assert sf.batch(scans, tmp_path / "out", **OPTIONS).n_done == 0


def test_a_file_too_large_for_a_share_of_the_memory_is_done_alone(scans, tmp_path, monkeypatch):
    def need(path):
        return usable_memory() / 2 if path.endswith("one.ply") else 0

    asked = []
    monkeypatch.setattr(batching, "memory_of", need)
    pool = batching.open_pool
    monkeypatch.setattr(batching, "open_pool", lambda *sizes: asked.append(sizes) or pool(*sizes))
    seen = []
    result = sf.batch(scans, tmp_path / "out", workers=2, progress=seen.append, **OPTIONS)
    assert result.n_done == 4
    assert [state.record["name"] for state in seen[3:]] == ["a/one.ply", "b/one.ply"]
    assert asked == [(2,), (1, batching.checked_threads(None))]


def full_disk_job(job):
    if job.name == "b/one.ply":
        raise OSError(28, "No space left on device", "x.npy")
    return run_job(job)


def test_a_full_disk_ends_the_batch_and_keeps_what_was_done(scans, alone, tmp_path, monkeypatch):
    monkeypatch.setattr(batching, "run_job", full_disk_job)
    with pytest.raises(OSError, match=r"No space left on device: 'x.npy'"):
        sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS)
    done = list(records_of(tmp_path / "out"))
    assert done[0] == "b/c/three.ply"  # the largest file is processed first
    assert "b/one.ply" not in done
    monkeypatch.undo()
    result = sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS)
    assert (result.n_done, result.n_kept) == (4 - len(done), len(done))
    assert results_in(tmp_path / "out") == results_in(alone)


def start(scans, out):
    """Start the command, and wait for its first record."""
    command = [
        *COMMAND,
        str(scans),
        "-o",
        str(out),
        "-n",
        "20",
        "--to",
        "npy,ply",
        "--workers",
        "2",
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60
    while not (out / "manifest.jsonl").exists():
        assert time.monotonic() < deadline
        time.sleep(0.005)
    return process


@pytest.fixture
def many(scans):
    """Return the folder with more files, so that a batch takes a while."""
    source = (scans / "b" / "c" / "three.ply").read_bytes()
    for place in range(20):
        (scans / f"more{place}.ply").write_bytes(source)
    return scans


def wait_for_the_end_of_session(number):
    """Wait until the command and all processes that it has started have ended."""
    deadline = time.monotonic() + 20
    while any(session_of(pid) == number for pid in psutil.pids()):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def session_of(pid):
    try:
        return os.getsid(pid)
    except OSError:
        return None


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes here")
@pytest.mark.parametrize(("how", "status"), [("SIGINT", 130), ("SIGTERM", 130), ("SIGKILL", -9)])
def test_a_batch_that_is_ended_goes_on_where_it_was(many, alone, tmp_path, how, status):
    out = tmp_path / "out"
    process = start(many, out)
    if how == "SIGINT":
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does for Ctrl-C
    else:
        process.send_signal(getattr(signal, how))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status
    wait_for_the_end_of_session(process.pid)
    if how != "SIGKILL":
        lines = [line for line in errors.split("\n") if line and "bad.ply" not in line]
        assert lines == ["superfacets: error: interrupted"]
    n_before = len((out / "manifest.jsonl").read_text().splitlines())
    assert n_before < 25
    result = sf.batch(many, out, workers=2, **OPTIONS)
    assert result.n_kept + ("bad.ply" in errors) == n_before
    assert len(records_of(out)) == len(result.records) == 25
    wanted = results_in(alone)
    for place in range(20):
        for ending in OPTIONS["formats"]:
            wanted[f"more{place}.superfacets.{ending}"] = wanted[f"b/c/three.superfacets.{ending}"]
    assert results_in(out) == wanted


UNGUARDED = """
import superfacets
print(superfacets.batch({scans!r}, {out!r}, workers=2, n_segments=20).n_done)
"""


def test_a_script_needs_no_guard_as_workers_do_not_import_it(scans, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED.format(scans=str(scans), out=str(tmp_path / "out")))
    command = [sys.executable, str(script)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (ended.stdout, ended.stderr) == ("4\n", "")


def test_workers_run_no_code_of_the_current_folder(scans, tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    for name in ("multiprocessing", "numpy", "psutil", "pickle", "superfacets"):
        (here / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    script = tmp_path / "command.py"  # as for an installed command, not in the current folder
    script.write_text("from superfacets.__main__ import main; main()")
    command = [sys.executable, str(script), "batch", str(scans), "--workers", "2"]
    command += ["-o", str(tmp_path / "out"), "-n", "20"]
    ended = subprocess.run(command, cwd=here, capture_output=True, text=True, check=False)
    assert ended.stdout.startswith("4 files done")
    assert not (tmp_path / "ran").exists()


def test_psutil_is_needed_for_more_than_one_file_alone(scans, scan, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "psutil", None)
    assert sf.batch(scan, tmp_path / "out").n_done == 1
    with pytest.raises(sf.MissingExtraError, match=r"superfacets\[batch\]"):
        sf.batch(scans, tmp_path / "out")


def test_dask_is_needed_for_a_scheduler_alone(scans, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert sf.batch(scans, tmp_path / "out", workers=2, **OPTIONS).n_done == 4
    with pytest.raises(sf.MissingExtraError, match=r"a Dask scheduler needs .*\[batch\]"):
        sf.batch(scans, tmp_path / "other", scheduler="tcp://127.0.0.1:1", **OPTIONS)


def test_the_estimated_memory_grows_with_the_file_and_its_cells(tmp_path):
    for ending, n_cells in ((".ply", 100), (".stl", 36), (".unknown", 150)):
        path = tmp_path / f"a{ending}"
        path.write_bytes(bytes(1800))
        assert jobs.cells_of(str(path)) == n_cells
        assert jobs.memory_of(str(path)) == jobs.BASE + 3 * 1800 + 200 * n_cells
    assert jobs.memory_of(str(tmp_path / "missing.ply")) == jobs.BASE
