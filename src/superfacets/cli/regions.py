"""The command ``superfacets regions``."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

from .._types import Array, Floats, Ints
from .._validate import ranked_labels
from ..batches.files import seen_from
from ..cells.kinds import kind_of
from ..cells.named_features import property_of
from ..cells.region_adjacency import RegionGraph, region_graph
from ..cells.sums import weighted_majority
from ..errors import MeshError
from ..export.tables import (
    LINE_ENDINGS,
    TABLE_ENDINGS,
    print_csv,
    write_lines,
    write_tables,
)
from ..io.atomic import checked_targets
from ..io.attributes import MeshAttributes
from ..io.guards import counted, known_ending
from ..io.readers.labels import read_labels
from ..mesh.cells import Cells
from ..regions.lines import BorderLines, border_lines
from ..regions.pooling import pool
from . import options as opts
from .inputs import check_inputs, labels_beside, load_cells_and_attributes, name_of
from .interrupts import run_in_background
from .options import FILE, option, options
from .outputs import Job, check_files

_Drawn = tuple[Floats, list[tuple[str, Ints]]]
"""Vertices of a mesh, and a list of (name, vertex indices along the line)."""


@click.command("regions")
@click.argument("cells", metavar="IN", type=opts.INPUT)
@click.argument("labels", metavar="[LABELS]", type=FILE, required=False)
@options(
    option("-o --output", click.Path(path_type=Path, allow_dash=True),
           "Write the table of regions to this .csv, .json or .parquet file, or as CSV to standard"
           " output (-).  [default: -]"),
    option("--arcs", FILE,
           "Write a table of all pairs of adjacent regions to this .csv, .json or .parquet file."),
    option("--borders", FILE,
           "Write the borders of regions of a mesh as polylines to this .obj file."),
    option("--majority NAME", None,
           "Add a column majority_NAME with the most frequent value of this integer property of IN,"
           " such as classification, in each region; may be given several times.", multiple=True),
    option("--mean NAME", None,
           "Add a column mean_NAME with the mean of this property of IN, such as intensity, over"
           " the faces or points of each region; may be given several times.", multiple=True),
    opts.viewpoint_option,
    opts.format_option("IN", of_stream=True),
    opts.labels_named_option,
    option("-q --quiet is_quiet", opts.FLAG, "Print only the table and errors."),
    opts.json_option(),
)  # fmt: skip
def regions_command(
    cells: str, labels: Path | None, output: Path | None, arcs: Path | None, borders: Path | None,
    majority: tuple[str, ...], mean: tuple[str, ...], viewpoint: tuple[float, ...] | None,
    format: str | None, labels_named: str, is_quiet: bool, as_json: bool,
) -> None:  # fmt: skip
    """Measure regions: areas, shapes, neighbors.

    IN may be a point cloud, or - for standard input. The table has one row per region with area,
    perimeter, centroid, normal, shape, neighbors and more. LABELS is a .npy, .seg or .txt file, or
    a labeled mesh or point cloud. If LABELS is not given, the labels in IN are used.
    """
    check_inputs((cells,))
    if majority and cells == opts.STANDARD_STREAM:
        raise click.UsageError("--majority needs a file, not standard input")
    output = None if str(output) == opts.STANDARD_STREAM else output
    files = _checked_outputs(output, arcs, borders)
    check_files([Job(cells, files)], also_read=[str(labels)] if labels else [])
    checked_targets(files)

    def compute() -> tuple[RegionGraph, Ints, dict[str, Array], _Drawn | None]:
        whole: Any
        whole, attributes = load_cells_and_attributes(cells, format, keep=bool(mean))
        given = labels_beside(Path(cells), labels, whole, labels_named, is_quiet=is_quiet)
        if given is None:
            raise MeshError(f"{name_of(cells)} has no labels: give a label file as LABELS")
        if borders is not None and not kind_of(whole).has_faces:
            raise click.UsageError(f"--borders needs a mesh with faces: {cells} has none")
        if viewpoint is not None:
            whole = seen_from(viewpoint, whole)
        compact, names = ranked_labels(given)  # label numbers in a file may have gaps
        if not len(names):
            raise MeshError(f"{labels or cells}: no cell is in a region: all labels are -1")
        graph = region_graph(whole, compact)
        columns: dict[str, Array] = {
            f"majority_{name}": _most_frequent(
                compact, read_labels(cells, whole.n_cells, name=name), len(names)
            )
            for name in majority
        }
        columns |= {
            f"mean_{name}": pool(_values_of(name, cells, whole, attributes), compact)
            for name in mean
        }
        drawn: _Drawn | None = None
        if borders is not None:
            drawn = whole.vertices, list(_named(border_lines(whole, compact), names))
        return graph, names, columns, drawn

    graph, names, columns, drawn = run_in_background(compute)
    regions = graph.table() | {"region": names} | columns
    ends = {"low": names[graph.edge_index[0]], "high": names[graph.edge_index[1]]}
    of_arcs = ends | {name: graph.arc_values(name) for name in graph.ARC_VALUES}
    tables = [(output, regions), (arcs, of_arcs)]
    write_tables([(path, table) for path, table in tables if path is not None])
    if borders is not None and drawn is not None:
        write_lines(borders, *drawn)
    if output is None and sys.stdout is None:
        raise OSError("standard output is closed")
    if output is None:
        print_csv(sys.stdout, regions)
    if as_json:
        names_written = [opts.STANDARD_STREAM] * (output is None) + [str(path) for path in files]
        facts = {"file": cells, "n_regions": graph.n_regions, "n_pairs": graph.n_arcs}
        click.echo(json.dumps({**facts, "outputs": names_written}), err=output is None)
        return
    found = f"{counted(graph.n_regions, 'region')}, {counted(graph.n_arcs, 'pair')} of neighbors"
    if is_quiet:
        return
    for path in files:
        click.echo(f"wrote {path}", err=output is None)
    click.echo(f"{cells}: {found}", err=output is None)


def _most_frequent(regions: Ints, values: Ints, n_regions: int) -> Ints:
    """Return the most frequent value in each region; the lowest value if there is a tie."""
    kept = regions >= 0
    weights = np.ones(np.count_nonzero(kept))
    return weighted_majority(regions[kept], values[kept], weights, n_regions).winners


def _values_of(name: str, path: str, cells: Cells, attributes: MeshAttributes | None) -> Floats:
    """Return one value of a property per cell, or raise a MeshError that lists all properties."""
    values = property_of(name, cells, attributes)
    if values is None:
        stored = () if attributes is None else (*attributes.face, *attributes.vertex)
        listed = f"the properties are {', '.join(stored)}" if stored else "it has no properties"
        raise MeshError(f"{name_of(path)} has no property {name}: {listed}")
    return values


def _checked_outputs(
    output: Path | None, arcs: Path | None, borders: Path | None
) -> tuple[Path, ...]:
    """Return the paths of all given outputs; raise a usage error if a file ending is wrong."""
    try:
        for path in (output, arcs):
            if path is not None:
                known_ending(path, TABLE_ENDINGS)
        if borders is not None:
            known_ending(borders, LINE_ENDINGS)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    return tuple(path for path in (output, arcs, borders) if path is not None)


def _named(lines: BorderLines, names: Ints) -> Iterator[tuple[str, Ints]]:
    """Yield border lines with names: ``border_3_7``, or ``border_3_open`` at the mesh boundary."""
    for i, (low, high) in enumerate(lines.regions.tolist()):
        line = lines.line(i)
        other = "open" if high < 0 else names[high]
        closed = np.append(line, line[0]) if lines.is_closed[i] else line
        yield f"border_{names[low]}_{other}", closed
