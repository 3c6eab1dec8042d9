"""Make the tables of the quality study: means, and comparisons with the variant `PLAIN`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..princeton import category_of
from ..table_writer import markdown_table
from .measure import CREASES, DEFAULT, NO_RIDGES, PLAIN, VARIANTS

Row = dict[str, Any]

Means = dict[tuple[str, int], tuple[float, float]]


def means(rows: Iterable[Row]) -> Means:
    """Return the means of UE and compactness over all models, for each pair (variant, k)."""
    values: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for row in rows:
        values.setdefault((row["variant"], row["k"]), []).append((row["ue"], row["compactness"]))
    columns = {key: zip(*pairs, strict=True) for key, pairs in values.items()}
    return {key: (float(np.mean(ue)), float(np.mean(c))) for key, (ue, c) in columns.items()}


def dominators(found: Means) -> list[str]:
    """Return the variants that are better than `PLAIN` for every k.

    Better means that UE or compactness is lower, and neither is higher.
    """
    ks = [k for variant, k in found if variant == PLAIN]

    def is_better(variant: str, k: int) -> bool:
        new, old = found[variant, k], found[PLAIN, k]
        return new != old and new[0] <= old[0] and new[1] <= old[1]

    variants = dict.fromkeys(variant for variant, _ in found)
    return [variant for variant in variants if all(is_better(variant, k) for k in ks)]


def render_quality(results: Mapping[str, Any]) -> str:
    """Return the tables of a study as Markdown.

    `results` has the keys "rows", "resolution" (rows at all scales) and "ks" (numbers of regions).
    """
    sections = [
        ("UE / compactness by k", _frontier(results)),
        ("Comparison with plain", _comparison(results)),
        ("UE / compactness by category", _categories(results)),
        ("UE / compactness / in valleys by number of faces", _resolution(results)),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in sections)


def _pair(values: tuple[float, float]) -> str:
    return f"{values[0]:.4f} / {values[1]:.3f}"


def _frontier(results: Mapping[str, Any]) -> str:
    found = means(results["rows"])
    return markdown_table(
        ["variant", *(f"k = {k}" for k in results["ks"])],
        ([name, *(_pair(found[name, k]) for k in results["ks"])] for name in VARIANTS),
    )


def _comparison(results: Mapping[str, Any]) -> str:
    rows = results["rows"]
    plain = {(row["model"], row["k"]): row for row in rows if row["variant"] == PLAIN}
    dominating = dominators(means(rows))
    header = ["variant", "dominates", "lower UE", "lower compactness", "in valleys", "in ridges"]

    def line(name: str) -> list[str]:
        pairs = [(row, plain[row["model"], row["k"]]) for row in rows if row["variant"] == name]
        ratio = np.median([new["seconds"] / old["seconds"] for new, old in pairs])
        pieces = sum(new["extra_pieces"] for new, _ in pairs)
        return [
            name,
            "yes" if name in dominating else "-",
            _share(new["ue"] < old["ue"] for new, old in pairs),
            _share(new["compactness"] < old["compactness"] for new, old in pairs),
            _mean_share([new["valleys"] for new, _ in pairs]),
            _mean_share([new["ridges"] for new, _ in pairs]),
            f"{ratio:.2f}",
            str(pieces),
            _share(new["regions"] == new["k"] for new, _ in pairs),
        ]

    return markdown_table([*header, "time", "pieces", "exactly k"], map(line, VARIANTS))


def _share(cases: Iterable[bool]) -> str:
    values = list(cases)
    return f"{sum(values)} of {len(values)}"


def _mean_share(shares: Iterable[float | None]) -> str:
    """Return the mean fraction in percent, ignoring None (no creases), or "-" if all are None."""
    found = [share for share in shares if share is not None]
    return f"{100 * np.mean(found):.0f} %" if found else "-"


def _resolution(results: Mapping[str, Any]) -> str:
    cells: dict[tuple[str, int], dict[str, list[Row]]] = {}
    faces: dict[str, list[int]] = {}
    for row in results["resolution"]:
        key, scale = (row["variant"], row["k"]), row["scale"]
        cells.setdefault(key, {}).setdefault(scale, []).append(row)
        faces.setdefault(scale, []).append(row["faces"])

    def cell(key: tuple[str, int], scale: str) -> str:
        rows = cells[key][scale]
        return f"{_pair(means(rows)[key])} / {_mean_share(row['valleys'] for row in rows)}"

    return markdown_table(
        ["variant", "k", *(f"{scale}: {np.mean(faces[scale]):,.0f} faces" for scale in faces)],
        ([*key, *(cell(key, scale) for scale in faces)] for key in cells),
    )


def _categories(results: Mapping[str, Any]) -> str:
    """Return a table of means per category, sorted by the decrease of UE from PLAIN to DEFAULT.

    The category with the largest decrease is first.
    """
    names = (PLAIN, CREASES, NO_RIDGES, DEFAULT)
    rows = [
        row | {"variant": f"{row['variant']} {category_of(row['model'])}", "k": 0}
        for row in results["rows"]
        if row["variant"] in names
    ]
    found = means(rows)

    def gain(category: str) -> float:
        return found[f"{PLAIN} {category}", 0][0] - found[f"{DEFAULT} {category}", 0][0]

    present = {category_of(row["model"]) for row in rows}
    return markdown_table(
        ["category", *names],
        (
            [category, *(_pair(found[f"{name} {category}", 0]) for name in names)]
            for category in sorted(present, key=gain, reverse=True)
        ),
    )
