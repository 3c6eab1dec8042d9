"""The command ``superfacets batch``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click

from superfacets import batch
from superfacets.kit import counted
from superfacets_batch import BatchProgress, BatchResult

from . import options as opts
from .failures import EXIT_DATA, is_quiet, print_error, print_notes
from .inputs import mask_values_option
from .interrupts import soon_ended
from .outputs import to_option
from .progress import Progress
from .segment import file_options, options_of, segment_options


@click.command("batch", cls=opts.GroupedCommand)
@click.argument("inputs", metavar="IN...", nargs=-1, required=True)
@opts.options(
    opts.options(
        opts.option("-o --output DIR", opts.FOLDER,
               "Folder for the results and the manifest. Its subfolders mirror the folders of IN.",
               required=True),
        to_option("--to --format"), opts.quiet_option(), group="Everyday options",
    ),
    segment_options,
    opts.options(mask_values_option, opts.labels_named_option, group="Data that borders follow"),
    file_options,
    opts.options(
        opts.option("--workers", opts.COUNT,
               "Number of worker processes on this machine; with 1, files are processed one after"
               " the other in this process.  [default: one per core if Dask is installed, else 1]"),
        opts.option("--scheduler ADDRESS", None,
               "Address of a Dask scheduler, such as tcp://10.0.0.1:8786."),
        opts.option("--timeout SECONDS", opts.POSITIVE,
               "Maximum time per file: a file that takes longer fails, and its worker restarts."
               "  [default: no maximum]"),
        opts.option("--retry-failed", opts.FLAG, "Retry files that failed in an earlier run."),
        opts.json_option("the summary as a JSON object"), group="Running",
    ),
)  # fmt: skip
def batch_command(
    inputs: tuple[str, ...], output: Path, formats: tuple[str, ...], workers: int | None,
    scheduler: str | None, timeout: float | None, retry_failed: bool, as_json: bool, **given: Any,
) -> None:  # fmt: skip
    """Segment thousands of files on all cores, or on a cluster.

    Each IN is a file, a folder, a quoted pattern ("scans/**/*.ply"), or @LIST, a text file with one
    path per line. DIR/manifest.jsonl gets one line per file. A second run segments only files that
    have no valid result yet. If a file fails, the remaining files are still processed, and the exit
    status is 1.
    """
    from tqdm import tqdm

    arguments = options_of(**given).arguments
    tried: list[str] = []
    hidden, delay = is_quiet() or None, Progress.DELAY  # None: hidden if stderr is no terminal
    with tqdm(unit=" files", leave=False, disable=hidden, delay=delay) as bar, soon_ended():

        def progress(state: BatchProgress) -> None:
            bar.total = state.n_files
            bar.update(state.n_ended - bar.n)
            if "error" in state.record:
                tried.append(state.record["name"])
                name, error = state.record["input"], state.record["error"]
                error = error.removeprefix("MeshError: ")
                with tqdm.external_write_mode(file=sys.stderr):
                    print_error(error if name in error else f"{name}: {error}")

        result = batch(
            inputs, output, formats=formats, scheduler=scheduler, workers=workers,
            timeout=timeout, retry_failed=retry_failed, progress=progress, **arguments,
        )  # fmt: skip
    print_notes(result.notes)
    if as_json:
        click.echo(json.dumps(_facts(result, output)))
    elif not is_quiet():
        click.echo(_summary(result))
    if result.n_failed:
        failed = f"{result.n_failed} of {counted(len(result.records), 'file')} failed"
        if not tried:
            failed += " in an earlier run: retry with --retry-failed"
        print_error(failed)
        click.get_current_context().exit(EXIT_DATA)


def _facts(result: BatchResult, output: Path) -> dict[str, Any]:
    counts = {name: getattr(result, name) for name in ("n_done", "n_kept", "n_failed", "n_cells")}
    failed = {record["name"]: record["error"] for record in result.records if "error" in record}
    facts = {"n_files": len(result.records), **counts, "seconds": result.seconds}
    return {**facts, "manifest": str(output / "manifest.jsonl"), "failed": failed}


def _summary(result: BatchResult) -> str:
    pace = result.n_cells / result.seconds
    kept = f", {result.n_kept} done before" if result.n_kept else ""
    return (
        f"{counted(result.n_done, 'file')} done{kept}; {counted(result.n_cells, 'cell')} in"
        f" {result.seconds:.1f} s, {pace:,.0f} cells/s"
    )
