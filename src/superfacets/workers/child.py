"""Define the main function of worker processes, in a module that must be fast to import."""

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

TICK = 0.1
"""Interval between checks of the memory of this process, in seconds."""


def serve(connection: Connection, n_threads: int, memory: float) -> NoReturn:
    """Run pickled calls until the parent process closes the connection.

    The first message to the parent process is None. Then one message follows for each call, in the
    order of the calls: whether the call returned, and its pickled result or exception. If the
    connection is closed, or if this process uses more than `memory` bytes, this process ends
    immediately, even during a call.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent process
    os.environ["SUPERFACETS_NUM_THREADS"] = str(n_threads)  # read by `checked_threads`
    gc.freeze()  # otherwise, garbage collection would write to memory shared by fork and copy it
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls, memory), daemon=True).start()
    with contextlib.suppress(OSError):
        connection.send(None)
        while True:
            connection.send(_ended(calls.get()))
    os._exit(0)


def _receive(connection: Connection, calls: SimpleQueue[bytes], memory: float) -> NoReturn:
    """Receive calls in a thread, and put them into `calls`.

    Ends the process if the connection is closed, or if the process uses more than `memory` bytes.
    """
    own = import_module("psutil").Process() if memory < math.inf else None
    with contextlib.suppress(EOFError, OSError):
        while own is None or own.memory_info().rss <= memory:
            if connection.poll(TICK):
                calls.put(connection.recv_bytes())
    os._exit(1)


def _ended(call: bytes) -> tuple[bool, bytes]:
    """Run a pickled call; return (True, pickled result) or (False, pickled exception)."""
    try:
        function, arguments = pickle.loads(call)
        return True, pickle.dumps(function(*arguments))
    except BaseException as error:  # sent to the parent process
        return False, _pickled(error)


def _pickled(error: BaseException) -> bytes:
    """Pickle an exception or, if this is impossible, a RuntimeError with the same message."""
    with contextlib.suppress(Exception):
        data = pickle.dumps(error)
        if isinstance(pickle.loads(data), Exception):  # some pickled exceptions cannot be loaded
            return data
    return pickle.dumps(RuntimeError(reason_of(error)))
