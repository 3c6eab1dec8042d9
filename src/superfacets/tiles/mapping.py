"""The same work for many pieces: in this process, on others, or on workers of Dask."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..batches.cluster import remote_team
from ..batches.processes import local_team
from ..batches.teams import Team
from .store import Job, Run

__all__ = ["OnDone", "on_team", "open_run", "run_all"]

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done, and of all, each time that one is."""


def run_all(run: Run, work: Callable[..., Any], store: Any, n_pieces: int, *args: Any) -> list[Any]:
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

    def run(
        work: Callable[..., Any], store: Any, jobs: Sequence[Job], n_before: int = 0,
        n_after: int = 0,
    ) -> list[Any]:  # fmt: skip
        results: dict[int, Any] = {}
        for place, result in team.map(work, store, jobs):
            results[place] = result
            if on_done is not None:
                on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return [results[place] for place in range(len(jobs))]

    return run


@contextlib.contextmanager
def open_run(
    workers: int, scheduler: str | None, folder: Path, on_done: OnDone | None = None
) -> Iterator[Run]:
    """Give a `Run` on so many processes of this machine, or on the workers of a scheduler.

    One worker is this process itself. Each thread of the others has a piece at a time, on one
    thread of the core.

    Parameters
    ----------
    workers : int
        Not used with a scheduler.
    scheduler : str or None
        Address.
    folder : Path
        Absolute; all workers have to see it.
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
        team = local_team(workers)
    else:
        yield _in_this_process(on_done)
        return
    with team as opened:
        yield on_team(opened, on_done)


def _in_this_process(on_done: OnDone | None) -> Run:
    def run(
        work: Callable[..., Any], store: Any, jobs: Sequence[Job], n_before: int = 0,
        n_after: int = 0,
    ) -> list[Any]:  # fmt: skip
        results = []
        for job in jobs:
            results.append(work(store, *job))
            if on_done is not None:
                on_done(n_before + len(results), n_before + len(jobs) + n_after)
        return results

    return run
