"""The command line of `tools/fuzz`."""

from __future__ import annotations

import argparse
import concurrent.futures
import contextlib
import faulthandler
import itertools
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pebble import ProcessPool

from superfacets import BalanceWarning, FeatureWarning, IslandWarning, SliverWarning

from .batches import check_manifest
from .cells import check_cells
from .files import check_file, whole_files
from .graphs import check_graph
from .labels import check_documents
from .meshes import check_mesh
from .sizes import check_sizes
from .studio import check_work_file

Check = Callable[[np.random.Generator, Path], None]


class Kind(NamedTuple):
    """A kind of cases: the function that runs a case, its relative frequency, and its limits.

    Limits on time are in seconds, and generous for busy machines. Files have low limits, because
    readers must refuse damaged files quickly, and must not allocate what a header declares.
    """

    check: Check
    frequency: int
    seconds: float = 60.0
    n_bytes: int = 6 << 30  # memory that a case may allocate


KINDS = {
    "files": Kind(check_file, 60, 10.0, 1 << 30),
    "labels": Kind(check_documents, 20, 10.0, 1 << 30),
    "meshes": Kind(check_mesh, 12),
    "cells": Kind(check_cells, 12),
    "graphs": Kind(check_graph, 6),
    "sizes": Kind(check_sizes, 6),
    "studio": Kind(check_work_file, 5),
    "batches": Kind(check_manifest, 3),
}

MAX_FAILURES = 20
"""Number of failures after which the search ends, because they probably have the same cause."""


def main() -> None:
    """Parse the command line, and run the search or one case."""
    parser = argparse.ArgumentParser(prog="tools/fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="duration of the search")
    parser.add_argument("--cases", type=int, help="number of cases, without a limit on time")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND",
                        help=f"kinds of cases: {', '.join(KINDS)}")  # fmt: skip
    parser.add_argument("--formats", nargs="+", default=[], metavar="ENDING",
                        help="only files of these formats, such as .laz")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="seed of the random cases")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="number of processes")
    parser.add_argument("--case", type=int, help="run only this case, in this process")
    options = parser.parse_args()
    search = Search(options.seed, tuple(options.only), tuple(options.formats))
    if options.case is None:
        sys.exit(search.run(_numbers(options.seconds, options.cases), options.jobs))
    prepare()
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    kind = search.kind_of(options.case)
    print(f"case {options.case}, {kind}: its files are in {folder}", flush=True)
    search.run_case(options.case, folder)


def _numbers(seconds: float, n_cases: int | None) -> Iterator[int]:
    """Yield case numbers 0, 1, 2, ...: `n_cases` of them, or until `seconds` have passed."""
    if n_cases is not None:
        return iter(range(n_cases))
    end = time.monotonic() + seconds
    return itertools.takewhile(lambda _: time.monotonic() < end, itertools.count())


class Search(NamedTuple):
    """A search with random cases. A case depends only on its number and on these fields."""

    seed: int
    kinds: tuple[str, ...]
    formats: tuple[str, ...]

    def kind_of(self, number: int) -> str:
        """Return the kind of a case."""
        return self._start_of(number)[0]

    def run_case(self, number: int, folder: Path) -> None:
        """Run the case with this number; raise an error if a property does not hold."""
        kind, rng = self._start_of(number)
        if kind == "files":
            check_file(rng, folder, self.formats)
        else:
            KINDS[kind].check(rng, folder)

    def _start_of(self, number: int) -> tuple[str, np.random.Generator]:
        rng = np.random.default_rng([self.seed, number])
        ends = np.cumsum([KINDS[kind].frequency for kind in self.kinds])
        index = np.searchsorted(ends, rng.integers(ends[-1]), side="right")
        return self.kinds[index], rng

    def failure_of(self, number: int) -> str | None:
        """Run the case with this number; return the traceback of its failure, or None."""
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            limit_memory(KINDS[self.kind_of(number)].n_bytes)
            try:
                self.run_case(number, Path(folder))
            except BaseException:
                return traceback.format_exc()
        return None

    def run(self, numbers: Iterator[int], n_jobs: int) -> int:
        """Run cases in separate processes, and print the failures; return the exit status."""
        tally: Counter[str] = Counter()
        n_failed = 0
        began = time.monotonic()
        for number, failure in self.outcomes(numbers, n_jobs):
            kind = self.kind_of(number)
            tally[kind] += 1
            if failure is not None:
                n_failed += 1
                print(f"== {kind}: {self._command(number)}\n{failure}", flush=True)
            if n_failed == MAX_FAILURES:
                break
        counts = ", ".join(f"{count} of {kind}" for kind, count in sorted(tally.items()))
        seconds = time.monotonic() - began
        print(f"seed {self.seed}: {sum(tally.values())} cases ({counts}) in {seconds:.0f} s, "
              f"{n_failed} failed")  # fmt: skip
        return 1 if n_failed else 0

    def _command(self, number: int) -> str:
        """Return the command line that repeats a case."""
        words = ["tools/fuzz", "--seed", str(self.seed), "--case", str(number)]
        words += ["--only", *self.kinds] if self.kinds != tuple(KINDS) else []
        words += ["--formats", *self.formats] if self.formats else []
        return " ".join(words)

    def outcomes(self, numbers: Iterator[int], n_jobs: int) -> Iterator[tuple[int, str | None]]:
        """Yield the number of each case that has ended, with its failure or None."""
        methods = multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        formats = self.formats if "files" in self.kinds else None
        with ProcessPool(n_jobs, context=context, initializer=prepare, initargs=(formats,)) as pool:
            running: dict[concurrent.futures.Future[str | None], int] = {}
            while True:
                for number in itertools.islice(numbers, 8 * n_jobs - len(running)):
                    seconds = KINDS[self.kind_of(number)].seconds
                    future = pool.schedule(self.failure_of, args=(number,), timeout=seconds)
                    running[future] = number
                if not running:
                    break
                done = concurrent.futures.wait(running, return_when="FIRST_COMPLETED").done
                for future in done:
                    yield running.pop(future), _outcome(future)
            pool.stop()


def _outcome(future: concurrent.futures.Future[str | None]) -> str | None:
    """Return the failure of a case that has ended, or None if the case has not failed."""
    try:
        return future.result()
    except concurrent.futures.TimeoutError as error:
        return f"it did not end within {error.args[-1]:g} seconds"
    except Exception as error:  # Pebble raises various errors if the process has ended
        return f"the process ended: {error!r}, exit status {getattr(error, 'exitcode', None)}"


def prepare(formats: tuple[str, ...] | None = None) -> None:
    """Turn warnings into errors, and make the files of formats before a case is timed."""
    faulthandler.enable()
    warnings.simplefilter("error")
    # These warnings are usual with random meshes.
    for expected in (BalanceWarning, FeatureWarning, IslandWarning, SliverWarning):
        warnings.simplefilter("ignore", expected)
    if formats is not None:
        whole_files(formats)
        whole_files(())


def limit_memory(n_bytes: int) -> None:
    """Let this process allocate `n_bytes` more bytes than now; only Linux heeds such a limit."""
    with contextlib.suppress(ImportError, OSError):  # Windows has no `resource`, others no /proc
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[5])
        n_now = pages * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_DATA, (n_now + n_bytes, resource.RLIM_INFINITY))
