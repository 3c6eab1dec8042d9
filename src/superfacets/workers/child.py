"""The code that runs in a worker process of this machine; nothing here takes long to import."""

from __future__ import annotations

import contextlib
import gc
import math
import os
import pickle
import signal
import threading
from importlib import import_module
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import NoReturn

from ..errors import reason_of

__all__ = ["serve"]

TICK = 0.1
"""Seconds between looks at the memory of this process."""


def serve(connection: Connection, n_threads: int, memory: float) -> NoReturn:
    """Make the calls that come, until the other end of the connection is closed.

    The process ends then even amid a call: the team has closed it, or has ended itself.

    Parameters
    ----------
    connection : Connection
        Pickled calls come in. The first message sent is None, and each that follows tells of a
        call, in their order, whether it returned, and its pickled result or error.
    n_threads : int
        Threads of the core.
    memory : float
        Bytes. A process that uses more ends at once.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the team hears it
    os.environ["SUPERFACETS_NUM_THREADS"] = str(n_threads)  # also for reading and writing
    gc.freeze()  # or collections would look through, and so copy, all that was imported
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls, memory), daemon=True).start()
    with contextlib.suppress(OSError):
        connection.send(None)
        while True:
            connection.send(_ended(calls.get()))
    os._exit(0)


def _receive(connection: Connection, calls: SimpleQueue[bytes], memory: float) -> NoReturn:
    """Take calls while others are at work, and end the process when it has to end."""
    own = import_module("psutil").Process() if memory < math.inf else None
    with contextlib.suppress(EOFError, OSError):
        while own is None or own.memory_info().rss <= memory:
            if connection.poll(TICK):
                calls.put(connection.recv_bytes())
    os._exit(1)


def _ended(call: bytes) -> tuple[bool, bytes]:
    """Make a call; return whether it returned, and its pickled result or error."""
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
