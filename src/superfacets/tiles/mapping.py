"""The same work for many pieces: on threads, on processes, or on workers of Dask."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

from ..batches.cluster import remote_team
from ..workers.calls import Team
from ..workers.pool import open_pool
from .scratch import despite_interrupts
from .store import Job, Run

__all__ = ["OnDone", "on_team", "open_run", "run_all"]

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done, and of all, each time that one is."""

Work = Callable[..., Any]
Each = Callable[[Work, Any, Sequence[Job]], Iterator[tuple[int, Any]]]
"""Calls ``work(store, *job)`` for each job, and gives the results as they come."""


def run_all(run: Run, work: Work, store: Any, n_pieces: int, *args: Any) -> list[Any]:
    """Call ``work(store, piece, *args)`` for all pieces, with the same arguments."""
    return run(work, store, [(piece, *args) for piece in range(n_pieces)])


def on_team(team: Team, on_done: OnDone | None = None) -> Run:
    """Return a `Run` on the workers of a team: a piece at a time on each thread.

    A piece is worked on again where a worker was killed, and so the work must do nothing but read
    the store and write arrays of its own.

    Raises
    ------
    OSError
        If the workers are gone, or were killed time and again with one piece at work.
    """
    return _reporting(team.map, on_done)


def _reporting(each: Each, on_done: OnDone | None) -> Run:
    """A `Run` of what gives results as they come, each with the place of its job."""

    def run(
        work: Work, store: Any, jobs: Sequence[Job], n_before: int = 0,
        n_after: int = 0,
    ) -> list[Any]:  # fmt: skip
        results: dict[int, Any] = {}
        for place, result in each(work, store, jobs):
            results[place] = result
            if on_done is not None:
                on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return [results[place] for place in range(len(jobs))]

    return run


@contextlib.contextmanager
def open_run(
    workers: int,
    scheduler: str | None,
    folder: Path,
    n_threads: int = 1,
    on_done: OnDone | None = None,
) -> Iterator[Run]:
    """Give a `Run` on threads of this process, on others, or on the workers of a scheduler.

    One worker is this process itself. Each thread has a piece at a time, on one thread of the core.

    Parameters
    ----------
    workers : int
        Not used with a scheduler.
    scheduler : str or None
        Address.
    folder : Path
        Absolute; all workers have to see it.
    n_threads : int, default 1
        Of this process, if it is the only one.
    on_done : callable, optional

    Raises
    ------
    ConnectionError
        If there is no scheduler, it has no worker, or one does not fit.
    MissingExtraError
        If several workers need psutil, or a scheduler needs Dask, and it is not installed.
    """
    team: contextlib.AbstractContextManager[Team]
    if scheduler is not None:
        team = remote_team(scheduler, str(folder))
    elif workers > 1:
        team = open_pool(workers)
    elif n_threads > 1:
        threads = _Threads(n_threads)
        try:
            threads.start()
            yield _reporting(threads.each, on_done)
        finally:
            threads.end()
        return
    else:
        yield _reporting(_in_turn, on_done)
        return
    with team as opened:
        yield on_team(opened, on_done)


class _Threads:
    """Threads of this process that do a job each."""

    def __init__(self, n_threads: int) -> None:
        self._pool = ThreadPoolExecutor(n_threads)
        self._n_threads = n_threads
        self._given: list[Future[Any]] = []

    def start(self) -> None:
        """Start all of them: one that a Ctrl-C comes upon while it starts would be lost sight of.

        A MemoryError if the system has no room for so many.
        """
        barrier = threading.Barrier(self._n_threads)
        try:
            for started in [self._pool.submit(barrier.wait) for _ in range(self._n_threads)]:
                started.result()
        except RuntimeError:
            raise MemoryError(f"no room for {self._n_threads} threads") from None
        finally:
            barrier.abort()  # those that wait for others

    def each(self, work: Work, store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
        """Do jobs. None is left waiting if one fails, or the user interrupts it."""
        if len(jobs) == 1:  # as many visits of a tile are
            yield from _in_turn(work, store, jobs)
            return
        self._given = []
        try:
            for job in jobs:
                self._given.append(self._pool.submit(work, store, *job))
            for place, done in enumerate(self._given):
                yield place, done.result()
        finally:
            for left in self._given:
                left.cancel()

    def end(self) -> None:
        """Return when nothing is at work any more, whatever comes meanwhile: it may write."""
        despite_interrupts(self._wait)

    def _wait(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        wait([job for job in self._given if not job.cancelled()])


def _in_turn(work: Work, store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    for place, job in enumerate(jobs):
        yield place, work(store, *job)
