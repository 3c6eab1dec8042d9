"""The command ``superfacets transfer``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, transfer
from superfacets.kit import Cells, Ints, counted, kind_of

from .inputs import labels_for, read_input
from .interrupts import run_in_background
from .options import FILE, NOT_NEGATIVE, drop_attributes_option, format_option, option
from .outputs import OneRun, one_output_options


@click.command("transfer")
@click.argument("source", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("target", metavar="TARGET", type=FILE)
@option(
    "--max-distance", NOT_NEGATIVE,
    "Cells of TARGET farther than this from IN, in units of IN, get label -1.  [default: no limit]",
)  # fmt: skip
@one_output_options("TARGET with its labels, or the labels alone", "TARGET")
@format_option("IN")
@format_option("TARGET", name="--target-format")
@drop_attributes_option("TARGET")
def transfer_command(
    source: Path, labels: Path, target: Path, max_distance: float | None, format: str | None,
    target_format: str | None, **given: Any,
) -> None:  # fmt: skip
    """Transfer labels to another mesh or cloud of the same object.

    TARGET must have the same position as IN. Each face or point of TARGET gets the label of the
    nearest face or point of IN. LABELS is a .npy, .seg or .txt file, or a labeled .ply or .vtp; if
    IN contains the labels, give IN again.
    """
    run = OneRun(target, (source, labels), given)

    def compute() -> tuple[Cells, MeshAttributes | None, Ints]:
        origin = read_input(str(source), format)
        cells = origin.cells()
        of_source = labels_for(origin, cells, labels, run.labels_named, is_quiet=run.is_quiet)
        file = read_input(str(target), target_format)
        goal, attributes = file.cells_and_attributes(keep=run.keeps_attributes)
        run.outputs.check_fit(goal)
        with warnings.catch_warnings(record=True) as caught:  # warnings become notes
            carried = transfer(
                cells, of_source, goal, max_distance=max_distance, n_threads=run.n_threads
            )
        notes.extend(str(warning.message) for warning in caught)
        return goal, attributes, carried

    notes: list[str] = []
    goal, attributes, carried = run_in_background(compute)
    run.write(goal, carried, attributes, notes)
    n_without = int(np.count_nonzero(carried < 0))
    n_labels = len(np.unique(carried[carried >= 0]))
    noun = kind_of(goal).noun
    facts = {f"n_{noun}s": len(carried), "n_labels": n_labels, "n_without": n_without}
    without = f", {n_without} without a label" if n_without else ""
    run.report(facts, f"{counted(len(carried), noun)}, {counted(n_labels, 'label')}{without}", noun)
