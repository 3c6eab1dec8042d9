"""Encode the colors of vertices, points or cells for the JavaScript viewer."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import MeshAttributes, PointCloud
from superfacets.kit import Array, Bytes, Cells, corners_of, kind_of, stored_colors

from .coding import Coding
from .shape import DrawnSurface


def own_colors(
    cells: Any, colors: npt.ArrayLike | None, attributes: MeshAttributes | None
) -> Bytes | None:
    """Check given colors of vertices or cells; if None, return the colors of a cloud or a file."""
    if colors is None:
        return stored_colors(cells, attributes)
    n_vertices = getattr(cells, "n_vertices", cells.n_cells)
    n_rows = n_vertices if np.shape(colors)[:1] == (n_vertices,) else cells.n_cells
    given: Any = colors
    checked = PointCloud(np.zeros((n_rows, 3)), colors=given).colors  # a cloud checks its colors
    assert checked is not None
    return np.rint(checked * 255).astype(np.uint8)


def color_parts(
    cells: Cells, shape: DrawnSurface, colors: Bytes
) -> dict[str, tuple[Array, Coding]]:
    """Return an array for the JavaScript viewer: colors of the points of `shape`, or of cells.

    `colors` has one row per vertex or per cell. Vertices that `shape` merges get their mean color.
    If the mean color of each cell is closer to the given colors, for example because each face has
    its own vertices and color, the colors of cells are returned.
    """
    if shape.outline is None:
        return {"vertex_colors": (colors, "difference")}
    corners = kind_of(cells).corners(cells)
    if corners is None or len(colors) != getattr(cells, "n_vertices", None):
        return {"cell_colors": (colors, "difference")}
    outline, drawn = shape.outline, corners_of(shape.outline.mesh)
    places, given = outline.places[drawn.vertices], colors[drawn.vertices]
    counts = np.bincount(places)
    means = [np.bincount(places, channel) / counts for channel in given.T]
    of_points = np.rint(np.stack(means, axis=1)).astype(np.uint8)
    error = _difference(of_points[places], given)
    if error > 0:
        of_cells = np.rint(corners.means(colors.astype(np.float64))).astype(np.uint8)
        sources = np.arange(cells.n_cells) if outline.cells is None else outline.cells
        if _difference(of_cells[np.repeat(sources, drawn.sizes)], given) < error:
            return {"cell_colors": (of_cells, "difference")}
    return {"vertex_colors": (of_points, "difference")}


def _difference(colors: Bytes, others: Bytes) -> int:
    return int(np.abs(colors.astype(np.int16) - others).sum())
