"""The team of the workers of a Dask scheduler."""

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
from ..errors import import_extra, reason_of
from ..workers.calls import Call, Done, Ending, Failed, Killed, Team, Worker

PATIENCE = 60.0
"""Seconds to wait while there is no worker. A worker restarts in about 2 seconds; a batch queue may
need longer."""

TICK = 1.0
"""Seconds between updates of the list of workers."""

GATHER_TIMEOUT = 10.0
"""Seconds to wait for a result of a few kilobytes from a worker."""

CONNECT_TIMEOUT = 10.0
"""Seconds to wait for a scheduler."""


class RemoteTeam(Team):
    """Workers of a Dask scheduler, reached by a `distributed.Client`."""

    def __init__(self, client: Any) -> None:
        facts = sorted(client.run(_facts_of).items())
        super().__init__([Worker(address, *of_worker) for address, of_worker in facts])
        self.client = client

    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """Run calls as `Team` does: one per thread, and one more in the queue of each worker.

        The scheduler never has thousands of calls. If a worker is killed, Dask therefore blames
        only a few calls that had not begun. Calls are not tied to workers: Dask would never run the
        calls of a worker again if it ended while no other worker was present.
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
            with contextlib.suppress(Exception):  # the scheduler may be gone
                self.client.cancel([future for future, _ in running.values()])


@contextlib.contextmanager
def remote_team(address: str, folder: str) -> Iterator[RemoteTeam]:
    """Connect to a scheduler whose workers see the folder and have this version of the package.

    A ConnectionError if there is no scheduler or no worker, or if a worker is unsuitable.
    """
    distributed = import_extra("distributed", "a Dask scheduler", "batch")
    with contextlib.ExitStack() as stack:
        stack.enter_context(_silenced())
        client = stack.enter_context(_connected(distributed, address))
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ConnectionError(f"the scheduler at {address} has no workers") from None
        _check_versions(client)
        _check_sees(client, folder)
        yield RemoteTeam(client)


def _connected(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = reason_of(error)
    # Garbage collection closes the failed client. During the start of another client, this would be
    # a deadlock.
    gc.collect()
    raise ConnectionError(f"no scheduler at {address}: {reason}")


def _check_versions(client: Any) -> None:
    """Raise a ConnectionError if a worker has another version of the package."""
    # Workers may lack this package, so the function is from the standard library.
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
                f"the worker at {address} does not see the folder {folder}: use a folder that has"
                " the same path on all machines"
            )


def _facts_of(dask_worker: Any) -> tuple[int, float]:
    """Threads and memory of a worker; Dask calls this function on the worker."""
    return dask_worker.state.nthreads, dask_worker.memory_manager.memory_limit or math.inf


def _ending_of(future: Any) -> Ending | None:
    """Ending of a call; None if the result was lost with its worker and is computed again."""
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
    except Exception as error:  # raised by the call, or by pickling its result
        return Failed(error)


def _scheduler_lost() -> ConnectionError:
    return ConnectionError(
        "the scheduler is gone: restart the scheduler and its workers, then run this command again"
    )


class _Presence:
    """Number of threads of the current workers, updated at intervals."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._looked = -math.inf
        self._seen = time.monotonic()
        self._n_threads = 0

    def n_threads(self) -> int:
        """Number of threads; a ConnectionError if there was no worker for `PATIENCE` seconds."""
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
            raise ConnectionError(f"there has been no worker for {PATIENCE:.0f} seconds: start one")
        return self._n_threads


@contextlib.contextmanager
def _silenced() -> Iterator[None]:
    """Silence Dask's log messages, because errors are reported in one line here."""
    names = [
        name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"
    ]
    loggers = [logging.getLogger(name) for name in names]  # Dask sets the levels of some itself
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
