"""Teams of workers: what they have in common, wherever the workers are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import __version__
from ..errors import reason_of
from ..io.guards import counted
from .jobs import BatchJob, Record, check_version, hash_of, run_job

__all__ = ["Call", "Done", "Ending", "Failed", "Killed", "Piece", "Team", "Worker", "run_piece"]

ALLOWED_KILLS = 3
"""Workers that may end with a task at work before it is given up."""

Piece = tuple[Any, ...]
"""The number of a piece of work, and whatever else the work is called with."""

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
    """A call at which so many workers ended."""

    n_workers: int

    def __str__(self) -> str:
        n_workers = counted(self.n_workers, "worker")
        return f"KilledWorker: {n_workers} ended with this file at work (out of memory?)"


Ending = Done | Failed | Killed


@dataclass(frozen=True)
class Worker:
    """A process of a team."""

    address: str
    n_threads: int
    memory: float
    """Bytes that it may use; infinite if nothing limits it."""


class Team(ABC):
    """Workers, in processes of their own.

    Parameters
    ----------
    workers : sequence of Worker
        At least one.
    """

    def __init__(self, workers: Sequence[Worker]) -> None:
        self.workers = tuple(workers)

    @abstractmethod
    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Yield the places of calls with what came of them, as they end.

        A call is made again where its worker was killed. With a `width`, so many are at work.

        Raises
        ------
        ConnectionError
            If no worker is left, or none can be started.
        """

    @property
    def share(self) -> float:
        """Bytes that every file may need if each thread of each worker has one."""
        return min(worker.memory / worker.n_threads for worker in self.workers)

    def do_together(self, jobs: Sequence[BatchJob]) -> Iterator[tuple[BatchJob, Record | Killed]]:
        """Yield jobs with their records as they end, one at a time on each thread of a worker.

        Raises
        ------
        OSError
            If no worker is left, the scheduler is gone, or a job says that the batch cannot go on.
        """
        yield from self._do([job.with_threads(1) for job in jobs], width=None)

    def do_alone(self, jobs: Sequence[BatchJob]) -> Iterator[tuple[BatchJob, Record | Killed]]:
        """Likewise, but one after the other, each on all threads of a worker."""
        n_threads = min(worker.n_threads for worker in self.workers)
        yield from self._do([job.with_threads(n_threads) for job in jobs], width=1)

    def _do(
        self, jobs: Sequence[BatchJob], width: int | None
    ) -> Iterator[tuple[BatchJob, Record | Killed]]:
        for place, ending in self.run([(run_job, (job,)) for job in jobs], width):
            job = jobs[place]
            if isinstance(ending, Killed):
                yield job, ending
            elif isinstance(ending, Done):
                yield job, ending.value
            elif isinstance(ending.error, OSError):  # the batch cannot go on
                raise ending.error
            else:  # such as a record that cannot be pickled
                error = reason_of(ending.error)
                yield job, {**job.head, "sha256": hash_of(job.path), "error": error}

    def map(
        self, work: Callable[..., Any], store: Any, jobs: Sequence[Piece]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the places of jobs with ``work(store, *job)`` as they end, one on each thread.

        Raises
        ------
        OSError
            If no worker is left, the scheduler is gone, or workers were killed with one piece at
            work time and again. What the work raises is raised as it is.
        """
        calls = [(run_piece, (__version__, work, store, job)) for job in jobs]
        for place, ending in self.run(calls, width=None):
            if isinstance(ending, Failed):
                raise ending.error
            if isinstance(ending, Killed):
                n_workers = counted(ending.n_workers, "worker")
                raise ConnectionError(
                    f"{n_workers} ended with piece {jobs[place][0]} at work (out of memory?): take"
                    " smaller tiles, or fewer workers"
                )
            yield place, ending.value


def run_piece(version: str, work: Callable[..., Any], store: Any, job: Piece) -> Any:
    """Do the work of a `Team.map` here, if this process has the version of who asks for it."""
    check_version(version)
    return work(store, *job)
