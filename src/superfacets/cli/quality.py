"""The command ``superfacets quality``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._validate import checked_threads
from .failures import print_note
from .options import COUNT, EXISTING_FOLDER, FOLDER, Count, numbers


@click.command("quality")
@click.argument("benchmark", type=EXISTING_FOLDER)
@click.option(
    "-o", "--output", metavar="OUT", type=FOLDER, required=True, help="Folder for the results."
)
@click.option(
    "--ks", callback=numbers, metavar="LIST", help="Numbers of regions.  [default: 50 to 300]"
)
@click.option("--models", callback=numbers, metavar="LIST", help="Only these, as 5,125,397.")
@click.option("--every", type=COUNT, default=1, help="Only every so many-th of the models.")
@click.option(
    "--finer",
    "n_finer",
    type=Count(0),
    default=10,
    show_default=True,
    help="Models that are subdivided and decimated, too.",
)
@click.option("--jobs", "n_jobs", type=COUNT, help="Processes.  [default: one per core]")
def quality_command(
    benchmark: Path,
    output: Path,
    ks: tuple[int, ...] | None,
    n_jobs: int | None,
    **options: Any,
) -> None:
    """Compare variants of the method on the Princeton benchmark.

    BENCHMARK holds off/N.off and seg/Benchmark/N/N_j.seg. Every run leaves a record in OUT: a
    second start does only what is missing or failed. Tables are printed, and written to
    OUT/tables.md; OUT/runs.csv has a row for every run.
    """
    from ..study.quality.measure import KS
    from ..study.quality.study import Options, study

    report = study(
        Options(
            benchmark=benchmark,
            output=output,
            ks=ks or KS,
            n_jobs=checked_threads(n_jobs),
            **options,
        )
    )
    for problem in report.problems:
        print_note(problem)
    click.echo(report.tables)
