"""The process that workers of this machine are copies of, so that all import what they need once.

Nothing is imported here that takes long: the command starts the template before it imports what it
needs itself, and a second core does both at a time.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

__all__ = ["CAN_COPY", "Template", "deaf_to_interrupts", "prepare", "take_prepared"]

CAN_COPY = sys.platform == "linux"
"""Elsewhere a copy of a process that has used the libraries of the system may not be able to."""

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Libraries read these when they are loaded: each worker has its own share of the cores, and a
process with threads cannot be copied."""

_prepared: list[Template] = []


class Template:
    """A process that imports what work takes and is then copied, once for each worker.

    Copies live on without it, and end when their connections are closed, as by the end of this
    process.
    """

    def __init__(self) -> None:
        self._requests, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            "from superfacets.batches.serving import copy_on_demand\n"
            f"copy_on_demand({theirs.fileno()})"
        )
        with theirs, deaf_to_interrupts():
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                env={**os.environ, **_ONE_THREAD},
            )

    def copy(self, n_threads: int) -> Connection:
        """Return the connection to a new worker with so many threads; an OSError if it is gone.

        It is not waited for: the worker may come later, or the connection end.
        """
        from multiprocessing.connection import Connection

        ours, theirs = socket.socketpair()
        with ours, theirs:
            socket.send_fds(self._requests, [str(n_threads).encode()], [theirs.fileno()])
            return Connection(ours.detach())

    def close(self) -> None:
        """Return when all copies have ended, and the process too: that is not made to happen."""
        self._requests.close()
        self._process.wait()

    def kill(self) -> None:
        """End the process; not its copies."""
        self._process.kill()
        self.close()


def prepare() -> None:
    """Start a template for whoever asks first, where another core can run it."""
    if CAN_COPY and len(os.sched_getaffinity(0)) > 1:
        _prepared.append(Template())
        atexit.register(_discard_prepared)


def _discard_prepared() -> None:
    """End what nobody has asked for: it holds our standard error."""
    while _prepared:
        _prepared.pop().kill()


def take_prepared() -> Template:
    """The template that was prepared, or a new one."""
    return _prepared.pop() if _prepared else Template()


@contextlib.contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Start processes that no Ctrl-C reaches: the terminal sends it to all of them.

    One that comes meanwhile is heard at the end.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
