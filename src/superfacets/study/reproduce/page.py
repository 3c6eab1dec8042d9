"""One page that holds everything: what was run, on what, how long, and what came out."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ... import __version__
from . import markup
from .gallery import GALLERY, TABLE_METHODS, Picture, table_runs
from .methods import METHODS
from .pictures import picture_path
from .plan import CURVES
from .results import Comparison, Curve, Results
from .runs import Run

__all__ = ["Files", "write_page"]

TITLE = "Superfacets: the paper's comparison, run again"

# Seconds in the paper's Table 1, by numbers of faces.
_TIMES_2014 = {
    345_944: 153, 69_451: 22, 7_219_045: 3_125, 105_860: 39, 96_966: 34, 274_196: 108,
    400_000: 137, 4_007_872: 1_797, 1_652_528: 738,
}  # fmt: skip

_PICTURE_TEXTS = {
    "1": "Large meshes",
    "2": "What alpha does",
    "3": "Normalized cuts and superfacets",
    "8": "Variational Shape Approximation and superfacets",
}

_CURVE_TEXTS = {
    "4": "Superfacets and normalized cuts",
    "6": "Our weights and those of Shlafman, Tal and Katz",
    "7": "Superfacets and Variational Shape Approximation",
    "rivals": "All methods, each at its usual alpha",
}

# Columns of the summary: title, metric, decimals. An arrow tells which way is better.
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
class Files:
    """What was written before the page."""

    folder: Path
    plots: dict[str, list[Path]]
    """Plots of each figure: the main one, then those of categories."""
    comparisons: dict[str, Comparison]
    seconds: float
    """Of this start."""
    n_before: int
    """Runs that earlier starts had done."""
    picture_problems: tuple[str, ...]


def write_page(path: Path, results: Results, files: Files) -> None:
    """Write the page; all images are inside."""
    sections = [("Summary", _summary(results))]
    for figure in results.plan.choice.figures:
        if figure in GALLERY:
            sections.append((f"Figure {figure}", _picture_section(figure, results, files)))
        elif figure == "5":
            sections.append(("Figure 5", _times_section(results, files)))
        else:
            name = "All methods" if figure == "rivals" else f"Figure {figure}"
            sections.append((name, _curve_section(figure, results, files)))
    sections.append(("What is missing", _missing_section(results, files)))
    sections.append(("How it was run", _method_section(results, files)))
    path.write_text(markup.document(TITLE, _lead(results), sections), encoding="utf-8")


def _lead(results: Results) -> str:
    plan = results.plan
    categories = len({model.category for model in plan.models})
    kind = "the smallest model of each category" if plan.choice.is_subset else "all models found"
    methods = len({run.method for run in plan.runs})
    ks = ", ".join(map(str, plan.choice.ks))
    return (
        f"{len(plan.models)} models of {categories} categories of the Princeton Segmentation"
        f" Benchmark ({kind}), {methods} methods, k = {ks}: {len(results.done):,} of"
        f" {len(plan.runs):,} runs done."
    )


def _summary(results: Results) -> str:
    """Return means at the usual k, over the models that each method has."""
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
    return markup.paragraph(
        f"Means at k = {k}: over the ground truths of a model first, then over the models that a"
        " method was run on. Rows with different numbers of models do not compare directly; the"
        " figures below do, for there all curves are over the same models. UE is the"
        " undersegmentation error, ASA the achievable segmentation accuracy; extra pieces are"
        " those of regions that fall apart. An arrow tells which way is better.",
        "caption",
    ) + markup.table(head, rows, frozenset({usual}))


def _place(curve: Curve) -> tuple[int, float]:
    return list(METHODS).index(curve.method), -1.0 if curve.alpha is None else curve.alpha


def _picture_section(figure: str, results: Results, files: Files) -> str:
    pictures = [picture for picture in results.plan.pictures if picture.figure == figure]
    text = markup.paragraph(f"{_PICTURE_TEXTS[figure]}, k = {results.plan.choice.k}.")
    if figure == "1" and not results.plan.meshes:
        return markup.paragraph("Left out: no folder of large meshes was given with --meshes.")
    if not pictures:
        return markup.paragraph("Left out: none of its methods was chosen.")
    cells = {
        (picture.row, picture.column): _image_of(picture, results, files) for picture in pictures
    }
    if figure == "1":
        cards = {column: cell for (_, column), cell in cells.items()}
        return text + markup.picture_cards(cards) + _mesh_table(results)
    rows = list(dict.fromkeys(row for row, _ in cells))
    columns = list(dict.fromkeys(column for _, column in cells))
    return text + markup.picture_grid(rows, columns, cells)


def _image_of(picture: Picture, results: Results, files: Files) -> str:
    path = picture_path(files.folder / "pictures", picture)
    if picture.run not in results.done or not path.exists():
        return "<i>failed, see below</i>"
    return markup.image(path, f"{picture.row}, {picture.column}".strip(", "))


def _mesh_table(results: Results) -> str:
    """Return Table 1: times on the user's meshes."""
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
    return markup.paragraph(
        "Table 1: seconds from mesh to labels on one thread. The paper's are those that it gives"
        " for a mesh with as many faces, on a processor of 2011.",
        "caption",
    ) + markup.table(["mesh", "faces", *titles, "the paper, 2014"], rows)


def _curve_section(figure: str, results: Results, files: Files) -> str:
    plots, comparison = files.plots.get(figure), files.comparisons[figure]
    if not plots:
        return markup.paragraph("Left out: no model has all runs that it needs.")
    n_all, n_shown = len(results.plan.models), len(comparison.models)
    over = f"all {n_all} models" if n_shown == n_all else f"the {n_shown} of {n_all} models"
    captions = [
        f"{_CURVE_TEXTS[figure]}. Means over {over} for which every point of every curve is there;"
        " lower is better in both measures. Right: one against the other"
        + (", dots with their alpha." if figure in CURVES else ".")
    ]
    captions += [
        f"{curve.title}: left out, for it shares no model with the others."
        for curve in comparison.left_out
    ]
    body = markup.image(plots[0], _CURVE_TEXTS[figure], "plot")
    body += "".join(markup.paragraph(caption, "caption") for caption in captions)
    by_category = "".join(
        markup.image(plot, f"{_CURVE_TEXTS[figure]}, by category", "plot") for plot in plots[1:]
    )
    return body + markup.details("By category (number of models)", by_category)


def _times_section(results: Results, files: Files) -> str:
    plots = files.plots.get("5")
    if not plots:
        return markup.paragraph("Left out: no run that it needs is done.")
    caption = markup.paragraph(
        f"Seconds from mesh to labels over faces, k = {results.plan.choice.k}, one thread; both"
        " axes are logarithmic. Files are not read in that time; of normalized cuts it has the"
        " distances, the eigenvectors (as many as the largest k asks for) and the regions.",
        "caption",
    )
    head = ["method", "models", "median seconds", "times superfacets' (median over models)"]
    return (
        markup.image(plots[0], "seconds over faces", "plot")
        + caption
        + markup.table(head, _time_rows(results), frozenset({METHODS["superfacets"].title}))
    )


def _time_rows(results: Results) -> list[list[str]]:
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


def _missing_section(results: Results, files: Files) -> str:
    parts = []
    for title, lines in (
        (
            f"{len(results.missing):,} runs were not started within the budget:",
            results.not_started(),
        ),
        (f"{len(results.failed):,} runs failed:", results.reasons()),
        ("Files that are missing or not used:", results.plan.problems),
        ("Pictures that could not be drawn:", files.picture_problems),
        ("Models left out of a method for their size:", _too_large(results)),
    ):
        if lines:
            parts += [markup.paragraph(title), markup.bullets(lines)]
    return "".join(parts) or markup.paragraph("Nothing: every run that was planned is done.")


def _too_large(results: Results) -> list[str]:
    """Return a line for each method that the plan does not run on all models."""
    lines = []
    for method in dict.fromkeys(run.method for run in results.plan.runs):
        shown = {run.source for run in results.plan.runs if run.method == method}
        n_left = sum(model not in shown for model in results.plan.models)
        if n_left and METHODS[method].max_faces is not None:
            lines.append(f"{METHODS[method].title}: {n_left} models")
    return lines


def _method_section(results: Results, files: Files) -> str:
    plan = results.plan
    tasks = {(r["model"], r["method"], r["alpha"]): r for r in results.done.values()}
    busy = sum(r["seconds"]["total"] + r["seconds"]["metrics"] for r in results.done.values())
    rows = [
        [
            METHODS[method].title,
            method,
            ", ".join(
                sorted({_alpha(run) for run in plan.runs if run.method == method}, key=_size)
            ),
            str(sum(run.method == method for run in results.done)),
        ]
        for method in dict.fromkeys(run.method for run in plan.runs)
    ]
    faces = [model.n_faces for model in plan.models]
    size = f" The models have {min(faces):,} to {max(faces):,} faces." if faces else ""
    return (
        markup.paragraph(
            f"superfacets {__version__}, Python {platform.python_version()}, NumPy"
            f" {np.__version__}, {platform.system()} on {platform.machine()}. The"
            f" {len(results.done):,} runs ({len(tasks):,} methods and settings on meshes) took"
            f" {_duration(busy)} of one core in all, metrics included. This start took"
            f" {_duration(files.seconds)}; {files.n_before:,} of the runs had been done before."
        )
        + markup.paragraph(
            "Each method ran on one thread of a process of its own core. Random seeding draws"
            f" from the number of the model, so that numbers repeat.{size}"
        )
        + markup.table(["method", "name", "alphas", "runs done"], rows)
        + markup.paragraph(
            "Beside this page: runs.csv has a row for every run with all metrics and times,"
            " means.csv the means by category, figure-*.csv the points of the plots, plots and"
            " pictures the images, records what every run wrote.",
            "caption",
        )
    )


def _alpha(run: Run) -> str:
    return "-" if run.alpha is None else f"{run.alpha:g}"


def _size(text: str) -> float:
    return -1.0 if text == "-" else float(text)


def _seconds(value: float) -> str:
    return f"{value:.3f}" if value < 1 else f"{value:.3g}" if value < 100 else f"{value:,.0f}"


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} seconds"
    return f"{seconds / 60:.0f} minutes" if seconds < 7200 else f"{seconds / 3600:.1f} hours"
