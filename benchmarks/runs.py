"""Times from arrays to labels, and times of the stages, as reported by `superfacets.segment`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import superfacets as sf

from .checks import PLAIN, Expected, check_invariants, check_labels, hash_labels, require
from .clock import Sample, interleaved, median, summary
from .meshes import Arrays, shuffle

SETTINGS: dict[str, Callable[..., sf.Segmentation]] = {
    "defaults": sf.segment,
    "creases": partial(sf.segment, weights="creases"),
    "plain": partial(sf.segment, **PLAIN),
    "tol=0": partial(sf.segment, **PLAIN, tol=0.0),
    "10 iterations": partial(sf.segment, **PLAIN, tol=0.0, max_num_iter=10),
    "halted, 10 iterations": partial(sf.paper.segment, max_num_iter=10),
}
"""Functions that take a mesh, the number of regions and `n_threads`, by name."""

Row = dict[str, Any]


class Case(NamedTuple):
    """Mesh and settings of one row of the results."""

    mesh: str
    n_segments: int
    settings: str
    n_threads: int


def run_name(n_segments: int, settings: str) -> str:
    """Return the name under which a hash of labels is stored."""
    return f"k={n_segments}, {settings}"


def measure(arrays: Arrays, cases: list[Case], repeats: int, expected: Expected) -> list[Row]:
    """Return a row for each case of one mesh, with medians over interleaved runs.

    The labels of the warm-up are checked. All later runs, on any number of threads, must give the
    same labels.
    """
    known: dict[str, tuple[str, str]] = {}  # by name of run: hash of the labels, how it was checked

    def accept(case: Case, result: sf.Segmentation) -> tuple[sf.Segmentation, str]:
        run = run_name(case.n_segments, case.settings)
        if run not in known:
            alone = partial(_segment, arrays, case._replace(n_threads=1))
            verdict = check_labels(expected, (case.mesh, run), arrays, result, alone)
            known[run] = hash_labels(result.labels), verdict
        is_same = known[run][0] == hash_labels(result.labels)
        require(is_same, f"{case}: the labels depend on the run or on the number of threads")
        return result, known[run][1]

    jobs = {case: partial(_segment, arrays, case) for case in cases}
    samples = interleaved(jobs, repeats, accept)
    return [_row(arrays, case, samples[case]) for case in cases]


def _segment(arrays: Arrays, case: Case) -> sf.Segmentation:
    return SETTINGS[case.settings](arrays, case.n_segments, n_threads=case.n_threads)


def _row(arrays: Arrays, case: Case, samples: list[Sample]) -> Row:
    result, verdict = samples[0].fact
    n_faces = len(arrays.faces)
    timings = [sample.fact[0].timings for sample in samples]
    stages = {stage: median([seconds[stage] for seconds in timings]) for stage in result.timings}
    return {
        "mesh": case.mesh,
        "faces": n_faces,
        "k": case.n_segments,
        "settings": case.settings,
        "threads": case.n_threads,
        "regions": result.n_segments,
        "iterations": result.n_iter,
        "levels": [(level.n_cells, level.n_iter) for level in result.levels],
        "stop_reason": result.stop_reason,
        "checked": verdict,
        "stages": stages,
    } | summary([sample.seconds for sample in samples])


def measure_orders(mesh: str, arrays: Arrays, n_segments: int, repeats: int) -> list[Row]:
    """Return rows for a mesh as it is, with shuffled faces, and with shuffled faces and vertices.

    Labels are checked by invariants. All runs with the same order must give the same labels.
    """
    orders = {
        "as it is": arrays,
        "faces shuffled": shuffle(arrays, vertices=False),
        "faces and vertices shuffled": shuffle(arrays, vertices=True),
    }
    known: dict[str, str] = {}

    def accept(order: str, result: sf.Segmentation) -> None:
        if order not in known:
            check_invariants(orders[order], result)
            known[order] = hash_labels(result.labels)
        is_same = known[order] == hash_labels(result.labels)
        require(is_same, f"{mesh}, {order}: the labels depend on the run")

    jobs = {order: partial(sf.segment, made, n_segments) for order, made in orders.items()}
    samples = interleaved(jobs, repeats, accept)
    first = samples["as it is"]
    facts = {"mesh": mesh, "faces": len(arrays.faces), "k": n_segments}
    return [
        {**facts, "order": order, **summary([sample.seconds for sample in taken])}
        | {"ratio": _over(taken, first, "seconds"), "cpu": _over(taken, first, "cpu_seconds")}
        for order, taken in samples.items()
    ]


def _over(samples: list[Sample], first: list[Sample], clock: str) -> float:
    """Return the median of `samples` divided by the median of `first`.

    `clock` is "seconds" for the wall time, or "cpu_seconds" for the processor time.
    """
    one, other = (median([getattr(s, clock) for s in taken]) for taken in (samples, first))
    return one / other


def speedups(rows: list[Row]) -> list[Row]:
    """Return a row with the speedup over one thread, for each run on several threads.

    Runs that were not also measured on one thread are left out.
    """
    alone = {_without_threads(row): row for row in rows if row["threads"] == 1}
    return [
        {name: row[name] for name in ("mesh", "faces", "k", "settings", "threads")}
        | {"speedup": alone[_without_threads(row)]["seconds"] / row["seconds"]}
        | {"stages": _stage_speedups(alone[_without_threads(row)], row)}
        for row in rows
        if row["threads"] > 1 and _without_threads(row) in alone
    ]


def _stage_speedups(one: Row, many: Row) -> dict[str, float]:
    return {
        stage: one["stages"][stage] / seconds
        for stage, seconds in many["stages"].items()
        if seconds > 0
    }


def _without_threads(row: Row) -> tuple[Any, ...]:
    return row["mesh"], row["k"], row["settings"]
