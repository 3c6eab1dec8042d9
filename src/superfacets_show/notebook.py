"""Show a `Segmentation` in a notebook: a picture, a table, and a histogram of region sizes."""

from __future__ import annotations

import base64
import io
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from superfacets import CellGraph, MissingExtraError, RenderError
from superfacets.kit import Array, Cells, Ints, kind_of

from .backend import import_pillow
from .colors import PALETTE
from .plotting import plot

MAX_DRAWN = 200_000
"""Maximum number of faces or tetrahedra for which a notebook shows a picture. Drawing more cells
without a graphics card takes seconds. `plot` does not have this limit."""

MAX_DRAWN_POINTS = 50_000
"""Maximum number of points for which a notebook shows a picture. The limit is lower than for faces,
because the neighbors of all points must be computed again to draw a cloud."""

# Size of the picture in pixels. The picture is shown at half this size, so that it is sharp on
# displays with small pixels.
_SIZE = (640, 480)
_SHOWN_WIDTH = 320

# Number of colors in the palette of a PNG file. A palette reduces the file size to a fifth.
_N_COLORS = 256

_CHART_WIDTH, _CHART_HEIGHT, _MAX_BARS = 240, 64, 24

# Cache of the picture of each result, because notebooks request a picture several times. The value
# is None if the picture cannot be drawn.
_drawn: WeakKeyDictionary[Any, bytes | None] = WeakKeyDictionary()


def png_of(result: Any) -> bytes | None:
    """Return a picture of a `Segmentation` as PNG, or None if no picture can be drawn.

    The result is None if the segmentation has no mesh or cloud, if it has more than `MAX_DRAWN`
    cells or `MAX_DRAWN_POINTS` points, or if the extra `viz` or OpenGL is missing.
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
        picture = import_pillow("Image").fromarray(plot(cells, labels, size=_SIZE).image)
        picture.quantize(_N_COLORS).save(file, format="PNG", optimize=True)
    except (MissingExtraError, RenderError):
        return None
    return file.getvalue()


def html_of(result: Any) -> str:
    """Return HTML with a table, a histogram and, unless `png_of` returns None, the picture."""
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
    left_out = len(result.labels) - int(sizes.sum())
    facts = {f"{noun}s": f"{len(result.labels):,}", "regions": f"{result.n_segments:,}"}
    if left_out:
        facts["in no region"] = f"{left_out:,} {noun}s"
    low, middle, high = (int(number) for number in np.quantile(sizes, [0, 0.5, 1]))
    facts[f"{noun}s per region"] = f"{low:,} to {high:,}, median {middle:,}"
    facts["iterations"] = f"{result.n_iter}, {result.stop_reason}"
    facts["time"] = f"{sum(result.timings.values()):.3g} s"
    return facts


def _histogram(sizes: Array, noun: str) -> str:
    """Return a histogram of the number of cells per region, as inline SVG."""
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
        f' aria-label="Histogram of region sizes, from {low:,} to {high:,} {noun}s">'
        f'<g fill="rgb({red},{green},{blue})">{"".join(bars)}</g>'
        '<g fill="currentColor" font-size="11" font-family="sans-serif">'
        f'<text x="0" y="{base}">{low:,}</text>'
        f'<text x="{_CHART_WIDTH}" y="{base}" text-anchor="end">{high:,} {noun}s</text></g></svg>'
    )
