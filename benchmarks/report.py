"""Tables in Markdown from results: seconds for the terminal, ratios for the documentation."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from superfacets.study.table_writer import EMPTY, markdown_table

Results = dict[str, Any]

CONTESTANT = ("mesh", "k", "who", "settings", "labels", "regions", "size spread")


def _number(value: float | None) -> str:
    """Return three significant digits, or all digits before the point; "-" for None."""
    if value is None:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _runs(results: Results) -> str:
    rows = results["runs"]
    stages = list(dict.fromkeys(stage for row in rows for stage in row["stages"]))
    header = [
        "mesh",
        "faces",
        "k",
        "settings",
        "threads",
        "iterations",
        "seconds",
        "range",
        *stages,
    ]
    return markdown_table(
        [*header, "checked by"],
        (
            [
                *_place(row),
                row["settings"],
                row["threads"],
                _iterations(row),
                _number(row["seconds"]),
                _range(row),
                *(_number(row["stages"].get(stage)) for stage in stages),
                row["checked"],
            ]
            for row in rows
        ),
    )


def _place(row: dict[str, Any]) -> list[str]:
    return [row["mesh"], f"{row['faces']:,}", f"{row['k']:,}"]


def _range(row: dict[str, Any]) -> str:
    return f"{_number(row['fastest'])} to {_number(row['slowest'])}"


def _iterations(row: dict[str, Any]) -> str:
    """Return the numbers of iterations on all levels, the coarsest level first."""
    return " + ".join(str(n_iter) for _, n_iter in row["levels"])


def _passes(results: Results) -> str:
    return markdown_table(
        ["mesh", "faces", "k", "threads", "seconds", "ns per face"],
        (
            [
                *_place(row),
                row["threads"],
                *(_number(row[name]) for name in ("pass_seconds", "ns_per_face")),
            ]
            for row in results["passes"]
        ),
    )


def _speedups(results: Results) -> str:
    rows = results["speedups"]
    stages = list(dict.fromkeys(stage for row in rows for stage in row["stages"]))
    return markdown_table(
        ["mesh", "faces", "k", "threads", "times faster than one", *stages],
        (
            [
                *_place(row),
                row["threads"],
                f"{row['speedup']:.2f}",
                *(_number(row["stages"].get(stage)) for stage in stages),
            ]
            for row in rows
        ),
    )


def _rivals(results: Results) -> str:
    return markdown_table(
        [*CONTESTANT, "seconds", "range", "parts", "times ours"],
        (
            [
                *_contestant(row),
                _number(row["seconds"]),
                _range(row),
                ", ".join(f"{name} {_number(value)}" for name, value in row["parts"].items()),
                _number(row["ratio"]),
            ]
            for row in results["label_races"]
        ),
    )


def _orders(results: Results) -> str:
    return markdown_table(
        ["mesh", "faces", "k", "order", "seconds", "range", "times the first", "processor time"],
        (
            [*_place(row), row["order"], _number(row["seconds"]), _range(row), *_order_ratios(row)]
            for row in results["orders"]
        ),
    )


def _order_ratios(row: dict[str, Any]) -> list[str]:
    return [f"{row['ratio']:.2f}", f"{row['cpu']:.2f}"]


def _rival_ratios(results: Results) -> str:
    """Return the table of times over ours: a row for each mesh, a column for each contestant."""
    rows = results["label_races"]
    races = list(dict.fromkeys((row["mesh"], row["faces"], row["k"]) for row in rows))
    ratios = {(row["mesh"], row["k"], row["who"], row["settings"]): row["ratio"] for row in rows}
    names = list(dict.fromkeys((row["who"], row["settings"]) for row in rows))
    return markdown_table(
        ["faces", "k", *(f"{who}: {settings}" for who, settings in names)],
        (
            [f"{n_faces:,}", f"{k:,}", *(_number(ratios.get((mesh, k, *name))) for name in names)]
            for mesh, n_faces, k in races
        ),
    )


def _targets(results: Results) -> str:
    """Return the rows with a target, each in its unit."""
    return markdown_table(
        ["", "now", "target", "machine", "unit"],
        (
            [
                row["what"],
                _number(row["now"]),
                "" if row["target"] is None else _number(row["target"]),
                _number(row["floor"]) if row["floor"] else "",
                row["unit"],
            ]
            for row in results["targets"]
        ),
    )


def _contestant(row: dict[str, Any]) -> list[str]:
    names = [row["mesh"], f"{row['k']:,}", row["who"], row["settings"], row["elements"]]
    return [*names, f"{row['regions']:,}", f"{row['spread']:.2f}"]


def _pass_rivals(results: Results) -> str:
    return markdown_table(
        ["mesh", "faces", "k", "who", "settings", "seconds", "times ours"],
        (
            [
                *_place(row),
                row["who"],
                row["settings"],
                _number(row["seconds"]),
                _number(row["ratio"]),
            ]
            for row in results["pass_races"]
        ),
    )


def _memory(results: Results) -> str:
    return markdown_table(
        ["mesh", "faces", "k", "input, bytes per face", "peak above it, bytes per face"],
        (
            [
                *_place(row),
                _number(row["input_bytes_per_face"]),
                _number(row["bytes_per_face"]),
            ]
            for row in results["memory"]
        ),
    )


def _processes(results: Results) -> str:
    rows = []
    if "imports" in results:
        imports = results["imports"]
        rows += [[f"import {name}", _number(imports[name]["seconds"]), _range(imports[name])]
                 for name in ("numpy", "superfacets")]  # fmt: skip
        rows.append(["the difference, pair by pair", _number(1e-3 * imports["more_ms"]), ""])
    if "command" in results:
        row = results["command"]
        rows.append([f"superfacets segment, {row['mesh']}", _number(row["seconds"]), _range(row)])
    return markdown_table(["process", "seconds", "range"], rows)


def _machine(results: Results) -> str:
    machine = results["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    return (
        f"{machine['processor']}, {machine['cores']} cores (load before: {machine['load']}),"
        f" {machine['memory_gib']} GiB,"
        f" {machine['system']} on {machine['machine']}, {machine['c_library']};"
        f" built by {machine['compiler']}; Python {machine['python']}, {versions}"
    )


TABLES: dict[str, Callable[[Results], str]] = {
    "Machine": _machine,
    "Targets": _targets,
    "Arrays to labels": _runs,
    "One full classification": _passes,
    "Threads": _speedups,
    "Orders": _orders,
    "Rivals": _rivals,
    "Rivals for one classification": _pass_rivals,
    "Memory": _memory,
    "Processes": _processes,
}

DOC_TABLES: dict[str, Callable[[Results], str]] = {
    "machine": _machine,
    "targets": _targets,
    "rivals": _rival_ratios,
}


EMPTY_RESULTS: Results = {
    name: []
    for name in (
        "targets", "runs", "passes", "speedups", "orders", "label_races", "pass_races", "memory",
    )
}  # fmt: skip
"""Results of a run that measures nothing."""


def render(results: Results) -> str:
    """Return all tables that the results have rows for, with absolute times."""
    parts = [(title, make(EMPTY_RESULTS | results)) for title, make in TABLES.items()]
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text != EMPTY)


def fill(document: str, results: Results) -> str:
    """Return the document with new tables between its marks.

    A table is between ``<!-- table: NAME -->`` and ``<!-- end -->``; names are the keys of
    `DOC_TABLES`. Tables that the results have no rows for stay as they are.

    Raises
    ------
    KeyError
        If a mark names an unknown table.
    """

    def replaced(match: re.Match[str]) -> str:
        table = DOC_TABLES[match[2]](EMPTY_RESULTS | results)
        return match[0] if table == EMPTY else f"{match[1]}\n\n{table}\n\n{match[3]}"

    pattern = r"(<!-- table: ([\w-]+) -->).*?(<!-- end -->)"
    return re.sub(pattern, replaced, document, flags=re.DOTALL)


def readme_table(rows: list[dict[str, Any]]) -> str:
    """Return the table of times for the README."""
    return markdown_table(
        ["faces", "regions", "iterations", "seconds"],
        (
            [f"{row['faces']:,}", f"{row['k']:,}", row["iterations"], f"{row['seconds']:.2f}"]
            for row in rows
        ),
    )
