"""Tables in Markdown from results: seconds for the terminal, ratios for the documentation."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

__all__ = ["DOC_TABLES", "fill", "readme_table", "render", "table"]

Results = dict[str, Any]

CONTESTANT = ("mesh", "k", "who", "settings", "labels", "regions", "size spread")


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table; columns of numbers, as the first row has them, go to the right."""
    lines = [[str(cell) for cell in row] for row in rows]
    if not lines:
        return "(not measured)"
    is_number = [bool(re.match(r"[\d.,]+(\s?\w+)?$", cell)) for cell in lines[0]]
    rule = "|" + "|".join("---:" if number else "---" for number in is_number) + "|"
    return "\n".join([_line(header), rule, *map(_line, lines)])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _number(value: float | None) -> str:
    """Return three digits, or all before the point."""
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
    return table(
        [*header, "ns per pass and face", "checked by"],
        (
            [
                *_place(row),
                row["settings"],
                row["threads"],
                row["iterations"],
                _number(row["seconds"]),
                _range(row),
                *(_number(row["stages"].get(stage)) for stage in stages),
                _number(row["ns_per_pass_and_face"]),
                row["checked"],
            ]
            for row in rows
        ),
    )


def _place(row: dict[str, Any]) -> list[str]:
    return [row["mesh"], f"{row['faces']:,}", f"{row['k']:,}"]


def _range(row: dict[str, Any]) -> str:
    return f"{_number(row['fastest'])} to {_number(row['slowest'])}"


def _shares(results: Results) -> str:
    """Return what share of its time each run with the defaults on all threads spends where."""
    threads = results["machine"]["cores"]
    rows = [r for r in results["runs"] if (r["settings"], r["threads"]) == ("plain", threads)]
    stages = list(dict.fromkeys(stage for row in rows for stage in row["stages"]))
    return table(
        ["mesh", "faces", "k", "iterations", *stages],
        (
            [
                *_place(row),
                row["iterations"],
                *(f"{row['stages'].get(stage, 0.0) / row['seconds']:.0%}" for stage in stages),
            ]
            for row in rows
        ),
    )


def _passes(results: Results) -> str:
    return table(
        ["mesh", "faces", "k", "threads", "seconds", "ns per face", "times streaming the graph"],
        (
            [
                *_place(row),
                row["threads"],
                *(_number(row[name]) for name in ("pass_seconds", "ns_per_face", "times_stream")),
            ]
            for row in results["passes"]
        ),
    )


def _pass_ratios(results: Results) -> str:
    return table(
        ["mesh", "faces", "k", "threads", "graph, bytes per face", "times streaming the graph"],
        (
            [
                *_place(row),
                row["threads"],
                _number(row["graph_bytes"] / row["faces"]),
                _number(row["times_stream"]),
            ]
            for row in results["passes"]
        ),
    )


def _growth(results: Results) -> str:
    rows = [("N", f"k={row['k']:,}", row) for row in results["growth_with_faces"]]
    rows += [("k", f"N={row['faces']:,}", row) for row in results["growth_with_regions"]]
    names = ("exponent", "exponent_per_iteration", "exponent_of_pass")
    header = ["grows", "from", "to", "surface", "fixed", "settings", "threads", "exponent"]
    return table(
        [*header, "per iteration", "of a pass", "iterations"],
        (
            [
                grows,
                f"{row['from']:,}",
                f"{row['to']:,}",
                row["mesh"],
                fixed,
                row["settings"],
                row["threads"],
                *(f"{row[name]:.2f}" for name in names),
                ", ".join(map(str, row["iterations"])),
            ]
            for grows, fixed, row in rows
        ),
    )


def _speedups(results: Results) -> str:
    rows = results["speedups"]
    stages = list(dict.fromkeys(stage for row in rows for stage in row["stages"]))
    return table(
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
    return table(
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


def _rival_ratios(results: Results) -> str:
    return table(
        [*CONTESTANT, "time over ours"],
        ([*_contestant(row), _number(row["ratio"])] for row in results["label_races"]),
    )


def _contestant(row: dict[str, Any]) -> list[str]:
    names = [row["mesh"], f"{row['k']:,}", row["who"], row["settings"], row["elements"]]
    return [*names, f"{row['regions']:,}", f"{row['spread']:.2f}"]


def _pass_rivals(results: Results) -> str:
    return table(
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


def _pass_rival_ratios(results: Results) -> str:
    return table(
        ["mesh", "faces", "k", "who", "settings", "time over ours"],
        (
            [*_place(row), row["who"], row["settings"], _number(row["ratio"])]
            for row in results["pass_races"]
        ),
    )


def _memory(results: Results) -> str:
    return table(
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
    return table(["process", "seconds", "range"], rows)


def _targets(results: Results) -> str:
    return table(
        ["target", "bound", "measured", "reached"],
        ([row["target"], _bound(row), _measured(row), _verdict(row)] for row in results["targets"]),
    )


def _target_ratios(results: Results) -> str:
    """Return the targets without seconds: what was measured as a multiple of the bound."""
    return table(
        ["target", "bound", "reached", "measured, in bounds"],
        (
            [row["target"], _bound(row), _verdict(row), _number(_in_bounds(row))]
            for row in results["targets"]
        ),
    )


def _in_bounds(row: dict[str, Any]) -> float | None:
    return None if row["measured"] is None else row["measured"] / row["bound"]


def _measured(row: dict[str, Any]) -> str:
    return "-" if row["measured"] is None else f"{_number(row['measured'])} {row['unit']}".strip()


def _bound(row: dict[str, Any]) -> str:
    sign = "≥" if row["at_least"] else "≤"
    return f"{sign} {row['bound']:g} {row['unit']}".strip()


def _verdict(row: dict[str, Any]) -> str:
    return {None: "not measured", True: "yes", False: "**no**"}[row["reached"]]


def _machine(results: Results) -> str:
    machine = results["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    rate = results["bandwidth"]
    read = f"; {rate / 1e9:.0f} GB/s read from memory on all threads" if rate else ""
    return (
        f"{machine['processor']}, {machine['cores']} cores (load before: {machine['load']}),"
        f" {machine['memory_gib']} GiB,"
        f" {machine['system']} on {machine['machine']}, {machine['c_library']};"
        f" built by {machine['compiler']}; Python {machine['python']}, {versions}{read}"
    )


TABLES: dict[str, Callable[[Results], str]] = {
    "Machine": _machine,
    "Arrays to labels": _runs,
    "One full classification": _passes,
    "Growth": _growth,
    "Threads": _speedups,
    "Rivals": _rivals,
    "Rivals for one classification": _pass_rivals,
    "Memory": _memory,
    "Processes": _processes,
    "Targets": _targets,
}

DOC_TABLES: dict[str, Callable[[Results], str]] = {
    "machine": _machine,
    "targets": _target_ratios,
    "shares": _shares,
    "passes": _pass_ratios,
    "growth": _growth,
    "threads": _speedups,
    "rivals": _rival_ratios,
    "pass-rivals": _pass_rival_ratios,
    "memory": _memory,
}


def render(results: Results) -> str:
    """Return all tables that the results have rows for, with absolute times."""
    parts = [(title, make(results)) for title, make in TABLES.items()]
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text != "(not measured)")


def fill(document: str, results: Results) -> str:
    """Return the document with the tables between its marks made anew.

    A table stands between ``<!-- table: NAME -->`` and ``<!-- end -->``; names are those of
    `DOC_TABLES`.

    Raises
    ------
    KeyError
        If a mark names no table.
    """

    def replaced(match: re.Match[str]) -> str:
        return f"{match[1]}\n\n{DOC_TABLES[match[2]](results)}\n\n{match[3]}"

    pattern = r"(<!-- table: ([\w-]+) -->).*?(<!-- end -->)"
    return re.sub(pattern, replaced, document, flags=re.DOTALL)


def readme_table(rows: list[dict[str, Any]]) -> str:
    """Return the table of the README."""
    return table(
        ["faces", "regions", "iterations", "seconds"],
        (
            [f"{row['faces']:,}", f"{row['k']:,}", row["iterations"], f"{row['seconds']:.2f}"]
            for row in rows
        ),
    )
