"""Ctrl-C where Python does not handle it in time; nothing is imported here that takes long."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Iterator
from typing import NoReturn

__all__ = ["EXIT_INTERRUPTED", "INTERRUPTED", "soon_ended", "while_importing"]

EXIT_INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""

INTERRUPTED = "interrupted"
"""What is said then."""

GRACE = 3.0
"""Seconds that a command has to tidy up after Ctrl-C: ending workers takes a tenth of that."""


@contextlib.contextmanager
def while_importing() -> Iterator[None]:
    """Let Ctrl-C end the process at once, with the same words and status as later.

    An error that is raised amid imports may be lost there, or change the exit status.
    """
    is_main = threading.current_thread() is threading.main_thread()  # others cannot set it
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield  # whoever has started the process wants something else, as that it is ignored
        return
    signal.signal(signal.SIGINT, _end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextlib.contextmanager
def soon_ended() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the process after a few seconds if the block has not ended then.

    Python handles signals between two of its instructions. One that reads from a dead network
    drive, or computes in the core, may take forever.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    is_over = threading.Event()

    def watch() -> None:
        while received := ours.recv(1):
            if received[0] in (signal.SIGINT, signal.SIGTERM) and not is_over.wait(GRACE):
                _end()

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    try:
        yield
    finally:
        is_over.set()
        signal.set_wakeup_fd(before)
        theirs.close()
        watcher.join()
        ours.close()


def _end(*_: object) -> NoReturn:
    with contextlib.suppress(OSError):  # standard error is closed
        os.write(2, f"superfacets: error: {INTERRUPTED}\n".encode())
    os._exit(EXIT_INTERRUPTED)
