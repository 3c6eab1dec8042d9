"""The progress of a run over all of its stages, and the bar that shows it."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # a bar for one file takes no batch
    from ..batches.runs import BatchProgress

__all__ = ["SHARES", "Bar", "Estimate", "FileBar", "open_bar"]

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
"""Shares of the time of a run with the defaults: measured on 1 and 3 million faces in binary PLY
with k = 150 and 2,000. `classify` is the whole loop. Reading 1 million faces as OBJ takes 0.12."""

NAMES = {
    "mesh": "reading",
    "face_graph": "face graph",
    "classify": "iterations",
    "export": "writing",
}
"""Names that the bar shows for stages."""

ITERATIONS = 8.0
"""The loop is taken for 1 - exp(-n / 8) done after n iterations. They get shorter, and their number
is not known before: on the same meshes 13 to 18 iterations gave 0.8 to 0.9, and half of the time
was spent after 6 to 8 of them."""

NEARLY = 0.95
"""Share at which a stage stops that takes longer than expected."""


class Estimate:
    """The share of a run that is done, by the stages done and the time spent in this one.

    Parameters
    ----------
    now : float
        Seconds on a clock when the run begins.

    Attributes
    ----------
    stage : str
        Key of `SHARES`; the first before any has begun.
    """

    def __init__(self, now: float) -> None:
        self.stage = next(iter(SHARES))
        self._begin_of_run = self._begin_of_stage = now
        self._n_iterations = 0

    def begin(self, stage: str, now: float) -> None:
        """A stage begins; stages before the current one are ignored."""
        stages = list(SHARES)
        if stages.index(stage) > stages.index(self.stage):
            self.stage = stage
            self._begin_of_stage = now

    def iterate(self, n_iterations: int) -> None:
        """Set the number of iterations done."""
        self._n_iterations = n_iterations

    def fraction(self, now: float) -> float:
        """From 0 to 1, never falling as long as the clock does not."""
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
        if not done or spent_before <= 0:  # nothing to compare with yet
            return 0.0
        expected = share * spent_before / done
        return min((now - self._begin_of_stage) / expected, NEARLY)


class Bar:
    """A bar on stderr for one run. It draws nothing if it is not to be shown."""

    def __init__(self, name: str, is_shown: bool) -> None:
        self._name = name
        self._estimate = Estimate(time.perf_counter())
        self._bar: Any = None
        if is_shown:
            from tqdm import tqdm

            self._bar = tqdm(
                total=100.0,
                leave=False,
                dynamic_ncols=True,
                file=sys.stderr,
                bar_format="{desc} {percentage:3.0f}% |{bar}| {elapsed}",
            )

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def on_stage(self, stage: str) -> None:
        """Show that a stage begins."""
        self._estimate.begin(stage, time.perf_counter())
        self.draw()

    def on_iteration(self, n_iterations: int, _n_moved: int) -> None:
        """Count an iteration of the loop."""
        self._estimate.iterate(n_iterations)

    def draw(self) -> None:
        """Show the current progress."""
        if self._bar is None:
            return
        stage = self._estimate.stage
        self._bar.set_description_str(f"{self._name}: {NAMES.get(stage, stage)}", refresh=False)
        self._bar.n = 100.0 * self._estimate.fraction(time.perf_counter())
        self._bar.refresh()


def open_bar(name: str, *, is_quiet: bool = False) -> Bar:
    """A bar for the run of that name, to be used in a `with`; shown where stderr is a terminal."""
    return Bar(name, is_shown=not is_quiet and sys.stderr.isatty())


class FileBar:
    """A bar on stderr for a batch; shown where that is a terminal, from the first file on."""

    def __init__(self, *, is_quiet: bool) -> None:
        self._is_shown = not is_quiet and sys.stderr.isatty()
        self._bar: Any = None

    def __enter__(self) -> FileBar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def draw(self, state: BatchProgress) -> None:
        """Show how many files have ended, cells per second, and the time left."""
        if not self._is_shown:
            return
        from tqdm import tqdm

        if self._bar is None:
            self._bar = tqdm(
                total=state.n_files,
                leave=False,
                dynamic_ncols=True,
                file=sys.stderr,
                bar_format="{n_fmt}/{total_fmt} files |{bar}| {desc}",
            )
        pace = tqdm.format_sizeof(state.n_cells / state.seconds)
        left = tqdm.format_interval(state.seconds_left)
        self._bar.set_description_str(f"{pace} cells/s, {left} left", refresh=False)
        self._bar.n = state.n_ended
        self._bar.refresh()

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Take the bar away while a line is printed."""
        if self._bar is not None:
            self._bar.clear()
        yield
        if self._bar is not None:
            self._bar.refresh()
