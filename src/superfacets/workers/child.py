"""The code that runs in a worker process of this machine; nothing here takes long to import."""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import signal
import threading
from importlib import import_module
from multiprocessing.connection import Connection

from ..errors import reason_of

__all__ = ["begin", "hello", "make_call"]

TICK = 0.1
"""Seconds between looks at the memory of this process."""


def begin(life: Connection, n_threads: int, memory: float) -> None:
    """Prepare a new worker.

    Parameters
    ----------
    life : Connection
        The worker ends, even amid a call, when the other end is closed: by the team, or by the
        end of its process.
    n_threads : int
        Threads of the core.
    memory : float
        Bytes. A worker that uses more ends at once.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the team hears it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # not as the process that it was forked from
    os.environ["SUPERFACETS_NUM_THREADS"] = str(n_threads)  # also for reading and writing
    threading.Thread(target=_watch, args=(life, memory), daemon=True).start()


def _watch(life: Connection, memory: float) -> None:
    if memory < math.inf:
        own = import_module("psutil").Process()
        while not life.poll(TICK):
            if own.memory_info().rss > memory:
                os._exit(1)
    life.poll(None)
    os._exit(0)


def hello() -> None:
    """Return: this process is there."""


def make_call(call: bytes) -> tuple[bool, bytes]:
    """Make a pickled `Call`; return whether it returned, and its pickled result or error."""
    try:
        function, arguments = pickle.loads(call)
        return True, pickle.dumps(function(*arguments))
    except BaseException as error:  # of any kind: it is raised where the call came from
        return False, _pickled(error)


def _pickled(error: BaseException) -> bytes:
    """The error, or its text if it cannot be sent as it is, or would end the process there."""
    with contextlib.suppress(Exception):
        data = pickle.dumps(error)
        if isinstance(pickle.loads(data), Exception):  # some need arguments that they do not keep
            return data
    return pickle.dumps(RuntimeError(reason_of(error)))
