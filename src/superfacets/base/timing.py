"""Measure the wall time of the stages of a computation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field

OnStage = Callable[[str], object]
"""Function that is called at the beginning of each stage, with the name of the stage."""


@contextmanager
def timed(timings: dict[str, float], stage: str, on_stage: OnStage | None = None) -> Iterator[None]:
    """Call `on_stage`, and add the wall time of the with block in seconds to ``timings[stage]``."""
    if on_stage is not None:
        on_stage(stage)
    start = time.perf_counter()
    try:
        yield
    finally:
        timings[stage] = timings.get(stage, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Clock:
    """Wall times of stages, and the function to call at the beginning of each stage."""

    on_stage: OnStage | None
    timings: dict[str, float] = field(default_factory=dict)  # seconds, keyed by stage

    def timed(self, stage: str, *, begins: bool = True) -> AbstractContextManager[None]:
        """Measure the time of a with block; if `begins` is true, also call `on_stage`."""
        return timed(self.timings, stage, self.on_stage if begins else None)
