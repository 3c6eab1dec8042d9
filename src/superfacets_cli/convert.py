"""The command ``superfacets convert``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, MeshError, kit, write_regions
from superfacets.kit import FORMATS, Cells

from . import options as opts
from .failures import for_each, print_note
from .inputs import GivenLabels, given_labels, labels_of_cells, read_input
from .interrupts import run_in_background
from .options import FILE, option, options
from .outputs import Job, output_option, plan_jobs, to_option
from .progress import Progress


@click.command("convert")
@click.argument("mesh", metavar="IN|FOLDER", type=FILE)
@opts.labels_argument
@options(
    output_option(
        "Output file in any format that segment -o writes, a folder (results/), or - for standard"
        " output. This option may be given several times."),
    option("--split folder DIR", opts.FOLDER,
           "Instead of -o: write each region to a separate file in this folder, such as"
           " DIR/region_017.ply. Existing files with these names are replaced. DIR must not contain"
           " other region files of the same format."),
    to_option(), opts.labels_named_option, opts.format_option("IN"), opts.ascii_option,
    opts.label_options, opts.drop_attributes_option("IN"), opts.force_option,
    opts.quiet_option(), opts.json_option(),
)  # fmt: skip
def convert_command(mesh: Path, labels: Path | None, folder: Path | None, **given: Any) -> None:
    """Write meshes with their labels in other formats.

    If LABELS is not given, labels stored in IN are written. All meshes and point clouds of a FOLDER
    are converted, and written to the folder that -o names.
    """
    outputs, formats = given["outputs"], given["formats"]
    if bool(outputs) == (folder is not None):
        raise click.UsageError("give -o a file or a folder, or --split a folder, not both")
    inputs = [str(mesh)]
    if mesh.is_dir():
        if labels is not None or folder is not None:
            raise click.UsageError("LABELS and --split need a single mesh, but IN is a folder")
        inputs = [source.input for source in kit.InputFile.find(mesh)]
    if folder is None:
        jobs = plan_jobs(inputs, given, (labels,))
    else:
        jobs = [Job(str(mesh), ())]
        for path in [mesh] if labels is None else [mesh, labels]:
            if path.name.startswith("region_") and path.resolve().parent == folder.resolve():
                raise click.UsageError(f"{path}: --split could overwrite the input")
        if len(formats) > 1:
            raise click.UsageError("--split writes a single format: give --to only once")
    for_each(inputs, lambda i: _Run(labels, folder, given).do(jobs[i]))


@dataclass(frozen=True)
class _Run:
    """Options of the command that apply to every file."""

    labels: Path | None
    folder: Path | None  # folder of --split
    given: dict[str, Any]

    def do(self, job: Job) -> None:
        """Convert one file, and print a report."""
        job.outputs.check()
        cells, given, attributes = run_in_background(lambda: self._read(job))
        labels = of_vertices = n_labels = names = None
        if given is not None:
            is_kept = self.folder is None and job.endings <= {*FORMATS.unconverted_outputs}
            labels = labels_of_cells(cells, given, is_noted=not is_kept)
            of_vertices = given.labels if given.are_of_vertices else None
            names = {} if job.endings.isdisjoint(FORMATS.class_outputs) else given.names
            n_labels = len(np.unique(given.labels[given.labels >= 0]))
            has_all = not names or is_kept or n_labels == len(np.unique(labels[labels >= 0]))
        elif self.folder is not None or not job.endings <= {*FORMATS.cell_outputs}:
            raise MeshError(
                f"{job.input}: there are no labels (none called {self.given['labels_named']}): give"
                " a label file as LABELS, or the name of the labels with --labels-named"
            )
        parts: list[str] = []
        if self.folder is not None and labels is not None:
            formats, ascii = self.given["formats"], self.given["ascii"]
            ending = FORMATS.ending_of[formats[0]] if formats else None
            with Progress():
                paths = write_regions(
                    self.folder, cells, labels, ending=ending, attributes=attributes, ascii=ascii
                )
            named = [f"{kit.counted(len(paths), 'file')} in {self.folder}"]
            parts = [*map(str, paths)] if self.given["as_json"] else named
            if attributes is not None and attributes.texture is not None:
                print_note(f"no texture in the files of {self.folder}")
        else:
            if names and (not has_all or not job.endings.isdisjoint(FORMATS.key_labels)):
                what = f"{'' if has_all else 'names and '}colors of areas"
                print_note(f"{what} are not copied from {self.labels}")
                names = names if has_all else {}
            job.write(cells, labels, attributes, names=names, of_vertices=of_vertices)
        noun = kit.kind_of(cells).noun
        size = kit.counted(cells.n_cells, noun)
        job.report({f"n_{noun}s": cells.n_cells, "n_labels": n_labels}, size, noun, parts)

    def _read(self, job: Job) -> tuple[Cells, GivenLabels | None, MeshAttributes | None]:
        name, source = self.given["labels_named"], read_input(job.input, self.given["format"])
        keep = job.keeps_attributes if self.folder is None else not self.given["drop_attributes"]
        cells, attributes = source.cells_and_attributes(keep=keep)
        if self.labels is not None:
            return cells, given_labels(source, cells, self.labels, name), attributes
        own = source.own_labels(cells.n_cells, name)
        if own is None or (own.are_parts and not job.endings.isdisjoint(FORMATS.cell_outputs)):
            return cells, None, attributes
        return cells, GivenLabels(Path(job.input), own.values, False, {}), attributes
