"""Progress bars of commands, and an estimate of the finished fraction of a run."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Self

if TYPE_CHECKING:  # not imported for a bar of one file
    from ..batches.batching import BatchProgress

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
"""Fractions of the time of a run with the defaults, measured on 1 and 3 million faces in binary PLY
with k = 150 and 2,000. `classify` is the whole loop. Reading 1 million faces as OBJ takes 0.12."""

NAMES = {
    "mesh": "reading",
    "face_graph": "face graph",
    "classify": "iterations",
    "export": "writing",
}
"""Names of stages in the bar."""

ITERATIONS = 8.0
"""After n iterations, 1 - exp(-n / 8) of the loop counts as done. Their number is not known in
advance, and later iterations are shorter: on the same meshes, 13 to 18 iterations gave 0.8 to 0.9,
and half of the time was spent after 6 to 8."""

NEARLY = 0.95
"""Largest fraction of a stage, except the loop, that the bar shows before the stage ends."""


class Estimate:
    """Estimate of the finished fraction of a run, by its stages and the time in the current one.

    `now` is the time, in seconds on some clock, when the run begins. `stage` is the current stage.
    """

    def __init__(self, now: float) -> None:
        self.stage = next(iter(SHARES))
        self._begin_of_run = self._begin_of_stage = now
        self._n_iterations = 0

    def begin(self, stage: str, now: float) -> None:
        """Begin a stage; stages before the current one are ignored."""
        stages = list(SHARES)
        if stages.index(stage) > stages.index(self.stage):
            self.stage = stage
            self._begin_of_stage = now

    def iterate(self, n_iterations: int) -> None:
        """Set the number of iterations done."""
        self._n_iterations = n_iterations

    def fraction(self, now: float) -> float:
        """Return the finished fraction, 0 to 1, which never decreases unless the clock does."""
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
    """A progress bar on stderr; draws nothing if stderr is not a terminal, or if `is_quiet`."""

    layout: ClassVar[str]
    """Format of the bar, for tqdm."""

    def __init__(self, *, is_quiet: bool = False) -> None:
        self._is_shown = not is_quiet and sys.stderr.isatty()
        self._bar: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def show(self, text: str, n_done: float, n_all: float) -> None:
        """Draw the bar with this text and state."""
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


class RunBar(Bar):
    """The bar of a run in memory: the stage, and the estimated share of the time."""

    layout = "{desc} {percentage:3.0f}% |{bar}| {elapsed}"

    def __init__(self, name: str, *, is_quiet: bool = False) -> None:
        super().__init__(is_quiet=is_quiet)
        self._name = name
        self._estimate = Estimate(time.perf_counter())
        self.draw()

    def on_stage(self, stage: str) -> None:
        """Show that a stage begins."""
        self._estimate.begin(stage, time.perf_counter())
        self.draw()

    def on_iteration(self, n_iterations: int, _n_moved: int) -> None:
        """Count an iteration of the loop."""
        self._estimate.iterate(n_iterations)

    def draw(self) -> None:
        """Show the current progress."""
        stage = self._estimate.stage
        share = 100.0 * self._estimate.fraction(time.perf_counter())
        self.show(f"{self._name}: {NAMES.get(stage, stage)}", share, 100.0)


class TileBar(Bar):
    """The bar of a run in tiles: the stage, and the tiles that are done in it."""

    layout = "{desc} {n_fmt}/{total_fmt} |{bar}| {elapsed}"

    SECONDS = 0.1
    """Shortest time between two updates of the bar."""

    def __init__(self, name: str, *, is_quiet: bool = False) -> None:
        super().__init__(is_quiet=is_quiet)
        self._name, self._stage, self._drawn = name, "mesh", 0.0

    def on_stage(self, stage: str) -> None:
        """Show that a stage begins."""
        self._stage = stage
        self.on_tile(0, 1)

    def on_iteration(self, n_iterations: int, _n_moved: int) -> None:
        """Show the number of iterations on coarse cells."""
        self.on_tile(n_iterations, n_iterations)

    def on_tile(self, n_done: int, n_tiles: int) -> None:
        """Show how many tiles, or other pieces of a pass, are done."""
        now = time.monotonic()
        if n_done >= n_tiles or now >= self._drawn + self.SECONDS:
            self._drawn = now
            self.show(f"{self._name}: {NAMES.get(self._stage, self._stage)}", n_done, n_tiles)


class FileBar(Bar):
    """The bar of a batch: files that have ended, cells per second, and the time left."""

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
