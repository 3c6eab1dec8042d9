"""The command ``superfacets evaluate``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from superfacets.kit import counted

from .failures import print_note
from .inputs import given_labels, labels_of_cells, read_input
from .interrupts import run_in_background
from .options import FILE, NOT_NEGATIVE, json_option, labels_named_option, option, options


@click.command("evaluate")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("more", nargs=-1, type=FILE, metavar="[--gt SEG...]")
@options(
    option("--gt truths SEG...", FILE,
           "One or more label files with the ground truth, such as seg/1/*.seg.", multiple=True),
    option("--tolerance", NOT_NEGATIVE,
           "Maximum distance between matching borders, as a fraction of the mesh's diagonal.",
           default=0.01),
    labels_named_option,
    json_option(),
)  # fmt: skip
def evaluate_command(
    mesh: Path, labels: Path, truths: tuple[Path, ...], more: tuple[Path, ...], tolerance: float,
    labels_named: str, as_json: bool,
) -> None:  # fmt: skip
    """Measure the quality of labels.

    The metrics rate LABELS, a label file of the mesh IN. With --gt, more metrics compare LABELS
    with ground truth. Label files are .npy, .seg, .txt, .segs.json, or labeled .ply or .vtp. In
    ground truth, -1 means unannotated. If LABELS and all ground truths have one label per vertex,
    they are compared at the vertices, without metrics of borders and normals.
    """
    from superfacets import metrics

    if more and not truths:
        raise click.UsageError(
            f"Got unexpected extra argument ({more[0]}): give ground truth with --gt"
        )

    def compute() -> dict[str, float]:
        source = read_input(str(mesh))
        cells, paths = source.cells(), (labels, *truths, *more)
        given = [given_labels(source, cells, path, labels_named) for path in paths]
        if truths and all(each.are_of_vertices for each in given):
            regions, *segments = (each.labels for each in given)
            print_note(
                "labels are compared at the vertices, without metrics of borders and normals: for"
                " these metrics, convert the labels with superfacets.face_labels"
            )
            return metrics.evaluate_vertices(cells, regions, segments)
        regions, *segments = (labels_of_cells(cells, each) for each in given)
        return metrics.evaluate(cells, regions, segments, tolerance=tolerance)

    values = run_in_background(compute)
    n_truths = len(truths) + len(more)
    if n_truths:
        click.echo(f"{labels} compared with {counted(n_truths, 'ground truth')}", err=True)
    if as_json:
        files = {"file": str(mesh), "labels": str(labels), "n_ground_truths": n_truths}
        click.echo(json.dumps(files | values))
    else:
        click.echo("\n".join(f"{name:<26} {value:.6g}" for name, value in values.items()))
