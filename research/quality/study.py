"""Run the quality study: measure all cases that have no results yet, and write the results."""

from __future__ import annotations

import importlib.util
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from superfacets.base.errors import MeshError
from superfacets.files.atomic import atomic_outputs, locked, remove_leftovers

from ..checks import MissingGroupError
from ..princeton import Benchmark
from ..sources import StudyMesh, find_models
from ..table_writer import write_csv
from ..tasks import memory_of_tasks, outcome_of, read_item, run_tasks
from .measure import KS, RESOLUTION_VARIANTS, SCALES, VARIANTS, Case, CaseTask
from .tables import Row, render_quality

_RUN = ("model", "scale", "variant", "k")  # columns that identify the run that a row describes


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """Options of the quality study."""

    benchmark: Path
    output: Path
    models: tuple[int, ...] | None = None  # numbers of models; None means all models in the folder
    every: int = 1  # step in the list of models: 2 selects every second model
    ks: tuple[int, ...] = KS
    n_finer: int = 10  # number of models that are measured at all resolutions, 0 for none
    n_jobs: int = 1  # number of worker processes


@dataclass(frozen=True)
class StudyReport:
    """Results of the quality study."""

    rows: list[Row]  # results at the original resolution
    resolution: list[Row]  # results of some models at all resolutions
    tables: str  # all tables, as Markdown
    problems: tuple[str, ...]  # messages about unused files, missing packages and failed runs


def study(options: StudyOptions) -> StudyReport:
    """Measure all variants on all models, and some variants on some models at all resolutions.

    Rows are written to ``runs.csv`` in the output folder, and tables to ``tables.md``. If a run
    fails, its model is left out at the scale of the run, so that all means at this scale are over
    the same models.
    Raises MeshError if no model could be measured, ValueError if a model does not exist or another
    process uses the output folder, and MissingGroupError if tabulate is not installed.
    """
    if importlib.util.find_spec("tabulate") is None:
        raise MissingGroupError("quality without tabulate")
    numbers = Benchmark(options.benchmark).numbers if options.models is None else options.models
    sources = find_models(options.benchmark, sorted(set(numbers))[:: options.every])
    models = sorted(sources.found, key=lambda model: model.number)
    scales, problems = _usable_scales() if options.n_finer else ([], ())
    finer, main = _tasks(models, scales, options)
    files = [options.output / name for name in ("runs.csv", "tables.md")]
    with locked(options.output):
        records = [item.path for task in finer + main for item in task.items]
        remove_leftovers([*files, *records], older_than=0.0)  # temporary files of killed processes
        none = {"reason": "no record"}
        left = [[item for item in task.items if "reason" in (read_item(item) or none)]
                for task in finer + main]  # fmt: skip
        todo = [CaseTask(tuple(items)) for items in left if items]
        lost = run_tasks("tasks", todo, options.n_jobs, memory=memory_of_tasks())
        rows, failures = _collect(main, lost)
        resolution, more_failures = _collect(finer, lost)
        if not rows:
            raise MeshError(f"all models failed; the first failure: {failures[0]}")
        tables = render_quality({"rows": rows, "resolution": resolution, "ks": options.ks})
        runs = {tuple(row[name] for name in _RUN): row for row in rows + resolution}
        write_csv(files[0], list(runs.values()))  # a run that is in both lists is written once
        with atomic_outputs([files[1]]) as (partial,):
            partial.write_text(tables + "\n", encoding="utf-8")
    said = (*sources.problems, *problems, *failures, *more_failures)
    return StudyReport(rows, resolution, tables, said)


def _usable_scales() -> tuple[list[str], tuple[str, ...]]:
    """Return the usable scales, and a message if a scale needs packages that are not installed."""
    if all(importlib.util.find_spec(name) for name in ("pyvista", "scipy")):
        return list(SCALES), ()
    finer = [scale for scale in SCALES if scale != "x1/4"]
    return finer, ("coarser meshes are left out: PyVista and SciPy are not installed",)


def _tasks(
    models: Sequence[StudyMesh], scales: Sequence[str], options: StudyOptions
) -> tuple[list[CaseTask], list[CaseTask]]:
    """Return two lists of tasks, with one task per model and scale.

    The first list is for `RESOLUTION_VARIANTS` on some models at all `scales`, with the middle k.
    The second list is for all variants, models and k at the original resolution.
    """
    some = models[:: max(1, len(models) // options.n_finer)] if options.n_finer else []
    ks = sorted(set(options.ks))

    def task(model: StudyMesh, scale: str, variants: Iterable[str], ks: Sequence[int]) -> CaseTask:
        cases = [Case(model, scale, name, k) for k, name in itertools.product(ks, variants)]
        return CaseTask(tuple(case.item(options.output / "records") for case in cases))

    middle = [ks[len(ks) // 2]]
    finer = [
        task(model, scale, RESOLUTION_VARIANTS, middle)
        for scale in scales
        for model in some[: options.n_finer]
    ]
    return finer, [task(model, "x1", VARIANTS, ks) for model in models]


def _collect(tasks: Sequence[CaseTask], lost: dict[Path, str]) -> tuple[list[Row], list[str]]:
    """Return the rows of tasks without failures, and messages about the failures of all tasks."""
    rows: list[Row] = []
    failures: list[str] = []
    for task in tasks:
        gone = {"reason": "its record was deleted"}
        records = [outcome_of(item, lost) or gone for item in task.items]
        reasons = [
            f"{item.subject}: {record['reason']}"
            for item, record in zip(task.items, records, strict=True)
            if "reason" in record
        ]
        failures += reasons
        rows += [] if reasons else records
    return rows, failures
