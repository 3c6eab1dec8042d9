"""Batches on an existing Dask cluster, which is found by its address and checked."""

import gc
import logging
import signal
import socket
import time
from types import SimpleNamespace

import numpy as np
import pytest
from batch_folders import results_in
from dask_cluster import started
from distributed import Client

import superfacets as sf
from superfacets_batch import cluster

OPTIONS = {"n_segments": 20, "formats": ["npy"]}


@pytest.fixture(scope="module")
def there(tmp_path_factory):
    with started(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def test_a_batch_runs_by_address_alone(there, scans, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = sf.batch("scans", "out", scheduler=there.address, **OPTIONS)
    assert (result.n_done, result.n_failed) == (4, 1)
    sf.batch("scans", "local", workers=1, **OPTIONS)
    assert results_in(tmp_path / "out") == results_in(tmp_path / "local")
    assert sf.batch("scans", "out", scheduler=there.address, **OPTIONS).n_kept == 4


def test_workers_may_differ_in_threads(there, tmp_path):
    with cluster.remote_client(there.address, str(tmp_path)) as client:
        crew = cluster.Crew(client)
        assert crew.n_threads == 1
        assert 0 < crew.share < np.inf


def test_a_large_file_runs_alone_on_a_cluster_too(there, scans, tmp_path, limit):
    limit("memory of a worker process", 1e15)
    assert sf.batch(scans, tmp_path / "out", scheduler=there.address, **OPTIONS).n_done == 4


@pytest.mark.parametrize(
    ("module", "message"),
    [("cluster", r"the worker at tcp://127.0.0.1:\d+ has"), ("batching", "a worker on .* has")],
)
def test_another_version_on_a_worker_is_named(there, scans, tmp_path, monkeypatch, module, message):
    """The first case is a worker at the start, the second one that comes later."""
    monkeypatch.setattr(f"superfacets_batch.{module}.__version__", "9.9")
    with pytest.raises(
        ConnectionError, match=rf"{message} superfacets .*, but this process has 9.9"
    ):
        sf.batch(scans, tmp_path / "out", scheduler=there.address, **OPTIONS)
    assert results_in(tmp_path / "out") == {}


def test_a_worker_without_the_package_is_named(there, scans, tmp_path, broken):
    broken("superfacets_batch.cluster.metadata.version", ModuleNotFoundError("superfacets"))
    with pytest.raises(ConnectionError, match=r"127.0.0.1:\d+ has no superfacets: install it"):
        sf.batch(scans, tmp_path / "out", scheduler=there.address, **OPTIONS)


def test_a_folder_that_workers_do_not_see_is_named(there, tmp_path):
    with (
        pytest.raises(ConnectionError, match="access /nowhere, which all machines must share"),
        cluster.remote_client(there.address, "/nowhere"),
    ):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{port}", "nonsense://a:1"])
def test_a_scheduler_that_is_not_there_is_one_line(scans, tmp_path, limit, address):
    limit("wait for a scheduler", 0.3)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = address.format(port=free.getsockname()[1])
    with pytest.raises(ConnectionError, match=f"cannot connect to a Dask scheduler at {address}: "):
        sf.batch(scans, tmp_path / "out", scheduler=address, **OPTIONS)


def test_a_client_that_failed_does_not_wait_for_the_garbage_collector(limit):
    # Garbage collection closes a client that failed to connect. If this happens while another
    # client starts, both wait forever.
    limit("wait for a scheduler", 0.3)
    gc.disable()
    try:
        with pytest.raises(ConnectionError), cluster.remote_client("tcp://127.0.0.1:1", "."):
            pass
        assert not [one for one in gc.get_objects() if isinstance(one, Client)]
    finally:
        gc.enable()


def test_workers_that_end_for_good_end_the_batch_when_none_is_left(many, tmp_path, limit):
    limit("wait for a worker", 1.0)
    seen = []

    def kill(state):
        seen.append(state.record)
        if len(seen) == 3:
            own.kill(1)
        if len(seen) == 10:
            own.kill(2)

    with started(tmp_path) as own:
        out = tmp_path / "out"
        with pytest.raises(ConnectionError, match="there were no workers for 1 seconds: start one"):
            sf.batch(many, out, scheduler=own.address, progress=kill, **OPTIONS)
        with pytest.raises(
            ConnectionError, match=f"the scheduler at {own.address} has no workers: start"
        ):
            sf.batch(many, out, scheduler=own.address, **OPTIONS)
    assert len(seen) >= 10
    result = sf.batch(many, out, workers=1, **OPTIONS)
    assert result.n_kept + result.n_failed + result.n_done == 25
    assert result.n_kept >= 9


def test_lost_records_end_the_batch_when_no_worker_is_left(monkeypatch):
    """The scheduler says that a job has ended, but its record was at a worker that is gone."""
    monkeypatch.setattr(cluster, "TICK", 0.01)
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
    n_asked = 0

    class Lost:
        key, status, cancelled = "job", "finished", staticmethod(lambda: False)

        def add_done_callback(self, call):
            call(self)

        def result(self, timeout):
            nonlocal n_asked
            n_asked += 1
            assert n_asked < 30
            time.sleep(0.1)  # longer than five ticks
            raise TimeoutError

    class Dask:
        counts = iter([{"worker": 1}, {"worker": 1}])
        run = staticmethod(lambda _: {"worker": 1e9})
        submit = staticmethod(lambda *_, **__: Lost())
        nthreads = staticmethod(lambda: next(Dask.counts, {}))
        cancel = staticmethod(lambda _: None)

    job = SimpleNamespace(with_threads=lambda _: None)
    with pytest.raises(ConnectionError, match=r"no workers for 0\.3 seconds: start one"):
        list(cluster.Crew(Dask).run([job], timeout=None))


def test_a_scheduler_that_ends_ends_the_batch(many, tmp_path):
    seen = []

    def kill(state):
        seen.append(state.record)
        if len(seen) == 3:
            own.processes[0].send_signal(signal.SIGKILL)

    with (
        started(tmp_path) as own,
        pytest.raises(
            ConnectionError,
            match="the connection to the Dask scheduler was lost: restart the scheduler and"
            " its workers, then run again",
        ),
    ):
        sf.batch(many, tmp_path / "out", scheduler=own.address, progress=kill, **OPTIONS)
    assert len((tmp_path / "out" / "manifest.jsonl").read_text().splitlines()) == len(seen)


def test_dask_logs_nothing_that_is_told_in_one_line():
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    with cluster._silenced():
        assert not any(logger.isEnabledFor(logging.CRITICAL) for logger in loggers)
    assert [logger.level for logger in loggers] == levels
    assert all(logger.isEnabledFor(logging.ERROR) for logger in loggers)
