"""Write the page with all results: runs, meshes, times and figures.

The templates contain text and layout. This module computes the values that they show. Images are
embedded.
"""

from __future__ import annotations

import base64
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import __version__
from superfacets.base.checks import counted
from superfacets.files.atomic import atomic_outputs

from .gallery import GALLERY, TABLE_METHODS, Picture, picture_path, table_runs
from .measure import Run
from .methods import METHODS
from .plan import CURVES
from .results import Comparison, Curve, RunResults

TITLE = "Superfacets: the paper's comparison, run again"

_TEMPLATES = Path(__file__).parent / "templates"

_MEDIA_TYPES = {".png": "image/png", ".svg": "image/svg+xml"}

Section = dict[str, Any]  # title and template of the section, and values for the template

# Times in seconds from Table 1 of the paper, by number of faces.
_TIMES_2014 = {
    345_944: 153, 69_451: 22, 7_219_045: 3_125, 105_860: 39, 96_966: 34, 274_196: 108,
    400_000: 137, 4_007_872: 1_797, 1_652_528: 738,
}  # fmt: skip

_PICTURE_TEXTS = {
    "1": "Large meshes",
    "2": "The effect of alpha",
    "3": "Normalized cuts and superfacets",
    "8": "Variational Shape Approximation and superfacets",
}

_CURVE_TEXTS = {
    "4": "Superfacets and normalized cuts",
    "6": "Our weights, and the weights of Shlafman, Tal and Katz",
    "7": "Superfacets and Variational Shape Approximation",
    "rivals": "All methods, each at its usual alpha",
}

# Columns of the summary: title, metric, number of decimals. An arrow up means that higher values
# are better, and an arrow down that lower values are better.
_COLUMNS = (
    ("UE ↓", "undersegmentation_error", 4),
    ("compactness ↓", "compactness", 3),
    ("ASA ↑", "achievable_accuracy", 4),
    ("boundary recall ↑", "boundary_recall", 3),
    ("boundary precision ↑", "boundary_precision", 3),
    ("expl. variation ↑", "explained_variation", 3),
    ("regions", "n_regions", 1),
    ("extra pieces ↓", "n_extra_pieces", 1),
)


@dataclass(frozen=True)
class PageFiles:
    """Plots, times and messages that the page shows in addition to `RunResults`."""

    folder: Path
    plots: dict[str, list[Path]]  # for each figure, the main plot, then the plots by category
    comparisons: dict[str, Comparison]
    seconds: float  # wall time of the reproduction, in seconds
    n_before: int  # number of runs that had results at the start
    picture_problems: tuple[str, ...]


def write_page(path: Path, results: RunResults, files: PageFiles) -> None:
    """Write the page of results as HTML. This function needs Jinja2."""
    sections = [
        _summary(results),
        *(_figure(figure, results, files) for figure in results.plan.choice.figures),
        _missing_section(results, files),
        _method_section(results, files),
    ]
    text = _render(title=TITLE, lead=_lead(results), sections=sections)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(text, encoding="utf-8")


def _render(**values: Any) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = _data_uri
    return environment.get_template("page.html").render(values) + "\n"


def _data_uri(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{_MEDIA_TYPES[path.suffix]};base64,{data}"


def _figure(figure: str, results: RunResults, files: PageFiles) -> Section:
    if figure in GALLERY:
        return _picture_section(figure, results, files)
    if figure == "5":
        return _times_section(results, files)
    return _curve_section(figure, results, files)


def _lead(results: RunResults) -> str:
    plan = results.plan
    categories = len({model.category for model in plan.models})
    kind = "the smallest model of each category" if plan.choice.is_subset else "all models found"
    methods = len({run.method for run in plan.runs})
    ks = ", ".join(map(str, plan.choice.ks))
    return (
        f"{counted(len(plan.models), 'model')} of {counted(categories, 'category')} of the"
        f" Princeton Segmentation Benchmark ({kind}), {counted(methods, 'method')}, k = {ks}:"
        f" {len(results.done):,} of {len(plan.runs):,} runs done."
    )


def _summary(results: RunResults) -> Section:
    """Return the section with the means over all models, for each method and alpha, at one k."""
    k = results.plan.choice.k
    curves = dict.fromkeys(
        Curve(run.method, run.alpha) for run in results.done if run.source.is_model and run.k == k
    )
    rows = []
    for curve in sorted(curves, key=_place):
        models = results.models_with(curve, (k,))
        seconds = [results.value(Run(m, curve.method, curve.alpha, k), "seconds") for m in models]
        numbers = [
            f"{results.mean(curve, k, metric, models):.{decimals}f}"
            for _, metric, decimals in _COLUMNS
        ]
        rows.append([curve.title, str(len(models)), *numbers, _seconds(float(np.median(seconds)))])
    head = ["", "models", *(title for title, _, _ in _COLUMNS), "seconds, median"]
    usual = Curve("superfacets", METHODS["superfacets"].usual_alpha).title
    return {
        "title": "Summary",
        "template": "summary.html",
        "k": k,
        "table": {"head": head, "rows": rows, "marked": usual},
    }


def _place(curve: Curve) -> tuple[int, float]:
    return list(METHODS).index(curve.method), -1.0 if curve.alpha is None else curve.alpha


def _picture_section(figure: str, results: RunResults, files: PageFiles) -> Section:
    pictures = [picture for picture in results.plan.pictures if picture.figure == figure]
    cells = {(picture.row, picture.column): _cell(picture, results, files) for picture in pictures}
    reason = None
    if figure == "1" and not results.plan.meshes:
        reason = "it needs a folder of large meshes: --meshes DIR."
    elif not pictures:
        reason = "none of its methods was chosen."
    return {
        "title": f"Figure {figure}",
        "template": "pictures.html",
        "reason": reason,
        "text": _PICTURE_TEXTS[figure],
        "k": results.plan.choice.k,
        "cells": cells,
        "rows": list(dict.fromkeys(row for row, _ in cells)),
        "columns": list(dict.fromkeys(column for _, column in cells)),
        "table": _mesh_table(results) if figure == "1" else None,
    }


def _cell(picture: Picture, results: RunResults, files: PageFiles) -> dict[str, Any]:
    path = picture_path(files.folder / "pictures", picture)
    is_there = picture.run in results.done and path.exists()
    text = f"{picture.row}, {picture.column}".strip(", ")
    return {"path": path if is_there else None, "text": text}


def _mesh_table(results: RunResults) -> dict[str, Any]:
    """Return Table 1: times of methods for the large meshes of the user."""
    rows = []
    for mesh in results.plan.meshes:
        runs = {run.method: run for run in table_runs((mesh,), results.plan.choice.k)}
        times = [
            _seconds(results.value(run, "seconds")) if run in results.done else "-"
            for run in (runs[method] for method in TABLE_METHODS)
        ]
        paper = _TIMES_2014.get(mesh.n_faces)
        rows.append([mesh.name, f"{mesh.n_faces:,}", *times, "-" if paper is None else str(paper)])
    titles = (METHODS[method].title for method in TABLE_METHODS)
    return {"head": ["mesh", "faces", *titles, "the paper, 2014"], "rows": rows}


def _curve_section(figure: str, results: RunResults, files: PageFiles) -> Section:
    comparison = files.comparisons[figure]
    n_all, n_shown = len(results.plan.models), len(comparison.models)
    return {
        "title": "All methods" if figure == "rivals" else f"Figure {figure}",
        "template": "curves.html",
        "text": _CURVE_TEXTS[figure],
        "plots": files.plots.get(figure),
        "over": f"all {n_all} models" if n_shown == n_all else f"the {n_shown} of {n_all} models",
        "has_alphas": figure in CURVES,
        "left_out": [curve.title for curve in comparison.left_out],
    }


def _times_section(results: RunResults, files: PageFiles) -> Section:
    head = ["method", "models", "median seconds", "time / superfacets' time (median over models)"]
    ours = METHODS["superfacets"].title
    return {
        "title": "Figure 5",
        "template": "times.html",
        "plots": files.plots.get("5"),
        "k": results.plan.choice.k,
        "table": {"head": head, "rows": _time_rows(results), "marked": ours},
    }


def _time_rows(results: RunResults) -> list[list[str]]:
    k = results.plan.choice.k
    seconds = {
        method: {
            run.source: results.value(run, "seconds")
            for run in results.done
            if run.source.is_model and run.k == k
            and (run.method, run.alpha) == (method, METHODS[method].usual_alpha)
        }
        for method in results.plan.choice.methods_in("5")
    }  # fmt: skip
    ours = seconds.get("superfacets", {})
    rows = []
    for method, times in seconds.items():
        ratios = [times[model] / ours[model] for model in times if model in ours]
        ratio = f"{np.median(ratios):.3g}" if ratios else "-"
        if times:
            median = _seconds(float(np.median(list(times.values()))))
            rows.append([METHODS[method].title, str(len(times)), median, ratio])
    return rows


def _missing_section(results: RunResults, files: PageFiles) -> Section:
    lists = (
        (f"Runs that were not started in time ({len(results.missing):,}):", results.not_started()),
        (f"Runs that failed ({len(results.failed):,}):", results.reasons()),
        ("Files that are missing or not used:", results.plan.problems),
        ("Pictures that could not be drawn:", files.picture_problems),
        ("Models that are too large for a method:", _too_large(results)),
    )
    return {
        "title": "Missing results",
        "template": "missing.html",
        "lists": [(title, lines) for title, lines in lists if lines],
    }


def _too_large(results: RunResults) -> list[str]:
    """Return one line per method that leaves out large models, with the number of models."""
    lines = []
    for method in dict.fromkeys(run.method for run in results.plan.runs):
        shown = {run.source for run in results.plan.runs if run.method == method}
        n_left = sum(model not in shown for model in results.plan.models)
        if n_left and METHODS[method].max_faces is not None:
            lines.append(f"{METHODS[method].title}: {counted(n_left, 'model')}")
    return lines


def _method_section(results: RunResults, files: PageFiles) -> Section:
    plan = results.plan
    tasks = {(r["model"], r["method"], r["alpha"]) for r in results.done.values()}
    busy = sum(r["seconds"]["total"] + r["seconds"]["metrics"] for r in results.done.values())
    faces = [model.n_faces for model in plan.models]
    return {
        "title": "How it was run",
        "template": "method.html",
        "versions": {
            "superfacets": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "system": f"{platform.system()} on {platform.machine()}",
        "n_done": f"{len(results.done):,}",
        "n_tasks": f"{len(tasks):,}",
        "busy": _duration(busy),
        "seconds": _duration(files.seconds),
        "n_before": f"{files.n_before:,}",
        "sizes": f"{min(faces):,} to {max(faces):,}" if faces else "",
        "table": {
            "head": ["method", "name", "alphas", "runs done"],
            "rows": _method_rows(results),
        },
    }


def _method_rows(results: RunResults) -> list[list[str]]:
    runs = results.plan.runs
    return [
        [
            METHODS[method].title,
            method,
            _alphas({run.alpha for run in runs if run.method == method}),
            str(sum(run.method == method for run in results.done)),
        ]
        for method in dict.fromkeys(run.method for run in runs)
    ]


def _alphas(values: set[float | None]) -> str:
    ordered = sorted(values, key=lambda alpha: -1.0 if alpha is None else alpha)
    return ", ".join("-" if alpha is None else f"{alpha:g}" for alpha in ordered)


def _seconds(value: float) -> str:
    return f"{value:.3f}" if value < 1 else f"{value:.3g}" if value < 100 else f"{value:,.0f}"


def _duration(seconds: float) -> str:
    if seconds < 120:
        return counted(round(seconds), "second")
    return f"{seconds / 60:.0f} minutes" if seconds < 7200 else f"{seconds / 3600:.1f} hours"
