"""Measure the times of interleaved jobs, so that a slow minute affects all jobs equally."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from functools import partial
from typing import Any, NamedTuple, TypeVar

Key = TypeVar("Key", bound=Hashable)


class Sample(NamedTuple):
    """Times of one run of a job, in seconds."""

    seconds: float
    cpu_seconds: float  # processor time of all threads
    fact: Any  # value that `accept` (see `interleaved`) returned for the result of the job


def interleaved(
    jobs: Mapping[Key, Callable[[], Any]],
    repeats: int,
    accept: Callable[[Key, Any], Any],
) -> dict[Key, list[Sample]]:
    """Run all jobs once as a warm-up, then in `repeats` rounds; return the samples of each job.

    The warm-up gives no samples. Garbage is collected before each job, and not during a job. After
    each run, including the warm-up, `accept(key, result)` is called. It must raise an error if the
    result is wrong. Its return value is kept in the sample, and the result is dropped.
    """
    samples: dict[Key, list[Sample]] = {key: [] for key in jobs}
    keys = list(jobs)
    for number in range(repeats + 1):
        first = number % max(1, len(keys))  # each round starts with another job
        for key in keys[first:] + keys[:first]:
            sample = _timed(jobs[key], partial(accept, key))
            if number > 0:
                samples[key].append(sample)
    return samples


def _timed(job: Callable[[], Any], accept: Callable[[Any], Any]) -> Sample:
    gc.collect()
    gc.disable()
    try:
        start, cpu_start = time.perf_counter(), time.process_time()
        result = job()
        seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
    finally:
        gc.enable()
    return Sample(seconds, cpu_seconds, accept(result))


def median(values: list[float]) -> float:
    """Return the median as a Python float."""
    return float(statistics.median(values))


def summary(values: list[float]) -> dict[str, float]:
    """Return the median, minimum and maximum of times in seconds, as fields of a row of results."""
    return {"seconds": median(values), "fastest": min(values), "slowest": max(values)}
