"""Wall time of stages."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

OnStage = Callable[[str], object]
"""Function that is called with the name of each stage when it begins."""


@contextmanager
def timed(timings: dict[str, float], stage: str, on_stage: OnStage | None = None) -> Iterator[None]:
    """Add the wall time of the block to the time of a stage; call `on_stage` at the start."""
    if on_stage is not None:
        on_stage(stage)
    start = time.perf_counter()
    try:
        yield
    finally:
        timings[stage] = timings.get(stage, 0.0) + time.perf_counter() - start
