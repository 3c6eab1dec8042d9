"""Measure the wall time of the stages of a computation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field

import numpy as np

Callback = Callable[[str, int, int], object]
"""Function that is called with (stage, number of the iteration, number of centers that moved): when
a stage begins, with two zeros, and in the stage ``"classify"`` after each iteration of the loop. If
it returns False, the loop stops after the current iteration."""


@dataclass
class Reports:
    """Calls the `Callback` of the user, and remembers whether it has returned False."""

    callback: Callback | None = None
    is_cancelled: bool = False

    def __call__(self, stage: str, n_iter: int = 0, n_moved: int = 0) -> None:
        """Report the beginning of a stage, or an iteration."""
        answer = None if self.callback is None else self.callback(stage, n_iter, n_moved)
        if isinstance(answer, (bool, np.bool_)) and not answer:
            self.is_cancelled = True


@contextmanager
def timed(timings: dict[str, float], stage: str, report: Reports | None = None) -> Iterator[None]:
    """Report the stage, and add the wall time of the block in seconds to ``timings[stage]``."""
    if report is not None:
        report(stage)
    start = time.perf_counter()
    try:
        yield
    finally:
        timings[stage] = timings.get(stage, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Clock:
    """Wall times of stages, and the function that reports the beginning of each stage."""

    report: Reports
    timings: dict[str, float] = field(default_factory=dict)  # seconds, keyed by stage

    def timed(self, stage: str, *, begins: bool = True) -> AbstractContextManager[None]:
        """Measure the time of a with block; if `begins` is true, also report it."""
        return timed(self.timings, stage, self.report if begins else None)
