"""Tables of the studies and of the benchmark: CSV files, Markdown and HTML."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..io.atomic import atomic_outputs

if TYPE_CHECKING:
    from markupsafe import Markup

EMPTY = "(not measured)"
"""Text that replaces a table without rows in Markdown."""

_NUMBER = re.compile(r"[\d.,]+(\s?\w+)?")


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table, or `EMPTY`. Needs tabulate.

    Columns whose first cell is a number are aligned to the right.

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


def html_table(
    head: Sequence[str], rows: Iterable[Sequence[str]], marked: frozenset[str] = frozenset()
) -> Markup:
    """Return a table in HTML: names in the first column, numbers in all others.

    Text is escaped. First cells that are in `marked` are put into <mark>. Needs tabulate and
    markupsafe.
    """
    from markupsafe import Markup, escape
    from tabulate import tabulate

    def name(cell: str) -> Markup:
        return Markup("<mark>{}</mark>").format(cell) if cell in marked else escape(cell)

    cells = [[name(first), *map(escape, others)] for first, *others in rows]
    table = tabulate(
        cells,
        list(map(escape, head)),
        tablefmt="unsafehtml",
        disable_numparse=True,
        colalign=["left", *["right"] * (len(head) - 1)] if cells else None,
    )
    return Markup(str(table))


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV with all columns that occur; missing values are empty."""
    names = dict.fromkeys(name for row in rows for name in row)
    with (
        atomic_outputs([path]) as (partial,),
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, list(names), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
