"""Teams of workers: processes of this machine, or those of any Dask scheduler."""

from __future__ import annotations

import contextlib
import gc
import importlib
import logging
import math
import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from .. import __version__
from ..errors import MissingExtraError, reason_of
from ..io.guards import counted
from .jobs import BatchJob, Record, check_version, hash_of, run_job

__all__ = ["Killed", "Team", "Worker", "local_memory", "local_team", "remote_team"]

PATIENCE = 60.0
"""Seconds to wait while there is no worker at all: one that ended is started anew in two or so, and
a queue may give a place to another."""

TICK = 1.0
"""Seconds between looks at which workers there are."""

GATHER_TIMEOUT = 10.0
"""Seconds to wait for a record, of a few kilobytes, from a worker."""

START_ATTEMPTS = 10
"""Of a cluster: one fails where a worker is killed while it starts, as it may be several times."""

CONNECT_TIMEOUT = 10.0
"""Seconds to wait for a scheduler."""

LOCALHOST = "127.0.0.1"

Piece = tuple[Any, ...]
"""The number of a piece of work, and whatever else the work is called with."""

Task = TypeVar("Task")
Result = TypeVar("Result")

_LOCAL_SETTINGS = {
    # Results stay in a worker for a moment and are small: a worker that uses much memory is at work
    # on a large mesh, and nothing is gained if it pauses. It is ended at 95 % of its share.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.scheduler.allowed-failures": 3,
    "distributed.worker.profile.enabled": False,  # it looks at all threads 100 times a second
}


@dataclass(frozen=True)
class Killed:
    """Stands for the record of a file at which so many workers ended."""

    n_workers: int

    def __str__(self) -> str:
        n_workers = counted(self.n_workers, "worker")
        return f"KilledWorker: {n_workers} ended with this file at work (out of memory?)"


@dataclass(frozen=True)
class Worker:
    """A process of a team."""

    address: str
    n_threads: int
    memory: float
    """Bytes that it may use; infinite if nothing limits it."""


@dataclass(frozen=True)
class Team:
    """Workers that are reached through a scheduler."""

    client: Any  # of Dask
    workers: tuple[Worker, ...]
    restore: Callable[[], object] = lambda: None
    """Starts workers anew that ended for good, where that is ours to do."""

    @property
    def share(self) -> float:
        """Bytes that every file may need if each thread of each worker has one."""
        return min(worker.memory / worker.n_threads for worker in self.workers)

    def do_together(self, jobs: Sequence[BatchJob]) -> Iterator[tuple[BatchJob, Record | Killed]]:
        """Yield jobs with their records as they end, one at a time on each thread of a worker.

        Raises
        ------
        OSError
            If no worker is left, the scheduler is gone, or a job says that the batch cannot go on.
        """
        yield from _run_jobs(self, [job.with_threads(1) for job in jobs], width=None)

    def do_alone(self, jobs: Sequence[BatchJob]) -> Iterator[tuple[BatchJob, Record | Killed]]:
        """Likewise, but one after the other, each on all threads of a worker."""
        n_threads = min(worker.n_threads for worker in self.workers)
        yield from _run_jobs(self, [job.with_threads(n_threads) for job in jobs], width=1)

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Piece]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the places of jobs with ``work(store, *job)`` as they end, one on each thread.

        Raises
        ------
        OSError
            If no worker is left, the scheduler is gone, or workers were killed with one piece at
            work time and again. What the work raises is raised as it is.
        """

        def call(place: int) -> tuple[Any, ...]:
            return run_piece, __version__, work, store, jobs[place]

        def result_of(future: Any, place: int) -> tuple[Any] | None:
            return _piece_of(future, jobs[place][0])

        for place, (result,) in _run(self, range(len(jobs)), call, result_of, width=None):
            yield place, result


def local_memory() -> int:
    """Bytes that the system lets processes of this machine use."""
    _import_dask()
    limit: int = importlib.import_module("distributed.system").MEMORY_LIMIT
    return limit


@contextlib.contextmanager
def local_team(n_workers: int, n_threads: int = 1) -> Iterator[Team]:
    """Start processes with equal shares of the memory; they end with the context, or with us."""
    dask, distributed = _import_dask()
    with contextlib.ExitStack() as stack:
        stack.enter_context(_silenced())
        stack.enter_context(dask.config.set(_LOCAL_SETTINGS))
        cluster = stack.enter_context(_started(distributed, n_workers, n_threads))
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        yield Team(client, _workers_of(client), _restorer(cluster, n_workers))


def _started(distributed: Any, n_workers: int, n_threads: int) -> Any:
    """A local cluster. Dask gives up where a worker is killed while it starts: tried again."""
    for attempts_left in reversed(range(START_ATTEMPTS)):
        try:
            with _deaf_to_interrupts():
                return distributed.LocalCluster(
                    n_workers=n_workers,
                    threads_per_worker=n_threads,
                    memory_limit=local_memory() // n_workers,
                    host=LOCALHOST,
                    dashboard_address=f"{LOCALHOST}:0",  # none would be sought at port 8787
                    scheduler_kwargs={"dashboard": False},
                    silence_logs=logging.CRITICAL,
                    env={"SUPERFACETS_NUM_THREADS": str(n_threads)},  # also for reading and writing
                )
        except RuntimeError as error:
            if not attempts_left or _is_refused():
                raise ConnectionError(
                    f"the workers cannot be started ({reason_of(error)}): a script that calls batch"
                    " has to do so below if __name__ == '__main__':"
                ) from None
    raise AssertionError


def _restorer(cluster: Any, n_workers: int) -> Callable[[], None]:
    """What replaces workers that Dask has given up: those that were killed while they started."""
    ended_before: set[Any] = set()

    def restore() -> None:
        nannies = dict(cluster.workers)
        ended = {name for name, nanny in nannies.items() if _has_ended(nanny)}
        for name in ended & ended_before:  # it is not about to start anew
            cluster.workers.pop(name, None)
            cluster.worker_spec.pop(name, None)
            cluster.loop.add_callback(nannies[name].close)
        ended_before.clear()
        ended_before.update(ended)
        cluster.scale(n_workers)

    return restore


def _has_ended(nanny: Any) -> bool:
    """Whether a worker's keeper, or the process that it keeps, has come to an end."""
    if nanny.status.name in ("closing", "closed", "failed"):
        return True
    return nanny.process is not None and nanny.process.status.name in ("stopped", "failed")


def _is_refused() -> bool:
    """Whether a script lets no process begin: it starts some where it is imported, which fails.

    A process that was killed has another exit code.
    """
    with _deaf_to_interrupts():
        process = multiprocessing.get_context("spawn").Process(target=os.getpid)
        process.start()
    process.join()
    return process.exitcode == 1


@contextlib.contextmanager
def remote_team(address: str, folder: str) -> Iterator[Team]:
    """Connect to a scheduler, whose workers have to see the folder and to have this version.

    Raises
    ------
    ConnectionError
        If there is none, it has no worker, or one does not fit.
    """
    _, distributed = _import_dask()
    with contextlib.ExitStack() as stack:
        stack.enter_context(_silenced())
        client = stack.enter_context(_connected(distributed, address))
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ConnectionError(f"the scheduler at {address} has no workers") from None
        _check_versions(client)
        _check_sees(client, folder)
        yield Team(client, _workers_of(client))


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = reason_of(error)
    # The client that failed closes itself when it is collected. While another one is being started,
    # both would wait for each other.
    gc.collect()
    raise ConnectionError(f"no scheduler at {address}: {reason}")


def _check_versions(client: Any) -> None:
    """Raise a ConnectionError if a worker has not this version of the package.

    What is called is of the standard library: a worker may not have this module.
    """
    found = client.run(metadata.version, "superfacets", on_error="return")
    for address, version in sorted(found.items()):
        if isinstance(version, BaseException):
            raise ConnectionError(f"the worker at {address} has no superfacets: install it there")
        if version != __version__:
            raise ConnectionError(
                f"the worker at {address} has superfacets {version}, and this is superfacets"
                f" {__version__}: install the same on both"
            )


def _check_sees(client: Any, folder: str) -> None:
    for address, is_seen in sorted(client.run(os.path.isdir, folder).items()):
        if not is_seen:
            raise ConnectionError(
                f"the worker at {address} does not see the folder {folder}: files have to lie where"
                " all machines have them under the same path"
            )


def _workers_of(client: Any) -> tuple[Worker, ...]:
    facts = client.run(_facts_of)
    return tuple(Worker(address, *facts[address]) for address in sorted(facts))


def _facts_of(dask_worker: Any) -> tuple[int, float]:
    """Threads and memory of a worker: called there by Dask, which gives it."""
    return dask_worker.state.nthreads, dask_worker.memory_manager.memory_limit or math.inf


def run_piece(version: str, work: Callable[..., Any], store: Any, job: Piece) -> Any:
    """Do the work of a `Team.map` here, if this process has the version of who asks for it."""
    check_version(version)
    return work(store, *job)


def _run_jobs(
    team: Team, jobs: Sequence[BatchJob], width: int | None
) -> Iterator[tuple[BatchJob, Record | Killed]]:
    return _run(team, jobs, lambda job: (run_job, job), _result_of, width)


def _run(
    team: Team,
    tasks: Sequence[Task],
    call: Callable[[Task], tuple[Any, ...]],
    result_of: Callable[[Any, Task], Result | None],
    width: int | None,
) -> Iterator[tuple[Task, Result]]:
    """Hand out tasks: one to each thread, and one more to each worker for when it has done that.

    With a `width`, no more than that. So the scheduler never has thousands of them, and a worker
    that is killed counts against few that it had not begun; none is lost by that. They are tied to
    no worker: one that is tied to a worker which ends is never run again by Dask, though others may
    be allowed, if no other is there at the time. `call` gives the function and the arguments of a
    task, and `result_of` what came of its future, or None if it is being done again.
    """
    waiting = deque(tasks)
    running: dict[str, tuple[Any, Task]] = {}
    ended: SimpleQueue[Any] = SimpleQueue()
    presence = _Presence(team)
    try:
        while waiting or running:
            n_threads = presence.n_threads()
            room = n_threads + len(team.workers) if width is None else width
            while waiting and len(running) < room:
                task = waiting.popleft()
                future = team.client.submit(*call(task), pure=False)
                running[future.key] = (future, task)
                future.add_done_callback(ended.put)
            try:
                future = ended.get(timeout=TICK)
            except Empty:
                continue
            task = running[future.key][1]
            result = result_of(future, task)
            if result is None:
                future.add_done_callback(ended.put)
                continue
            del running[future.key]
            yield task, result
    finally:
        with contextlib.suppress(Exception):  # there may be no scheduler any more
            team.client.cancel([future for future, _ in running.values()])


def _result_of(future: Any, job: BatchJob) -> Record | Killed | None:
    """What came of a job; None if its worker ended with the result: it is being done again.

    An OSError that `run_job` raised is raised here: the batch cannot go on.
    """
    if future.cancelled():
        raise _scheduler_lost()
    killed = importlib.import_module("distributed").KilledWorker
    try:
        record: Record = future.result(timeout=GATHER_TIMEOUT)
    except TimeoutError:
        return None
    except OSError:
        if future.status == "error":
            raise
        raise _scheduler_lost() from None
    except killed as error:
        return Killed(error.allowed_failures + 1)
    except Exception as error:  # such as one that cannot be pickled
        return {**job.head, "sha256": hash_of(job.path), "error": reason_of(error)}
    return record


def _piece_of(future: Any, piece: int) -> tuple[Any] | None:
    """What the work for a piece returned, or raises what it raised; None as for `_result_of`."""
    if future.cancelled():
        raise _scheduler_lost()
    killed = importlib.import_module("distributed").KilledWorker
    try:
        return (future.result(timeout=GATHER_TIMEOUT),)
    except TimeoutError:
        return None
    except OSError:
        if future.status == "error":
            raise
        raise _scheduler_lost() from None
    except killed as error:
        n_workers = counted(error.allowed_failures + 1, "worker")
        raise ConnectionError(
            f"{n_workers} ended with piece {piece} at work (out of memory?): take smaller tiles, or"
            " fewer workers"
        ) from None


def _scheduler_lost() -> ConnectionError:
    return ConnectionError("the scheduler is gone; a second start does what is missing")


class _Presence:
    """Which workers there are, looked up once in a while."""

    def __init__(self, team: Team) -> None:
        self._team = team
        self._looked = -math.inf
        self._seen = time.monotonic()
        self._n_threads = 0

    def n_threads(self) -> int:
        """Threads of all workers; a ConnectionError if there have been none for long."""
        now = time.monotonic()
        if now < self._looked + TICK:
            return self._n_threads
        try:
            self._n_threads = sum(self._team.client.nthreads().values())
        except OSError:
            raise _scheduler_lost() from None
        self._looked = now
        self._team.restore()
        if self._n_threads:
            self._seen = now
        elif now > self._seen + PATIENCE:
            raise ConnectionError(f"no worker has been there for {PATIENCE:.0f} seconds")
        return self._n_threads


@contextlib.contextmanager
def _silenced() -> Iterator[None]:
    """Let Dask not log what is told in one line here."""
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


@contextlib.contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start threads and processes that no Ctrl-C reaches: the terminal sends it to all of them.

    One that comes meanwhile is heard at the end.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # or the first process would, and unblock signals
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _import_dask() -> tuple[Any, Any]:
    try:
        return importlib.import_module("dask"), importlib.import_module("distributed")
    except ModuleNotFoundError:
        raise MissingExtraError("more than one file at a time", "batch") from None
