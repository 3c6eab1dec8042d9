"""The command ``superfacets cut``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import BorderCut, MeshError, cut_borders, kit, segment
from superfacets.kit import CellFile, FaceMesh, Ints

from .inputs import labels_beside, read_input
from .interrupts import run_in_background
from .options import COUNT, FILE, USUAL_COUNT, format_option, labels_argument, option
from .outputs import OneRun, one_output_options


@click.command("cut")
@click.argument("mesh", metavar="IN", type=FILE)
@labels_argument
@option(
    "-n --n-segments", COUNT,
    "Segment the mesh into this many regions first.  [default: use the labels in IN; if IN has no"
    f" labels, {USUAL_COUNT}]",
)  # fmt: skip
@one_output_options("the cut mesh with its labels, or the labels of its faces alone", "IN")
@format_option("IN")
def cut_command(
    mesh: Path, n_segments: int | None, labels: Path | None, format: str | None, **given: Any
) -> None:
    """Cut a mesh along smooth borders of its regions.

    Borders between regions zigzag along mesh edges. This command replaces the borders by smooth
    curves, and cuts faces along these curves. Borders that follow creases do not change, and closed
    meshes stay closed. LABELS is a label file with the regions of IN, instead of -n.
    """
    if n_segments is not None and labels is not None:
        raise click.UsageError("give -n or LABELS, not both")
    run = OneRun(mesh, [] if labels is None else [labels], given)

    def compute() -> tuple[BorderCut, Ints]:
        source = read_input(str(mesh), format)
        surface = _surface_of(source)
        run.outputs.check_fit(surface)
        found = None
        if n_segments is None:
            found = labels_beside(source, labels, surface, run.labels_named)
        if found is None:
            found = segment(surface, n_segments, n_threads=run.n_threads).labels
        compact, names = kit.ranked_labels(found)  # label numbers in a file may have gaps
        if not len(names):
            raise MeshError(f"{labels or mesh}: no face is in a region: all labels are -1")
        return cut_borders(surface, compact, n_threads=run.n_threads), names

    cut, names = run_in_background(compute)
    run.write(cut.mesh, np.append(names, -1)[cut.labels].astype(np.int32))
    n_regions, n_kept = len(cut.is_kept), int(np.count_nonzero(cut.is_kept))
    n_new = cut.mesh.n_faces
    facts = {
        "n_faces": cut.n_sources, "n_regions": n_regions, "n_new_faces": n_new, "n_kept": n_kept,
    }  # fmt: skip
    kept = f" ({n_kept} kept their old borders)" if n_kept else ""
    faces = f"{kit.counted(cut.n_sources, 'face')} cut into {n_new}"
    run.report(facts, f"{faces}, {kit.counted(n_regions, 'region')}{kept}")


def _surface_of(source: CellFile) -> FaceMesh:
    cells = source.cells()
    kind = kit.kind_of(cells)
    if not kind.has_faces:
        raise MeshError(f"{source.name}: expected a mesh of faces to cut, got {kind.plural}")
    return kit.as_mesh(cells)
