"""Measure the wall time of the stages of a computation."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
