"""Run all stages of the reproduction: plan, measure, draw, and write results."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from superfacets.base.errors import MeshError
from superfacets.files.atomic import locked, remove_leftovers
from superfacets_show.rendering import check_rendering

from ..checks import MissingGroupError
from ..sources import StudyMeshes, find_meshes, find_models
from ..tasks import WorkItem, memory_of_tasks, run_shown, run_tasks
from .gallery import GALLERY, Drawing, is_drawn, picture_path
from .measure import Run, RunTask
from .methods import METHODS
from .page import PageFiles, write_page
from .plan import CURVES, Choice, RunPlan, make_plan
from .results import (
    Comparison,
    Curve,
    RunResults,
    collect,
    compare,
    write_means,
    write_points,
    write_runs,
)

_QUANTITIES = ("undersegmentation_error", "compactness")
"""Metrics that are also plotted separately for each category."""


@dataclass(frozen=True, kw_only=True)
class ReproductionOptions:
    """Options of the reproduction."""

    benchmark: Path
    output: Path
    meshes: Path | None  # folder with meshes of the user for Figure 1; None means no meshes
    choice: Choice
    budget_seconds: float | None
    """Time in seconds after which no task is started; None means no limit."""
    n_jobs: int  # number of worker processes


@dataclass(frozen=True)
class ReproductionReport:
    """Results of the reproduction."""

    results: RunResults
    page: Path
    picture_problems: tuple[str, ...]
    seconds: float


def reproduce(options: ReproductionOptions) -> ReproductionReport:
    """Do all runs that have no results yet, and write tables, plots, pictures and the page.

    Raises MeshError if no run succeeded, and ValueError if the figures need no run or another
    process uses the output folder. If a figure cannot be drawn, raises MissingGroupError or
    RenderError before the first run.
    """
    start = time.monotonic()
    plan = _plan(options)
    _check_needs(plan)
    most_segments = max(plan.choice.ks)
    items = {run: run.item(options.output / "records", most_segments) for run in plan.runs}
    with locked(options.output):
        # The lock excludes other running processes, so temporary files are from killed processes.
        remove_leftovers(_outputs(plan, items, options.output), older_than=0.0)
        results, n_before = _measure(plan, items, options, start)
        if not results.done:
            raise MeshError(_why_nothing(results))
        problems = _draw_pictures(results, items, options)
        page = options.output / "index.html"
        plots, comparisons = _write_files(results, options.output)
        seconds = time.monotonic() - start
        files = PageFiles(options.output, plots, comparisons, seconds, n_before, problems)
        write_page(page, results, files)
    return ReproductionReport(results, page, problems, time.monotonic() - start)


def _plan(options: ReproductionOptions) -> RunPlan:
    nothing = StudyMeshes((), ())
    meshes = nothing
    if options.meshes is not None and "1" in options.choice.figures:
        meshes = find_meshes(options.meshes)
    return make_plan(find_models(options.benchmark), meshes, options.choice)


def _check_needs(plan: RunPlan) -> None:
    """Raise an error if a package that a run, a figure or the page needs is not installed.

    Raises a RenderError if pictures are needed but cannot be rendered.
    """
    packages = ["jinja2"]
    packages += [name for run in plan.runs for name in METHODS[run.method].packages]
    if any(figure not in GALLERY for figure in plan.choice.figures):
        packages.append("matplotlib")
    if plan.pictures:
        packages.append("pyvista")
    missing = [name for name in dict.fromkeys(packages) if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingGroupError(f"reproduce without {' and '.join(missing)}")
    if plan.pictures:
        check_rendering()


def _measure(
    plan: RunPlan, items: Mapping[Run, WorkItem], options: ReproductionOptions, start: float
) -> tuple[RunResults, int]:
    """Do all runs that have no results; return all results, and the number of earlier results."""
    pictured = frozenset(picture.run for picture in plan.pictures)
    before = collect(plan, items, pictured, {})
    memory = memory_of_tasks()
    lost = run_tasks(
        "runs",
        _tasks(before, items, pictured, memory),
        options.n_jobs,
        memory=memory,
        deadline=None if options.budget_seconds is None else start + options.budget_seconds,
    )
    return collect(plan, items, pictured, lost), len(before.done)


def _tasks(
    results: RunResults, items: Mapping[Run, WorkItem], pictured: frozenset[Run], memory: int
) -> list[RunTask]:
    """Return tasks for all runs in `results` that are not done, in the order of the plan."""
    groups: dict[tuple[Any, ...], list[Run]] = {}
    most_segments = max(results.plan.choice.ks)
    for run in results.plan.runs:
        if run not in results.done:
            groups.setdefault((run.source, run.method, run.alpha), []).append(run)
    return [
        RunTask(
            tuple(items[run] for run in runs),
            pictured & frozenset(runs),
            runs[0].setting(most_segments, memory),
        )
        for runs in groups.values()
    ]


def _draw_pictures(
    results: RunResults, items: Mapping[Run, WorkItem], options: ReproductionOptions
) -> tuple[str, ...]:
    """Draw the pictures that are missing or outdated; return a message for each failure."""
    folder = options.output / "pictures"
    folder.mkdir(exist_ok=True)
    drawings = [
        Drawing.of(picture, items[picture.run].key, results.done[picture.run]["labels"], folder)
        for picture in results.plan.pictures
        if picture.run in results.done
    ]
    wanted = [drawing for drawing in drawings if not is_drawn(drawing)]
    ends = run_shown("pictures", wanted, options.n_jobs, memory=memory_of_tasks())
    return tuple(f"{drawing.picture.name}: {end}" for drawing, end in ends if end is not None)


def _outputs(plan: RunPlan, items: Mapping[Run, WorkItem], folder: Path) -> list[Path]:
    paths = [item.path for item in items.values()]
    paths += [picture_path(folder / "pictures", picture) for picture in plan.pictures]
    paths += [folder / name for name in ("runs.csv", "means.csv", "index.html")]
    for figure in plan.choice.figures:
        paths.append(folder / f"figure-{figure}.csv")
        for plot in _plots(folder, figure):
            paths += [plot, plot.with_suffix(".png")]
    return paths


def _plots(folder: Path, figure: str) -> list[Path]:
    """Return the path of the main plot, then for each metric the path of the plot by category."""
    endings = ["", *(f"-{quantity.replace('_', '-')}" for quantity in _QUANTITIES)]
    return [folder / "plots" / f"figure-{figure}{ending}.svg" for ending in endings]


def _write_files(
    results: RunResults, folder: Path
) -> tuple[dict[str, list[Path]], dict[str, Comparison]]:
    write_runs(folder / "runs.csv", results)
    write_means(folder / "means.csv", results)
    plots: dict[str, list[Path]] = {}
    comparisons: dict[str, Comparison] = {}
    (folder / "plots").mkdir(exist_ok=True)
    for figure in results.plan.choice.figures:
        if figure in (*CURVES, "rivals"):
            comparisons[figure] = compare(results, figure)
            plots[figure] = _plot_curves(figure, results, comparisons[figure], folder)
        elif figure == "5":
            plots[figure] = _plot_times(results, folder)
    return plots, comparisons


def _plot_curves(
    figure: str, results: RunResults, comparison: Comparison, folder: Path
) -> list[Path]:
    """Plot the curves of a figure, also by category, and write their points as a CSV file.

    Returns the paths of the plots, or [] if the comparison has no models.
    """
    from .figures import plot_categories, plot_curves

    if not comparison.models:
        return []
    write_points(folder / f"figure-{figure}.csv", results, comparison)
    main, *others = _plots(folder, figure)
    plot_curves(main, results, comparison)
    for path, quantity in zip(others, _QUANTITIES, strict=True):
        plot_categories(path, results, comparison, quantity)
    return [main, *others]


def _plot_times(results: RunResults, folder: Path) -> list[Path]:
    from .figures import plot_times

    k = results.plan.choice.k
    curves = [Curve(*pair) for pair in results.plan.choice.curves_in("5")]
    shown = [curve for curve in curves if results.models_with(curve, (k,))]
    if not shown:
        return []
    path = _plots(folder, "5")[0]
    plot_times(path, results, shown)
    return [path]


def _why_nothing(results: RunResults) -> str:
    if results.failed:
        return f"every run failed; the first failure: {results.reasons()[0]}"
    return "no run was started within --budget-minutes: allow more minutes"
