"""Tiles on workers: equal labels although workers are killed, and clear errors where runs fail."""

import errno
import os
import signal
import socket

import numpy as np
import pytest
from dask_cluster import started
from local_workers import worker_processes
from tiled_checks import in_memory, largest_file
from tiled_meshes import as_ply

import superfacets as sf
from superfacets.batches import cluster
from superfacets.batches.mapping import open_run
from superfacets.tiles.segmenting import segment_tiled
from superfacets.workers import calls

OPTIONS = {"n_segments": 30, "tile_size": 4096}


@pytest.fixture(scope="module")
def mesh():
    return sf.sample_mesh(30_000)


@pytest.fixture(scope="module")
def labels(mesh):
    return in_memory(mesh, 30).labels


@pytest.fixture(scope="module")
def there(tmp_path_factory):
    with started(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def left_in(folder):
    return [path.name for path in folder.iterdir() if "tiles" in path.name]


def test_processes_label_as_one_does(mesh, labels, tmp_path):
    seen = []
    result = segment_tiled(
        as_ply(tmp_path, mesh), scratch=tmp_path, workers=2, out=tmp_path / "labels.npy",
        on_tile=lambda *counts: seen.append(counts), **OPTIONS,
    )  # fmt: skip
    assert np.array_equal(result.labels, labels)
    assert np.array_equal(np.load(tmp_path / "labels.npy"), labels)
    assert (5, 5) in seen
    assert left_in(tmp_path) == []
    assert worker_processes() == []


def test_arrays_reach_workers_through_the_scratch_folder(mesh, labels, there, tmp_path):
    result = segment_tiled(mesh, scratch=tmp_path, scheduler=there.address, **OPTIONS)
    assert np.array_equal(result.labels, labels)


def test_a_killed_worker_loses_nothing(mesh, labels, tmp_path):
    killed = []

    def kill(*_):
        if len(killed) < 4 and (processes := worker_processes()):  # or all were killed before
            processes[0].kill()
            killed.append(processes[0].pid)

    result = segment_tiled(mesh, scratch=tmp_path, workers=2, on_tile=kill, **OPTIONS)
    assert np.array_equal(result.labels, labels)
    assert len(killed) == 4
    assert left_in(tmp_path) == []


def test_a_cluster_is_used_by_its_address(there, mesh, labels, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    as_ply(tmp_path, mesh)
    result = segment_tiled("mesh.ply", scratch="work", scheduler=there.address, **OPTIONS)
    assert np.array_equal(result.labels, labels)
    assert left_in(tmp_path / "work") == []


def test_what_does_not_fit_is_named(there, mesh, tmp_path, monkeypatch):
    def run(**options):
        segment_tiled(mesh, scratch=tmp_path, **{**OPTIONS, **options})

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 0.3)
    with pytest.raises(ConnectionError, match=f"cannot connect to a Dask scheduler at {address}"):
        run(scheduler=address)
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 10.0)
    monkeypatch.setattr(cluster, "__version__", "9.9")
    with pytest.raises(ConnectionError, match=r"has superfacets .*, but this process has 9\.9"):
        run(scheduler=there.address)
    monkeypatch.setattr(cluster, "_check_versions", lambda client: None)  # it came later
    monkeypatch.setattr(calls, "__version__", "9.9")
    with pytest.raises(ConnectionError, match=r"a worker on .* has superfacets"):
        run(scheduler=there.address)
    assert left_in(tmp_path) == []


def test_workers_that_end_for_good_end_the_run(mesh, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 1.0)
    with started(tmp_path) as own:

        def kill(*_):
            own.kill(1, 2)

        with pytest.raises(ConnectionError, match="there were no workers for 1 second: start one"):
            segment_tiled(mesh, scratch=tmp_path, scheduler=own.address, on_tile=kill, **OPTIONS)
    assert left_in(tmp_path) == []


def end_here(store, piece):
    """End the process, like a tile that needs too much memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def full_disk(store, piece):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/scratch/a.npy")


def test_a_tile_that_kills_workers_and_a_full_disk_are_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(calls, "ALLOWED_KILLS", 0)
    with open_run(2, None, tmp_path) as run:
        message = (
            r"1 worker died while processing part 0 of the input \(out of memory\?\): use smaller"
            r" tiles or fewer workers"
        )
        with pytest.raises(ConnectionError, match=message):
            run.all(end_here, None, 1)
        with pytest.raises(OSError, match=r"No space left on device: '/scratch/a\.npy'"):
            run.all(full_disk, None, 1)


def test_a_scratch_array_that_cannot_be_written_leaves_no_scratch_and_no_labels(mesh, tmp_path):
    (tmp_path / "labels.npy").write_text("of before")
    options = {"scratch": tmp_path, "cache": 0, "out": tmp_path / "labels.npy", **OPTIONS}
    with largest_file(1 << 18), pytest.raises(OSError, match="File too large"):
        segment_tiled(mesh, **options)
    assert left_in(tmp_path) == []
    assert (tmp_path / "labels.npy").read_text() == "of before"
