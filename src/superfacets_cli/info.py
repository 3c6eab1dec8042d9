"""The commands ``superfacets info``, ``formats`` and ``evaluate``."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import SliverWarning, cloud_info, mesh_info
from superfacets.kit import FORMATS, counted, kind_of

from . import options as opts
from .failures import for_each, print_note, print_notes
from .inputs import given_labels, labels_of_cells, name_of, read_input
from .interrupts import run_in_background
from .options import FILE, option, options

_FACES_DOWN = (
    "if z is up, this open surface faces down: aspects are wrong by 180 degrees, and convex and"
    " concave edges are swapped; reverse the order of the corners of each face, or of the rows of"
    " the grid"
)


@click.command("info")
@click.argument("inputs", metavar="IN...", type=opts.INPUT, nargs=-1, required=True)
@opts.format_option("the inputs", of_stream=True)
@opts.json_option("the results as JSON, one line per IN")
def info_command(inputs: tuple[str, ...], format: str | None, as_json: bool) -> None:
    """Print counts and sizes of meshes and point clouds.

    IN may be - for standard input. If an input fails, the remaining inputs are still read, and the
    exit status is 1.
    """

    def report(index: int) -> None:
        text = inputs[index]
        info, of_file = run_in_background(lambda: _read(text, format))
        if hasattr(info, "sliver_share"):
            slivers = SliverWarning.text(info.sliver_share, "try segment --subdivide")
            notes = (slivers, _FACES_DOWN if info.faces_down else None)
            print_notes(f"{name_of(text)}: {note}" for note in notes if note is not None)
        facts = {"file": text, **dataclasses.asdict(info), **of_file}
        if as_json:
            click.echo(json.dumps(facts))
            return
        for name, value in facts.items():
            if value != ():
                title = re.sub("^(n|is|are|has)_", "", name).replace("tets", "tetrahedra")
                click.echo(f"{title.replace('_', ' '):<20} {_text_of(value, info.diagonal)}")

    for_each([name_of(text) for text in inputs], report)


def _read(text: str, format: str | None) -> tuple[Any, dict[str, Any]]:
    """Return the measures of a file, and its declared items (see `fates`) and header facts."""
    cells, attributes = read_input(text, format).cells_and_attributes(keep=True)
    measure: Any = cloud_info if kind_of(cells).are_points else mesh_info
    assert attributes is not None
    header: Any = attributes.header
    return measure(cells), {**attributes.fates, **({} if header is None else header.facts)}


def _text_of(value: Any, diagonal: float) -> str:
    """Return a fact as text; coordinates are rounded to about a millionth of the diagonal."""
    if isinstance(value, tuple) and isinstance(value[0], str):
        return "; ".join(value)
    if isinstance(value, tuple):
        n_digits = max(0, 6 - math.floor(math.log10(diagonal))) if diagonal > 1e-4 else 17
        rows = (" ".join(f"{round(x, n_digits) + 0.0:.15g}" for x in corner) for corner in value)
        return " to ".join(rows)
    if value is None or isinstance(value, bool):
        return {None: "unknown (open)", True: "yes", False: "no"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


_LABEL_IMAGE = ".ids.png"  # written from a mesh, but contains only its labels
Tables = Mapping[str, Collection[str]]  # endings by what their files store
_WORDS = dict.fromkeys(("faces", "polygons", "triangles"), "mesh")


@click.command("formats")
def formats_command() -> None:
    """List the formats of files."""
    cells = {"mesh": FORMATS["read"], "points": FORMATS["read_points"]}
    values = FORMATS.vertex_values
    read: Tables = {**cells, "labels": {*FORMATS.labels}.difference(values), "values": values}
    labels = {*FORMATS.labels, *FORMATS.label_outputs, *FORMATS.id_outputs, *FORMATS.class_outputs}
    kinds = {kind: {*table} - {_LABEL_IMAGE} for kind, table in FORMATS.writers.items()}
    labels = labels & {*FORMATS.outputs} | {_LABEL_IMAGE}
    write: Tables = {**kinds, "labels": labels, "region graph": FORMATS.graph_outputs}
    endings = dict.fromkeys([*FORMATS.cells, *FORMATS.labels, *FORMATS.outputs])
    click.echo(f"{'ending':<18} {'reads':<26} {'with extra':<11} writes")
    for each in endings:
        extra = FORMATS.extras.get(each, "")
        click.echo(f"{each:<18} {_of(each, read):<26} {extra:<11} {_of(each, write)}".rstrip())
    click.echo("For --to and --format, write an ending without its first . or _, such as ply.")


def _of(ending: str, tables: Tables) -> str:
    words = (_WORDS.get(kind, kind) for kind, table in tables.items() if ending in table)
    return ", ".join(dict.fromkeys(words))


@click.command("evaluate")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("more", nargs=-1, type=FILE, metavar="[--gt SEG...]")
@options(
    option("--gt truths SEG...", FILE,
           "One or more label files with the ground truth, such as seg/1/*.seg.", multiple=True),
    option("--tolerance", opts.NOT_NEGATIVE,
           "Maximum distance between matching borders, as a fraction of the mesh's diagonal.",
           default=0.01),
    option("--ignore N,N", opts.Listed(opts.Count(0)),
           "Labels in the ground truth that mean unannotated, such as 0 in ScanNet's .labels.ply."),
    opts.labels_named_option, opts.json_option(),
)  # fmt: skip
def evaluate_command(
    mesh: Path, labels: Path, truths: tuple[Path, ...], more: tuple[Path, ...], tolerance: float,
    ignore: tuple[int, ...] | None, labels_named: str, as_json: bool,
) -> None:  # fmt: skip
    """Measure the quality of labels.

    The metrics rate LABELS, a label file of the mesh IN. With --gt, more metrics compare LABELS
    with ground truth. Label files have any format with labels that superfacets formats lists. In
    ground truth, -1 means unannotated; for other labels, see --ignore. If LABELS and all ground
    truths have one label per vertex, they are compared there, without metrics of borders, normals.
    """
    from superfacets import metrics

    if more and not truths:
        raise click.UsageError(f"unexpected argument ({more[0]}): give ground truth with --gt")
    if ignore and not truths:
        raise click.UsageError("--ignore needs ground truth: give --gt")

    def compute() -> dict[str, float]:
        source = read_input(str(mesh))
        cells, paths = source.cells(), (labels, *truths, *more)
        given = [given_labels(source, cells, path, labels_named) for path in paths]
        for i, (_, values, *_) in enumerate(given[1:], 1):
            kept = np.where(np.isin(values, ignore or ()), -1, values)
            given[i] = given[i]._replace(labels=kept)
        for each in given:
            # Classes exported by the studio; or, as ground truth, such as ScanNet's .labels.ply.
            named = {".classes", ".vertex-classes", ".labels" if each is not given[0] else ""}
            if named & {*each.path.suffixes} and not each.labels.all():
                how = "replace it by -1" if each is given[0] else "add --ignore 0"
                advice = f"if it means no class, {how}, or give the studio's work file"
                print_note(f"{each.path}: 0 counts as a class; {advice}")
        if truths and all(each.are_of_vertices for each in given):
            regions, *segments = (each.labels for each in given)
            note = "labels are compared at the vertices, without metrics of borders and normals"
            print_note(f"{note}: for these, give LABELS or a ground truth with one label per face")
            return metrics.evaluate_vertices(cells, regions, segments)
        regions, *segments = (labels_of_cells(cells, each) for each in given)
        return metrics.evaluate(cells, regions, segments, tolerance=tolerance)

    values, n_truths = run_in_background(compute), len(truths) + len(more)
    if n_truths:
        click.echo(f"{labels} compared with {counted(n_truths, 'ground truth')}", err=True)
    if as_json:
        files = {"file": str(mesh), "labels": str(labels), "n_ground_truths": n_truths}
        click.echo(json.dumps(files | values))
    else:
        click.echo("\n".join(f"{name:<26} {value:.6g}" for name, value in values.items()))
