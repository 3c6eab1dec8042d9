"""Show progress bars of commands, and estimate the finished fraction of a run."""

from __future__ import annotations

import contextlib
import math
import sys
import threading
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Self

from . import failures

if TYPE_CHECKING:
    from superfacets_batch import BatchProgress

SHARES = {
    "mesh": 0.06,
    "face_graph": 0.15,
    "weights": 0.15,
    "order": 0.13,
    "coarsen": 0.09,
    "seeding": 0.02,
    "classify": 0.20,
    "regions": 0.08,
    "export": 0.12,
}
"""Fraction of the run time that each stage takes with default options. Measured on binary PLY files
with 1 and 3 million faces, for 150 and 2,000 regions. `classify` is the whole loop."""

NAMES = {
    "mesh": "reading",
    "face_graph": "face graph",
    "classify": "iterations",
    "export": "writing",
}
"""Names of stages in the progress bar, where they differ from the keys of `SHARES`."""

ITERATIONS = 8.0
"""The bar shows a fraction of 1 - exp(-n / 8) of the loop as finished after n iterations, because
the number of iterations is not known in advance, and later iterations are shorter. On the meshes
measured for `SHARES`, the loop had 13 to 18 iterations, and the first 6 to 8 took half of its
time."""

NEARLY = 0.95
"""Largest fraction of a stage, except the loop, that the bar shows before the stage ends."""


class Estimate:
    """Estimates the finished fraction of a run from its stage and the time spent in that stage.

    `now` is the start time of the run, in seconds of any clock. `stage` is the current stage.
    """

    def __init__(self, now: float) -> None:
        self.stage = next(iter(SHARES))
        self._begin_of_run = self._begin_of_stage = now
        self._n_iterations = 0

    def begin(self, stage: str, now: float) -> None:
        """Begin a stage; the current stage and earlier stages are ignored."""
        stages = list(SHARES)
        if stages.index(stage) > stages.index(self.stage):
            self.stage = stage
            self._begin_of_stage = now

    def iterate(self, n_iterations: int) -> None:
        """Set the number of finished iterations."""
        self._n_iterations = n_iterations

    def fraction(self, now: float) -> float:
        """Return the finished fraction, 0 to 1. It never decreases unless the clock is set back."""
        done = 0.0
        for stage, share in SHARES.items():
            if stage == self.stage:
                return done + share * self._fraction_of_stage(done, share, now)
            done += share
        raise AssertionError(self.stage)

    def _fraction_of_stage(self, done: float, share: float, now: float) -> float:
        if self.stage == "classify":
            return 1.0 - math.exp(-self._n_iterations / ITERATIONS)
        spent_before = self._begin_of_stage - self._begin_of_run
        if not done or spent_before <= 0:  # no earlier stage to compare with
            return 0.0
        expected = share * spent_before / done
        return min((now - self._begin_of_stage) / expected, NEARLY)


class Bar:
    """A progress bar on stderr; hidden if stderr is no terminal, or on request."""

    layout: ClassVar[str]  # layout of the bar, as a format string for tqdm

    def __init__(self, *, is_quiet: bool = False) -> None:
        self._is_shown = not (is_quiet or failures.is_quiet()) and sys.stderr.isatty()
        self._bar: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def show(self, text: str, n_done: float, n_all: float) -> None:
        """Draw the bar with this text, and with `n_done` of `n_all` units of work finished."""
        if not self._is_shown:
            return
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(
                total=n_all, leave=False, dynamic_ncols=True, file=sys.stderr,
                bar_format=self.layout,
            )  # fmt: skip
        self._bar.set_description_str(text, refresh=False)
        self._bar.n, self._bar.total = n_done, n_all
        self._bar.refresh()


class WaitBar(Bar):
    """Line on stderr with the elapsed time, for work whose progress is unknown.

    The line appears after `DELAY` seconds.
    """

    layout = "{desc}"

    DELAY = 2.0

    def __enter__(self) -> Self:
        self._begin, self._is_done = time.monotonic(), threading.Event()
        self._thread = threading.Thread(target=self._count, daemon=True)
        if self._is_shown:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._is_done.set()
        if self._is_shown:
            self._thread.join()
        super().__exit__(*error)

    def _count(self) -> None:
        while not self._is_done.wait(self.DELAY if self._bar is None else 1.0):
            self.show(f"working, {time.monotonic() - self._begin:.0f} s", 0, 1)


class RunBar(Bar):
    """Progress bar of a run: the stage, and the estimated finished fraction."""

    layout = "{desc} {percentage:3.0f}% |{bar}| {elapsed}"

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        self._estimate = Estimate(time.perf_counter())
        self.draw()

    def on_report(self, stage: str, n_iter: int = 0, _n_moved: int = 0) -> None:
        """Show that a stage begins, or note that an iteration has ended (a `Callback`)."""
        if n_iter:
            self._estimate.iterate(n_iter)
            return
        self._estimate.begin(stage, time.perf_counter())
        self.draw()

    @contextlib.contextmanager
    def timed(self, stage: str, timings: dict[str, float]) -> Iterator[None]:
        """Show that a stage begins, and store the time of the with block in `timings`."""
        self.on_report(stage)
        begin = time.perf_counter()
        yield
        timings[stage] = time.perf_counter() - begin

    def draw(self) -> None:
        """Show the current progress."""
        stage = self._estimate.stage
        share = 100.0 * self._estimate.fraction(time.perf_counter())
        self.show(f"{self._name}: {NAMES.get(stage, stage)}", share, 100.0)


class FileBar(Bar):
    """Progress bar of a batch: finished files, cells per second, and the remaining time."""

    layout = "{n_fmt}/{total_fmt} files |{bar}| {desc}"

    def draw(self, state: BatchProgress) -> None:
        """Show the state of a batch."""
        if self._is_shown:
            from tqdm import tqdm

            pace = tqdm.format_sizeof(state.n_cells / state.seconds)
            left = tqdm.format_interval(state.seconds_left)
            self.show(f"{pace} cells/s, {left} left", state.n_ended, state.n_files)

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Hide the bar while a line is printed."""
        if self._bar is not None:
            self._bar.clear()
        yield
        if self._bar is not None:
            self._bar.refresh()
