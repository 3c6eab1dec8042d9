"""The same work for many pieces: on threads, on processes, or on workers of Dask."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..batches.cluster import remote_team
from ..workers.pool import open_pool
from ..workers.threads import in_turn, thread_team
from .store import Job, Run

__all__ = ["OnDone", "open_run", "run_all"]

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done, and of all, each time that one is."""

Work = Callable[..., Any]
Each = Callable[[Work, Any, Sequence[Job]], Iterator[tuple[int, Any]]]
"""Calls ``work(store, *job)`` for each job, and gives the results as they come."""


def run_all(run: Run, work: Work, store: Any, n_pieces: int, *args: Any) -> list[Any]:
    """Call ``work(store, piece, *args)`` for all pieces, with the same arguments."""
    return run(work, store, [(piece, *args) for piece in range(n_pieces)])


def _reporting(each: Each, on_done: OnDone | None) -> Run:
    """A `Run` of what gives results as they come, each with the place of its job."""

    def run(
        work: Work, store: Any, jobs: Sequence[Job], n_before: int = 0, n_after: int = 0
    ) -> list[Any]:
        results: dict[int, Any] = {}
        for place, result in each(work, store, jobs):
            results[place] = result
            if on_done is not None:
                on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return [results[place] for place in range(len(jobs))]

    return run


@contextlib.contextmanager
def open_run(
    workers: int, scheduler: str | None, folder: Path, n_threads: int = 1,
    on_done: OnDone | None = None,
) -> Iterator[Run]:  # fmt: skip
    """Give a `Run` on so many threads of this process, on others, or on workers of a scheduler.

    One worker is this process itself; with the address of a scheduler, `workers` says nothing. Each
    thread has a piece at a time, on one thread of the core. A piece is worked on again where a
    worker was killed, and so the work must do nothing but read the store and write arrays of its
    own. All workers have to see `folder`, an absolute path.

    Raises
    ------
    OSError
        If there is no scheduler, it has no worker, or one does not fit; or, in a run, if workers
        are gone, or were killed time and again with one piece at work.
    MissingExtraError
        If several workers need psutil, or a scheduler needs Dask, and it is not installed.
    """
    if scheduler is not None or workers > 1:
        remote = None if scheduler is None else remote_team(scheduler, str(folder))
        with remote or open_pool(workers) as team:
            yield _reporting(team.map, on_done)
    elif n_threads > 1:
        with thread_team(n_threads) as threads:
            yield _reporting(threads.map, on_done)
    else:
        yield _reporting(in_turn, on_done)
