"""Handle signals, and run work in a thread, so that Ctrl-C works while the C++ core computes."""

from __future__ import annotations

import _thread
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import NoReturn, TypeVar

EXIT_INTERRUPTED = 130  # exit status after Ctrl-C, as in shells
INTERRUPTED = "interrupted"  # message after Ctrl-C
# Signals that end the command as Ctrl-C does. Windows has no SIGHUP.
_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
GRACE = 3.0  # seconds for cleaning up after a signal; ending worker processes takes 0.3 seconds


def end_at_signals() -> None:
    """Make Ctrl-C, SIGTERM and SIGHUP end the process immediately, while modules are imported.

    The import system could swallow a KeyboardInterrupt, or change the exit status. Signals that are
    ignored when the process starts, such as SIGHUP under nohup, stay ignored.
    """
    for number in (signal.SIGINT, *_ENDING):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def hear_signals() -> None:
    """Make signals raise a KeyboardInterrupt after `end_at_signals`, so that files are cleaned up.

    Only the first SIGTERM or SIGHUP raises: `timeout` sends a second one during the clean-up.
    """
    for number in (signal.SIGINT, *_ENDING):
        if signal.getsignal(number) is _end:
            signal.signal(number, _interrupt if number in _ENDING else signal.default_int_handler)
    sys.unraisablehook = _raise_again


def _interrupt(*_: object) -> NoReturn:
    for number in _ENDING:
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, lambda *_: None)  # child processes would inherit SIG_IGN
    raise KeyboardInterrupt


def _raise_again(ignored: sys.UnraisableHookArgs) -> None:
    """Repeat a KeyboardInterrupt that Python has ignored, such as one raised in a finalizer."""
    if issubclass(ignored.exc_type, KeyboardInterrupt):
        threading.Timer(0.1, _thread.interrupt_main).start()  # this function would ignore it, too
    else:
        sys.__unraisablehook__(ignored)


@contextlib.contextmanager
def soon_ended() -> Iterator[None]:
    """After a signal, end the process if the `with` block does not finish within `GRACE` seconds.

    Python runs signal handlers only between two bytecode instructions. A single instruction may
    block for very long, if it reads from a dead network drive or computes in the C++ core.
    """
    import socket  # slow to import

    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    is_over = threading.Event()

    def watch() -> None:
        with ours:
            while received := ours.recv(1):
                if received[0] in (signal.SIGINT, *_ENDING) and not is_over.wait(GRACE):
                    _end()

    threading.Thread(target=watch, daemon=True).start()
    before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    try:
        yield
    finally:
        is_over.set()
        signal.set_wakeup_fd(before)
        theirs.close()


def _end(*_: object) -> NoReturn:
    with contextlib.suppress(OSError):  # standard error may be closed
        os.write(2, f"superfacets: error: {INTERRUPTED}\n".encode())
    os._exit(EXIT_INTERRUPTED)


T = TypeVar("T")
_NAME = "superfacets-work"  # name of the threads of `run_in_background`


def run_in_background(work: Callable[[], T], *, is_shown: bool = True) -> T:
    """Run `work` in a thread, and return its result or raise its error.

    If `is_shown`, a terminal shows progress meanwhile. A KeyboardInterrupt ends only the waiting:
    the thread continues until the process ends. Therefore `work` must not write files.
    """
    from concurrent.futures import Future  # slow to import

    import click  # importing it earlier would end the process differently on Ctrl-C

    from .progress import Progress

    found: Future[T] = Future()
    context = click.get_current_context(silent=True)

    def body() -> None:
        try:
            with context.scope(cleanup=False) if context else contextlib.nullcontext():
                found.set_result(work())
        except BaseException as error:
            found.set_exception(error)

    thread = threading.Thread(target=body, name=_NAME, daemon=True)
    thread.start()
    with Progress() if is_shown else contextlib.nullcontext():
        while thread.is_alive():
            thread.join(0.1)  # without a timeout, Windows blocks Ctrl-C
    return found.result()


def is_busy() -> bool:
    """Return whether a thread of `run_in_background` is still running."""
    return any(thread.name == _NAME for thread in threading.enumerate())
