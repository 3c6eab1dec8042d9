"""The command ``superfacets transfer``."""

from __future__ import annotations

import warnings
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from ..cells.kinds import kind_of
from ..export.cells import FormatOptions
from ..export.write import check_fit, check_outputs
from ..io.attributes import MeshAttributes
from ..io.guards import counted
from ..io.readers.labels import read_labels
from ..mesh.cells import Cells
from ..regions.nearest_labels import transfer
from .failures import print_note
from .inputs import load_cells, load_cells_and_attributes
from .interrupts import run_in_background
from .options import (
    FILE,
    NOT_NEGATIVE,
    ascii_option,
    drop_attributes_option,
    force_option,
    format_option,
    labels_named_option,
    quiet_option,
    threads_option,
)
from .outputs import Job, output_option, plan_jobs, to_option
from .report import notes_on_written


@click.command("transfer")
@click.argument("source", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("target", metavar="TARGET", type=FILE)
@click.option(
    "--max-distance",
    type=NOT_NEGATIVE,
    help="What is farther than this from IN, in its unit, gets the label -1.  [default: no limit]",
)
@output_option(
    "TARGET with its labels, or the labels alone, in any format that segment writes; may be"
    " given several times. Or a folder (results/), or - for standard output."
    "  [default: TARGET.superfacets.ply beside TARGET]"
)
@to_option()
@labels_named_option
@format_option("IN")
@format_option("TARGET", name="--target-format")
@ascii_option
@drop_attributes_option("TARGET")
@force_option
@threads_option
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def transfer_command(
    source: Path, labels: Path, target: Path, max_distance: float | None,
    outputs: tuple[str, ...], formats: tuple[str, ...], labels_named: str, format: str | None,
    target_format: str | None, ascii: bool, drop_attributes: bool, n_threads: int | None,
    force: bool, is_quiet: bool, as_json: bool,
) -> None:  # fmt: skip
    """Carry labels to another mesh or point cloud of the same object.

    TARGET must be of the same object, in the same place. Each of its faces or points gets the label
    of the nearest face or point of IN. LABELS are read from .npy, .seg, .txt or labeled .ply or
    .vtp files; a labeled IN may be given twice.
    """
    read = (str(source), str(labels))
    (job,) = plan_jobs((str(target),), outputs, formats, ascii=ascii, also_read=read)
    check_outputs(job.files, force=force)

    form = FormatOptions(ascii=ascii, force=force)

    def compute() -> tuple[Cells, MeshAttributes | None, npt.NDArray[np.int32]]:
        cells = load_cells(str(source), format)
        given = read_labels(labels, cells.n_cells, name=labels_named)
        keeps = job.holds_attributes and not drop_attributes
        goal, attributes = load_cells_and_attributes(str(target), target_format, keep=keeps)
        check_fit(goal, None, job.endings, form)
        with warnings.catch_warnings(record=True) as caught:  # printed as notes
            carried = transfer(cells, given, goal, max_distance=max_distance, n_threads=n_threads)
        far.extend(str(warning.message) for warning in caught)
        return goal, attributes, carried

    far: list[str] = []
    goal, attributes, carried = run_in_background(compute)
    n_lost = job.write(goal, carried, attributes=attributes, options=form)
    if not is_quiet:
        for note in [*far, *notes_on_written(goal, attributes, job.endings, n_lost)]:
            print_note(note)
    _report(job, goal, carried, as_json=as_json, is_quiet=is_quiet)


def _report(
    job: Job, goal: Cells, labels: npt.NDArray[np.int32], *, as_json: bool, is_quiet: bool
) -> None:
    """Print counts and files."""
    n_without = int(np.count_nonzero(labels < 0))
    n_labels = len(np.unique(labels[labels >= 0]))
    noun = kind_of(goal).noun
    facts = {f"n_{noun}s": len(labels), "n_labels": n_labels, "n_without": n_without}
    without = f", {n_without} without" if n_without else ""
    counts = f"{counted(len(labels), noun)}, {counted(n_labels, 'label')}{without}"
    text = f"{job.name}: {counts}"
    job.report(facts, text, as_json=as_json, is_quiet=is_quiet)
