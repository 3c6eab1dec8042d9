"""The rows of CSV files: of every run, and means over models."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..sources import Source
from ..table_writer import write_csv
from ..tasks import Record
from .results import Comparison, Curve, Results
from .runs import Run

Row = dict[str, Any]

_FACTS = ("model", "category", "faces", "ground_truths", "method", "alpha", "k")


def write_runs(path: Path, results: Results) -> None:
    """Write a row for each planned run: its numbers, or why there are none."""
    rows = [_row_of_run(results, run) for run in results.plan.runs]
    write_csv(path, rows)


def write_means(path: Path, results: Results) -> None:
    """Write means over models, and medians of seconds, for each method, alpha and k.

    One row is over all models that have the run, and one over those of each category.
    """
    groups: dict[tuple[str, str, float | None, int], list[Run]] = {}
    for run in results.done:
        if run.source.is_model:
            for category in ("all", run.source.category):
                groups.setdefault((category, run.method, run.alpha, run.k), []).append(run)
    rows = []
    for (category, method, alpha, k), runs in groups.items():
        row: Row = {"category": category, "method": method, "alpha": alpha, "k": k}
        row["models"] = len(runs)
        row |= _means([results.done[run]["metrics"] for run in runs])
        row["seconds_median"] = float(np.median([results.value(run, "seconds") for run in runs]))
        rows.append(row)
    write_csv(path, rows)


def write_points(path: Path, results: Results, comparison: Comparison) -> None:
    """Write the points of a figure: means over the models that all its curves have."""
    rows = [
        _row_of_point(results, curve, k, comparison.models)
        for curve in comparison.curves
        for k in results.plan.choice.ks
    ]
    write_csv(path, rows)


def _row_of_run(results: Results, run: Run) -> Row:
    source = run.source
    facts = (source.name, source.category, source.n_faces, source.n_ground_truths)
    row: Row = dict(zip(_FACTS, (*facts, run.method, run.alpha, run.k), strict=True))
    if run in results.failed:
        return row | {"status": "failed", "reason": results.failed[run]}
    if run not in results.done:
        return row | {"status": "missing"}
    return row | {"status": "done"} | _numbers(results.done[run])


def _numbers(record: Record) -> Row:
    row = {name: record[name] for name in ("n_segments", "n_iter", "stop_reason")}
    row |= record["metrics"]
    row |= {f"seconds_{stage}": spent for stage, spent in record["seconds"].items()}
    return row | {f"version_{name}": version for name, version in record["versions"].items()}


def _row_of_point(results: Results, curve: Curve, k: int, models: Iterable[Source]) -> Row:
    records = [results.done[Run(model, curve.method, curve.alpha, k)] for model in models]
    row: Row = {"method": curve.method, "alpha": curve.alpha, "k": k, "models": len(records)}
    return row | _means([record["metrics"] for record in records])


def _means(metrics: Sequence[Mapping[str, float]]) -> Row:
    return {name: float(np.mean([one[name] for one in metrics])) for name in metrics[0]}
