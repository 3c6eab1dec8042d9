"""The command ``superfacets cut``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import BorderCut, MeshError, cut_borders, kit, segment
from superfacets.kit import Array

from .inputs import ranked_labels_beside, read_input
from .interrupts import run_in_background
from .options import COUNT, FILE, USUAL_COUNT, format_option, labels_argument, option
from .outputs import one_output_options, plan_jobs


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
def cut_command(mesh: Path, n_segments: int | None, labels: Path | None, **given: Any) -> None:
    """Cut a mesh along smooth borders of its regions.

    Borders between regions zigzag along mesh edges. This command replaces the borders by smooth
    curves, and cuts faces along these curves. Borders that follow creases do not change, and closed
    meshes stay closed. LABELS is a label file with the regions of IN, instead of -n.
    """
    if n_segments is not None and labels is not None:
        raise click.UsageError("give -n or LABELS, not both")
    (job,) = plan_jobs((str(mesh),), given, (labels,))
    job.outputs.check()

    def compute() -> tuple[BorderCut, Array]:
        source = read_input(str(mesh), given["format"])
        surface, name, n_threads = source.cells(), given["labels_named"], given["n_threads"]
        if not kit.kind_of(surface).has_faces:
            plural = kit.kind_of(surface).plural
            raise MeshError(f"{mesh}: expected a mesh of faces to cut, got {plural}")
        surface = kit.as_mesh(surface)
        job.outputs.check_fit(surface)
        has_labels = labels is not None or source.labels(surface.n_cells, name) is not None
        if n_segments is None and has_labels:
            found, names = ranked_labels_beside(source, labels, surface, name)
        else:
            found = segment(surface, n_segments, n_threads=n_threads).labels
            names = np.arange(found.max() + 1)
        return cut_borders(surface, found, n_threads=n_threads), names

    cut, names = run_in_background(compute)
    job.write(cut.mesh, np.append(names, -1)[cut.labels].astype(np.int32))
    n_regions, n_kept = len(cut.is_kept), int(np.count_nonzero(cut.is_kept))
    n_new = cut.mesh.n_faces
    facts = {
        "n_faces": cut.n_sources, "n_regions": n_regions, "n_new_faces": n_new, "n_kept": n_kept,
    }  # fmt: skip
    kept = f" ({n_kept} kept their old borders)" if n_kept else ""
    faces = f"{kit.counted(cut.n_sources, 'face')} cut into {n_new}"
    job.report(facts, f"{faces}, {kit.counted(n_regions, 'region')}{kept}")
