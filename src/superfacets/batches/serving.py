"""What a worker process of this machine runs; nothing is imported here that takes long."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import pickle
import signal
import socket
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, NoReturn

from ..errors import reason_of

__all__ = ["copy_on_demand", "serve"]

_MODULES = ("superfacets.batches.jobs", "superfacets.io.readers.read", "superfacets.pipeline")
"""What nearly every worker needs: imported once, and there in all copies of a process."""

Task = tuple[int, bytes]
"""A number, and a pickled `Call`."""


def copy_on_demand(descriptor: int) -> NoReturn:
    """Import what work takes, and let a copy of this process serve each connection that is sent.

    Ends when nobody is there any more to send one, and all copies have ended. This process has one
    thread, and so each copy of it can do whatever a new process could.

    Parameters
    ----------
    descriptor : int
        Of a socket. A message on it is the number of threads of a worker, with the descriptor of
        the worker's connection.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _MODULES:
        importlib.import_module(name)
    gc.freeze()  # or the first collection of each worker would write to, and so copy, all memory
    with socket.socket(fileno=descriptor) as requests:
        while True:
            message, (*connections,), _, _ = socket.recv_fds(requests, 16, 1)
            if not message:
                break
            if _is_copy():
                requests.close()
                serve(Connection(connections[0]), int(message))
            os.close(connections[0])
            _reap(os.WNOHANG)
    _reap(0)
    os._exit(0)  # at once: there is nothing to be tidied


def _is_copy() -> bool:
    """Copy this process: False here, and True in the copy. False too if there can be no more."""
    try:
        return os.fork() == 0
    except OSError:  # whose connection is closed now, which is seen at its other end
        return False


def _reap(options: int) -> None:
    """Take note of copies that have ended, so that the system counts what they took."""
    with contextlib.suppress(ChildProcessError):  # there are none any more
        while os.waitpid(-1, options)[0]:
            pass


def serve(connection: Connection, n_threads: int) -> NoReturn:
    """Do the tasks that come, until nobody is there any more to send one; even amid a task.

    The first message sent is the number of the process, and each that follows (number of the task,
    whether it is done, its pickled result or error).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who sends the tasks hears it
    os.environ["SUPERFACETS_NUM_THREADS"] = str(n_threads)  # also for reading and writing
    tasks: SimpleQueue[Task] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, tasks), daemon=True).start()
    try:
        connection.send(os.getpid())
        while True:
            connection.send(_done(*tasks.get()))
    except OSError:
        os._exit(0)


def _receive(connection: Connection, tasks: SimpleQueue[Task]) -> NoReturn:
    """Take tasks while others are at work, and end the process when the other end is closed."""
    try:
        while True:
            tasks.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _done(number: int, call: bytes) -> tuple[int, bool, bytes]:
    """Do a task, and return what is to be sent."""
    try:
        function, arguments = pickle.loads(call)
        return number, True, pickle.dumps(function(*arguments))
    except Exception as error:  # of any kind: it is raised where the task came from
        return number, False, _pickled(error)


def _pickled(error: Exception) -> bytes:
    """The error, or its text if it cannot be sent as it is."""
    try:
        data = pickle.dumps(error)
        pickle.loads(data)  # some need arguments that they do not keep
    except Exception:
        return pickle.dumps(RuntimeError(reason_of(error)))
    return data


def result_of(is_done: bool, data: bytes) -> Any:
    """The result in a message of a worker, or the error, which is raised."""
    value = pickle.loads(data)
    if not is_done:
        raise value
    return value
