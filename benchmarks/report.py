"""Make tables in Markdown from results: seconds for the terminal, ratios for the documentation."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from research.table_writer import EMPTY, markdown_table

IDLE_LOAD = 0.5
"""Maximum load of a machine on which only the benchmark runs."""

Results = dict[str, Any]
Row = dict[str, Any]
Column = tuple[str, Callable[[Row], str]]
"""Title of a column, and the function that makes the text of its cell from a row of results."""


def _number(value: float | None) -> str:
    """Return a number as text, with three significant digits; "-" for None.

    Numbers of 100 or more are rounded to integers.
    """
    if value is None:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _column(key: str, form: Callable[[Any], str] = str, title: str | None = None) -> Column:
    """Return the column for the field `key` of a row. The default title is `key`."""
    return title or key, lambda row: form(row[key])


def _stages(rows: list[Row]) -> list[Column]:
    """Return a column for each stage that occurs in any of the rows."""

    def seconds_of(name: str) -> Column:
        return name, lambda row: _number(row["stages"].get(name))

    return [seconds_of(name) for name in dict.fromkeys(s for row in rows for s in row["stages"])]


def _table(rows: list[Row], *columns: Column) -> str:
    return markdown_table(
        [title for title, _ in columns], ([cell(row) for _, cell in columns] for row in rows)
    )


def _integer(value: int) -> str:
    return f"{value:,}"


def _ratio(value: float) -> str:
    return f"{value:.2f}"


def _range_of(row: Row) -> str:
    return f"{_number(row['fastest'])} to {_number(row['slowest'])}"


PLACE = (_column("mesh"), _column("faces", _integer), _column("k", _integer))
SETTINGS, THREADS, WHO = _column("settings"), _column("threads"), _column("who")
SECONDS = (_column("seconds", _number), ("range", _range_of))
TIMES_OURS = _column("ratio", _number, "times ours")


def _runs(results: Results) -> str:
    rows = results["runs"]
    # Number of iterations on each level, from the coarsest to the finest.
    iterations = _column("levels", lambda levels: " + ".join(str(n) for _, n in levels))
    columns = (SETTINGS, THREADS, ("iterations", iterations[1]), *SECONDS, *_stages(rows))
    return _table(rows, *PLACE, *columns, _column("checked", title="checked by"))


def _passes(results: Results) -> str:
    seconds = _column("pass_seconds", _number, "seconds")
    per_face = _column("ns_per_face", _number, "ns per face")
    return _table(results["passes"], *PLACE, THREADS, seconds, per_face)


def _speedups(results: Results) -> str:
    rows = results["speedups"]
    speedup = _column("speedup", _ratio, "times faster than one")
    return _table(rows, *PLACE, THREADS, speedup, *_stages(rows))


def _rivals(results: Results) -> str:
    parts = _column(
        "parts", lambda part: ", ".join(f"{name} {_number(value)}" for name, value in part.items())
    )
    return _table(
        results["label_races"], PLACE[0], PLACE[2], WHO, SETTINGS,
        _column("elements", title="labels"), _column("regions", _integer),
        _column("spread", _ratio, "size spread"), *SECONDS, parts, TIMES_OURS,
    )  # fmt: skip


def _orders(results: Results) -> str:
    ratios = _column("ratio", _ratio, "times the first"), _column("cpu", _ratio, "processor time")
    return _table(results["orders"], *PLACE, _column("order"), *SECONDS, *ratios)


def _rival_ratios(results: Results) -> str:
    """Return times divided by the time of superfacets: one row per mesh, one column per method."""
    rows = results["label_races"]
    races = list(dict.fromkeys((row["mesh"], row["faces"], row["k"]) for row in rows))
    ratios = {(row["mesh"], row["k"], row["who"], row["settings"]): row["ratio"] for row in rows}
    names = list(dict.fromkeys((row["who"], row["settings"]) for row in rows))
    return markdown_table(
        ["faces", "k", *(f"{who}: {settings}" for who, settings in names)],
        (
            [
                f"{n_faces:,}{', noisy' * mesh.endswith('-noisy')}",
                f"{k:,}",
                *(_number(ratios.get((mesh, k, *name))) for name in names),
            ]
            for mesh, n_faces, k in races
        ),
    )


def _targets(results: Results) -> str:
    """Return the rows with a target, each row in its unit."""

    def number(value: float | None) -> str:
        return _number(value) if value else ""

    target, floor = _column("target", number), _column("floor", number, "machine")
    return _table(
        results["targets"], ("", lambda row: str(row["what"])), _column("now", _number), target,
        floor, _column("unit"),
    )  # fmt: skip


def _pass_rivals(results: Results) -> str:
    seconds = SECONDS[0]
    return _table(results["pass_races"], *PLACE, WHO, SETTINGS, seconds, TIMES_OURS)


def _memory(results: Results) -> str:
    input_bytes = _column("input_bytes_per_face", _number, "input, bytes per face")
    peak = _column("bytes_per_face", _number, "peak above it, bytes per face")
    return _table(results["memory"], *PLACE, input_bytes, peak)


def _processes(results: Results) -> str:
    rows = []
    if "imports" in results:
        imports = results["imports"]
        rows += [[f"import {name}", _number(imports[name]["seconds"]), _range_of(imports[name])]
                 for name in ("numpy", "superfacets")]  # fmt: skip
        rows.append(["median difference of a pair", _number(1e-3 * imports["more_ms"]), ""])
    if "command" in results:
        row = results["command"]
        rows.append(
            [f"superfacets segment, {row['mesh']}", _number(row["seconds"]), _range_of(row)]
        )
    return markdown_table(["process", "seconds", "range"], rows)


def _machine(results: Results) -> str:
    machine = results["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    load = machine["load"]
    was_busy = ", so other programs were running" if load and load > IDLE_LOAD else ""
    return (
        f"{machine['processor']}, {machine['cores']} cores (load before: {load}{was_busy}),"
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
    """Return all tables for which `results` has rows. Times are in seconds."""
    parts = [(title, make(EMPTY_RESULTS | results)) for title, make in TABLES.items()]
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text != EMPTY)


def _peers(results: Results) -> str:
    error = _column("error", "{:.3f}".format)
    shape, times = _column("compactness", _ratio), _column("times_ours", _number, "time")
    return _table(results["peers"], _column("method"), error, shape, times)


def fill_peers(document: str, rows: list[Row]) -> str:
    """Return a document with the table of `rows` at its mark, as in `fill`."""
    return _filled(document, {"peers": rows}, {"peers": _peers})


def fill(document: str, results: Results) -> str:
    """Return the document with new tables in the places that are marked for tables.

    A place begins with ``<!-- table: NAME -->`` and ends with ``<!-- end -->``, where NAME is a key
    of `DOC_TABLES`. A table for which `results` has no rows is not changed.

    Raises
    ------
    KeyError
        If a mark names an unknown table.
    """
    return _filled(document, EMPTY_RESULTS | results, DOC_TABLES)


def _filled(document: str, results: Results, tables: Mapping[str, Callable[[Results], str]]) -> str:
    def replaced(match: re.Match[str]) -> str:
        table = tables[match[2]](results)
        return match[0] if table == EMPTY else f"{match[1]}\n\n{table}\n\n{match[3]}"

    pattern = r"(<!-- table: ([\w-]+) -->).*?(<!-- end -->)"
    return re.sub(pattern, replaced, document, flags=re.DOTALL)


def readme_table(rows: list[dict[str, Any]]) -> str:
    """Return the table of times for the README."""
    regions, seconds = _column("k", _integer, "regions"), _column("seconds", _ratio)
    return _table(rows, PLACE[1], regions, _column("iterations"), seconds)
