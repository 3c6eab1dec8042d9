"""The command ``superfacets regions``."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import click
import numpy as np

from superfacets import MeshError, RegionGraph, border_lines, kit, pool, region_graph
from superfacets_formats import write_vtk_xml
from superfacets_show import LINE_ENDINGS, write_borders

from . import options as opts
from .failures import print_note
from .inputs import given_labels, labels_of_cells, ranked_labels_beside, read_input
from .interrupts import run_in_background
from .options import FILE, option, options
from .outputs import Job, check_files, print_report

Columns = Mapping[str, kit.Array]
"""Columns of a table, keyed by column name; all columns have the same length."""


@click.command("regions")
@click.argument("cells", metavar="IN", type=opts.INPUT)
@opts.labels_argument
@options(
    option("-o --output", click.Path(path_type=Path, allow_dash=True),
           "Write the table of regions to this .csv or .json file, or as CSV to standard"
           " output (-).  [default: -]"),
    option("--arcs", FILE,
           "Write the graph of neighboring regions (adjacency) to this .csv or .json file: one row"
           " per pair, with the length and the angles of the border."),
    option("--borders", FILE,
           "Write the borders of regions of a mesh as polylines to this .obj or .vtp file."),
    option("--majority NAMES", opts.Listed(),
           "Add a column majority_NAME with the most frequent value of this integer property of IN,"
           " such as classification, or of a label file, in each region, as in --mean, and a column"
           " majority_NAME_name if the values have names.", multiple=True),
    option("--mean NAMES", opts.Listed(),
           "Add a column mean_NAME with the mean of this property of IN, such as intensity, or of"
           " a file, such as lh.thickness, over the faces or points of each region, or its vertices"
           " if LABELS and NAME have a value per vertex. Separate names by commas.", multiple=True),
    opts.viewpoint_option, opts.format_option("IN", of_stream=True), opts.labels_named_option,
    opts.quiet_option("Print only the table and errors."), opts.json_option(),
)  # fmt: skip
def regions_command(
    cells: str, labels: Path | None, output: Path | None, arcs: Path | None, borders: Path | None,
    viewpoint: tuple[float, ...] | None, **given: Any,
) -> None:  # fmt: skip
    """Measure regions: areas, shapes, neighbors.

    IN may be a point cloud, or - for standard input. The table has one row per region with area,
    perimeter, centroid, normal, shape, neighbors and more. LABELS is a file of any label format,
    such as .npy or .segs.json, or a labeled mesh or point cloud. If LABELS is not given, the labels
    in IN are used.
    """
    output = None if str(output) == opts.STANDARD_STREAM else output
    files = _files_to_write((output, TABLE_ENDINGS), (arcs, TABLE_ENDINGS), (borders, LINE_ENDINGS))
    check_files([Job(cells, files)], (labels,))
    kit.checked_targets(files)

    def compute() -> tuple[RegionGraph, dict[str, kit.Array], tuple[Any, ...]]:
        source = read_input(cells, given["format"])
        whole: Any
        whole, kept = source.cells_and_attributes(keep=bool(given["mean"] + given["majority"]))
        found = ranked_labels_beside(source, labels, whole, given["labels_named"])
        compact, names, as_given, titles = found
        if borders is not None and not kit.kind_of(whole).has_faces:
            raise click.UsageError(f"--borders needs a mesh with faces: {cells} has none")
        pooled = _pooled_columns(source, kit.CellData(whole, kept), compact, as_given, given)
        whole = kit.kind_of(whole).seen_from(whole, viewpoint)
        graph = region_graph(whole, compact)
        columns = graph.table() | {"region": names}
        columns |= ({"name": _named(titles, names)} if titles else {}) | pooled
        lines = () if borders is None else (whole.vertices, border_lines(whole, compact), names)
        return graph, columns, lines

    graph, columns, lines = run_in_background(compute)
    low, high = columns["region"][graph.edge_index]
    of_arcs = {"low": low, "high": high} | {n: graph.arc_values(n) for n in graph.ARC_VALUES}
    tables = [(output, columns), (arcs, of_arcs)]
    write_tables([(path, table) for path, table in tables if path is not None])
    if borders is not None:
        write_borders(borders, write_vtk_xml, *lines)
    if output is None:
        if sys.stdout is None:
            raise OSError("standard output is closed")
        print_csv(sys.stdout, columns)
    facts = {"n_regions": graph.n_regions, "n_pairs": graph.n_arcs}
    pairs = f"{kit.counted(graph.n_arcs, 'pair')} of neighbors"
    text = f"{kit.counted(graph.n_regions, 'region')}, {pairs}"
    print_report(cells, [*map(str, files)], facts, text, has_stream=output is None)


def _files_to_write(*outputs: tuple[Path | None, Sequence[str]]) -> tuple[Path, ...]:
    """Return paths that are not None; raise a UsageError if the ending of one is not allowed."""
    given = [(path, endings) for path, endings in outputs if path is not None]
    try:
        for path, endings in given:
            kit.known_ending(path, endings)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    return tuple(path for path, _ in given)


def _pooled_columns(
    source: kit.CellFile, data: kit.CellData, of_cells: kit.Ints, as_given: kit.Ints, given: Any
) -> dict[str, kit.Array]:
    """Return the columns of --majority and --mean, by labels of cells or, as given, of vertices."""
    at_vertices = as_given is not of_cells
    if at_vertices and given["mean"] + given["majority"]:
        print_note("values of vertices are pooled over vertices, by the labels of vertices")
    kept, columns = data.attributes, dict[str, kit.Array]()
    of_faces, named = ({}, {}) if kept is None else (kept.face, kept.names)
    for name in given["majority"]:
        if Path(name).suffix and Path(name).is_file():
            found = given_labels(source, data.cells, Path(name), given["labels_named"])
            titles, is_own = found.names, at_vertices and found.are_of_vertices
            values = found.labels if is_own else labels_of_cells(data.cells, found)
        else:
            values, is_own = source.integers(data.cells, name, at_vertices=at_vertices)
            titles = dict(enumerate(named.get(name, ())))
        most = pool(as_given if is_own else of_cells, values, how="majority")
        columns[title := _title("majority", name, columns)] = most
        if titles:
            columns[f"{title}_name"] = _named(titles, most)
    for name in given["mean"]:
        real = _values_of(name, source.name, data, at_vertices)
        labels = as_given if name not in of_faces and len(real) == len(as_given) else of_cells
        columns[_title("mean", name, columns)] = pool(labels, real)
    return columns


def _named(titles: Mapping[int, str], values: kit.Array) -> kit.Array:
    return np.array([titles.get(value, "") for value in values.tolist()])


def _title(kind: str, name: str, columns: Columns) -> str:
    """Return the title of a new column; if two files have one name, the second has its path."""
    title = f"{kind}_{Path(name).name if Path(name).is_file() else name}"
    return f"{kind}_{name}" if title in columns else title


def _values_of(name: str, file: str, data: kit.CellData, at_vertices: bool) -> kit.Floats:
    """Return `CellData.values` of property `name`; if it is missing, the MeshError lists all."""
    values = data.values(name, at_vertices=at_vertices)
    if values is None:
        kept = data.attributes
        stored = () if kept is None else (*kept.face, *kept.vertex)
        listed = f"the properties are {', '.join(stored)}" if stored else "it has no properties"
        raise MeshError(f"{file} has no property {name}: {listed}")
    return values


TABLE_ENDINGS = (".csv", ".json")


def write_tables(tables: Sequence[tuple[Path, Columns]]) -> None:
    """Write each table to its path, in the format of its ending: all tables, or none.

    NaN becomes an empty field in CSV, and null in JSON. A JSON file has a list with one object per
    row. Numbers are written with enough digits to restore them exactly.
    """
    endings = [kit.known_ending(path, TABLE_ENDINGS) for path, _ in tables]
    with kit.atomic_outputs([path for path, _ in tables]) as temporaries:
        for temporary, ending, (_, columns) in zip(temporaries, endings, tables, strict=True):
            with temporary.open("w", encoding="utf-8", newline="") as file:
                if ending == ".csv":
                    print_csv(file, columns)
                else:
                    rows = (dict(zip(columns, row, strict=True)) for row in _rows(columns))
                    json.dump(list(rows), file, indent=1)
                    file.write("\n")


def print_csv(file: IO[str], columns: Columns) -> None:
    """Write CSV: a line with the column names, then one line per row."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(_rows(columns))


def _rows(columns: Columns) -> Iterable[tuple[Any, ...]]:
    """Return rows of Python numbers; NaN is replaced by None."""
    none: Any = None
    lists = [np.where(v.dtype.kind == "f" and np.isnan(v), none, v) for v in columns.values()]
    return zip(*(values.tolist() for values in lists), strict=True)
