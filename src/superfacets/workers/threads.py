"""Define `ThreadTeam`, which calls a function for many jobs in several threads."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from .._validate import counted

Job = tuple[Any, ...]


class ThreadTeam:
    """A fixed number of threads. Each thread runs one job at a time."""

    def __init__(self, n_threads: int) -> None:
        self._pool = ThreadPoolExecutor(n_threads)
        self._n_threads = n_threads
        self._given: list[Future[Any]] = []

    def start(self) -> None:
        """Start all threads now, because Ctrl-C during a later start could lose a thread.

        Raises a MemoryError if the system cannot start this number of threads.
        """
        barrier = threading.Barrier(self._n_threads)
        try:
            for started in [self._pool.submit(barrier.wait) for _ in range(self._n_threads)]:
                started.result()
        except RuntimeError:
            threads = counted(self._n_threads, "thread")
            raise MemoryError(f"cannot start {threads}: reduce n_threads") from None
        finally:
            barrier.abort()  # releases threads that still wait

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index of the job, ``work(store, *job)``) for each job, in order.

        If a job fails or the user presses Ctrl-C, jobs that have not started are cancelled.
        """
        if len(jobs) == 1:  # a frequent case that needs no thread
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
        """Wait for the end of all threads, even after Ctrl-C, because they may be writing files."""
        despite_interrupts(self._wait)

    def _wait(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        wait([job for job in self._given if not job.cancelled()])
        self._pool.shutdown()  # waits, because Python may lose Ctrl-C while a thread ends


@contextlib.contextmanager
def thread_team(n_threads: int) -> Iterator[ThreadTeam]:
    """Yield a `ThreadTeam`, and wait for its threads after the `with` block."""
    threads = ThreadTeam(n_threads)
    try:
        threads.start()
        yield threads
    finally:
        threads.end()


def in_turn(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, Any]]:
    """Yield the same as `ThreadTeam.map`, but run all jobs in the calling thread."""
    for place, job in enumerate(jobs):
        yield place, work(store, *job)


def despite_interrupts(work: Callable[[], object]) -> None:
    """Run `work`, and repeat it each time that Ctrl-C interrupts it.

    After `work` has ended, the last KeyboardInterrupt is raised, if there was one.
    """
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
