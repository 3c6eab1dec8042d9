"""Write tables of numbers as CSV, JSON or Parquet, and border lines as OBJ or VTP."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from superfacets import BorderLines
from superfacets.kit import Array, Floats, Ints, atomic_outputs, import_extra, known_ending
from superfacets_formats import write_vtk_xml

Columns = Mapping[str, Array]
"""Columns of a table, keyed by column name; all columns have the same length."""

TABLE_ENDINGS = (".csv", ".json", ".parquet")
LINE_ENDINGS = (".obj", ".vtp")


def write_tables(tables: Sequence[tuple[Path, Columns]]) -> None:
    """Write each table to its path, in the format of its ending: all tables, or none.

    The endings are ``.csv``, ``.json`` and ``.parquet``. NaN becomes an empty field in CSV, and
    null in JSON. A JSON file has a list with one object per row. Numbers are written with enough
    digits to restore them exactly. Parquet needs pandas and pyarrow.
    """
    endings = [known_ending(path, TABLE_ENDINGS) for path, _ in tables]
    with atomic_outputs([path for path, _ in tables]) as temporaries:
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
    import_extra("pyarrow", "a .parquet file", "graph")  # else pandas raises a plain ImportError
    pandas = import_extra("pandas", "a .parquet file", "graph")
    pandas.DataFrame(dict(columns)).to_parquet(path, engine="pyarrow", index=False)


def write_borders(path: Path, vertices: Floats, lines: BorderLines, names: Ints) -> None:
    """Write border lines as OBJ or VTP, with the vertices on the lines; regions get new `names`.

    In OBJ, each line is a group ``border_3_7``, or ``border_3_open`` at the boundary of the mesh.
    In VTP, the numbers of the two regions are the cell data ``low`` and ``high``.
    """
    whole = [lines.line(i) for i in range(len(lines))]
    rows = [np.append(row, row[: int(lines.is_closed[i])]) for i, row in enumerate(whole)]
    used, along = np.unique(np.concatenate([np.empty(0, int), *rows]), return_inverse=True)
    ends = np.cumsum([*map(len, rows)], dtype=np.int64)
    low, high = np.append(names, -1)[lines.regions].astype(np.int32).T  # -1 at the boundary
    ending = known_ending(path, LINE_ENDINGS)
    with atomic_outputs([path]) as temporaries, temporaries[0].open("wb") as file:
        if ending == ".vtp":
            sections: dict[str, dict[str, Array]] = {
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
