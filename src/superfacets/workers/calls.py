"""Calls to worker processes, and their results: on this machine or elsewhere."""

from __future__ import annotations

import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import __version__
from ..io.guards import counted

ALLOWED_KILLS = 3
"""Number of workers that may die during a call before it is given up."""

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a module, and its arguments: both are pickled."""


@dataclass(frozen=True)
class Done:
    """A call that returned."""

    value: Any


@dataclass(frozen=True)
class Failed:
    """A call that raised an error, or whose result could not be sent."""

    error: Exception


@dataclass(frozen=True)
class Killed:
    """A call that was given up, as this many workers died during it."""

    n_workers: int

    def __str__(self) -> str:
        n_workers = counted(self.n_workers, "worker")
        return f"KilledWorker: {n_workers} ended during this work (out of memory?)"


Ending = Done | Failed | Killed


@dataclass(frozen=True)
class Worker:
    """Description of a worker process."""

    address: str
    n_threads: int
    memory: float
    """Memory limit in bytes; infinite if there is none."""


class Team(ABC):
    """Workers, at least one, in processes of their own."""

    def __init__(self, workers: Sequence[Worker]) -> None:
        self.workers = tuple(workers)

    @abstractmethod
    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Yield (index of the call, its ending) as calls end; at most `width` run at a time.

        A call is made again if its worker was killed. A ConnectionError if no worker is left, or
        none can be started.
        """

    @property
    def share(self) -> float:
        """Memory in bytes for one file, if every thread of every worker has one."""
        return min(worker.memory / worker.n_threads for worker in self.workers)

    def map(
        self, work: Callable[..., Any], store: Any, pieces: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index, ``work(store, *piece)``) as pieces end; each thread has one at a time.

        An OSError if no worker is left, the scheduler is gone, or several workers were killed with
        the same piece at work. Errors of the work are raised as they are.
        """
        calls = [(run_piece, (__version__, work, store, piece)) for piece in pieces]
        for place, ending in self.run(calls, width=None):
            if isinstance(ending, Failed):
                raise ending.error
            if isinstance(ending, Killed):
                n_workers = counted(ending.n_workers, "worker")
                raise ConnectionError(
                    f"{n_workers} ended with piece {pieces[place][0]} at work (out of memory?):"
                    " take smaller tiles, or fewer workers"
                )
            yield place, ending.value


def run_piece(version: str, work: Callable[..., Any], store: Any, piece: tuple[Any, ...]) -> Any:
    """Run the work of `Team.map`, if this process has the caller's version of the package."""
    check_version(version)
    return work(store, *piece)


def check_version(version: str) -> None:
    """Raise a ConnectionError if this process, a worker, has another version of the package."""
    if version != __version__:
        raise ConnectionError(
            f"a worker on {socket.gethostname()} has superfacets {__version__}, and this is"
            f" superfacets {version}"
        )
