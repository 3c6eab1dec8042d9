"""The command ``superfacets convert``."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from ..cells.kinds import kind_of
from ..errors import MeshError
from ..export.cells import FormatOptions
from ..export.regions import write_regions
from ..export.scannet import GROUPS
from ..export.write import ENDING_OF_FORMAT, check_outputs, write_outputs
from ..interop.aggregation import regroup_segments
from ..io.attributes import MeshAttributes
from ..mesh.cells import Cells
from .failures import print_note
from .inputs import labels_beside, load_cells_and_attributes
from .interrupts import run_in_background
from .options import (
    FILE,
    FOLDER,
    STANDARD_STREAM,
    ascii_option,
    drop_attributes_option,
    force_option,
    format_option,
    label_options,
    labels_named_option,
    quiet_option,
)
from .outputs import Job, output_option, plan_jobs, to_option
from .report import notes_on_attributes, notes_on_vertices


@click.command("convert")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("labels", metavar="[LABELS]", type=FILE, required=False)
@output_option(
    "Any file that segment -o writes; may be given several times. Or a folder (results/), or -"
    " for standard output."
)
@click.option(
    "--split",
    "folder",
    metavar="DIR",
    type=FOLDER,
    help="Write each region to a file of its own in this folder: DIR/region_17.ply.",
)
@to_option("Format of outputs whose name has no known ending")
@click.option(
    "--segments",
    metavar="FILE",
    type=FILE,
    help="Old .segs.json, if IN is an .aggregation.json.  [default: the file that it names]",
)
@labels_named_option
@format_option("IN")
@ascii_option
@label_options
@drop_attributes_option("input")
@force_option
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def convert_command(
    mesh: Path, labels: Path | None, outputs: tuple[str, ...], folder: Path | None,
    segments: Path | None, formats: tuple[str, ...], labels_named: str, format: str | None,
    ascii: bool, label_name: str, vertex_labels: bool, drop_attributes: bool, force: bool,
    is_quiet: bool, as_json: bool,
) -> None:  # fmt: skip
    """Write the mesh in the file IN, with its LABELS, in other formats.

    Without a file of LABELS, the labels in IN are written if there are any. If IN is an
    .aggregation.json, LABELS are new segments (.segs.json), and its objects are written as groups
    of these; a table shows the vertices that each object loses and gains.
    """
    if mesh.name.endswith(GROUPS):
        _regroup(mesh, labels, outputs, segments, is_quiet=is_quiet, as_json=as_json)
        return
    if segments is not None:
        raise click.UsageError("--segments goes with an .aggregation.json only")
    job, ending = _plan(mesh, labels, outputs, folder, formats, ascii=ascii)
    form = FormatOptions.checked(
        [*job.endings], ascii=ascii, label_name=label_name, vertex_labels=vertex_labels,
        force=force,
    )  # fmt: skip
    check_outputs(job.files, force=force)
    keeps = job.holds_attributes and not drop_attributes
    found = run_in_background(lambda: _read(mesh, labels, labels_named, format, keep=keeps))
    hint = f" (none called {labels_named}): name a file of them, or --labels-named"
    if folder is not None and found.labels is None:
        raise MeshError(f"{mesh}: there are no labels to split it by{hint}")
    if job.holds_labels and found.labels is None:
        raise MeshError(f"{mesh}: there are no labels to write{hint}")
    parts, n_lost = _write(
        job, found, form, folder, ending
    )  # in the foreground, because it writes files
    if not is_quiet:
        for note in [*notes_on_vertices(n_lost, job.endings), *found.notes(job.endings)]:
            print_note(note)
    if as_json:
        facts = {"file": str(mesh), **found.facts, "outputs": [*job.names, *parts]}
        click.echo(json.dumps(facts), err=job.stream is not None)
    elif not is_quiet:
        names = ["standard output" if name == STANDARD_STREAM else name for name in job.names]
        if folder is not None:
            names.append(f"{len(parts)} files in {folder}")
        for name in names:
            click.echo(f"wrote {name}", err=job.stream is not None)


def _regroup(
    groups: Path,
    labels: Path | None,
    outputs: tuple[str, ...],
    segments: Path | None,
    *,
    is_quiet: bool,
    as_json: bool,
) -> None:
    """Write an aggregation for other segments, and a table of what objects lost."""
    if labels is None or len(outputs) != 1:
        raise click.UsageError("an .aggregation.json needs new segments (.segs.json) and one -o")
    objects = regroup_segments(groups, labels, outputs[0], segments=segments)
    if as_json:
        facts = {"file": str(groups), "objects": [found._asdict() for found in objects]}
        click.echo(json.dumps({**facts, "outputs": list(outputs)}))
    elif not is_quiet:
        click.echo(f"{'object':>8} {'vertices':>9} {'lost':>7} {'gained':>7}  label")
        for found in objects:
            counts = f"{found.n_vertices:>9} {found.n_lost:>7} {found.n_gained:>7}"
            click.echo(f"{found.object_id:>8} {counts}  {found.label}")
        click.echo(f"wrote {outputs[0]}")


@dataclass(frozen=True)
class _Found:
    """Contents of the input files."""

    cells: Cells
    labels: npt.NDArray[np.int32] | None
    attributes: MeshAttributes | None
    are_named: bool  # whether the labels come from a separate file

    @property
    def facts(self) -> dict[str, int | None]:
        """Numbers of cells and of labels; None for labels if there are none."""
        count = {f"n_{kind_of(self.cells).noun}s": self.cells.n_cells}
        if self.labels is None:
            return {**count, "n_labels": None}
        return {**count, "n_labels": len(np.unique(self.labels[self.labels >= 0]))}

    def notes(self, endings: set[str]) -> list[str]:
        """Notes on attributes that the outputs lack."""
        if self.attributes is None:
            return []
        return notes_on_attributes(
            self.attributes, endings, self.cells, are_replaced=self.are_named
        )


def _plan(
    mesh: Path,
    labels: Path | None,
    outputs: tuple[str, ...],
    folder: Path | None,
    formats: tuple[str, ...],
    *,
    ascii: bool,
) -> tuple[Job, str | None]:
    """The outputs, and the ending of region files if a format is given."""
    if not outputs and folder is None:
        raise click.UsageError("nothing to write: name a file with -o, or a folder with --split")
    also_read = [] if labels is None else [str(labels)]
    if folder is None:
        plans = plan_jobs([str(mesh)], outputs, formats, ascii=ascii, also_read=also_read)
        return plans[0], None
    if len(formats) > 1:
        raise click.UsageError("files of regions have one format: give --to once")
    ending = ENDING_OF_FORMAT[formats[0]] if formats else None
    if not outputs:
        return Job(str(mesh), ()), ending
    return plan_jobs([str(mesh)], outputs, (), ascii=ascii, also_read=also_read)[0], ending


def _read(mesh: Path, labels: Path | None, named: str, format: str | None, *, keep: bool) -> _Found:
    cells, attributes = load_cells_and_attributes(str(mesh), format, keep=keep)
    if labels is None and format is not None:  # labels in IN would be searched by its ending
        return _Found(cells, None, attributes, False)
    found = labels_beside(mesh, labels, cells.n_cells, named)
    return _Found(cells, found, attributes, labels is not None)


def _write(
    job: Job, found: _Found, form: FormatOptions, folder: Path | None, ending: str | None
) -> tuple[list[str], int]:
    """Write all files; return paths of region files, and the number of regions without a vertex."""
    streams = {job.stream: sys.stdout.buffer} if job.stream else {}
    n_lost = write_outputs(
        job.files,
        found.cells,
        found.labels,
        streams=streams,
        attributes=found.attributes,
        options=form,
    )
    paths = []
    if folder is not None and found.labels is not None:
        paths = write_regions(folder, found.cells, found.labels, ending=ending, ascii=form.ascii)
    return [str(path) for path in paths], n_lost
