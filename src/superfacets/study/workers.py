"""Worker processes that do one job at a time and end with their parent, even if it is killed."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

__all__ = ["Death", "Job", "run_jobs"]

# Libraries read these when they are loaded: one thread each, as every worker has one core.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

# Without the safe path, a worker would look for `multiprocessing` in the current folder first.
_OF_WORKERS = {**_ONE_THREAD, "PYTHONSAFEPATH": "1"}


class Job(Protocol):
    """A job for a worker. The job and its result are pickled."""

    @property
    def memory(self) -> int:
        """Bytes that it will need, if they are many; 0 otherwise."""

    def run(self) -> Any:
        """Do it. An exception ends the worker."""


@dataclass(frozen=True)
class Death:
    """Stands for the result if the worker ended during a job."""

    exit_code: int | None

    def __str__(self) -> str:
        if self.exit_code is not None and self.exit_code < 0:
            name = signal.Signals(-self.exit_code).name
            why = " (out of memory?)" if name == "SIGKILL" else ""
            return f"its process was ended by {name}{why}"
        return f"its process ended with status {self.exit_code}"


def run_jobs(
    jobs: Sequence[Job], n_workers: int, *, memory: int, deadline: float | None = None
) -> Generator[tuple[Any, Any], None, None]:
    """Yield jobs with their results, or a `Death`, in the order in which they end.

    Parameters
    ----------
    jobs : sequence of Job
        Begun in this order, but that a job which does not fit into memory waits.
    n_workers : int
        Processes, >= 1.
    memory : int
        Bytes that the jobs at work may need together; a job that needs more runs alone.
    deadline : float, optional
        `time.monotonic` after which no job is begun.

    Closing the iterator ends the workers at once.
    """
    pending = list(jobs)
    team = [_Worker() for _ in range(min(n_workers, len(pending)))]
    try:
        while True:
            if deadline is not None and time.monotonic() >= deadline:
                pending.clear()
            _hand_out(pending, team, memory)
            busy = {worker.connection: worker for worker in team if worker.job is not None}
            if not busy:
                return
            for connection in wait(list(busy)):
                worker = busy[connection]  # type: ignore[index]
                job, result = worker.take_result()
                if isinstance(result, Death):
                    team[team.index(worker)] = _Worker()
                yield job, result
    finally:
        for worker in team:
            worker.stop()


def _hand_out(pending: list[Job], team: list[_Worker], memory: int) -> None:
    """Give each idle worker the first job that fits."""
    for worker in team:
        at_work = [other.job for other in team if other.job is not None]
        place = _first_that_fits(pending, at_work, memory)
        if worker.job is None and place is not None:
            worker.give(pending.pop(place))


def _first_that_fits(pending: list[Job], at_work: list[Job], memory: int) -> int | None:
    """Index of the first job that can begin now; any can if no other is running."""
    room = memory - sum(job.memory for job in at_work)
    fits = (not at_work or job.memory == 0 or job.memory <= room for job in pending)
    return next((place for place, does in enumerate(fits) if does), None)


class _Worker:
    """A process that waits for jobs; dropped once it died."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")  # nothing of the parent's state comes along
        self.connection, far_end = context.Pipe()
        self.job: Job | None = None
        self._process: BaseProcess = context.Process(target=_work, args=(far_end,), daemon=True)
        with _settings_of_workers():
            self._process.start()
        far_end.close()  # so that the worker's end is the last, and its death is seen here

    def give(self, job: Job) -> None:
        self.job = job
        with contextlib.suppress(OSError):  # it is dead: seen when the result is taken
            self.connection.send(job)

    def take_result(self) -> tuple[Job | None, Any]:
        job, self.job = self.job, None
        try:
            return job, self.connection.recv()
        except (EOFError, OSError):
            self._process.join()
            return job, Death(self._process.exitcode)

    def stop(self) -> None:
        self._process.terminate()
        self._process.join()
        self.connection.close()


@contextlib.contextmanager
def _settings_of_workers() -> Iterator[None]:
    """One thread, no modules of the current folder, and deaf to the Ctrl-C of a terminal."""
    before = {name: os.environ.get(name) for name in _OF_WORKERS}
    os.environ.update(_OF_WORKERS)
    is_main = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if is_main else None
    try:
        yield
    finally:
        if handler is not None:
            signal.signal(signal.SIGINT, handler)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _work(connection: Connection) -> None:
    """Do jobs until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        connection.send(job.run())


def _end_with_parent() -> None:
    """End this process, whatever it is doing, when the parent is gone."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
