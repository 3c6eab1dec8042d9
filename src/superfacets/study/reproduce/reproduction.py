"""The whole of it, stage by stage: plan, measure, draw, write."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import MeshError, MissingExtraError
from ...io.atomic import remove_leftovers
from ...view.rendering import check_rendering
from .gallery import GALLERY
from .measure import Task, record_failure
from .methods import METHODS
from .page import Files, write_page
from .pictures import Drawing, is_drawn
from .plan import CURVES, Choice, Plan, make_plan
from .processes import Death, Job, run_jobs
from .records import is_blocked, read_record, record_path
from .results import Comparison, Curve, Results, collect, compare
from .runs import Run
from .sources import Sources, find_meshes, find_models
from .tables import write_means, write_points, write_runs

__all__ = ["Options", "Report", "reproduce"]

# Share of the free memory that tasks plan with; the rest is for everything else.
_MEMORY_SHARE = 0.8

# Where the system does not tell.
_MEMORY_UNKNOWN = 4 << 30


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to run and where."""

    benchmark: Path
    output: Path
    meshes: Path | None
    choice: Choice
    budget_seconds: float | None
    """No task is begun after so many seconds."""
    n_jobs: int
    """Worker processes."""


@dataclass(frozen=True)
class Report:
    """What came of it."""

    results: Results
    page: Path
    picture_problems: tuple[str, ...]
    seconds: float


def reproduce(options: Options) -> Report:
    """Run what is missing, and write tables, plots, pictures and the page.

    Raises
    ------
    MeshError
        If no run succeeded.
    ValueError, OSError
        If the folders are not as they should be, or another start is using the output.
    MissingExtraError, RenderError
        If something is missing on this machine for what was chosen; found before anything runs.
    """
    start = time.monotonic()
    plan = _plan(options)
    _check_needs(plan)
    with _locked(options.output):
        # Of starts that were killed, as there is no other now.
        records = options.output / "records"
        remove_leftovers((record_path(records, run) for run in plan.runs), older_than=0.0)
        results, n_before = _measure(plan, options, start)
        if not results.done:
            raise MeshError(_why_nothing(results))
        problems = _draw_pictures(results, options)
        page = options.output / "index.html"
        plots, comparisons = _write_files(results, options.output)
        seconds = time.monotonic() - start
        files = Files(options.output, plots, comparisons, seconds, n_before, problems)
        write_page(page, results, files)
    return Report(results, page, problems, time.monotonic() - start)


def _plan(options: Options) -> Plan:
    nothing = Sources((), ())
    meshes = nothing
    if options.meshes is not None and "1" in options.choice.figures:
        meshes = find_meshes(options.meshes)
    return make_plan(find_models(options.benchmark), meshes, options.choice)


def _check_needs(plan: Plan) -> None:
    """Find out what is not installed before hours of work."""
    packages = [name for run in plan.runs for name in METHODS[run.method].packages]
    if any(figure not in GALLERY for figure in plan.choice.figures):
        packages.append("matplotlib")
    if plan.pictures:
        packages.append("pyvista")
    missing = [name for name in dict.fromkeys(packages) if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingExtraError(f"reproduce without {' and '.join(missing)}", "reproduce")
    if plan.pictures:
        check_rendering()


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Make the folder, and keep other starts out of it, where the system can."""
    folder.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ImportError:  # Windows: two starts at once would do work twice, and no harm
        yield
        return
    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ValueError(f"{folder}: another run is writing there") from None
        yield


def _measure(plan: Plan, options: Options, start: float) -> tuple[Results, int]:
    """Run the tasks that have no records yet; return, too, how many runs were done before."""
    records = options.output / "records"
    pictured = frozenset(picture.run for picture in plan.pictures)
    before = collect(plan, records, pictured)
    memory = _free_memory()
    tasks = _tasks(before, records, pictured, memory)
    deadline = None if options.budget_seconds is None else start + options.budget_seconds
    for task, result in _with_bar("runs", tasks, options.n_jobs, memory, deadline):
        if isinstance(result, Death):
            _record_death(task, result)
    return collect(plan, records, pictured), len(before.done)


def _tasks(results: Results, folder: Path, pictured: frozenset[Run], memory: int) -> list[Task]:
    """Return tasks for all runs that are not done, in the order of the plan."""
    groups: dict[tuple[Any, ...], list[Run]] = {}
    most_segments = max(results.plan.choice.ks)
    for run in results.plan.runs:
        if run not in results.done and not is_blocked(folder, run):
            groups.setdefault((run.source, run.method, run.alpha), []).append(run)
    return [
        Task(
            tuple(runs),
            pictured & frozenset(runs),
            runs[0].setting(most_segments, memory),
            folder,
        )
        for runs in groups.values()
    ]


def _record_death(task: Task, death: Death) -> None:
    """Give the runs that a worker did not come to a record of why."""
    for run in task.runs:
        key = run.key(task.setting.most_segments)
        if read_record(record_path(task.folder, run), key) is None:
            record_failure(task, run, str(death))


def _draw_pictures(results: Results, options: Options) -> tuple[str, ...]:
    """Draw what is not drawn yet; return a line for each failure."""
    folder = options.output / "pictures"
    folder.mkdir(exist_ok=True)
    drawings = [
        Drawing.of(picture, results.done[picture.run], folder)
        for picture in results.plan.pictures
        if picture.run in results.done
    ]
    wanted = [drawing for drawing in drawings if not is_drawn(drawing)]
    ends = _with_bar("pictures", wanted, options.n_jobs, _free_memory(), None)
    return tuple(f"{drawing.picture.name}: {end}" for drawing, end in ends if end is not None)


def _with_bar(
    name: str, jobs: Sequence[Job], n_jobs: int, memory: int, deadline: float | None
) -> Iterator[tuple[Any, Any]]:
    """Run jobs in workers, with a progress bar on a terminal."""
    from tqdm import tqdm

    ends = run_jobs(jobs, n_jobs, memory=memory, deadline=deadline)
    with (
        contextlib.closing(ends),
        tqdm(total=len(jobs), desc=name, unit="task", disable=None, leave=False) as bar,
    ):
        for job, result in ends:
            yield job, result
            bar.update()


def _write_files(
    results: Results, folder: Path
) -> tuple[dict[str, list[Path]], dict[str, Comparison]]:
    """Write tables and plots."""
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


def _plot_curves(figure: str, results: Results, comparison: Comparison, folder: Path) -> list[Path]:
    """Plot a figure, and the same by category; nothing if there is nothing to compare."""
    from .figures import plot_categories, plot_curves

    if not comparison.models:
        return []
    write_points(folder / f"figure-{figure}.csv", results, comparison)
    name = folder / "plots" / f"figure-{figure}.svg"
    plot_curves(name, results, comparison)
    paths = [name]
    for quantity in ("undersegmentation_error", "compactness"):
        path = name.with_name(f"figure-{figure}-{quantity.replace('_', '-')}.svg")
        plot_categories(path, results, comparison, quantity)
        paths.append(path)
    return paths


def _plot_times(results: Results, folder: Path) -> list[Path]:
    from .figures import plot_times

    k = results.plan.choice.k
    curves = [
        Curve(method, METHODS[method].usual_alpha) for method in results.plan.choice.methods_in("5")
    ]
    shown = [curve for curve in curves if results.models_with(curve, (k,))]
    if not shown:
        return []
    path = folder / "plots" / "figure-5.svg"
    plot_times(path, results, shown)
    return [path]


def _why_nothing(results: Results) -> str:
    if results.failed:
        return f"every run failed; the first: {results.reasons()[0]}"
    return "no run was started within the budget"


def _free_memory() -> int:
    """Bytes that tasks may use together."""
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(line for line in lines if line.startswith("MemAvailable"))
        return int(_MEMORY_SHARE * 1024 * int(free.split()[1]))
    with contextlib.suppress(AttributeError, OSError, ValueError):
        pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        return int(_MEMORY_SHARE * pages)
    return _MEMORY_UNKNOWN
