"""Write tables as CSV files or Markdown, for the studies and the speed benchmark."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from superfacets.files.atomic import atomic_outputs

EMPTY = "(not measured)"  # Markdown text instead of a table without rows

_NUMBER = re.compile(r"-?[\d.,]+(\s?\w+)?")


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table, or `EMPTY` if there are no rows. This function needs tabulate.

    A column is aligned to the right if its cell in the first row is a number, with or without a
    unit.

    Examples
    --------
    >>> print(markdown_table(["who", "seconds"], [["ours", 0.5], ["theirs", "1,200"]]))
    | who    |   seconds |
    |:-------|----------:|
    | ours   |       0.5 |
    | theirs |     1,200 |
    """
    from tabulate import tabulate

    cells = [[str(cell) for cell in row] for row in rows]
    if not cells:
        return EMPTY
    alignment = ["right" if _NUMBER.fullmatch(cell) else "left" for cell in cells[0]]
    return str(tabulate(cells, head, tablefmt="pipe", disable_numparse=True, colalign=alignment))


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows to a CSV file, with a column for each key. Missing values give empty cells."""
    names = dict.fromkeys(name for row in rows for name in row)
    with (
        atomic_outputs([path]) as (partial,),
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, list(names), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
