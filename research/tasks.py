"""Run long studies as tasks in worker processes, and store the results in record files.

An item (class `WorkItem`) is the smallest unit of work, for example segmenting a mesh with one
method. A task is a sequence of items that share preparation, for example loading the mesh. Each
item has a record on disk, even if it fails. If a study is started again, it runs only items that
failed or have no valid record.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Protocol

from superfacets.base.errors import reason_of
from superfacets.files.atomic import atomic_outputs
from superfacets_batch.cluster import local_client

Key = Mapping[str, Any]
"""All inputs that the result of an item depends on. If they change, the record is outdated."""

Record = dict[str, Any]
"""Results of an item. The record of a failed item contains only the entry "reason"."""

_MEMORY_SHARE = 0.8
"""Fraction of the free memory that tasks may use. The remaining memory is for other programs."""


class WorkerJob(Protocol):
    """A job for a worker process. The job and its result are sent between processes by pickle."""

    @property
    def memory(self) -> int:
        """Estimated memory in bytes, or 0 if it is small. A job with 0 never waits for memory."""

    def run(self) -> Any:
        """Run the job, and return its result."""


@dataclass(frozen=True, eq=False)
class WorkItem:
    """The smallest unit of work in a study, and the path and key of the record of its results."""

    subject: Any  # input of the item; its type depends on the task
    path: Path
    key: Key


class Task(Protocol):
    """A sequence of items, which one worker processes. Tasks are pickled and sent to workers."""

    @property
    def items(self) -> tuple[WorkItem, ...]:
        """Items of the task, in the order of processing."""

    @property
    def memory(self) -> int:
        """Estimated memory in bytes, or 0 if it is small. A task with 0 never waits for memory."""

    def prepare(self) -> Callable[[WorkItem], Record]:
        """Do the work that all items share, and return a function that processes one item.

        The returned function returns the record of the item. If it raises an exception, only this
        item fails. If `prepare` itself raises an exception, all items fail.
        """


def run_tasks(
    title: str, tasks: Sequence[Task], n_workers: int, *, memory: int, deadline: float | None = None
) -> dict[Path, str]:
    """Run tasks in worker processes, and write the records of their items.

    `title` and `memory` are as for `run_shown`. No task is started after `deadline`, in seconds of
    `time.monotonic`. Returns a dict with the path of each record that could not be written, and the
    reason.
    """
    lost: dict[Path, str] = {}
    jobs = [_TaskJob(task, deadline) for task in tasks]
    for job, result in run_shown(title, jobs, n_workers, memory=memory):
        lost |= _record_death(job.task, result) if isinstance(result, Killed) else result
    return lost


def read_item(item: WorkItem) -> Record | None:
    """Return the record of an item, or None if the record is missing, damaged or outdated."""
    return read_record(item.path, item.key)


def outcome_of(item: WorkItem, lost: Mapping[Path, str]) -> Record | None:
    """Return the record of an item, or None if it has no valid record.

    `lost` is the result of `run_tasks`. If it contains the path of the record, a record of failure
    with the reason is returned.
    """
    return {"reason": lost[item.path]} if item.path in lost else read_item(item)


@dataclass(frozen=True)
class _TaskJob:
    """Job that runs a task, and writes its records. Its result is as for `run_tasks`."""

    task: Task
    deadline: float | None = None  # in seconds of `time.monotonic`, which is equal in all processes

    @property
    def memory(self) -> int:
        return self.task.memory

    def run(self) -> dict[Path, str]:
        lost: dict[Path, str] = {}
        if self.deadline is not None and time.monotonic() >= self.deadline:
            return lost
        for item in self.task.items:
            # Remove old records of failures. If this worker is killed, `_record_death` keeps
            # existing records, so an old record would hide the new reason.
            if "reason" in (read_item(item) or {}):
                with contextlib.suppress(OSError):
                    item.path.unlink()
        try:
            make = self.task.prepare()
        except Exception as error:  # recorded, so that the study continues
            for item in self.task.items:
                lost |= _record_failure(item, reason_of(error))
            return lost
        for item in self.task.items:
            try:
                write_record(item.path, item.key, make(item))
            except Exception as error:
                lost |= _record_failure(item, reason_of(error))
        return lost


def _record_failure(item: WorkItem, reason: str) -> dict[Path, str]:
    """Write a record with the reason of a failure.

    Returns an empty dict, or {path: error} if this record cannot be written.
    """
    try:
        write_record(item.path, item.key, {"reason": reason})
    except OSError as error:
        return {item.path: f"the record could not be written: {reason_of(error)}"}
    return {}


def _record_death(task: Task, death: Killed) -> dict[Path, str]:
    """After a worker was killed, write a record of failure for each item without a valid record.

    Returns a dict with the path of each record that could not be written, and the reason.
    """
    lost: dict[Path, str] = {}
    for item in task.items:
        if read_item(item) is None:
            lost |= _record_failure(item, str(death))
    return lost


@dataclass(frozen=True)
class Killed:
    """Result of a job whose worker ended."""

    def __str__(self) -> str:
        return "KilledWorker: a worker ended during this job (out of memory?)"


def run_shown(
    title: str, jobs: Sequence[WorkerJob], n_workers: int, *, memory: int
) -> Generator[tuple[Any, Any], None, None]:
    """Run jobs, and yield (job, result) when a job ends.

    A progress bar with `title` is shown in a terminal. With one worker, jobs run in this process.
    With more, they run in worker processes of Dask: if the worker of a job ended, the result is a
    `Killed`. An error of a job is raised again. The estimates of memory of all running jobs add up
    to at most `memory` bytes, except that a job that needs more may run alone. Jobs start in
    order, but later jobs that fit may overtake a job that waits for memory.
    """
    from tqdm import tqdm

    with tqdm(total=len(jobs), desc=title, unit="task", disable=None, leave=False) as bar:
        if n_workers == 1:
            ends: Iterator[tuple[WorkerJob, Any]] = ((job, job.run()) for job in jobs)
        else:
            ends = _on_workers(jobs, n_workers, memory)
        for end in ends:
            yield end
            bar.update()


def _on_workers(
    jobs: Sequence[WorkerJob], n_workers: int, memory: int
) -> Iterator[tuple[WorkerJob, Any]]:
    """Run jobs in worker processes; repeat a job whose worker ended once, alone, at the end."""
    from distributed import KilledWorker

    ended: SimpleQueue[Any] = SimpleQueue()
    waiting, again, running = list(jobs), list[WorkerJob](), dict[str, WorkerJob]()
    with local_client(n_workers) as client:

        def submit(job: WorkerJob) -> None:
            future = client.submit(job.run, pure=False)
            running[future.key] = job
            future.add_done_callback(ended.put)

        while waiting or running or again:
            for job in [*waiting]:
                used = sum(other.memory for other in running.values())
                fits = not running or job.memory == 0 or used + job.memory <= memory
                if fits and len(running) < n_workers:
                    waiting.remove(job)
                    submit(job)
            is_last = not running
            if is_last:
                submit(again.pop())
            future = ended.get()
            job = running.pop(future.key)
            try:
                yield job, future.result()
            except KilledWorker:
                if is_last:
                    yield job, Killed()
                else:
                    again.append(job)


def memory_of_tasks() -> int:
    """Return how much memory, in bytes, all running tasks may use in total."""
    import psutil

    return int(_MEMORY_SHARE * psutil.virtual_memory().available)


def write_record(path: Path, key: Key, record: Record) -> None:
    """Write a record atomically, so that the file is never incomplete.

    Raises ValueError if a number is not finite, and OSError if the record cannot be written.
    """
    whole = {"checksum": _checksum(key, record), "key": key, "record": record}
    text = json.dumps(whole, indent=1, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(text + "\n", encoding="utf-8")


def read_record(path: Path, key: Key) -> Record | None:
    """Return the record in a file, or None if the file is missing, damaged, or has another key."""
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
