"""Map a function over tiles: on threads, on processes, or on workers of Dask."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..batches.cluster import remote_team
from ..workers.pool import open_pool
from ..workers.threads import in_turn, thread_team
from .store import Job, Run

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done and the number of all, each time that one is done."""

Work = Callable[..., Any]
Each = Callable[[Work, Any, Sequence[Job]], Iterator[tuple[int, Any]]]
"""Calls ``work(store, *job)`` for each job, and yields (index of the job, result) as they end."""


def run_all(run: Run, work: Work, store: Any, n_pieces: int, *args: Any) -> list[Any]:
    """Call ``work(store, piece, *args)`` for all pieces, with the same arguments."""
    return run(work, store, [(piece, *args) for piece in range(n_pieces)])


def _reporting(each: Each, on_done: OnDone | None) -> Run:
    """A `Run` that returns the results in the order of the jobs, and reports each."""

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
    """Yield a `Run` on `n_threads` threads of this process, on `workers` processes, or on Dask.

    One worker is this process itself; with the address of a scheduler, `workers` has no effect.
    Each thread has one piece at a time, on one thread of the core. If a worker is killed, its piece
    is run again: so work may only read the store, and write arrays of its own piece. All workers
    must see `folder`, an absolute path.

    Raises
    ------
    OSError
        If the scheduler does not answer, has no worker, or a worker has another version; or, in a
        run, if all workers are gone, or the same piece has killed several.
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
