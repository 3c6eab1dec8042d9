"""Clean exit on signals: Ctrl-C, SIGTERM, and SIGHUP, which a closed terminal sends.

Nothing is imported here that takes long.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Iterator
from typing import NoReturn

EXIT_INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""

INTERRUPTED = "interrupted"
"""What is said then."""

_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that end the command as Ctrl-C does. Windows has no SIGHUP."""

GRACE = 3.0
"""Seconds for cleaning up after such a signal. Ending workers takes 0.3."""


def hear_signals() -> None:
    """Let SIGTERM and SIGHUP raise a KeyboardInterrupt, so that temporary files are removed.

    Only the first of them does: `timeout` sends two, and the second would cut the removal short. A
    signal that the process was started to ignore stays ignored, as SIGHUP under nohup.
    """
    for number in _ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


@contextlib.contextmanager
def while_importing() -> Iterator[None]:
    """Let these signals end the process at once, with the message and status of later interrupts.

    An error that is raised amid imports may be lost there, or change the exit status.
    """
    if threading.current_thread() is not threading.main_thread():  # others cannot set handlers
        yield
        return
    raising = (signal.default_int_handler, _interrupt)  # other handlers are the parent's wish
    heard = {
        number: handler
        for number in (signal.SIGINT, *_ENDING)
        if (handler := signal.getsignal(number)) in raising
    }
    for number in heard:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number, handler in heard.items():
            signal.signal(number, handler)


def _interrupt(*_: object) -> NoReturn:
    for number in _ENDING:
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, _ignore)
    raise KeyboardInterrupt


def _ignore(*_: object) -> None:
    """Ignore a signal. Unlike SIG_IGN, child processes do not inherit this."""


@contextlib.contextmanager
def soon_ended() -> Iterator[None]:
    """Let a signal end the process if the block has not ended a few seconds later.

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
            if received[0] in (signal.SIGINT, *_ENDING) and not is_over.wait(GRACE):
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
