"""Batches in worker processes on this machine: results are the same if processes are killed."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
from batch_folders import records_of, results_in
from dask import config
from distributed.system import MEMORY_LIMIT
from local_workers import worker_processes

import superfacets as sf
from superfacets.kit import InputFile
from superfacets_batch import batching, cluster
from superfacets_batch.jobs import run_job

OPTIONS = {"n_segments": 20, "formats": ["npy", "ply"]}

COMMAND = [sys.executable, "-m", "superfacets", "batch"]


@pytest.fixture(scope="module")
def alone(made_scans, tmp_path_factory):
    """Return the folder of results that are made file by file, without Dask."""
    folder = tmp_path_factory.mktemp("alone")
    for path in sorted(made_scans.rglob("*.ply")):
        sf.batch(path, folder / path.parent.relative_to(made_scans), **OPTIONS)
    return folder


def test_workers_do_what_one_process_does(scans, alone, tmp_path):
    seen = []
    environment = dict(os.environ)
    result = sf.batch(scans, tmp_path / "out", workers=2, progress=seen.append, **OPTIONS)
    assert dict(os.environ) == environment
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
        if len(killed) < 2 and (processes := worker_processes()):  # empty if all were killed
            processes[0].kill()
            killed.append(processes[0].pid)

    result = sf.batch(scans, tmp_path / "out", workers=2, progress=kill, **OPTIONS)
    assert len(killed) == 2
    assert (result.n_done, result.n_failed) == (4, 1)
    assert results_in(tmp_path / "out") == results_in(alone)


@pytest.fixture
def run_instead(monkeypatch):
    """Return a function that replaces `run_job`, here and in workers."""

    def replace(job_function):
        for module in (batching, cluster):
            monkeypatch.setattr(module, "run_job", job_function)

    return replace


class Unreadable:
    def __reduce__(self):
        raise ValueError("cannot be pickled")


def deadly_job(job):
    """Kill this process, as if memory ran out, or return an object that cannot be pickled."""
    if job.name == "a/two.ply":
        os.kill(os.getpid(), signal.SIGKILL)
    return Unreadable() if job.name == "a/one.ply" else run_job(job)


def test_a_file_that_kills_workers_is_recorded_and_the_others_are_done(
    scans, tmp_path, monkeypatch, run_instead
):
    run_instead(deadly_job)
    result = sf.batch(scans, tmp_path / "out", workers=2, **OPTIONS)
    assert (result.n_done, result.n_failed) == (2, 3)
    nonsense, killed = result.records[1:3]
    assert killed["error"] == "a worker ended during this file (out of memory?)"
    assert nonsense["error"]
    assert None not in (nonsense["sha256"], killed["sha256"])
    monkeypatch.undo()
    assert sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS).n_done == 0


def test_a_file_too_large_for_a_share_of_the_memory_is_done_alone(scans, tmp_path, monkeypatch):
    def need(file):
        return MEMORY_LIMIT / 2 if file.input.endswith("one.ply") else 0

    asked = []
    monkeypatch.setattr(InputFile, "memory", property(need))
    client = batching.local_client
    monkeypatch.setattr(
        batching, "local_client", lambda *sizes: asked.append(sizes) or client(*sizes)
    )
    seen = []
    result = sf.batch(scans, tmp_path / "out", workers=2, progress=seen.append, **OPTIONS)
    assert result.n_done == 4
    assert [state.record["name"] for state in seen[3:]] == ["a/one.ply", "b/one.ply"]
    assert asked == [(2,), (1, batching.kit.checked_threads(None))]


def full_disk_job(job):
    if job.name == "b/one.ply":
        raise OSError(28, "No space left on device", "x.npy")
    return run_job(job)


def test_a_full_disk_ends_the_batch_and_keeps_what_was_done(
    scans, alone, tmp_path, monkeypatch, run_instead
):
    run_instead(full_disk_job)
    with pytest.raises(OSError, match=r"No space left on device: 'x.npy'"):
        sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS)
    assert "b/one.ply" not in records_of(tmp_path / "out")
    monkeypatch.undo()
    result = sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS)
    assert (result.n_done, result.n_kept, result.n_failed) == (2, 2, 1)
    assert results_in(tmp_path / "out") == results_in(alone)


def start(scans, out, *, is_early=False):
    """Start the command, and wait for its first record, or for its first worker."""
    command = [
        *COMMAND, str(scans), "-o", str(out), "-n", "20", "--to", "npy,ply", "--workers", "2",
    ]  # fmt: skip
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60
    while not (
        len(psutil.Process(process.pid).children()) > 1  # one keeps track of semaphores
        if is_early
        else (out / "manifest.jsonl").exists()
    ):
        assert time.monotonic() < deadline
        time.sleep(0.005)
    return process


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
@pytest.mark.parametrize(
    ("how", "status"), [("SIGINT", 130), ("EARLY", 130), ("SIGTERM", 130), ("SIGKILL", -9)]
)
def test_a_batch_that_is_ended_goes_on_where_it_was(many, alone, tmp_path, how, status):
    out = tmp_path / "out"
    process = start(many, out, is_early=how == "EARLY")
    if how == "SIGINT":
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does for Ctrl-C
    else:
        process.send_signal(getattr(signal, how, signal.SIGINT))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status
    wait_for_the_end_of_session(process.pid)
    if how != "SIGKILL":
        lines = [line for line in errors.split("\n") if line and "bad.ply" not in line]
        assert lines[: 1 if how == "EARLY" else None] == ["superfacets: error: interrupted"]
    (out / "manifest.jsonl").touch()
    n_before = len((out / "manifest.jsonl").read_text().splitlines())
    assert n_before < 25
    result = sf.batch(many, out, workers=1, **OPTIONS)
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
    for name in ("multiprocessing", "numpy", "psutil", "pickle", "dask", "superfacets"):
        (here / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    script = tmp_path / "command.py"  # as for an installed command, not in the current folder
    script.write_text("from superfacets.__main__ import main; main()")
    command = [sys.executable, str(script), "batch", str(scans), "--workers", "2"]
    command += ["-o", str(tmp_path / "out"), "-n", "20"]
    ended = subprocess.run(command, cwd=here, capture_output=True, text=True, check=False)
    assert ended.stdout.startswith("4 files done")
    assert not (tmp_path / "ran").exists()


def test_without_dask_files_are_done_in_this_process_with_a_note(
    scans, alone, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "4")
    result = sf.batch(scans, tmp_path / "out", **OPTIONS)
    assert result.n_done == 4
    assert results_in(tmp_path / "out") == results_in(alone)
    [note] = result.notes
    assert note.startswith("files are processed one after the other: several workers need")
    for more in ({"workers": 2}, {"scheduler": "tcp://127.0.0.1:1"}):
        with pytest.raises(sf.MissingExtraError, match=r"superfacets\[batch\]"):
            sf.batch(scans, tmp_path / "other", **more, **OPTIONS)


def slow_job(job):
    if job.name == "a/two.ply":
        time.sleep(600)
    return run_job(job)


def test_a_file_that_takes_too_long_is_recorded_and_its_worker_restarts(
    scans, tmp_path, monkeypatch, run_instead
):
    run_instead(slow_job)
    result = sf.batch(scans, tmp_path / "out", workers=2, timeout=3, **OPTIONS)
    assert (result.n_done, result.n_failed) == (3, 2)
    errors = {record["name"]: record["error"] for record in result.records if "error" in record}
    assert errors["a/two.ply"] == "TimeoutError: no result in 3 s"
    monkeypatch.undo()
    again = sf.batch(scans, tmp_path / "out", workers=1, retry_failed=True, **OPTIONS)
    assert (again.n_done, again.n_failed) == (1, 1)
    assert sf.batch(scans, tmp_path / "out", workers=2, timeout=3, **OPTIONS).n_kept == 4


def test_a_worker_that_restarts_slowly_is_not_given_up():
    with cluster.local_client(1):
        assert config.get("distributed.deploy.lost-worker-timeout") == "1 day"


def test_a_file_that_ends_this_process_comes_last_and_then_fails(scans, alone, tmp_path):
    """With one worker, a crash ends the run, and the next run continues behind the file."""
    script = tmp_path / "crash.py"
    script.write_text(
        "import os, signal, sys\n"
        "from superfacets_batch import batching\n"
        "run = batching.run_job\n"
        "def crash(job):\n"
        "    if job.name == 'a/two.ply':\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return run(job)\n"
        "batching.run_job = crash\n"
        f"batching.batch({str(scans)!r}, {str(tmp_path / 'out')!r}, workers=1, n_segments=20,"
        " formats=['npy', 'ply'])\n"
    )
    ends = [subprocess.run([sys.executable, str(script)], check=False).returncode for _ in range(3)]
    assert ends == [-9, -9, 0]
    result = sf.batch(scans, tmp_path / "out", workers=1, **OPTIONS)
    assert (result.n_done, result.n_kept, result.n_failed) == (0, 3, 2)
    [error] = [r["error"] for r in result.records if r["name"] == "a/two.ply"]
    assert error == "the process ended twice while it processed this file"
    sf.batch(scans, tmp_path / "out", workers=1, retry_failed=True, **OPTIONS)
    assert results_in(tmp_path / "out") == results_in(alone)
    assert len(records_of(tmp_path / "out")) == 5


def test_the_estimated_memory_grows_with_the_file_and_its_cells(tmp_path):
    for ending, n_cells in ((".ply", 100), (".stl", 36), (".unknown", 150)):
        path = tmp_path / f"a{ending}"
        path.write_bytes(bytes(1800))
        file = InputFile(str(path), path.name)
        assert file.most_cells == n_cells
        assert file.memory == (150 << 20) + 3 * 1800 + 200 * n_cells
    assert InputFile(str(tmp_path / "missing.ply"), "missing.ply").memory == 150 << 20
