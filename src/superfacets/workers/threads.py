"""Thread teams: map work over jobs, one job per thread at a time."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

Job = tuple[Any, ...]


class ThreadTeam:
    """A team of running threads."""

    def __init__(self, n_threads: int) -> None:
        self._pool = ThreadPoolExecutor(n_threads)
        self._n_threads = n_threads
        self._given: list[Future[Any]] = []

    def start(self) -> None:
        """Start all threads now. A Ctrl-C during the start of a thread would lose track of it.

        A MemoryError if the system has no room for so many.
        """
        barrier = threading.Barrier(self._n_threads)
        try:
            for started in [self._pool.submit(barrier.wait) for _ in range(self._n_threads)]:
                started.result()
        except RuntimeError:
            raise MemoryError(f"no room for {self._n_threads} threads") from None
        finally:
            barrier.abort()  # releases threads that wait

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the place of each job, and ``work(store, *job)``.

        No job is left waiting if one fails, or the user interrupts it.
        """
        if len(jobs) == 1:  # as in many visits of tiles
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
        """Wait until no thread is running, despite interrupts: threads may be writing files."""
        despite_interrupts(self._wait)

    def _wait(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        wait([job for job in self._given if not job.cancelled()])
        self._pool.shutdown()  # joins: Python would lose a Ctrl-C at the end of a thread


@contextlib.contextmanager
def thread_team(n_threads: int) -> Iterator[ThreadTeam]:
    """Yield a team of threads; all are idle when the block ends."""
    threads = ThreadTeam(n_threads)
    try:
        threads.start()
        yield threads
    finally:
        threads.end()


def in_turn(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    """As `ThreadTeam.map`, in series on this thread."""
    for place, job in enumerate(jobs):
        yield place, work(store, *job)


def despite_interrupts(work: Callable[[], object]) -> None:
    """Call `work` until no Ctrl-C interrupts it; then raise the last KeyboardInterrupt."""
    interrupt: KeyboardInterrupt | None = None
    is_done = False
    while not is_done:
        try:
            work()
            is_done = True
        except KeyboardInterrupt as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt
