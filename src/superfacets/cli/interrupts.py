"""Ctrl-C before the command has begun its work; nothing is imported here that takes long."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from typing import NoReturn

__all__ = ["EXIT_INTERRUPTED", "INTERRUPTED", "while_importing"]

EXIT_INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""

INTERRUPTED = "interrupted"
"""What is said then."""


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


def _end(*_: object) -> NoReturn:
    with contextlib.suppress(OSError):  # standard error is closed
        os.write(2, f"superfacets: error: {INTERRUPTED}\n".encode())
    os._exit(EXIT_INTERRUPTED)
