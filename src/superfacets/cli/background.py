"""Work in a thread of its own, so that Ctrl-C is heard while the core computes.

Python handles signals in the main thread, between two of its instructions. A kernel of the core is
one instruction that can take seconds.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_NAME = "superfacets-work"

SECONDS_BETWEEN_TICKS = 0.1
"""Ten times a second a bar seems to move, and an interrupt to take effect at once."""


def run_in_background(work: Callable[[], T], tick: Callable[[], object] | None = None) -> T:
    """Return what `work` returns, or raise what it raises, and call `tick` while it runs.

    An interrupt ends the waiting, not the work: it goes on until the process ends, and so must not
    write files.
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
