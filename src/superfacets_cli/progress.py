"""Show on a terminal that a command works."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterator
from typing import ClassVar, Self

import click

from .failures import CLEAR, is_quiet

NAMES = {"mesh": "reading", "face_graph": "face graph", "export": "writing"}
"""Names of stages on the terminal, where they differ from the keys of timings."""


class Progress:
    """A line on stderr with the stage of the work and the seconds since its beginning.

    The line appears after `DELAY` seconds, and only if stderr is a terminal and the command is not
    quiet. It is drawn by a thread, because the work may be a single call of the C++ core.
    """

    DELAY: ClassVar[float] = 2.0
    STEP: ClassVar[float] = 0.5  # seconds between updates of the line

    def __init__(self, name: str = "") -> None:
        self._name, self._stage = f"{name}: " if name else "", "working"

    def __enter__(self) -> Self:
        self._begin, self._is_done = time.monotonic(), threading.Event()
        self._thread = threading.Thread(target=self._draw, daemon=True)
        if sys.stderr is not None and sys.stderr.isatty() and not is_quiet():
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_done.set()
        if self._thread.ident is not None:
            self._thread.join()

    def on_report(self, stage: str, n_iter: int = 0, _n_moved: int = 0) -> None:
        """Show that a stage begins, or that an iteration has ended (a `Callback`)."""
        self._stage = f"iteration {n_iter}" if n_iter else NAMES.get(stage, stage)

    @contextlib.contextmanager
    def timed(self, stage: str, timings: dict[str, float]) -> Iterator[None]:
        """Show that a stage begins, and store the time of the with block in `timings`."""
        self.on_report(stage)
        begin = time.perf_counter()
        yield
        timings[stage] = time.perf_counter() - begin

    def _draw(self) -> None:
        """Draw the line until the work ends, and then clear it."""
        import shutil  # slow to import

        wait, width = self.DELAY, 0
        while not self._is_done.wait(wait):
            wait, width = self.STEP, shutil.get_terminal_size().columns - 1
            text = f"{self._name}{self._stage}, {time.monotonic() - self._begin:.0f} s"
            click.echo(f"{CLEAR}{text[:width]}", err=True, nl=False)
        if width:
            click.echo(CLEAR, err=True, nl=False)
