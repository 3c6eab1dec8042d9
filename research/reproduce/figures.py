"""Draw plots like the paper's Figures 4 to 7, for all models and for each category."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from superfacets.files.atomic import atomic_outputs

from ..princeton import CATEGORIES
from ..sources import StudyMesh
from .measure import Run
from .methods import METHODS
from .results import Comparison, Curve, RunResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Color = tuple[float, float, float]

_NAMES = {"undersegmentation_error": "undersegmentation error", "compactness": "compactness"}

_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "lines.markersize": 3.5,
    "svg.hashsalt": "superfacets",  # fixed salt, so that ids in SVG files are reproducible
}

_LIGHTEST = 0.62  # fraction of white in the color of the smallest alpha of a method


def plot_curves(path: Path, results: RunResults, comparison: Comparison) -> None:
    """Plot undersegmentation error and compactness against k, and the error against compactness."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots(1, 3)
        for axis, (quantity, name) in zip(axes, _NAMES.items(), strict=False):
            _add_curves(axis, results, comparison.curves, quantity, comparison.models)
            axis.set(xlabel="regions, k", ylabel=name)
        _add_tradeoff(axes[2], results, comparison)
        _add_legend(figure, axes[0], comparison.curves)

    n_rows = math.ceil(len(comparison.curves) / 4)
    _save(path, (11.5, 3.5 + 0.19 * n_rows), draw)


def plot_times(path: Path, results: RunResults, curves: Sequence[Curve]) -> None:
    """Plot times against numbers of faces on logarithmic axes; each dot is one run."""

    def draw(figure: Figure) -> None:
        from matplotlib.ticker import LogLocator, NullLocator

        axis = figure.subplots()
        for curve in curves:
            k = results.plan.choice.k
            runs = [Run(model, curve.method, curve.alpha, k) for model in results.plan.models]
            done = [run for run in runs if run in results.done]
            axis.scatter(
                [run.source.n_faces for run in done],
                [results.value(run, "seconds") for run in done],
                s=14,
                color=METHODS[curve.method].color,
                label=curve.title,
                linewidths=0,
            )
        axis.set(xscale="log", yscale="log", xlabel="faces", ylabel="seconds, one thread")
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter("{x:,.0f}")
        axis.xaxis.set_minor_locator(NullLocator())
        axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))

    _save(path, (9.5, 4.6), draw)


def plot_categories(path: Path, results: RunResults, comparison: Comparison, quantity: str) -> None:
    """Plot a metric against k, with one panel per category and one curve per method.

    Each method is shown with its usual alpha.
    """
    curves = [
        curve for curve in comparison.curves if curve.alpha == METHODS[curve.method].usual_alpha
    ]
    shown = {model.category for model in comparison.models}
    categories = [category for category in CATEGORIES if category in shown]
    n_columns = min(5, len(categories))
    n_rows = math.ceil(len(categories) / n_columns)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(n_rows, n_columns, sharex=True, squeeze=False).ravel()
        for panel, category in zip(panels, categories, strict=False):
            models = [model for model in comparison.models if model.category == category]
            _add_curves(panel, results, curves, quantity, models)
            panel.set_title(f"{category} ({len(models)})", fontsize=9)
            panel.tick_params(labelsize=7)
        for panel in panels[len(categories) :]:
            panel.remove()
        figure.supylabel(_NAMES[quantity], fontsize=9)
        figure.supxlabel("regions, k", fontsize=9)
        _add_legend(figure, panels[0], curves, "outside upper center")

    _save(path, (11.5, 1.2 + 1.75 * n_rows), draw)


def _add_curves(
    axis: Axes,
    results: RunResults,
    curves: Sequence[Curve],
    quantity: str,
    models: Sequence[StudyMesh],
) -> None:
    ks = results.plan.choice.ks
    for curve, look in _looks(curves).items():
        values = [results.mean(curve, k, quantity, models) for k in ks]
        axis.plot(ks, values, marker="o", label=curve.title, **look)
    axis.set_xticks(ks)


def _add_tradeoff(axis: Axes, results: RunResults, comparison: Comparison) -> None:
    """Plot the error against compactness at one k: one dot per alpha, and one line per method."""
    k, looks = results.plan.choice.k, _looks(comparison.curves)
    for method in dict.fromkeys(curve.method for curve in comparison.curves):
        curves = [curve for curve in comparison.curves if curve.method == method]
        x, y = (
            [results.mean(curve, k, quantity, comparison.models) for curve in curves]
            for quantity in ("compactness", "undersegmentation_error")
        )
        axis.plot(x, y, color=METHODS[method].color, linewidth=0.8, alpha=0.6)
        for curve, across, up in zip(curves, x, y, strict=True):
            axis.plot(across, up, marker="o", color=looks[curve]["color"])
            text = "" if curve.alpha is None else f"{curve.alpha:g}"
            axis.annotate(text, (across, up), textcoords="offset points", xytext=(3, 3), fontsize=6)
    axis.set(xlabel=f"compactness at k = {k}", ylabel=f"undersegmentation error at k = {k}")


def _add_legend(
    figure: Figure,
    axis: Axes,
    curves: Sequence[Curve],
    place: Literal["outside lower center", "outside upper center"] = "outside lower center",
) -> None:
    handles, labels = axis.get_legend_handles_labels()
    n_columns = 4 if len(curves) > 4 else max(1, len(curves))
    figure.legend(handles, labels, loc=place, ncols=n_columns, fontsize=8)


def _looks(curves: Sequence[Curve]) -> dict[Curve, dict[str, Any]]:
    """Return the style of each curve: light for small alphas, and thick for the usual alpha."""
    looks = {}
    for curve in curves:
        method = METHODS[curve.method]
        alphas = [other.alpha for other in curves if other.method == curve.method]
        smaller = alphas.index(curve.alpha) + 1
        white = _LIGHTEST * (len(alphas) - smaller) / max(1, len(alphas) - 1)
        looks[curve] = {
            "color": _lighter(method.color, white),
            "linestyle": method.line,
            "linewidth": 2.0 if curve.alpha == method.usual_alpha else 1.1,
        }
    return looks


def _lighter(color: str, white: float) -> Color:
    from matplotlib.colors import to_rgb

    red, green, blue = (part + white * (1 - part) for part in to_rgb(color))
    return red, green, blue


def _save(path: Path, size: tuple[float, float], draw: Callable[[Figure], None]) -> None:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        with atomic_outputs([path.with_suffix(".svg"), path.with_suffix(".png")]) as partials:
            figure.savefig(partials[0], format="svg", metadata={"Date": None})
            figure.savefig(partials[1], format="png", dpi=150)
