"""The command line of `tools/fuzz`."""

from __future__ import annotations

import argparse
import faulthandler
import itertools
import os
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from superfacets import IslandWarning, SliverWarning

from .files import check_label_file, check_mesh_file
from .graphs import check_graph
from .meshes import check_mesh
from .pool import Worker, limit_memory, serve

KINDS = {
    "mesh file": check_mesh_file,
    "label file": check_label_file,
    "mesh": check_mesh,
    "graph": check_graph,
}

IN_TURN = ("mesh file", "mesh", "graph", "label file", "mesh", "mesh file", "graph", "mesh")
"""Kinds of the cases 0, 1, 2 and so on."""

SECONDS_PER_CASE = 60.0
"""Cases take a second at most; a machine may be busy."""

MOST_FAILURES = 20
"""After so many, the search ends: they are likely to be one."""


def main() -> None:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(prog="tools/fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to search")
    parser.add_argument("--seed", type=int, default=0, help="other cases for another seed")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--case", type=int, help="run this one case here, as a failure is shown")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    faulthandler.enable()
    warnings.simplefilter("error")
    for right in (IslandWarning, SliverWarning):  # about many of these meshes
        warnings.simplefilter("ignore", right)
    if options.serve:
        serve(lambda number: _failure_of(options.seed, number))
    elif options.case is not None:
        limit_memory()
        folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
        print(f"case {options.case} is a {_kind_of(options.case)}; its files are in {folder}")
        _run_case(options.seed, options.case, folder)
    else:
        sys.exit(_search(options.seed, options.seconds, options.jobs))


def _kind_of(number: int) -> str:
    return IN_TURN[number % len(IN_TURN)]


def _run_case(seed: int, number: int, folder: Path) -> None:
    """Run the case of this seed and number; an error if something does not hold."""
    KINDS[_kind_of(number)](np.random.default_rng([seed, number]), folder)


def _failure_of(seed: int, number: int) -> str | None:
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        try:
            _run_case(seed, number, Path(folder))
        except BaseException:
            return traceback.format_exc()
    return None


def _search(seed: int, seconds: float, n_jobs: int) -> int:
    """Run cases until the time is over; return the exit status."""
    numbers = _numbers(seconds)
    tally: Counter[str] = Counter()
    failed: list[int] = []
    lock = threading.Lock()

    def work() -> None:
        worker = Worker(
            [sys.executable, sys.argv[0], "--serve", "--seed", str(seed)], SECONDS_PER_CASE
        )
        while True:
            with lock:
                number = next(numbers, None)
                if number is None or len(failed) >= MOST_FAILURES:
                    break
            failure = worker.run(number)
            with lock:
                tally[_kind_of(number)] += 1
                if failure is not None:
                    failed.append(number)
                    print(f"== {_kind_of(number)}: tools/fuzz --seed {seed} --case {number}")
                    print(failure, flush=True)
        worker.stop()

    threads = [threading.Thread(target=work) for _ in range(n_jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    counts = ", ".join(f"{count} of a {kind}" for kind, count in sorted(tally.items()))
    print(f"seed {seed}: {sum(tally.values())} cases ({counts}), {len(failed)} failed")
    return 1 if failed else 0


def _numbers(seconds: float) -> Iterator[int]:
    """0, 1, 2 and so on, until the time is over."""
    end = time.monotonic() + seconds
    return itertools.takewhile(lambda _: time.monotonic() < end, itertools.count())
