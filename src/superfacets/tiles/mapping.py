"""The same work for many pieces: in this process, or on workers of Dask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from ..batches.cluster import Team

__all__ = ["Job", "OnDone", "Run", "on_team", "run_all", "run_serially"]

Job = tuple[Any, ...]
"""The number of a piece, and whatever else its work is called with."""

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done, and of all, each time that one is."""


class Run(Protocol):
    """Calls ``work(store, *job)`` for all jobs; returns the results in their order.

    A job is a tuple that begins with the number of a piece. The store lies on disk, and all
    arguments can be pickled. A piece may be worked on again after a worker was killed, and so the
    work must do nothing but read the store and write arrays of its own.
    """

    def __call__(self, work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> list[Any]:
        """See the class."""
        ...


def run_serially(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> list[Any]:
    """Work in this process, one piece after the other."""
    return [work(store, *job) for job in jobs]


def run_all(run: Run, work: Callable[..., Any], store: Any, n_pieces: int, *args: Any) -> list[Any]:
    """Call ``work(store, piece, *args)`` for all pieces, with the same arguments."""
    return run(work, store, [(piece, *args) for piece in range(n_pieces)])


def on_team(team: Team, on_done: OnDone | None = None) -> Run:
    """Return a `Run` on the workers of a team: a piece at a time on each thread.

    Raises
    ------
    OSError
        If the workers are gone, or were killed time and again with one piece at work.
    """

    def run(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> list[Any]:
        results: dict[int, Any] = {}
        for place, result in team.map(work, store, jobs):
            results[place] = result
            if on_done is not None:
                on_done(len(results), len(jobs))
        return [results[place] for place in range(len(jobs))]

    return run
