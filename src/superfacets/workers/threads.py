"""Thread teams, which map work over jobs; each thread runs one job at a time."""

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
        """Start all threads now, because a Ctrl-C during a later start would lose the thread.

        A MemoryError if the system cannot start this number of threads.
        """
        barrier = threading.Barrier(self._n_threads)
        try:
            for started in [self._pool.submit(barrier.wait) for _ in range(self._n_threads)]:
                started.result()
        except RuntimeError:
            raise MemoryError(f"the system cannot start {self._n_threads} threads") from None
        finally:
            barrier.abort()  # releases waiting threads

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the index of each job, and ``work(store, *job)``.

        Waiting jobs are cancelled if a job fails or the user interrupts.
        """
        if len(jobs) == 1:  # the usual number of jobs for tiles
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
        """Wait until no thread is running, despite interrupts, because threads may write files."""
        despite_interrupts(self._wait)

    def _wait(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        wait([job for job in self._given if not job.cancelled()])
        self._pool.shutdown()  # joins threads: Python would lose a Ctrl-C at the end of a thread


@contextlib.contextmanager
def thread_team(n_threads: int) -> Iterator[ThreadTeam]:
    """Yield a team of threads, which are idle when the block ends."""
    threads = ThreadTeam(n_threads)
    try:
        threads.start()
        yield threads
    finally:
        threads.end()


def in_turn(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    """Like `ThreadTeam.map`, but on this thread."""
    for place, job in enumerate(jobs):
        yield place, work(store, *job)


def despite_interrupts(work: Callable[[], object]) -> None:
    """Call `work` until a call is not interrupted by Ctrl-C; then raise the last interrupt."""
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
