"""The commands ``python -m research reproduce``, ``quality`` and ``superpoints``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from superfacets.base.checks import checked_threads, counted
from superfacets_cli import options as opts
from superfacets_cli.failures import print_notes
from superfacets_cli.main import run
from superfacets_cli.options import COUNT, FILE, Listed, option, options

if TYPE_CHECKING:
    from .reproduce.reproduction import ReproductionReport

_results_option = option("-o --output OUT", opts.FOLDER, "Folder for the results.", required=True)
_jobs_option = option("--jobs n_jobs", COUNT, "Number of processes.  [default: one per core]")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def commands() -> None:
    """Compare superfacets with other methods, and reproduce the figures of the paper."""


@commands.command("reproduce")
@click.argument("benchmark", type=opts.EXISTING_FOLDER)
@options(
    _results_option,
    option("--subset is_subset", opts.FLAG,
           "Use only the smallest model of each category, 50, 150 and 300 regions, and fewer values"
           " of alpha."),
    option("--figures LIST", None,
           "Figures to reproduce, such as 4,6: numbers from 1 to 8, or rivals.  [default: all]"),
    option("--methods LIST", None,
           "Methods to compare, such as superfacets,stk02.  [default: all]"),
    option("--ks LIST", Listed(COUNT), "Numbers of regions, such as 50,150."),
    option("--meshes DIR", opts.EXISTING_FOLDER,
           "Folder with large meshes for Figure 1 and Table 1."),
    option("--budget-minutes", opts.NOT_NEGATIVE,
           "Start no runs after this many minutes. Drawing the figures takes additional time."),
    _jobs_option,
)  # fmt: skip
def reproduce_command(
    benchmark: Path, output: Path, is_subset: bool, figures: str | None, methods: str | None,
    ks: tuple[int, ...] | None, meshes: Path | None, budget_minutes: float | None,
    n_jobs: int | None,
) -> None:  # fmt: skip
    """Repeat the paper's comparison on the Princeton benchmark.

    BENCHMARK is a folder with the files off/N.off and seg/Benchmark/N/N_j.seg. Each run writes a
    record to OUT, and a second start repeats only missing and failed runs. OUT/index.html shows all
    results.
    """
    from .reproduce.methods import METHODS
    from .reproduce.plan import FIGURES, KS, SUBSET_KS, Choice
    from .reproduce.reproduction import ReproductionOptions, reproduce

    choice = Choice(
        figures=_names(figures, FIGURES, "figures"),
        methods=_names(methods, tuple(METHODS), "methods"),
        ks=ks or (SUBSET_KS if is_subset else KS),
        is_subset=is_subset,
    )
    budget = None if budget_minutes is None else 60 * budget_minutes
    chosen = ReproductionOptions(
        benchmark=benchmark, output=output, meshes=meshes, choice=choice, budget_seconds=budget,
        n_jobs=checked_threads(n_jobs),
    )  # fmt: skip
    _print_report(reproduce(chosen))


@commands.command("quality")
@click.argument("benchmark", type=opts.EXISTING_FOLDER)
@options(
    _results_option,
    option("--ks LIST", Listed(COUNT), "Numbers of regions.  [default: 50 to 300]"),
    option("--models LIST", Listed(COUNT),
           "Numbers of the models to use, such as 5,125,397.  [default: all]"),
    option("--every", COUNT, "Use every N-th model only; 2 means every second model.", default=1),
    option("--finer n_finer", opts.Count(0),
           "Number of models that are also tested at other resolutions.", default=10),
    _jobs_option,
)  # fmt: skip
def quality_command(ks: tuple[int, ...] | None, n_jobs: int | None, **given: Any) -> None:
    """Compare variants of the method on the Princeton benchmark.

    BENCHMARK is a folder with the files off/N.off and seg/Benchmark/N/N_j.seg. Each run writes a
    record to OUT, and a second start repeats only missing and failed runs. Tables are printed, and
    written to OUT/tables.md. OUT/runs.csv has one row per run.
    """
    from .quality.measure import KS
    from .quality.study import StudyOptions, study

    report = study(StudyOptions(ks=ks or KS, n_jobs=checked_threads(n_jobs), **given))
    print_notes(report.problems)
    click.echo(report.tables)


@commands.command("superpoints")
@click.argument("rooms", type=opts.EXISTING_FOLDER)
@options(
    option("--labels folders DIR", opts.EXISTING_FOLDER,
           "Folder with a file of vertex labels for each room: ROOM.segs.json,"
           " ROOM.0.010000.segs.json or, if there is none, one file of another format. Adds a row"
           " to the table; may be given several times.", multiple=True),
    option("-o --output OUT", FILE, "CSV file for the scores of each room and method."),
)  # fmt: skip
def superpoints_command(rooms: Path, folders: tuple[Path, ...], output: Path | None) -> None:
    """Compare superpoints with the segments of other methods.

    ROOMS is a folder of .npz files. Each file contains the arrays vertices, faces and instances
    (the true object of each vertex, or -1 for vertices without annotation), and optionally colors
    and felzenszwalb (the segment of each vertex from ScanNet's segmenter, which is computed if it
    is missing). There are as many superpoints as segments in felzenszwalb. Each superpoint is
    assigned to the object that most of its vertices belong to. The table shows the fraction of
    vertices with a wrong object, and the mean IoU of objects. Rooms whose names end in a level of
    noise, such as _n1, are averaged for each level.
    """
    from .superpoints import study

    click.echo(study(rooms.glob("*.npz"), folders, output))


def _names(text: str | None, known: tuple[str, ...], what: str) -> tuple[str, ...]:
    """Return names from a comma-separated list, in the order of `known`."""
    if text is None:
        return known
    wanted = [name.strip() for name in text.split(",")]
    for name in wanted:
        if name not in known:
            raise click.UsageError(f"--{what}: {name!r} is not one of {', '.join(known)}")
    return tuple(name for name in known if name in wanted)


def _print_report(report: ReproductionReport) -> None:
    """Print problems on stderr and results on stdout."""
    results: Any = report.results
    print_notes(results.plan.problems)
    print_notes(f"failed: {line}" for line in results.reasons())
    print_notes(f"picture not drawn: {line}" for line in report.picture_problems)
    print_notes(f"not started because time ran out: {line}" for line in results.not_started())
    click.echo(
        f"{counted(len(results.done), 'run')} done, {len(results.failed)} failed,"
        f" {len(results.missing)} not started; this start took {report.seconds:.1f} seconds\n"
        f"wrote {report.page}"
    )


if __name__ == "__main__":
    run(commands, "python -m research")
