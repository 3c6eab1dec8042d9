"""Convert values of vertices to values of cells: the most frequent value at a cell's corners."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any

import numpy as np

from ..base.checks import counted
from ..base.errors import MeshError
from ..base.types import Array
from ..graph.kinds import kind_of
from ..graph.sums import weighted_majority

MIN_IN_FILES = 20
"""Minimum number of vertices of a region in files for neural networks. The training data of these
networks was made by ScanNet's Segmentator with the same minimum (its option segMinVerts)."""


def labels_of_corners(cells: Any, of_vertices: Array) -> Array:
    """Return, for each cell, the most frequent label of its corners, of the same type.

    If several labels are equally frequent, the lowest is used. `of_vertices` has one label per
    vertex, or per point of a cloud. Apps use it for files with labels of vertices.
    """
    corners = kind_of(cells).corners(cells)
    if corners is None:
        return of_vertices
    names, ranks = np.unique(of_vertices, return_inverse=True)
    groups = np.repeat(np.arange(cells.n_cells), corners.sizes)
    voters = ranks[corners.vertices].astype(np.int32)
    winners = weighted_majority(groups, voters, np.ones(len(voters)), cells.n_cells).winners
    return np.asarray(names[winners])


def of_cells(values: Any, cells: Any) -> Any:
    """Return one value per cell if there is one per vertex and not one per cell, else `values`."""
    return labels_of_corners(cells, np.asarray(values)) if fit_vertices(values, cells) else values


def fit_vertices(values: Any, cells: Any) -> bool:
    """Return whether there is one value per vertex and not one per cell, as in `of_cells`."""
    n_vertices = getattr(cells, "n_vertices", None)  # point clouds have no vertices
    return bool(np.shape(values) == (n_vertices,) != (cells.n_cells,))


def are_of_vertices(labels: Sized, cells: Any) -> bool:
    """Return whether labels are of vertices and not of cells; a MeshError if of neither."""
    n_vertices = getattr(cells, "n_vertices", None)  # point clouds have no vertices
    if len(labels) in (cells.n_cells, n_vertices):
        return len(labels) != int(cells.n_cells)
    vertices = "" if n_vertices is None else f" or per vertex ({n_vertices})"
    raise MeshError(
        f"labels must have one value per {kind_of(cells).noun} ({cells.n_cells}){vertices},"
        f" got {counted(len(labels), 'value')}"
    )
