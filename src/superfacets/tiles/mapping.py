"""The same work for many pieces: in this process, or on workers of Dask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..batches.cluster import Team
from .store import Job, Run

__all__ = ["OnDone", "on_team", "run_all"]

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

    def run(work: Callable[..., Any], store: Any, jobs: Sequence[Job]) -> list[Any]:
        results: dict[int, Any] = {}
        for place, result in team.map(work, store, jobs):
            results[place] = result
            if on_done is not None:
                on_done(len(results), len(jobs))
        return [results[place] for place in range(len(jobs))]

    return run
