"""Calls to worker processes, on this machine or on others, and their results."""

from __future__ import annotations

import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import __version__
from ..io.guards import counted

ALLOWED_KILLS = 3
"""Number of workers that may die during a call before it is abandoned."""

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A module-level function and its arguments; both are pickled."""


@dataclass(frozen=True)
class Done:
    """A call that returned a value."""

    value: Any


@dataclass(frozen=True)
class Failed:
    """A call that raised an error, or whose result could not be pickled."""

    error: Exception


@dataclass(frozen=True)
class Killed:
    """A call that was abandoned, because this number of workers died during the call."""

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
    """One or more workers, each in a separate process."""

    def __init__(self, workers: Sequence[Worker]) -> None:
        self.workers = tuple(workers)

    @abstractmethod
    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Yield (index of the call, its ending) as calls end; at most `width` calls run at a time.

        If a worker is killed, its call is repeated. A ConnectionError if no worker is left, or
        workers cannot be started.
        """

    @property
    def share(self) -> float:
        """Memory in bytes per thread, which is the memory for one file."""
        return min(worker.memory / worker.n_threads for worker in self.workers)

    def map(
        self, work: Callable[..., Any], store: Any, pieces: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index, ``work(store, *piece)``) as pieces end; each thread runs one at a time.

        An OSError if no worker is left, the scheduler is gone, or one piece has killed several
        workers. Errors of the work are raised unchanged.
        """
        calls = [(run_piece, (__version__, work, store, piece)) for piece in pieces]
        for place, ending in self.run(calls, width=None):
            if isinstance(ending, Failed):
                raise ending.error
            if isinstance(ending, Killed):
                n_workers = counted(ending.n_workers, "worker")
                raise ConnectionError(
                    f"{n_workers} ended while processing piece {pieces[place][0]} (out of memory?):"
                    " use smaller tiles or fewer workers"
                )
            yield place, ending.value


def run_piece(version: str, work: Callable[..., Any], store: Any, piece: tuple[Any, ...]) -> Any:
    """Run the work of `Team.map` in a worker, after a check of the version of the package."""
    check_version(version)
    return work(store, *piece)


def check_version(version: str) -> None:
    """Raise a ConnectionError if this worker has another version of the package."""
    if version != __version__:
        raise ConnectionError(
            f"a worker on {socket.gethostname()} has superfacets {__version__}, but this process"
            f" has {version}: install the same version on both"
        )
