"""Define `ThreadTeam`, which maps a function over jobs on several threads."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

Job = tuple[Any, ...]


class ThreadTeam:
    """A fixed number of threads, each of which runs one job at a time."""

    def __init__(self, n_threads: int) -> None:
        self._pool = ThreadPoolExecutor(n_threads)
        self._n_threads = n_threads
        self._given: list[Future[Any]] = []

    def start(self) -> None:
        """Start all threads now, because Ctrl-C during a later start would leave a lost thread.

        Raises a MemoryError if the system cannot start this number of threads.
        """
        barrier = threading.Barrier(self._n_threads)
        try:
            for started in [self._pool.submit(barrier.wait) for _ in range(self._n_threads)]:
                started.result()
        except RuntimeError:
            raise MemoryError(f"cannot start {self._n_threads} threads: reduce n_threads") from None
        finally:
            barrier.abort()  # releases threads that wait at the barrier

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index of the job, ``work(store, *job)``) for each job, in order.

        Waiting jobs are cancelled if a job fails or if the user presses Ctrl-C.
        """
        if len(jobs) == 1:  # a common case, for which no thread is needed
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
        """Wait until all threads have ended, even after Ctrl-C, because threads may write files."""
        despite_interrupts(self._wait)

    def _wait(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        wait([job for job in self._given if not job.cancelled()])
        self._pool.shutdown()  # joins all threads, because Python loses Ctrl-C while a thread ends


@contextlib.contextmanager
def thread_team(n_threads: int) -> Iterator[ThreadTeam]:
    """Yield a `ThreadTeam`, and wait for its threads at the end of the block."""
    threads = ThreadTeam(n_threads)
    try:
        threads.start()
        yield threads
    finally:
        threads.end()


def in_turn(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    """Do the same as `ThreadTeam.map`, but run all jobs on the calling thread."""
    for place, job in enumerate(jobs):
        yield place, work(store, *job)


def despite_interrupts(work: Callable[[], object]) -> None:
    """Repeat `work` until Ctrl-C does not interrupt it; then raise the last KeyboardInterrupt."""
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
