"""The command ``superfacets segment``."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, MeshError, Segmentation, kit
from superfacets.kit import Array, CellFile, Cells, FileOptions, FormatOptions, OutputFiles

from .failures import EXIT_DATA, count_failures, print_note, print_notes
from .inputs import (
    barrier_angle_option,
    check_inputs,
    constraint_options,
    constraints_of,
    name_of,
    read_input,
)
from .interrupts import run_in_background
from .options import (
    FLAG,
    INPUT,
    format_option,
    json_option,
    labels_named_option,
    option,
    options,
    quiet_option,
)
from .outputs import Job, check_mask, output_option, plan_jobs, to_option
from .progress import RunBar
from .report import facts_of, notes_of, summary_of
from .segment_options import SegmentCommand, file_options, options_of, segment_options


@click.command("segment", cls=SegmentCommand)
@click.argument("inputs", metavar="IN...", type=INPUT, nargs=-1, required=True)
@options(
    segment_options,
    constraint_options,
    barrier_angle_option,
    labels_named_option,
    output_option(
        "Output file, a folder (results/) for the files of all inputs, or - for standard output;"
        " may be given several times. A file can be a mesh with labels (.ply, .vtp, .obj, .stl,"
        " .off or .glb; .vtu or .vtk for tetrahedra), a point cloud with labels (.ply, .csv, .pcd,"
        " .las or .laz), labels alone (.npy, .seg or .txt), vertex labels (.segs.json, .bin,"
        " _sp_label.npy, .pth, .label.gii or .annot), an image of labels (.ids.png), annotations"
        " (.sstk.json or .aggregation.json), or a region graph (.npz)."
        "  [default: IN.superfacets.ply beside IN]"),
    to_option(),
    format_option("the inputs", of_stream=True),
    file_options,
    quiet_option,
    option("-v --verbose is_verbose", FLAG, "Also print the time of each stage."),
    json_option("the results as JSON, one line per IN"),
)  # fmt: skip
@click.pass_context
def segment_command(
    ctx: click.Context, /, inputs: tuple[str, ...], outputs: tuple[str, ...],
    formats: tuple[str, ...], format: str | None, mask: Path | None,
    mask_values: tuple[int, ...] | None, barriers: Path | None, barrier_angle: float | None,
    labels_named: str, is_quiet: bool, is_verbose: bool, as_json: bool, **given: Any,
) -> None:  # fmt: skip
    """Segment meshes and point clouds, and write their labels.

    IN may be - for standard input. The result is then written to standard output, unless -o names
    another output. If the result is written to standard output, messages are printed on stderr. If
    an input fails, the remaining inputs are still processed, and the exit status is 1.
    """
    scans = given["scans"]
    chosen = options_of(**given)
    check_inputs(inputs)
    if barriers is not None and barrier_angle is not None:
        raise click.UsageError("give --barriers or --barrier-angle, not both")
    if len(inputs) > 1 and (mask is not None or barriers is not None):
        raise click.UsageError(
            "files of --mask and --barriers fit only one input: to read values from each input,"
            " give --mask-values without --mask"
        )
    also_read = [str(path) for path in (mask, barriers) if path is not None]
    jobs = plan_jobs(inputs, outputs, formats, ascii=chosen.ascii, also_read=also_read)
    endings = [ending for job in jobs for ending in job.endings]
    has_mask = mask is not None or mask_values is not None
    check_mask(endings, has_mask=has_mask)
    form = chosen.form(endings)
    constraints = partial(constraints_of, mask, mask_values, barriers, name=labels_named)
    run = _Run(
        chosen, format, form, constraints, barrier_angle, has_mask, scans, is_quiet, as_json,
        is_verbose,
    )  # fmt: skip
    named = [name_of(job.input) for job in jobs]
    if count_failures(named, lambda i: run.do(jobs[i]), lambda i, m: run.print_failure(jobs[i], m)):
        ctx.exit(EXIT_DATA)


@dataclass(frozen=True)
class _Run:
    """Options of the command that apply to every job."""

    options: FileOptions
    format: str | None
    form: FormatOptions
    constraints: Callable[[CellFile, Cells], dict[str, Array]]
    barrier_angle: float | None
    has_mask: bool
    scans: bool
    is_quiet: bool
    as_json: bool
    is_verbose: bool

    def print_failure(self, job: Job, message: str) -> None:
        """Print a failure as a JSON object if ``--json`` is given."""
        if self.as_json:
            job.print(json.dumps({"file": job.input, "error": message}))

    def do(self, job: Job) -> None:
        """Run one job, and print a report."""
        outputs = job.outputs(self.form)
        outputs.check()
        timings: dict[str, float] = {}
        with RunBar(name_of(job.input), is_quiet=self.is_quiet) as bar:
            outcome = run_in_background(
                lambda: self._compute(job, outputs, bar, timings), tick=bar.draw
            )
            with bar.timed("export", timings):
                sizes = outcome.write(outputs)
        result, noun = outcome.result, kit.kind_of(outcome.mesh).noun
        timings = {**result.timings, **timings}
        if not self.is_quiet:
            asked = self.options.keywords.get("n_segments")
            print_notes(notes_of(outcome, asked, job.endings, sizes, job.holds_labels))
        n_left_out = int(np.count_nonzero(result.labels < 0))
        if self.has_mask and not n_left_out and not self.is_quiet:
            print_note(f"the mask leaves out no {noun}")
        inside = outcome.sharp_inside
        share = None if inside is None else float(inside.sum())
        self._report(job, result, timings, noun, n_left_out, share)

    def _report(
        self, job: Job, result: Segmentation, timings: Mapping[str, float], noun: str,
        n_left_out: int = 0, sharp_inside: float | None = None,
    ) -> None:  # fmt: skip
        summary = summary_of(
            result, timings, noun, n_left_out, denoise=self.options.keywords.get("denoise"),
            is_verbose=self.is_verbose,
        )  # fmt: skip
        text = f"{job.name}: {summary}"
        if sharp_inside == 0:
            text += "; all sharp edges are on borders"
        facts = facts_of(result, timings, noun, sharp_inside)
        job.report(facts, text, noun, as_json=self.as_json, is_quiet=self.is_quiet)

    def _compute(
        self, job: Job, outputs: OutputFiles, bar: RunBar, timings: dict[str, float]
    ) -> Any:
        """Read, subdivide and segment the input, without writing files."""
        return self.options.segment(
            lambda keep: self._load(job, outputs, keep=keep),
            holds_attributes=job.holds_attributes,
            timings=timings,
            barrier_angle=self.barrier_angle,
            progress=bar.on_iteration,
            on_stage=bar.on_stage,
        )

    def _load(
        self, job: Job, outputs: OutputFiles, *, keep: bool
    ) -> tuple[Cells, MeshAttributes | None, dict[str, Array]]:
        """Read the input and its constraints.

        Raises an error if an output format cannot store this kind of cells.
        """
        source = read_input(job.input, self.format)
        cells, attributes = source.cells_and_attributes(keep=keep)
        self._check_kind(job, cells)
        outputs.check_fit(cells)
        return cells, attributes, self.constraints(source, cells)

    def _check_kind(self, job: Job, cells: Cells) -> None:
        """Raise a MeshError if options for meshes are given with a point cloud."""
        if not kit.kind_of(cells).are_points:
            return
        typed = "--subdivide" if self.options.subdivide else None
        if self.options.keywords.get("denoise"):
            typed = "--scans" if self.scans else "--denoise"
        if typed is not None:
            raise MeshError(
                f"{name_of(job.input)}: {typed} is for meshes, but this is a point cloud"
            )
        if self.barrier_angle is not None:
            raise MeshError(
                f"{name_of(job.input)}: --barrier-angle needs a mesh: point clouds have no edges"
            )
