"""The command ``superfacets reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .._validate import checked_threads
from .failures import print_note
from .options import COUNT, EXISTING_FOLDER, FOLDER, NOT_NEGATIVE, numbers

if TYPE_CHECKING:
    from ..study.reproduce.reproduction import Report


@click.command("reproduce")
@click.argument("benchmark", type=EXISTING_FOLDER)
@click.option(
    "-o", "--output", metavar="OUT", type=FOLDER, required=True, help="Folder for the results."
)
@click.option(
    "--subset",
    "is_subset",
    is_flag=True,
    help="Only the smallest model of each category, k = 50, 150, 300, and fewer alphas.",
)
@click.option("--figures", metavar="LIST", help="Only these, as 4,6 (1 to 8, rivals).")
@click.option("--methods", metavar="LIST", help="Only these, as superfacets,stk02.")
@click.option("--ks", callback=numbers, metavar="LIST", help="Numbers of regions, as 50,150.")
@click.option(
    "--meshes", metavar="DIR", type=EXISTING_FOLDER, help="Large meshes for Figure 1 and Table 1."
)
@click.option(
    "--budget-minutes",
    type=NOT_NEGATIVE,
    help="Begin no task after so many minutes. Pictures and plots come on top.",
)
@click.option("--jobs", "n_jobs", type=COUNT, help="Processes.  [default: one per core]")
def reproduce_command(
    benchmark: Path,
    output: Path,
    is_subset: bool,
    figures: str | None,
    methods: str | None,
    ks: tuple[int, ...] | None,
    meshes: Path | None,
    budget_minutes: float | None,
    n_jobs: int | None,
) -> None:
    """Repeat the paper's comparison on the Princeton benchmark.

    BENCHMARK holds off/N.off and seg/Benchmark/N/N_j.seg. Every run leaves a record in OUT: a
    second start does only what is missing or failed. OUT/index.html shows everything.
    """
    from ..study.reproduce.methods import METHODS
    from ..study.reproduce.plan import FIGURES, KS, SUBSET_KS, Choice
    from ..study.reproduce.reproduction import Options, reproduce

    choice = Choice(
        figures=_names(figures, FIGURES, "figures"),
        methods=_names(methods, tuple(METHODS), "methods"),
        ks=ks or (SUBSET_KS if is_subset else KS),
        is_subset=is_subset,
    )
    options = Options(
        benchmark=benchmark,
        output=output,
        meshes=meshes,
        choice=choice,
        budget_seconds=None if budget_minutes is None else 60 * budget_minutes,
        n_jobs=checked_threads(n_jobs),
    )
    _tell(reproduce(options))


def _names(text: str | None, known: tuple[str, ...], what: str) -> tuple[str, ...]:
    """Names from a comma-separated list, in the order of `known`."""
    if text is None:
        return known
    wanted = [name.strip() for name in text.split(",")]
    for name in wanted:
        if name not in known:
            raise click.UsageError(f"--{what}: there is no {name!r}, only {', '.join(known)}")
    return tuple(name for name in known if name in wanted)


def _tell(report: Report) -> None:
    """Print problems on stderr and results on stdout."""
    results: Any = report.results
    for problem in results.plan.problems:
        print_note(problem)
    for line in results.reasons():
        print_note(f"failed: {line}")
    for line in report.picture_problems:
        print_note(f"not drawn: {line}")
    for line in results.not_started():
        print_note(f"not started within the budget: {line}")
    counts = (len(results.done), len(results.failed), len(results.missing))
    click.echo(
        "{} runs done, {} failed, {} not started".format(*counts)
        + f"; this start took {report.seconds:.1f} seconds\nwrote {report.page}"
    )
