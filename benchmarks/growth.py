"""How time grows with faces, regions and threads, from the rows of `runs`."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np

from .meshes import split_name

__all__ = ["fit_exponent", "growth_with_faces", "growth_with_regions", "speedups"]

Row = dict[str, Any]

MIN_FACES = 90_000
"""Growth is fitted from 100 thousand faces on, as it was promised; 10 % less count as that."""


def fit_exponent(sizes: list[float], seconds: list[float]) -> float:
    """Return b of the least-squares fit seconds = a * sizes**b on logarithms.

    Examples
    --------
    >>> round(fit_exponent([1, 10, 100], [2, 20, 200]), 6)
    1.0
    """
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def growth_with_faces(rows: list[Row]) -> list[Row]:
    """Return exponents in N at fixed k, for each surface at several finenesses."""
    groups: dict[tuple[Any, ...], list[Row]] = defaultdict(list)
    for row in rows:
        if row["faces"] >= MIN_FACES:
            base = split_name(row["mesh"])[0]
            groups[base, row["k"], row["settings"], row["threads"]].append(row)
    return [
        {"mesh": base, "k": k, "settings": settings, "threads": threads} | _fitted(group, "faces")
        for (base, k, settings, threads), group in groups.items()
        if len(group) > 1
    ]


def growth_with_regions(rows: list[Row]) -> list[Row]:
    """Return exponents in k at fixed N, where there are three values of k or more."""
    groups: dict[tuple[Any, ...], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row["mesh"], row["faces"], row["settings"], row["threads"]].append(row)
    return [
        {"mesh": mesh, "faces": n, "settings": settings, "threads": threads} | _fitted(group, "k")
        for (mesh, n, settings, threads), group in groups.items()
        if len(group) > 2
    ]


def _fitted(group: list[Row], size: str) -> Row:
    ordered = sorted(group, key=lambda row: row[size])
    sizes = [row[size] for row in ordered]
    return {
        "from": sizes[0],
        "to": sizes[-1],
        "exponent": fit_exponent(sizes, [row["seconds"] for row in ordered]),
        "exponent_per_iteration": fit_exponent(
            sizes, [row["seconds"] / row["iterations"] for row in ordered]
        ),
        "exponent_of_pass": fit_exponent(sizes, [row["seconds_per_pass"] for row in ordered]),
        "iterations": [row["iterations"] for row in ordered],
    }


def speedups(rows: list[Row]) -> list[Row]:
    """Return, for each run that was measured on one thread, how much faster more threads are."""
    alone = {_without_threads(row): row for row in rows if row["threads"] == 1}
    return [
        {name: row[name] for name in ("mesh", "faces", "k", "settings", "threads")}
        | {"speedup": alone[_without_threads(row)]["seconds"] / row["seconds"]}
        | {"stages": _stage_speedups(alone[_without_threads(row)], row)}
        for row in rows
        if row["threads"] > 1 and _without_threads(row) in alone
    ]


def _stage_speedups(one: Row, many: Row) -> dict[str, float]:
    return {
        stage: one["stages"][stage] / seconds
        for stage, seconds in many["stages"].items()
        if seconds > 0
    }


def _without_threads(row: Row) -> tuple[Any, ...]:
    return row["mesh"], row["k"], row["settings"]
