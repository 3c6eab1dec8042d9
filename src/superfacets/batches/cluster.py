"""Define `RemoteTeam`, which runs calls on the workers of a Dask scheduler."""

from __future__ import annotations

import contextlib
import gc
import importlib
import logging
import math
import os
import time
from collections import deque
from collections.abc import Iterator, Sequence
from importlib import metadata
from queue import Empty, SimpleQueue
from typing import Any

from .. import __version__
from .._validate import counted
from ..errors import import_extra, reason_of
from ..workers.calls import Call, Done, Ending, Failed, Killed, Team, Worker

PATIENCE = 60.0
"""Maximum time in seconds to wait while there is no worker. A worker restarts in about 2 seconds,
but a job scheduler may need longer to start a worker."""

TICK = 1.0
"""Interval between updates of the list of workers, in seconds."""

GATHER_TIMEOUT = 10.0
"""Maximum time to receive a result from a worker, in seconds. Results are only a few kilobytes."""

CONNECT_TIMEOUT = 10.0
"""Maximum time to connect to a scheduler, in seconds."""


class RemoteTeam(Team):
    """All workers of a Dask scheduler as a `Team`, controlled by a `distributed.Client`."""

    def __init__(self, client: Any) -> None:
        facts = sorted(client.run(_facts_of).items())
        super().__init__([Worker(address, *of_worker) for address, of_worker in facts])
        self.client = client

    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Run calls like `Team.run`.

        At most `width` calls are submitted at a time. If `width` is None, the maximum is one call
        per thread, plus one waiting call per worker. No more calls are submitted, because if a
        worker dies, Dask counts a failure for all calls assigned to the worker, even for calls that
        have not started. Calls are not pinned to workers, because Dask does not restart a pinned
        call if its worker ends while there is no other worker.
        """
        waiting = deque(range(len(calls)))
        running: dict[str, tuple[Any, int]] = {}
        ended: SimpleQueue[Any] = SimpleQueue()
        presence = _Presence(self.client)
        try:
            while waiting or running:
                n_threads = presence.n_threads()
                room = n_threads + len(self.workers) if width is None else width
                while waiting and len(running) < room:
                    place = waiting.popleft()
                    function, arguments = calls[place]
                    future = self.client.submit(function, *arguments, pure=False)
                    running[future.key] = (future, place)
                    future.add_done_callback(ended.put)
                try:
                    future = ended.get(timeout=TICK)
                except Empty:
                    continue
                ending = _ending_of(future)
                if ending is None:
                    future.add_done_callback(ended.put)
                    continue
                yield running.pop(future.key)[1], ending
        finally:
            with contextlib.suppress(Exception):  # the scheduler may have ended
                self.client.cancel([future for future, _ in running.values()])


@contextlib.contextmanager
def remote_team(address: str, folder: str) -> Iterator[RemoteTeam]:
    """Connect to the Dask scheduler at `address`, and yield its workers as a team.

    Raises a ConnectionError if there is no scheduler or no worker, or if a worker cannot access
    `folder` or has another version of the package.
    """
    distributed = import_extra("distributed", "a Dask scheduler", "batch")
    with contextlib.ExitStack() as stack:
        stack.enter_context(_silenced())
        client = stack.enter_context(_connected(distributed, address))
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ConnectionError(f"the scheduler at {address} has no workers: start one") from None
        _check_versions(client)
        _check_sees(client, folder)
        yield RemoteTeam(client)


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = reason_of(error)
    # Garbage collection closes the failed client now, because closing it later, while another
    # client starts, would cause a deadlock.
    gc.collect()
    raise ConnectionError(f"cannot connect to a Dask scheduler at {address}: {reason}")


def _check_versions(client: Any) -> None:
    # Workers may lack this package, so they run a function of the standard library.
    found = client.run(metadata.version, "superfacets", on_error="return")
    for address, version in sorted(found.items()):
        if isinstance(version, BaseException):
            raise ConnectionError(f"the worker at {address} has no superfacets: install it there")
        if version != __version__:
            raise ConnectionError(
                f"the worker at {address} has superfacets {version}, but this process has"
                f" {__version__}: install the same version on both"
            )


def _check_sees(client: Any, folder: str) -> None:
    for address, is_seen in sorted(client.run(os.path.isdir, folder).items()):
        if not is_seen:
            raise ConnectionError(
                f"the worker at {address} cannot access the folder {folder}: use a shared folder"
                " that has the same path on all machines"
            )


def _facts_of(dask_worker: Any) -> tuple[int, float]:
    """Return the number of threads of the calling worker, and its memory limit in bytes."""
    return dask_worker.state.nthreads, dask_worker.memory_manager.memory_limit or math.inf


def _ending_of(future: Any) -> Ending | None:
    """Return the outcome of a call, or None if the result was lost and Dask repeats the call.

    Raises a ConnectionError if the connection to the scheduler was lost.
    """
    if future.cancelled():
        raise _scheduler_lost()
    killed = importlib.import_module("distributed").KilledWorker
    try:
        return Done(future.result(timeout=GATHER_TIMEOUT))
    except TimeoutError as error:
        return Failed(error) if future.status == "error" else None
    except OSError as error:
        if future.status == "error":
            return Failed(error)
        raise _scheduler_lost() from None
    except killed as error:
        return Killed(error.allowed_failures + 1)
    except Exception as error:  # raised by the call or by pickling its result
        return Failed(error)


def _scheduler_lost() -> ConnectionError:
    return ConnectionError(
        "the connection to the Dask scheduler was lost: restart the scheduler and its workers, then"
        " run again"
    )


class _Presence:
    """Counts the threads of all workers of the scheduler, at most once every `TICK` seconds."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._looked = -math.inf
        self._seen = time.monotonic()
        self._n_threads = 0

    def n_threads(self) -> int:
        """Return the latest count; raise a ConnectionError if it was 0 for `PATIENCE` seconds."""
        now = time.monotonic()
        if now < self._looked + TICK:
            return self._n_threads
        try:
            self._n_threads = sum(self._client.nthreads().values())
        except OSError:
            raise _scheduler_lost() from None
        self._looked = now
        if self._n_threads:
            self._seen = now
        elif now > self._seen + PATIENCE:
            seconds = counted(round(PATIENCE), "second")
            raise ConnectionError(f"there were no workers for {seconds}: start one")
        return self._n_threads


@contextlib.contextmanager
def _silenced() -> Iterator[None]:
    """Suppress log messages of Dask, because Dask also raises its errors as exceptions."""
    names = [
        name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"
    ]
    loggers = [logging.getLogger(name) for name in names]  # each logger has its own level
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
