"""Map a function over tiles, on threads, on processes, or on workers of Dask."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..workers.pool import open_pool
from ..workers.threads import Job, in_turn, thread_team
from .cluster import remote_team

OnDone = Callable[[int, int], object]
"""Called after each piece, with the number of pieces done and the number of all pieces."""

Work = Callable[..., Any]
Each = Callable[[Work, Any, Sequence[Job]], Iterator[tuple[int, Any]]]
"""Calls ``work(store, *job)`` for each job, and yields (index of the job, result) when it ends."""


class Run:
    """Calls a function for many jobs, in any process, and reports progress."""

    def __init__(self, each: Each, on_done: OnDone | None = None) -> None:
        self._each = each
        self._on_done = on_done

    def __call__(
        self, work: Work, store: Any, jobs: Sequence[Job], *, n_before: int = 0, n_after: int = 0
    ) -> list[Any]:
        """Return ``work(store, *job)`` for each job, in order.

        For progress bars, `n_before` jobs of the same pass are already done, and `n_after` follow.
        """
        results: dict[int, Any] = {}
        for place, result in self._each(work, store, jobs):
            results[place] = result
            if self._on_done is not None:
                self._on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return [results[place] for place in range(len(jobs))]

    def all(self, work: Work, store: Any, n_pieces: int, *args: Any) -> list[Any]:
        """Call ``work(store, piece, *args)`` for all pieces, with the same arguments."""
        return self(work, store, [(piece, *args) for piece in range(n_pieces)])


@contextlib.contextmanager
def open_run(
    workers: int, scheduler: str | None, folder: Path, n_threads: int = 1,
    on_done: OnDone | None = None,
) -> Iterator[Run]:  # fmt: skip
    """Yield a `Run` on `n_threads` threads of this process, on `workers` processes, or on Dask.

    With one worker, this process does the work itself. With the address of a scheduler, `workers`
    has no effect. If a worker is killed, its piece is run again; so `work` must only read the store
    and write arrays of its piece. All workers must see `folder`, an absolute path. Raises the
    errors of `remote_team` and `open_pool`; during a run, an OSError if all workers are gone, or
    one piece has killed several workers.
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
