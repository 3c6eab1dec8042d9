"""Display of results in notebooks: a picture, counts, and a histogram of region sizes."""

from __future__ import annotations

import base64
import io
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from .._types import Array, Ints
from ..cells.cell_graph import CellGraph
from ..cells.kinds import kind_of
from ..errors import MissingExtraError, RenderError
from ..mesh.cells import Cells
from .backend import import_pillow
from .colors import PALETTE
from .rendering import render

MAX_DRAWN = 200_000
"""Largest number of faces or tetrahedra that are drawn. A notebook shows results often, and drawing
more cells takes seconds without a graphics card. `render` has no such limit."""

MAX_DRAWN_POINTS = 50_000
"""Largest number of points that are drawn; their neighbors have to be computed again."""

# Size of the picture in pixels, and its width on the page in CSS pixels, for sharp displays.
_SIZE = (640, 480)
_SHOWN_WIDTH = 320

# Number of colors in the palette. Notebooks store pictures; with a palette, a picture needs a fifth
# of the bytes.
_N_COLORS = 256

_CHART_WIDTH, _CHART_HEIGHT, _MAX_BARS = 240, 64, 24

# Pictures of results that are still in use: a notebook requests several formats of each result.
_drawn: WeakKeyDictionary[Any, bytes | None] = WeakKeyDictionary()


def png_of(result: Any) -> bytes | None:
    """Return a picture of a `Segmentation` as PNG, or None if there is no picture.

    There is no picture if the result does not hold its mesh or cloud, if there are more than
    `MAX_DRAWN` or `MAX_DRAWN_POINTS` cells, without the extra `viz`, or without OpenGL.
    """
    if result not in _drawn:
        _drawn[result] = _draw(result.labels, result.cells)
    return _drawn[result]


def _draw(labels: Ints, cells: Cells | CellGraph | None) -> bytes | None:
    if cells is None or isinstance(cells, CellGraph):
        return None
    if cells.n_cells > (MAX_DRAWN_POINTS if kind_of(cells).are_points else MAX_DRAWN):
        return None
    file = io.BytesIO()
    try:
        picture = import_pillow("Image").fromarray(render(cells, labels, size=_SIZE))
        picture.quantize(_N_COLORS).save(file, format="PNG", optimize=True)
    except (MissingExtraError, RenderError):
        return None
    return file.getvalue()


def html_of(result: Any) -> str:
    """Return HTML with the picture, if there is one, counts, and the histogram."""
    png = png_of(result)
    picture = ""
    if png is not None:
        data = base64.b64encode(png).decode("ascii")
        picture = (
            f'<img width="{_SHOWN_WIDTH}" alt="The regions in different colors"'
            f' src="data:image/png;base64,{data}">'
        )
    cells = result.cells
    noun = "cell" if cells is None else kind_of(cells).noun
    sizes = np.bincount(result.labels[result.labels >= 0], minlength=result.n_segments)
    rows = "".join(
        f'<tr><th style="text-align:left">{name}</th><td style="text-align:left">{value}</td></tr>'
        for name, value in _facts(result, noun, sizes).items()
    )
    return (
        '<div style="display:flex;flex-wrap:wrap;align-items:center;gap:1em">'
        f"{picture}<div><table>{rows}</table>{_histogram(sizes, noun)}</div></div>"
    )


def _facts(result: Any, noun: str, sizes: Array) -> dict[str, str]:
    """Names and values of the rows of the table."""
    left_out = len(result.labels) - int(sizes.sum())
    facts = {f"{noun}s": f"{len(result.labels):,}", "regions": f"{result.n_segments:,}"}
    if left_out:
        facts["left out"] = f"{left_out:,} {noun}s"
    low, middle, high = (int(number) for number in np.quantile(sizes, [0, 0.5, 1]))
    facts[f"{noun}s a region"] = f"{low:,} to {high:,}, median {middle:,}"
    facts["iterations"] = f"{result.n_iter}, {result.stop_reason}"
    facts["time"] = f"{sum(result.timings.values()):.3g} s"
    return facts


def _histogram(sizes: Array, noun: str) -> str:
    """Histogram of the sizes of regions in cells, as inline SVG with bars of equal width."""
    low, high = int(sizes.min()), int(sizes.max())
    n_bars = min(_MAX_BARS, high - low + 1)
    counts, edges = np.histogram(sizes, bins=n_bars, range=(low, high + 1))
    step, tallest = _CHART_WIDTH / n_bars, int(counts.max())
    red, green, blue = PALETTE[1]
    bars = [
        f'<rect x="{i * step:.1f}" y="{_CHART_HEIGHT * (1 - count / tallest):.1f}"'
        f' width="{max(step - 1, 0.5):.1f}" height="{_CHART_HEIGHT * count / tallest:.1f}">'
        f"<title>{count:,} of {np.ceil(edges[i]):,.0f} to"
        f" {np.ceil(edges[i + 1]) - 1:,.0f} {noun}s</title></rect>"
        for i, count in enumerate(counts.tolist())
        if count
    ]
    base = _CHART_HEIGHT + 14
    return (
        f'<svg width="{_CHART_WIDTH}" height="{base + 4}" role="img"'
        f' aria-label="Histogram of the sizes of regions, from {low:,} to {high:,} {noun}s">'
        f'<g fill="rgb({red},{green},{blue})">{"".join(bars)}</g>'
        '<g fill="currentColor" font-size="11" font-family="sans-serif">'
        f'<text x="0" y="{base}">{low:,}</text>'
        f'<text x="{_CHART_WIDTH}" y="{base}" text-anchor="end">{high:,} {noun}s</text></g></svg>'
    )
