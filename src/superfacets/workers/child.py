"""Code of a worker process. Its imports must be fast."""

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
"""Seconds between checks of the memory of this process."""


def serve(connection: Connection, n_threads: int, memory: float) -> NoReturn:
    """Run calls until the other end closes the connection, which also stops a running call.

    Calls arrive pickled. The first message to the other end is None. Then there is one message per
    call, in order: whether the call returned, and its pickled result or error. The process ends
    immediately if it uses more than `memory` bytes.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles it
    os.environ["SUPERFACETS_NUM_THREADS"] = str(n_threads)  # for all kernels, also in readers
    gc.freeze()  # garbage collection would write to, and so copy, all pages shared by fork
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, calls, memory), daemon=True).start()
    with contextlib.suppress(OSError):
        connection.send(None)
        while True:
            connection.send(_ended(calls.get()))
    os._exit(0)


def _receive(connection: Connection, calls: SimpleQueue[bytes], memory: float) -> NoReturn:
    """Receive calls while another call runs, and end the process if the connection closes."""
    own = import_module("psutil").Process() if memory < math.inf else None
    with contextlib.suppress(EOFError, OSError):
        while own is None or own.memory_info().rss <= memory:
            if connection.poll(TICK):
                calls.put(connection.recv_bytes())
    os._exit(1)


def _ended(call: bytes) -> tuple[bool, bytes]:
    """Run a call; return whether it returned, and its pickled result or error."""
    try:
        function, arguments = pickle.loads(call)
        return True, pickle.dumps(function(*arguments))
    except BaseException as error:  # the parent raises any error
        return False, _pickled(error)


def _pickled(error: BaseException) -> bytes:
    """The pickled error; a RuntimeError with its text if it is unpicklable or no Exception."""
    with contextlib.suppress(Exception):
        data = pickle.dumps(error)
        if isinstance(pickle.loads(data), Exception):  # fails if __init__ needs more arguments
            return data
    return pickle.dumps(RuntimeError(reason_of(error)))
