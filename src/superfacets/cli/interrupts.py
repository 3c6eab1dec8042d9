"""Signals, and work in a separate thread, so that Ctrl-C is handled while the core computes."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from typing import NoReturn, TypeVar

EXIT_INTERRUPTED = 130
"""Exit status after Ctrl-C, as in shells."""

INTERRUPTED = "interrupted"
"""Message after Ctrl-C."""

_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that end the command as Ctrl-C does. Windows has no SIGHUP."""

GRACE = 3.0
"""Seconds for cleaning up after a signal. Ending worker processes takes 0.3 seconds."""


def hear_signals() -> None:
    """Let SIGTERM and SIGHUP raise a KeyboardInterrupt, so that temporary files are removed.

    Only the first signal does this, because `timeout` sends two, and the second would interrupt the
    removal. A signal that this process was started to ignore, such as SIGHUP under nohup, stays
    ignored.
    """
    for number in _ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


@contextlib.contextmanager
def while_importing() -> Iterator[None]:
    """Let Ctrl-C, SIGTERM and SIGHUP end the process at once, with the usual message and status.

    A KeyboardInterrupt raised during an import may be lost there, or change the exit status.
    """
    if threading.current_thread() is not threading.main_thread():  # which alone may set handlers
        yield
        return
    raising = (signal.default_int_handler, _interrupt)  # other handlers are kept
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
    """Let a signal end the process if the block has not ended within `GRACE` seconds.

    Python handles signals only between two of its instructions. An instruction may take forever
    when it reads from a dead network drive, or computes in the core.
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


T = TypeVar("T")

_NAME = "superfacets-work"
"""Name of the threads of `run_in_background`."""

SECONDS_BETWEEN_TICKS = 0.1
"""Seconds between two calls of `tick`: short enough for a moving bar and a quick interrupt."""


def run_in_background(work: Callable[[], T], tick: Callable[[], object] | None = None) -> T:
    """Return the result of `work`, or raise its error, and call `tick` while it runs.

    A KeyboardInterrupt ends the waiting but not the work, which continues until the process ends.
    So `work` must not write files.
    """
    results: list[T] = []
    errors: list[BaseException] = []
    is_done = threading.Event()

    def body() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)
        finally:
            is_done.set()

    threading.Thread(target=body, name=_NAME, daemon=True).start()
    while not is_done.wait(SECONDS_BETWEEN_TICKS):
        if tick is not None:
            tick()
    if errors:
        raise errors.pop()
    return results.pop()


def is_busy() -> bool:
    """Whether abandoned work is still running."""
    return any(thread.name == _NAME for thread in threading.enumerate())
