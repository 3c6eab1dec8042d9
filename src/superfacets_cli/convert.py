"""The command ``superfacets convert``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, MeshError, kit, write_regions
from superfacets.kit import FORMATS, Cells, FormatOptions, Ints
from superfacets_scans import GROUPS, regroup_segments

from . import options as opts
from .failures import EXIT_DATA, count_failures, is_quiet, print_note, print_notes
from .inputs import GivenLabels, given_labels, labels_of_cells, read_input
from .interrupts import run_in_background
from .options import FILE, option, options
from .outputs import Job, output_option, plan_jobs, to_option
from .progress import WaitBar
from .report import notes_on_numbers, notes_on_written

_KEPT_IN_PARTS = (*FORMATS.attribute_outputs, ".csv")
"""Endings of files of --split that keep properties of the input; CSV keeps only ``label``."""


@click.command("convert")
@click.argument("mesh", metavar="IN|FOLDER", type=FILE)
@click.argument("labels", metavar="[LABELS]", type=FILE, required=False)
@options(
    output_option(
        "Output file in any format that segment -o writes, a folder (results/), or - for standard"
        " output; may be given several times."),
    option("--split folder DIR", opts.FOLDER,
           "Write each region to a separate file in this folder, such as DIR/region_17.ply."
           " Existing files with these names are replaced. DIR must not contain other region files"
           " of the same format."),
    to_option("Format of outputs whose file name is not given"),
    option("--segments FILE", FILE,
           "The .segs.json that belongs to IN, if IN is an .aggregation.json.  [default: the file"
           " named in IN]"),
    opts.labels_named_option,
    opts.format_option("IN"),
    opts.ascii_option,
    opts.label_options,
    opts.drop_attributes_option("IN"),
    opts.force_option,
    opts.quiet_option(),
    opts.json_option(),
)  # fmt: skip
@click.pass_context
def convert_command(
    ctx: click.Context, /, mesh: Path, labels: Path | None, outputs: tuple[str, ...],
    folder: Path | None, segments: Path | None, formats: tuple[str, ...], labels_named: str,
    format: str | None, ascii: bool, label_name: str, vertex_labels: bool, drop_attributes: bool,
    force: bool, as_json: bool,
) -> None:  # fmt: skip
    """Write meshes with their labels in other formats.

    If LABELS is not given, labels stored in IN are written. All meshes and point clouds of a FOLDER
    are converted, and written to the folder that -o names. If IN is an .aggregation.json, LABELS
    are new segments (.segs.json): the objects of IN are rewritten as groups of the new segments,
    and a table shows how many vertices each object loses and gains.
    """
    if mesh.name.endswith(GROUPS):
        chosen = {"segments": segments, "force": force}
        _regroup(mesh, labels, outputs, chosen, as_json=as_json)
        return
    if segments is not None:
        raise click.UsageError("--segments can be given only if IN is an .aggregation.json")
    inputs = _inputs_of(mesh, labels, folder)
    jobs, ending = _plan(inputs, labels, outputs, folder, formats, ascii=ascii)
    form = FormatOptions.checked(
        [ending for job in jobs for ending in job.endings], ascii=ascii, label_name=label_name,
        vertex_labels=vertex_labels, force=force,
    )  # fmt: skip
    keeps = not drop_attributes
    run = _Run(labels, labels_named, format, form, folder, ending, keeps, as_json)
    if count_failures([job.input for job in jobs], lambda i: run.do(jobs[i])):
        ctx.exit(EXIT_DATA)


def _regroup(
    groups: Path, labels: Path | None, outputs: tuple[str, ...], chosen: dict[str, Any], *,
    as_json: bool,
) -> None:  # fmt: skip
    """Rewrite an .aggregation.json for new segments, and print the changes of its objects."""
    if labels is None or len(outputs) != 1:
        raise click.UsageError(
            "to convert an .aggregation.json, give new segments (.segs.json) as LABELS, and -o once"
        )
    objects = regroup_segments(outputs[0], groups, labels, **chosen)
    if as_json:
        facts = {"file": str(groups), "objects": [found._asdict() for found in objects]}
        click.echo(json.dumps({**facts, "outputs": list(outputs)}))
    elif not is_quiet():
        click.echo(f"{'object':>8} {'vertices':>9} {'lost':>7} {'gained':>7}  label")
        for found in objects:
            counts = f"{found.n_vertices:>9} {found.n_lost:>7} {found.n_gained:>7}"
            click.echo(f"{found.object_id:>8} {counts}  {found.label}")
        click.echo(f"wrote {outputs[0]}")


@dataclass(frozen=True)
class _Run:
    """Options of the command that apply to every file."""

    labels: Path | None
    labels_named: str
    format: str | None  # format of the input; None to use the file ending
    form: FormatOptions
    folder: Path | None  # folder of --split
    ending: str | None  # file ending of --split; None for the default format
    keeps_attributes: bool
    as_json: bool

    def do(self, job: Job) -> None:
        """Convert one file, and print a report."""
        outputs = job.outputs(self.form)
        outputs.check()
        cells, given, attributes = run_in_background(lambda: self._read(job))
        labels = of_vertices = None
        if given is not None:
            is_kept = self.folder is None and {*job.endings} <= {*FORMATS.unconverted_outputs}
            labels = labels_of_cells(cells, given, is_noted=not is_kept)
            of_vertices = given.labels if given.are_of_vertices else None
        if labels is None and (self.folder is not None or job.holds_labels):
            task = "write" if self.folder is None else "split it by"
            raise MeshError(
                f"{job.input}: there are no labels to {task} (none called {self.labels_named}):"
                " give a label file as LABELS, or the name of the labels with --labels-named"
            )
        parts = [] if labels is None else self._split(cells, labels, attributes)
        with WaitBar():
            written = outputs.write(cells, labels, attributes=attributes, of_vertices=of_vertices)
        print_notes(
            notes_on_written(cells, attributes, job.endings, written)
            + notes_on_numbers(labels, job.endings, written.region_sizes)
        )
        if self.as_json:
            n_labels = None if given is None else len(np.unique(given.labels[given.labels >= 0]))
            facts = {f"n_{kit.kind_of(cells).noun}s": cells.n_cells, "n_labels": n_labels}
            named = {"file": job.input, **facts, "outputs": [*job.names, *parts]}
            job.print(json.dumps(named))
        elif not is_quiet():
            names = [
                *job.written(kit.kind_of(cells).noun),
                *([f"{kit.counted(len(parts), 'file')} in {self.folder}"] if parts else []),
            ]
            job.print("\n".join(f"wrote {name}" for name in names))

    def _split(self, cells: Cells, labels: Ints, attributes: MeshAttributes | None) -> list[str]:
        """Write the files of --split, and return their paths."""
        if self.folder is None:
            return []
        ending = (
            FORMATS.usual_output(kit.kind_of(cells).name) if self.ending is None else self.ending
        )
        kept = attributes if ending in _KEPT_IN_PARTS else None
        paths = write_regions(
            self.folder, cells, labels, ending=ending, attributes=kept, ascii=self.form.ascii
        )
        if kept is not None and kept.texture is not None:
            print_note(f"no texture in the files of {self.folder}")
        return [str(path) for path in paths]

    def _read(self, job: Job) -> tuple[Cells, GivenLabels | None, MeshAttributes | None]:
        is_kept_in_parts = self.folder is not None and self.ending in (None, *_KEPT_IN_PARTS)
        keep = (job.holds_attributes or is_kept_in_parts) and self.keeps_attributes
        path = Path(job.input)
        source = read_input(job.input, self.format)
        cells, attributes = source.cells_and_attributes(keep=keep)
        if self.labels is not None:
            of_file = given_labels(source, cells, self.labels, self.labels_named)
            return cells, of_file, attributes
        labels = source.labels(cells.n_cells, self.labels_named)
        given = None if labels is None else GivenLabels(path, labels, False)
        return cells, given, attributes


def _inputs_of(mesh: Path, labels: Path | None, folder: Path | None) -> list[str]:
    """Return the input file, or all files of an input folder."""
    if not mesh.is_dir():
        return [str(mesh)]
    if labels is not None or folder is not None:
        raise click.UsageError("LABELS and --split need a single mesh, but IN is a folder")
    return [source.input for source in kit.InputFile.find(mesh)]


def _plan(
    inputs: Sequence[str], labels: Path | None, outputs: tuple[str, ...],
    folder: Path | None, formats: tuple[str, ...], *, ascii: bool,
) -> tuple[list[Job], str | None]:  # fmt: skip
    """Return a job per input, and the file ending for --split, or None for the default ending."""
    if not outputs and folder is None:
        raise click.UsageError("nothing to write: name a file with -o, or a folder with --split")
    also_read = [] if labels is None else [str(labels)]
    if folder is None:
        jobs = plan_jobs(inputs, outputs, formats, ascii=ascii, also_read=also_read)
        return jobs, None
    for path in (Path(name) for name in [*inputs, *also_read]):
        if path.name.startswith("region_") and path.resolve().parent == folder.resolve():
            raise click.UsageError(f"{path}: a file written by --split could overwrite the input")
    if len(formats) > 1:
        raise click.UsageError("--split writes a single format: give --to only once")
    ending = FORMATS.ending_of[formats[0]] if formats else None
    if not outputs:
        return [Job(inputs[0], ())], ending
    return plan_jobs(inputs, outputs, (), ascii=ascii, also_read=also_read), ending
