"""The same work for many pieces: in this process, or on workers of Dask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from ..batches.cluster import Team

__all__ = ["OnDone", "Run", "on_team", "run_serially"]

OnDone = Callable[[int, int], object]
"""Called with the number of pieces done, and of all, each time that one is."""


class Run(Protocol):
    """Calls ``work(store, piece, *args)`` for all pieces; returns the results in their order.

    The store lies on disk, and all arguments can be pickled. A piece may be worked on again after
    a worker was killed, and so must do nothing but read the store and write arrays of its own.
    """

    def __call__(
        self, work: Callable[..., Any], store: Any, pieces: Sequence[int], /, *args: Any
    ) -> list[Any]:
        """See the class."""
        ...


def run_serially(
    work: Callable[..., Any], store: Any, pieces: Sequence[int], /, *args: Any
) -> list[Any]:
    """Work in this process, one piece after the other."""
    return [work(store, piece, *args) for piece in pieces]


def on_team(team: Team, on_done: OnDone | None = None) -> Run:
    """Return a `Run` on the workers of a team: a piece at a time on each thread.

    Raises
    ------
    OSError
        If the workers are gone, or were killed time and again with one piece at work.
    """

    def run(
        work: Callable[..., Any], store: Any, pieces: Sequence[int], /, *args: Any
    ) -> list[Any]:
        results: dict[int, Any] = {}
        for piece, result in team.map(work, store, pieces, *args):
            results[piece] = result
            if on_done is not None:
                on_done(len(results), len(pieces))
        return [results[piece] for piece in pieces]

    return run
