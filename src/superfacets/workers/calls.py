"""Define the interface of a team of worker processes, which run calls and return results."""

from __future__ import annotations

import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import __version__
from .._validate import counted

ALLOWED_KILLS = 3
"""A call whose worker died is repeated, unless more than this number of workers died during it."""

Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A module-level function and its arguments; both are sent to a worker as a pickle."""


@dataclass(frozen=True)
class Done:
    """Result of a call that returned a value."""

    value: Any


@dataclass(frozen=True)
class Failed:
    """Result of a call that raised an exception, or whose value could not be pickled."""

    error: Exception


@dataclass(frozen=True)
class Killed:
    """Result of a call that is given up, because `n_workers` workers died while running it."""

    n_workers: int

    def __str__(self) -> str:
        n_workers = counted(self.n_workers, "worker")
        return f"KilledWorker: {n_workers} died during this call (out of memory?)"


Ending = Done | Failed | Killed


@dataclass(frozen=True)
class Worker:
    """Address and resources of a worker process."""

    address: str
    n_threads: int
    memory: float  # memory limit in bytes; inf means no limit


class Team(ABC):
    """One or more worker processes, which run calls."""

    def __init__(self, workers: Sequence[Worker]) -> None:
        self.workers = tuple(workers)

    @abstractmethod
    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Run calls, at most `width` at a time; yield (index, result) of each call when it ends.

        If `width` is None, all workers are used. If a worker is killed, its call is repeated, or
        yields `Killed` after too many repetitions. Raises a ConnectionError if no worker is left or
        if workers cannot be started.
        """

    @property
    def share(self) -> float:
        """Memory per thread in bytes: the minimum over all workers."""
        return min(worker.memory / worker.n_threads for worker in self.workers)

    def map(
        self, work: Callable[..., Any], store: Any, pieces: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index of the piece, ``work(store, *piece)``) for each piece when it is done.

        A piece is a tuple of arguments. Each thread of a worker runs `work` for one piece at a
        time. Raises an OSError if no worker is left, if the connection to a scheduler is lost, or
        if several workers died while processing the same piece. Exceptions of `work` are raised
        unchanged.
        """
        calls = [(run_piece, (__version__, work, store, piece)) for piece in pieces]
        for place, ending in self.run(calls, width=None):
            if isinstance(ending, Failed):
                raise ending.error
            if isinstance(ending, Killed):
                n_workers = counted(ending.n_workers, "worker")
                raise ConnectionError(
                    f"{n_workers} died while processing part {pieces[place][0]} of the input"
                    " (out of memory?): use smaller tiles or fewer workers"
                )
            yield place, ending.value


def run_piece(version: str, work: Callable[..., Any], store: Any, piece: tuple[Any, ...]) -> Any:
    """Check the version of the package in this worker, then run `work` for one piece."""
    check_version(version)
    return work(store, *piece)


def check_version(version: str) -> None:
    """Raise a ConnectionError if this worker has another version of the package."""
    if version != __version__:
        raise ConnectionError(
            f"a worker on {socket.gethostname()} has superfacets {__version__}, but this process"
            f" has {version}: install the same version on both"
        )
