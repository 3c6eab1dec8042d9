"""Call a function for many tiles, in threads, processes or Dask workers."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..workers.pool import open_pool
from ..workers.threads import Job, in_turn, thread_team
from .cluster import remote_team

OnDone = Callable[[int, int], object]
"""Function that is called after each job with the numbers of finished jobs and of all jobs."""

Work = Callable[..., Any]
Each = Callable[[Work, Any, Sequence[Job]], Iterator[tuple[int, Any]]]
"""Function that calls ``work(store, *job)`` for each job, and yields (job index, result)."""


class Run:
    """Calls a function for many jobs, possibly in other processes, and reports progress."""

    def __init__(self, each: Each, on_done: OnDone | None = None) -> None:
        self._each = each
        self._on_done = on_done

    def __call__(
        self, work: Work, store: Any, jobs: Sequence[Job], *, n_before: int = 0, n_after: int = 0
    ) -> list[Any]:
        """Return ``work(store, *job)`` for each job, in the order of the jobs.

        `n_before` and `n_after` are only used to report progress. They are the numbers of jobs that
        run in other calls, before and after these jobs.
        """
        results: dict[int, Any] = {}
        for place, result in self._each(work, store, jobs):
            results[place] = result
            if self._on_done is not None:
                self._on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return [results[place] for place in range(len(jobs))]

    def all(self, work: Work, store: Any, n_pieces: int, *args: Any) -> list[Any]:
        """Return ``work(store, i, *args)`` for each i from 0 to `n_pieces` - 1.

        For example, i is the index of a tile, a chunk or a block.
        """
        return self(work, store, [(piece, *args) for piece in range(n_pieces)])


@contextlib.contextmanager
def open_run(
    workers: int, scheduler: str | None, folder: Path, n_threads: int = 1,
    on_done: OnDone | None = None,
) -> Iterator[Run]:  # fmt: skip
    """Yield a `Run` that uses threads of this process, worker processes, or Dask workers.

    If `workers` is 1, jobs run in `n_threads` threads of this process. If the address of a Dask
    scheduler is given, `workers` has no effect. If a worker is killed, its job is repeated.
    Therefore, a job must not change the data that it reads. Dask workers must have access to
    `folder`, an absolute path. Raises the errors of `remote_team` and `open_pool`. Calls of the
    `Run` raise an OSError if no worker is left, or if several workers were killed while running the
    same job.
    """
    if scheduler is not None or workers > 1:
        remote = None if scheduler is None else remote_team(scheduler, str(folder))
        with remote or open_pool(workers) as team:
            yield Run(team.map, on_done)
    elif n_threads > 1:
        with thread_team(n_threads) as threads:
            yield Run(threads.map, on_done)
    else:
        yield Run(in_turn, on_done)
