"""Long studies: tasks in worker processes, a record for each piece of work, and resumption.

A task groups pieces of work that share something, such as a mesh that is loaded once. Each piece
writes a record, also if it fails, so a second start runs only missing and failed pieces.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from .._memory import free_memory
from ..errors import reason_of
from ..io.atomic import atomic_outputs
from ..workers.calls import Done, Failed, Killed
from ..workers.pool import open_pool

Key = Mapping[str, Any]
"""Everything that a record depends on. A record with another key is stale."""

Record = dict[str, Any]
"""The results of a piece; or, if it failed, the cause under "reason"."""

_MEMORY_SHARE = 0.8
"""Fraction of the free memory that tasks may use; the rest is for other programs."""


class Job(Protocol):
    """A job for a worker. The job and its result are pickled."""

    @property
    def memory(self) -> int:
        """Estimated memory in bytes; 0 if it is small."""

    def run(self) -> Any:
        """Run the job."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A unit of work, with the path and key of its record."""

    subject: Any
    """The input of the piece; only the task interprets it."""
    path: Path
    key: Key


class Task(Protocol):
    """Pieces that one worker does in sequence. Tasks are pickled to send them to workers."""

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """The pieces of work."""

    @property
    def memory(self) -> int:
        """Estimated memory in bytes; 0 if it is small."""

    def prepare(self) -> Callable[[Piece], Record]:
        """Do the work that all pieces share; return the function that makes the record of a piece.

        An exception of `prepare` fails all pieces; an exception of the function fails one.
        """


def run_tasks(
    title: str, tasks: Sequence[Task], n_workers: int, *, memory: int, deadline: float | None = None
) -> dict[Path, str]:
    """Run tasks until all have ended; their pieces then have records.

    A progress bar with this title is shown on a terminal. `memory` is the number of bytes that
    running tasks may need together; a task that needs more runs alone. No task is started after
    `deadline`, by `time.monotonic`. Returns the reasons why records could not be written, by path.
    """
    lost: dict[Path, str] = {}
    jobs = [_Recording(task, deadline) for task in tasks]
    for job, result in run_shown(title, jobs, n_workers, memory=memory):
        lost |= _record_death(job.task, result) if isinstance(result, Killed) else result
    return lost


def read_piece(piece: Piece) -> Record | None:
    """Return the record of a piece; None if it is missing, damaged or stale."""
    return read_record(piece.path, piece.key)


def outcome_of(piece: Piece, lost: Mapping[Path, str]) -> Record | None:
    """Return the record of a piece, with the reason if it failed or is `lost`; None if missing."""
    return {"reason": lost[piece.path]} if piece.path in lost else read_piece(piece)


@dataclass(frozen=True)
class _Recording:
    """A task as a job. Its result maps paths of records that could not be written to the causes."""

    task: Task
    deadline: float | None = None
    """Time after which the task is not started, by `time.monotonic`, which all processes share."""

    @property
    def memory(self) -> int:
        return self.task.memory

    def run(self) -> dict[Path, str]:
        lost: dict[Path, str] = {}
        if self.deadline is not None and time.monotonic() >= self.deadline:
            return lost
        for piece in self.task.pieces:
            _forget_failure(piece)
        try:
            make = self.task.prepare()
        except Exception as error:  # any exception is recorded, and other tasks go on
            for piece in self.task.pieces:
                lost |= _record_failure(piece, reason_of(error))
            return lost
        for piece in self.task.pieces:
            try:
                write_record(piece.path, piece.key, make(piece))
            except Exception as error:
                lost |= _record_failure(piece, reason_of(error))
        return lost


def _forget_failure(piece: Piece) -> None:
    """Remove the record of an earlier failure, which would hide that the worker was killed now."""
    record = read_piece(piece)
    if record is not None and "reason" in record:
        with contextlib.suppress(OSError):
            piece.path.unlink()


def _record_failure(piece: Piece, reason: str) -> dict[Path, str]:
    """Write the reason of a failure as the record of the piece.

    Returns the error by path of the record if the record cannot be written, else no entry.
    """
    try:
        write_record(piece.path, piece.key, {"reason": reason})
    except OSError as error:
        return {piece.path: f"no record can be written: {reason_of(error)}"}
    return {}


def _record_death(task: Task, death: Killed) -> dict[Path, str]:
    """Write a failure, as the record, for each piece of a killed worker that has no record yet."""
    lost: dict[Path, str] = {}
    for piece in task.pieces:
        if read_piece(piece) is None:
            lost |= _record_failure(piece, str(death))
    return lost


def run_shown(
    title: str, jobs: Sequence[Job], n_workers: int, *, memory: int
) -> Generator[tuple[Any, Any], None, None]:
    """Yield each job with its result when it ends, and show a progress bar on a terminal.

    If the worker of a job was killed, the result is a `Killed`. If a job raises an error, it is
    raised here. Jobs start in their order, but a job waits if it does not fit into the memory
    beside the running ones.
    """
    from tqdm import tqdm

    def fits(place: int, at_work: Sequence[int]) -> bool:
        room = memory - sum(jobs[other].memory for other in at_work)
        return not at_work or jobs[place].memory == 0 or jobs[place].memory <= room

    with (
        open_pool(n_workers, memory=math.inf, allowed_kills=0) as pool,
        tqdm(total=len(jobs), desc=title, unit="task", disable=None, leave=False) as bar,
    ):
        for place, ending in pool.run([(_run, (job,)) for job in jobs], admits=fits):
            if isinstance(ending, Failed):
                raise ending.error
            yield jobs[place], ending.value if isinstance(ending, Done) else ending
            bar.update()


def _run(job: Job) -> Any:
    return job.run()


def memory_of_tasks() -> int:
    """Bytes that tasks may use together."""
    return int(_MEMORY_SHARE * free_memory())


def write_record(path: Path, key: Key, record: Record) -> None:
    """Write a record atomically: whenever the process ends, it is complete or absent.

    A ValueError if a number is not finite; an OSError if the record cannot be written.
    """
    whole = {"checksum": _checksum(key, record), "key": key, "record": record}
    text = json.dumps(whole, indent=1, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(text + "\n", encoding="utf-8")


def read_record(path: Path, key: Key) -> Record | None:
    """Return a record; None if it is missing, damaged, or made from another key."""
    try:
        whole = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(whole, dict) or whole.get("key") != key:
        return None
    record = whole.get("record")
    if not isinstance(record, dict) or whole.get("checksum") != _checksum(key, record):
        return None
    return record


def _checksum(key: Key, record: Record) -> str:
    text = json.dumps([key, record], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
