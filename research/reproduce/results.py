"""Collect the results of all runs, and write them and their means over models as CSV files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from superfacets.base.checks import counted

from ..sources import StudyMesh
from ..table_writer import write_csv
from ..tasks import Record, WorkItem, outcome_of
from .measure import Run
from .methods import METHODS
from .plan import RunPlan


@dataclass(frozen=True)
class Curve:
    """A curve in a figure. It shows the results of one method with one alpha."""

    method: str
    alpha: float | None

    @property
    def title(self) -> str:
        """Name of the curve in legends."""
        title = METHODS[self.method].title
        if self.alpha is None:
            return title
        return f"{title}, \N{GREEK SMALL LETTER ALPHA} = {self.alpha:g}"


@dataclass(frozen=True)
class RunResults:
    """The runs of a plan, divided into runs that are done, have failed, or are missing."""

    plan: RunPlan
    done: dict[Run, Record] = field(default_factory=dict)
    failed: dict[Run, str] = field(default_factory=dict)  # reason of failure of each failed run
    missing: tuple[Run, ...] = ()  # runs without a valid record

    def value(self, run: Run, quantity: str) -> float:
        """Return a metric of a run that is done, or its total time if `quantity` is "seconds"."""
        record = self.done[run]
        if quantity == "seconds":
            return float(record["seconds"]["total"])
        return float(record["metrics"][quantity])

    def models_with(self, curve: Curve, ks: Iterable[int]) -> set[StudyMesh]:
        """Return the models for which all runs of a curve with a k in `ks` are done."""
        ks = tuple(ks)
        return {
            model
            for model in self.plan.models
            if all(Run(model, curve.method, curve.alpha, k) in self.done for k in ks)
        }

    def mean(self, curve: Curve, k: int, quantity: str, models: Iterable[StudyMesh]) -> float:
        """Return the mean of `value` over `models`, for runs of a curve with k regions."""
        values = [
            self.value(Run(model, curve.method, curve.alpha, k), quantity) for model in models
        ]
        return float(np.mean(values))

    def reasons(self) -> list[str]:
        """Return one line per method and reason of failure, with the names of the meshes."""
        return [
            f"{_runs_of(method, runs)}: {reason}"
            for (method, reason), runs in _grouped(
                {run: (run.method, reason) for run, reason in self.failed.items()}
            ).items()
        ]

    def not_started(self) -> list[str]:
        """Return one line per method with missing runs, with the names of the meshes."""
        runs = _grouped({run: run.method for run in self.missing})
        return [_runs_of(method, of_method) for method, of_method in runs.items()]


def _grouped(keys: Mapping[Run, Any]) -> dict[Any, list[Run]]:
    groups: dict[Any, list[Run]] = defaultdict(list)
    for run, key in keys.items():
        groups[key].append(run)
    return groups


def _runs_of(method: str, runs: Sequence[Run]) -> str:
    names = dict.fromkeys(run.source.name for run in runs)
    return f"{method} on {', '.join(names)} ({counted(len(runs), 'run')})"


def collect(
    plan: RunPlan, items: Mapping[Run, WorkItem], pictured: frozenset[Run], lost: Mapping[Path, str]
) -> RunResults:
    """Read the records of all runs of a plan; `items` contains the path of each record.

    A run in `pictured` is missing if its record contains no labels. `lost` is the result of
    `run_tasks`: the paths of records that could not be written, and the reasons.
    """
    done: dict[Run, Record] = {}
    failed: dict[Run, str] = {}
    for run in plan.runs:
        record = outcome_of(items[run], lost)
        if record is not None and "reason" in record:
            failed[run] = record["reason"]
        elif record is not None and (run not in pictured or "labels" in record):
            done[run] = record
    missing = (run for run in plan.runs if run not in done and run not in failed)
    return RunResults(plan, done, failed, tuple(missing))


@dataclass(frozen=True)
class Comparison:
    """Curves that can be compared, because all of their points are means over the same models."""

    curves: tuple[Curve, ...]
    models: tuple[StudyMesh, ...]  # models with results for all points of all curves
    left_out: tuple[Curve, ...]  # curves that have no models in common with `curves`


def compare(results: RunResults, figure: str) -> Comparison:
    """Return the curves of a figure, and the models for which all curves have results.

    Curves are added one after another, the curves with the most models first. A curve is left out
    if it has no model in common with the curves added before.
    """
    choice = results.plan.choice
    curves = [Curve(*pair) for pair in choice.curves_in(figure)]
    models = {curve: results.models_with(curve, choice.ks) for curve in curves}
    shared, kept = set(results.plan.models), set()
    for curve in sorted(models, key=lambda curve: -len(models[curve])):
        if shared & models[curve]:
            shared &= models[curve]
            kept.add(curve)
    return Comparison(
        tuple(curve for curve in models if curve in kept),
        tuple(model for model in results.plan.models if kept and model in shared),
        tuple(curve for curve in models if curve not in kept),
    )


Row = dict[str, Any]

_FACTS = ("model", "category", "faces", "ground_truths", "method", "alpha", "k")


def write_runs(path: Path, results: RunResults) -> None:
    """Write a CSV file with one row per run: its status, and its results or reason of failure."""
    write_csv(path, [_row_of_run(results, run) for run in results.plan.runs])


def write_means(path: Path, results: RunResults) -> None:
    """Write a CSV file with means over models and median seconds, for each method, alpha and k.

    Each combination has one row for all models, and one row for each category.
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


def write_points(path: Path, results: RunResults, comparison: Comparison) -> None:
    """Write a CSV file with the points of all curves of a figure. Points are means over models."""
    rows = [
        _row_of_point(results, curve, k, comparison.models)
        for curve in comparison.curves
        for k in results.plan.choice.ks
    ]
    write_csv(path, rows)


def _row_of_run(results: RunResults, run: Run) -> Row:
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


def _row_of_point(results: RunResults, curve: Curve, k: int, models: Iterable[StudyMesh]) -> Row:
    records = [results.done[Run(model, curve.method, curve.alpha, k)] for model in models]
    row: Row = {"method": curve.method, "alpha": curve.alpha, "k": k, "models": len(records)}
    return row | _means([record["metrics"] for record in records])


def _means(metrics: Sequence[Mapping[str, float]]) -> Row:
    return {name: float(np.mean([one[name] for one in metrics])) for name in metrics[0]}
