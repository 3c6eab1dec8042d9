"""How the command `superfacets` starts: Ctrl-C is one line from here on.

It is a package of its own, as Python runs all of ``superfacets/__init__.py``, which takes a while,
before any module of that package.
"""

from __future__ import annotations

import os
import signal
from typing import NoReturn

__all__ = ["main"]

EXIT_INTERRUPTED = 130


def main() -> NoReturn:
    """Import the command, and run it."""
    is_heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_heard:  # not where the shell has it ignored
        signal.signal(signal.SIGINT, _end)
    from superfacets.cli.main import main as run

    if is_heard:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()


def _end(*_: object) -> NoReturn:
    # No exception: extension modules make another one of it while they are imported.
    os.write(2, b"superfacets: error: interrupted\n")
    os._exit(EXIT_INTERRUPTED)
