"""Threads of this process, each of which does a piece of work at a time."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from ..io.locks import despite_interrupts

__all__ = ["ThreadTeam", "in_turn", "thread_team"]

Job = tuple[Any, ...]


class ThreadTeam:
    """Threads that have been started."""

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

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the place of each job, and ``work(store, *job)``.

        No job is left waiting if one fails, or the user interrupts it.
        """
        if len(jobs) == 1:  # as many visits of a tile are
            yield from in_turn(work, store, jobs)
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
        self._pool.shutdown()  # a Ctrl-C amid what Python does when a thread ends would be lost


@contextlib.contextmanager
def thread_team(n_threads: int) -> Iterator[ThreadTeam]:
    """Start threads; none of them is at work any more when the block ends."""
    threads = ThreadTeam(n_threads)
    try:
        threads.start()
        yield threads
    finally:
        threads.end()


def in_turn(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    """Yield the same as `ThreadTeam.map`, one job after the other on this thread."""
    for place, job in enumerate(jobs):
        yield place, work(store, *job)
