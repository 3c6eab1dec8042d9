"""The command ``superfacets regions``."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import click
import numpy as np

from superfacets import BorderLines, MeshError, RegionGraph, border_lines, kit, pool, region_graph
from superfacets_formats import write_vtk_xml

from . import options as opts
from .failures import is_quiet
from .inputs import check_inputs, labels_beside, read_input
from .interrupts import run_in_background
from .options import FILE, option, options
from .outputs import Job, check_files


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
           "Write the borders of regions of a mesh as polylines to this .obj or .vtp file."),
    option("--majority NAME", None,
           "Add a column majority_NAME with the most frequent value of this integer property of IN,"
           " such as classification, in each region; may be given several times.", multiple=True),
    option("--mean NAME", None,
           "Add a column mean_NAME with the mean of this property of IN, such as intensity, over"
           " the faces or points of each region; may be given several times.", multiple=True),
    opts.viewpoint_option,
    opts.format_option("IN", of_stream=True),
    opts.labels_named_option,
    opts.quiet_option("Print only the table and errors."),
    opts.json_option(),
)  # fmt: skip
def regions_command(
    cells: str, labels: Path | None, output: Path | None, arcs: Path | None, borders: Path | None,
    majority: tuple[str, ...], mean: tuple[str, ...], viewpoint: tuple[float, ...] | None,
    format: str | None, labels_named: str, as_json: bool,
) -> None:  # fmt: skip
    """Measure regions: areas, shapes, neighbors.

    IN may be a point cloud, or - for standard input. The table has one row per region with area,
    perimeter, centroid, normal, shape, neighbors and more. LABELS is a file of any label format,
    such as .npy or .segs.json, or a labeled mesh or point cloud. If LABELS is not given, the labels
    in IN are used.
    """
    check_inputs((cells,))
    output = None if str(output) == opts.STANDARD_STREAM else output
    files = _checked_outputs(output, arcs, borders)
    check_files([Job(cells, files)], also_read=[str(labels)] if labels else [])
    kit.checked_targets(files)

    def compute() -> tuple[RegionGraph, dict[str, kit.Array], tuple[Any, ...] | None]:
        whole, given, integers, reals = _read(cells, format, labels, labels_named, majority, mean)
        if borders is not None and not kit.kind_of(whole).has_faces:
            raise click.UsageError(f"--borders needs a mesh with faces: {cells} has none")
        if viewpoint is not None:
            whole = kit.kind_of(whole).seen_from(whole, viewpoint)
        compact, names = kit.ranked_labels(given)  # label numbers in a file may have gaps
        if not len(names):
            raise MeshError(f"{labels or cells}: no cell is in a region: all labels are -1")
        graph = region_graph(whole, compact)
        columns = graph.table() | {"region": names}
        for name, values in integers.items():
            columns[f"majority_{name}"] = _most_frequent(compact, values, len(names))
        for name, numbers in reals.items():
            columns[f"mean_{name}"] = pool(compact, numbers)
        if borders is None:
            return graph, columns, None
        return graph, columns, (whole.vertices, border_lines(whole, compact), names)

    graph, columns, drawn = run_in_background(compute)
    _write(graph, columns, drawn, output, arcs, borders)
    if as_json:
        names_written = [opts.STANDARD_STREAM] * (output is None) + [str(path) for path in files]
        facts = {"file": cells, "n_regions": graph.n_regions, "n_pairs": graph.n_arcs}
        click.echo(json.dumps({**facts, "outputs": names_written}), err=output is None)
    elif not is_quiet():
        pairs = f"{kit.counted(graph.n_arcs, 'pair')} of neighbors"
        lines = [f"wrote {path}" for path in files]
        lines.append(f"{cells}: {kit.counted(graph.n_regions, 'region')}, {pairs}")
        click.echo("\n".join(lines), err=output is None)


def _read(
    text: str, format: str | None, labels: Path | None, name: str, majority: tuple[str, ...],
    mean: tuple[str, ...],
) -> tuple[Any, kit.Ints, dict[str, kit.Ints], dict[str, kit.Floats]]:  # fmt: skip
    """Read the cells, their labels `name`, and the properties named in `majority` and `mean`."""
    source = read_input(text, format)
    cells, attributes = source.cells_and_attributes(keep=bool(mean))
    given = labels_beside(source, labels, cells, name)
    if given is None:
        raise MeshError(f"{source.name} has no labels: give a label file as LABELS")
    integers = {key: source.integers(cells.n_cells, key) for key in majority}
    data = kit.CellData(cells, attributes)
    return cells, given, integers, {key: _values_of(key, source.name, data) for key in mean}


def _write(
    graph: RegionGraph, columns: dict[str, kit.Array], drawn: tuple[Any, ...] | None,
    output: Path | None, arcs: Path | None, borders: Path | None,
) -> None:  # fmt: skip
    """Write the tables and the borders; print the table of regions if `output` is None."""
    low, high = columns["region"][graph.edge_index]
    of_arcs = {"low": low, "high": high}
    of_arcs |= {name: graph.arc_values(name) for name in graph.ARC_VALUES}
    tables = [(output, columns), (arcs, of_arcs)]
    write_tables([(path, table) for path, table in tables if path is not None])
    if borders is not None and drawn is not None:
        write_borders(borders, *drawn)
    if output is None:
        if sys.stdout is None:
            raise OSError("standard output is closed")
        print_csv(sys.stdout, columns)


def _most_frequent(regions: kit.Ints, values: kit.Ints, n_regions: int) -> kit.Ints:
    """Return the most frequent value in each region; the lowest value if there is a tie."""
    kept = regions >= 0
    weights = np.ones(np.count_nonzero(kept))
    return kit.weighted_majority(regions[kept], values[kept], weights, n_regions).winners


def _values_of(name: str, file: str, data: kit.CellData) -> kit.Floats:
    """Return the property `name`, one value per cell.

    If it does not exist, a MeshError lists all properties.
    """
    values = data.values(name)
    if values is None:
        kept = data.attributes
        stored = () if kept is None else (*kept.face, *kept.vertex)
        listed = f"the properties are {', '.join(stored)}" if stored else "it has no properties"
        raise MeshError(f"{file} has no property {name}: {listed}")
    return values


def _checked_outputs(
    output: Path | None, arcs: Path | None, borders: Path | None
) -> tuple[Path, ...]:
    """Return the paths of all given outputs; raise a usage error if a file ending is wrong."""
    try:
        for path in (output, arcs):
            if path is not None:
                kit.known_ending(path, TABLE_ENDINGS)
        if borders is not None:
            kit.known_ending(borders, LINE_ENDINGS)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    return tuple(path for path in (output, arcs, borders) if path is not None)


Columns = Mapping[str, kit.Array]
"""Columns of a table, keyed by column name; all columns have the same length."""

TABLE_ENDINGS = (".csv", ".json", ".parquet")
LINE_ENDINGS = (".obj", ".vtp")


def write_tables(tables: Sequence[tuple[Path, Columns]]) -> None:
    """Write each table to its path, in the format of its ending: all tables, or none.

    The endings are ``.csv``, ``.json`` and ``.parquet``. NaN becomes an empty field in CSV, and
    null in JSON. A JSON file has a list with one object per row. Numbers are written with enough
    digits to restore them exactly. Parquet needs pandas and pyarrow.
    """
    endings = [kit.known_ending(path, TABLE_ENDINGS) for path, _ in tables]
    with kit.atomic_outputs([path for path, _ in tables]) as temporaries:
        for temporary, ending, (_, columns) in zip(temporaries, endings, tables, strict=True):
            if ending == ".parquet":
                _write_parquet(temporary, columns)
                continue
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
    lists = []
    for column in columns.values():
        values = column.tolist()
        if column.dtype.kind == "f":
            values = [None if math.isnan(value) else value for value in values]
        lists.append(values)
    return zip(*lists, strict=True)


def _write_parquet(path: Path, columns: Columns) -> None:
    # Without this line, pandas raises a plain ImportError.
    kit.import_extra("pyarrow", "a .parquet file", "graph")
    pandas = kit.import_extra("pandas", "a .parquet file", "graph")
    pandas.DataFrame(dict(columns)).to_parquet(path, engine="pyarrow", index=False)


def write_borders(path: Path, vertices: kit.Floats, lines: BorderLines, names: kit.Ints) -> None:
    """Write border lines as OBJ or VTP, with the vertices on the lines; regions get new `names`.

    In OBJ, each line is a group ``border_3_7``, or ``border_3_open`` at the boundary of the mesh.
    In VTP, the numbers of the two regions are the cell data ``low`` and ``high``.
    """
    whole = [lines.line(i) for i in range(len(lines))]
    rows = [np.append(row, row[: int(lines.is_closed[i])]) for i, row in enumerate(whole)]
    used, along = np.unique(np.concatenate([np.empty(0, int), *rows]), return_inverse=True)
    ends = np.cumsum([*map(len, rows)], dtype=np.int64)
    low, high = np.append(names, -1)[lines.regions].astype(np.int32).T  # -1 at the boundary
    ending = kit.known_ending(path, LINE_ENDINGS)
    with kit.atomic_outputs([path]) as temporaries, temporaries[0].open("wb") as file:
        if ending == ".vtp":
            sections: dict[str, dict[str, kit.Array]] = {
                "CellData": {"low": low, "high": high},
                "Points": {"Points": vertices[used]},
                "Lines": {"connectivity": along.astype(np.int64), "offsets": ends},
            }
            counts = {"NumberOfPoints": len(used), "NumberOfLines": len(rows)}
            write_vtk_xml(file, "PolyData", counts, sections, ascii=False)
            return
        points = vertices[used].tolist()
        file.writelines(f"v {x!r} {y!r} {z!r}\n".encode() for x, y, z in points)
        parts = np.split(along + 1, ends[:-1])
        for first, second, part in zip(low.tolist(), high.tolist(), parts, strict=False):
            row = " ".join(map(str, part.tolist()))
            other = "open" if second < 0 else second
            file.write(f"g border_{first}_{other}\nl {row}\n".encode())
