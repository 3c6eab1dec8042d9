"""Run the jobs of a batch on Dask workers, of this machine or of a scheduler."""

from __future__ import annotations

import contextlib
import gc
import logging
import math
import os
import signal
import sys
import time
import types
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import metadata
from queue import Empty, SimpleQueue
from typing import Any, cast

from superfacets import __version__
from superfacets.kit import import_extra, reason_of

from .jobs import BatchJob, Record, failed, other_version, run_job

PATIENCE = 60.0  # maximum seconds without a worker: a job scheduler may need longer to start one
TICK = 1.0  # seconds between checks of the workers
GATHER_TIMEOUT = 10.0  # maximum seconds to receive a record of a few kilobytes
CONNECT_TIMEOUT = 10.0  # maximum seconds to connect to a scheduler

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_ENVIRONMENT = {**dict.fromkeys(_THREADS, "1"), "PYTHONSAFEPATH": "1"}
"""Variables of local workers: no additional threads, no imports from the current folder."""


@dataclass
class _Started:
    """A job that was sent to the scheduler."""

    future: Any
    job: BatchJob
    place: str | None = None  # address of the worker that runs the job
    since: float = math.inf  # `time.monotonic` when the job was first seen there


class Crew:
    """All workers of a Dask scheduler. `share` is the least memory per thread, in bytes."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._looked, self._seen, self._count = -math.inf, time.monotonic(), 0
        limits = client.run(lambda dask_worker: dask_worker.memory_manager.memory_limit)
        threads = client.nthreads()  # a worker may have ended in between
        self.n_threads = min(threads.values())
        self.share = min((limits[at] or math.inf) / threads.get(at, 1) for at in limits)

    def run(
        self, jobs: Sequence[BatchJob], *, timeout: float | None, is_alone: bool = False
    ) -> Iterator[tuple[BatchJob, Record | None]]:
        """Yield each job with its record, or None if its worker ended.

        Each thread gets one job at a time, because Dask counts a failure for all jobs at a worker
        that ends. With `is_alone`, one job gets all threads. Raises errors that stop the batch.
        """
        waiting = deque(jobs)
        started: dict[str, _Started] = {}
        ended: SimpleQueue[Any] = SimpleQueue()
        tick = TICK if timeout is None else min(TICK, timeout / 4)
        try:
            while waiting or started:
                self._look(tick, started if timeout is not None else {})
                while waiting and len(started) < (1 if is_alone else self._count):
                    job = waiting.popleft()
                    sent = job.with_threads(self.n_threads if is_alone else 1)
                    future = self._client.submit(run_job, sent, pure=False)
                    started[future.key] = _Started(future, job)
                    future.add_done_callback(ended.put)
                with contextlib.suppress(Empty):
                    future = ended.get(timeout=tick)
                    if future.key in started:
                        try:
                            record = _record_of(future, started[future.key].job)
                        except TimeoutError:  # the record was lost: Dask repeats the job
                            future.add_done_callback(ended.put)
                            self._looked = time.monotonic()  # there may be no workers meanwhile
                            self._look(0.0, {})
                            continue
                        if record is None:
                            self._looked = -math.inf  # there is one worker less now
                        yield started.pop(future.key).job, record
                latest = time.monotonic() - (math.inf if timeout is None else timeout)
                for late in [one for one in started.values() if one.since < latest]:
                    del started[late.future.key]
                    self._end_worker_of(late)
                    yield late.job, failed(late.job, f"TimeoutError: no result in {timeout:g} s")
        finally:
            with contextlib.suppress(Exception):  # the scheduler may have ended
                self._client.cancel([one.future for one in started.values()])

    def _look(self, tick: float, started: Mapping[str, _Started]) -> None:
        """Once per tick, count threads and find workers of jobs; a new worker restarts a job."""
        now = time.monotonic()
        if now < self._looked + tick:
            return
        try:
            self._count = sum(self._client.nthreads().values())
            working = self._client.processing() if started else {}
        except OSError:
            raise _scheduler_lost() from None
        if self._count or now > self._looked + 5 * TICK:  # the last check was long ago
            self._seen = now
        self._looked = now
        places = {key: place for place, keys in working.items() for key in keys}
        for key, one in started.items():
            if places.get(key) != one.place:
                one.place = places.get(key)
                one.since = now if one.place else math.inf
        if now > self._seen + PATIENCE:
            raise ConnectionError(f"there were no workers for {PATIENCE:g} seconds: start one")

    def _end_worker_of(self, late: _Started) -> None:
        """Cancel a job, and restart its worker. A worker without a nanny gets no more jobs."""
        try:
            self._client.cancel([late.future], force=True)
            try:
                self._client.restart_workers([late.place], timeout=PATIENCE, raise_for_error=False)
            except ValueError:
                self._client.retire_workers([late.place], close_workers=True)
        except (KeyError, TimeoutError):
            pass  # the worker has already ended, or restarts later
        except OSError:
            raise _scheduler_lost() from None


def _record_of(future: Any, job: BatchJob) -> Record | None:
    """Return the record of a job, or None if its worker ended; raise TimeoutError if it is lost."""
    from distributed import KilledWorker

    if future.cancelled():
        raise _scheduler_lost()
    try:
        return cast("Record", future.result(timeout=GATHER_TIMEOUT))
    except KilledWorker:
        return None
    except OSError as error:
        if isinstance(error, TimeoutError) or future.status == "error":
            raise
        raise _scheduler_lost() from None
    except Exception as error:  # for example, the record cannot be pickled
        return failed(job, reason_of(error))


def _scheduler_lost() -> ConnectionError:
    advice = "restart the scheduler and its workers, then run again"
    return ConnectionError(f"the connection to the Dask scheduler was lost: {advice}")


@contextlib.contextmanager
def local_client(n_workers: int, n_threads: int = 1) -> Iterator[Any]:
    """Start workers, which share the memory of this machine and restart; yield their client."""
    distributed = import_extra("distributed", "several workers", "batch")
    from dask import config
    from distributed.system import MEMORY_LIMIT

    # By default, a worker that takes 15 seconds to restart is removed for good.
    patient = {"distributed.deploy.lost-worker-timeout": "1 day"}
    with _silenced(), config.set(patient), _own_settings(), contextlib.ExitStack() as stack:
        cluster = _entered(
            stack, distributed.LocalCluster, n_workers=0, threads_per_worker=n_threads,
            memory_limit=MEMORY_LIMIT // n_workers, host="127.0.0.1",
            dashboard_address="127.0.0.1:0", worker_dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL + 1, scheduler_kwargs={"allowed_failures": 0},
        )  # fmt: skip
        cluster.sync(_block_ctrl_c)
        client = _entered(stack, distributed.Client, cluster, set_as_default=False)
        cluster.scale(n_workers)
        client.wait_for_workers(n_workers, timeout=PATIENCE)
        yield client


def _entered(stack: contextlib.ExitStack, kind: Any, *args: Any, **options: Any) -> Any:
    """Start a part of Dask in a thread, which Ctrl-C cannot interrupt; half started, it hangs."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(lambda: stack.enter_context(kind(*args, **options))).result()


async def _block_ctrl_c() -> None:
    """Block Ctrl-C in the calling thread, and in workers, because this process ends its workers."""
    if os.name == "posix":
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # starting this process later would unblock signals
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


@contextlib.contextmanager
def _own_settings() -> Iterator[None]:
    """Start workers with `_ENVIRONMENT`, and without the script, which may lack a main guard."""
    main, environment = sys.modules["__main__"], os.environ.copy()
    sys.modules["__main__"] = types.ModuleType("__main__")
    os.environ.update(_ENVIRONMENT)
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        os.environ.clear()
        os.environ.update(environment)


@contextlib.contextmanager
def remote_client(address: str, folder: str) -> Iterator[Any]:
    """Connect to a Dask scheduler, check its workers, and yield the client."""
    distributed = import_extra("distributed", "a Dask scheduler", "batch")
    with _silenced(), contextlib.ExitStack() as stack:
        try:
            options = {"timeout": CONNECT_TIMEOUT, "set_as_default": False}
            client = _entered(stack, distributed.Client, address, **options)
        except (OSError, ValueError) as error:
            client, reason = None, reason_of(error)
        if client is None:  # closing it later, while another starts, would cause a deadlock
            gc.collect()
            raise ConnectionError(f"cannot connect to a Dask scheduler at {address}: {reason}")
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ConnectionError(f"the scheduler at {address} has no workers: start one") from None
        _check_workers(client, folder)
        yield client


def _check_workers(client: Any, folder: str) -> None:
    """Raise a ConnectionError if a worker lacks the folder or this version of superfacets."""
    # Workers may lack this package, so they run functions of the standard library.
    versions = client.run(metadata.version, "superfacets", on_error="return")
    seen = client.run(os.path.isdir, folder)
    for address, version in sorted(versions.items()):
        worker = f"the worker at {address}"
        if isinstance(version, BaseException):
            raise ConnectionError(f"{worker} has no superfacets: install it there")
        if version != __version__:
            raise other_version(worker, version, __version__)
        if not seen.get(address, True):  # a worker may have ended in between
            raise ConnectionError(f"{worker} cannot access {folder}, which all machines must share")


@contextlib.contextmanager
def _silenced() -> Iterator[None]:
    """Suppress log messages of Dask, because Dask also raises its errors as exceptions."""
    known = [f"{name}." for name in logging.root.manager.loggerDict]
    loggers = [logging.getLogger(name[:-1]) for name in known if name.startswith("distributed.")]
    levels = [logger.level for logger in loggers]  # each has its own level
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
