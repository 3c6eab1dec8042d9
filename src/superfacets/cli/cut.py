"""The command ``superfacets cut``."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
import numpy.typing as npt

from .._validate import ranked_labels
from ..adapters.convert import as_mesh
from ..cells.border_cut import BorderCut, cut_borders
from ..cells.kinds import kind_of
from ..cells.size import DEFAULT_N_SEGMENTS
from ..errors import MeshError
from ..export.cells import FormatOptions
from ..export.write import check_fit, check_outputs
from ..io.guards import counted
from ..mesh.faces import FaceMesh
from ..pipeline import segment
from .failures import print_note
from .inputs import labels_beside, load_cells
from .interrupts import run_in_background
from .options import (
    COUNT,
    FILE,
    ascii_option,
    force_option,
    format_option,
    labels_named_option,
    quiet_option,
    threads_option,
)
from .outputs import Job, output_option, plan_jobs, to_option
from .report import notes_on_vertices


@click.command("cut")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option(
    "-n",
    "--n-segments",
    type=COUNT,
    help="Segment the mesh in this many regions first.  [default: the labels in IN, if it has any;"
    f" otherwise {DEFAULT_N_SEGMENTS}]",
)
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="Regions of IN, instead of -n: a .npy, .seg, .txt or labeled .ply or .vtp.",
)
@output_option(
    "The cut mesh with its labels, or the labels of its faces alone, in any format that segment"
    " writes; may be given several times. Or a folder (results/), or - for standard output."
    "  [default: IN.superfacets.ply beside IN]"
)
@to_option()
@labels_named_option
@format_option("IN")
@ascii_option
@force_option
@threads_option
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def cut_command(
    mesh: Path, n_segments: int | None, labels: Path | None, outputs: tuple[str, ...],
    formats: tuple[str, ...], labels_named: str, format: str | None, ascii: bool,
    force: bool, n_threads: int | None, is_quiet: bool, as_json: bool,
) -> None:  # fmt: skip
    """Cut a mesh along smooth borders of its regions.

    Borders of regions run in zigzag along edges; here they become smooth curves across faces,
    which are cut there. Borders in creases stay, and closed meshes stay closed.
    """
    if n_segments is not None and labels is not None:
        raise click.UsageError("--labels names regions already: leave out -n")
    also_read = [] if labels is None else [str(labels)]
    (job,) = plan_jobs((str(mesh),), outputs, formats, ascii=ascii, also_read=also_read)
    check_outputs(job.files, force=force)
    form = FormatOptions(ascii=ascii, force=force)

    def compute() -> tuple[BorderCut, npt.NDArray[np.int32]]:
        surface = _load(mesh, format)
        check_fit(surface, None, job.endings, form)
        given = None
        if n_segments is None and (labels is not None or format is None):
            given = labels_beside(mesh, labels, surface.n_faces, labels_named)
        if given is None:
            given = segment(surface, n_segments, n_threads=n_threads).labels
        compact, names = ranked_labels(given)  # labels in a file may have gaps
        if not len(names):
            raise MeshError(f"{labels or mesh}: no face is in a region: all labels are -1")
        return cut_borders(surface, compact, n_threads=n_threads), names

    cut, names = run_in_background(compute)
    written = np.append(names, -1)[cut.labels].astype(np.int32)
    n_lost = job.write(cut.mesh, written, options=form)
    if not is_quiet:
        for note in notes_on_vertices(n_lost, job.endings):
            print_note(note)
    _report(job, cut, as_json=as_json, is_quiet=is_quiet)


def _load(path: Path, format: str | None) -> FaceMesh:
    cells = load_cells(str(path), format)
    kind = kind_of(cells)
    if not kind.has_faces:
        raise MeshError(f"{path}: holds {kind.plural}: only a mesh of faces can be cut")
    return as_mesh(cells)


def _report(job: Job, cut: BorderCut, *, as_json: bool, is_quiet: bool) -> None:
    """Print counts and files."""
    n_regions, n_kept = len(cut.is_kept), int(np.count_nonzero(cut.is_kept))
    n_new = cut.mesh.n_faces
    facts = {
        "n_faces": cut.n_sources,
        "n_regions": n_regions,
        "n_new_faces": n_new,
        "n_kept": n_kept,
    }
    kept = f", of which {n_kept} kept their faces" if n_kept else ""
    faces = f"{counted(cut.n_sources, 'face')} cut into {n_new}"
    text = f"{job.name}: {faces}, {counted(n_regions, 'region')}{kept}"
    job.report(facts, text, as_json=as_json, is_quiet=is_quiet)
