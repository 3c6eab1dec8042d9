"""Write tables of numbers as CSV, JSON or Parquet, and polylines along mesh edges as OBJ."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from .._types import Array, Floats
from ..errors import import_extra
from ..io.atomic import StrPath, atomic_outputs
from ..io.guards import known_ending

Columns = Mapping[str, Array]
"""Columns of a table, keyed by column name; all columns have the same length."""

TABLE_ENDINGS = (".csv", ".json", ".parquet")
LINE_ENDINGS = (".obj",)


def write_tables(tables: Sequence[tuple[StrPath, Columns]]) -> None:
    """Write each table to its path, in the format of its ending: all tables, or none.

    The endings are ``.csv``, ``.json`` and ``.parquet``. NaN becomes an empty field in CSV, and
    null in JSON. A JSON file has a list with one object per row. Numbers are written with enough
    digits to restore them exactly. Parquet needs pandas and pyarrow.
    """
    endings = [known_ending(Path(path), TABLE_ENDINGS) for path, _ in tables]
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


def write_lines(
    path: StrPath, vertices: Floats, lines: Iterable[tuple[str, npt.NDArray[np.integer]]]
) -> None:
    """Write polylines as OBJ groups; each polyline is a pair of its name and its vertex indices."""
    known_ending(Path(path), LINE_ENDINGS)
    named = list(lines)
    rows = [line for _, line in named]
    used, numbers = np.unique(np.concatenate([np.empty(0, int), *rows]), return_inverse=True)
    with atomic_outputs([path]) as temporaries, temporaries[0].open("w", newline="") as file:
        file.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices[used].tolist())
        start = 0
        for name, line in named:
            along = " ".join(map(str, (numbers[start : start + len(line)] + 1).tolist()))
            file.write(f"g {name}\nl {along}\n")
            start += len(line)
