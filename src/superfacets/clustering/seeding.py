"""Stage 3: the first centers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import (
    checked_choice,
    checked_count,
    checked_number,
    checked_seeds,
    checked_threads,
)
from ..cells.cell_graph import CellGraph, OrderedCells, box_diagonal, checked_graph
from ..cells.face_graph import FaceGraph

__all__ = [
    "INITS",
    "RegionSize",
    "check_size",
    "checked_n_segments",
    "expected_radius",
    "place_seeds",
    "region_size",
    "run_seeding",
]

INITS = ("geodesic", "farthest", "flood", "grid")
"""Names of the ways to place seeds."""

DEFAULT_N_SEGMENTS = 150
"""The paper's k, where neither a number of regions nor a radius is asked for."""

SEED_SPACING = 2.0
"""Radii that a flooded region expands to, and the edge of a grid cube in radii."""


class RegionSize(NamedTuple):
    """How many regions are expected, and how large."""

    n_segments: int
    """k: asked for, or as many disks of the radius as have the area of all cells."""
    radius: float
    """r in the unit of the positions: asked for, or sqrt(A / (pi k))."""


def check_size(n_segments: int | None, radius: float | None) -> None:
    """Raise an error where the two do not go together, or one is wrong on any mesh."""
    if n_segments is not None and radius is not None:
        raise ValueError("give n_segments or radius, not both")
    if n_segments is not None:
        checked_count(n_segments, "n_segments")
    if radius is not None:
        checked_number(radius, "radius", zero=False)


def checked_n_segments(n_segments: int | None, n_cells: int) -> int:
    """The number of regions asked for; if none is, the paper's, or that of the cells if less."""
    if n_segments is None:
        return min(DEFAULT_N_SEGMENTS, n_cells)
    return checked_count(n_segments, "n_segments", n_cells, "faces")


def region_size(
    cells: OrderedCells,
    n_segments: int | None = None,
    radius: float | None = None,
    init: str | npt.ArrayLike = "geodesic",
) -> RegionSize:
    """Return the number and the radius of the regions that the arguments of `segment` ask for."""
    check_size(n_segments, radius)
    whole = _Whole(cells.graph.n_cells, cells.graph.total_measure, box_diagonal(cells.bounds))
    return _size_of(whole, n_segments, radius, init)


def expected_radius(
    faces: FaceGraph, n_segments: int | None, radius: float | None, init: str | npt.ArrayLike
) -> float:
    """Return the radius that regions are expected to have, before there is a cell graph."""
    whole = _Whole(faces.n_cells, float(faces.measures.sum()), faces.diagonal)
    return _size_of(whole, n_segments, radius, init).radius


class _Whole(NamedTuple):
    """What there is to be divided into regions."""

    n_cells: int
    area: float
    diagonal: float


def _size_of(
    whole: _Whole, n_segments: int | None, radius: float | None, init: str | npt.ArrayLike
) -> RegionSize:
    if radius is not None:
        r = float(radius) * whole.diagonal
        k = whole.area / math.pi / r / r if r > 0 else math.inf
        return RegionSize(max(1, round(min(k, whole.n_cells))), r)
    if n_segments is None and not isinstance(init, str):
        k = len(checked_seeds(init, whole.n_cells, "init"))
    else:
        k = checked_n_segments(n_segments, whole.n_cells)
    return RegionSize(k, math.sqrt(whole.area / (math.pi * k)))


def place_seeds(
    graph: CellGraph,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    init: str | npt.ArrayLike = "geodesic",
    n_threads: int | None = None,
) -> npt.NDArray[np.int32]:
    """Return the first centers.

    Parameters
    ----------
    graph : CellGraph
    n_segments : int, optional
        Number of regions k, 1 to N: the expected radius is then r = sqrt(A / (pi k)), A the sum of
        all measures. 150 (N, if that is less) if neither this nor `radius` is given.
    radius : float, optional
        r as a fraction of the diagonal of the graph's bounds, > 0; k is then A / (pi r^2), rounded.
    init : {"farthest", "geodesic", "flood", "grid"} or array_like of int
        ``"farthest"``: the cell nearest to the centroid of all, then again and again the cell
        farthest (Euclidean) from all seeds so far; exactly k seeds, in O((N + k) log N) in
        practice. ``"geodesic"``: likewise the cell with the longest path to all seeds so far, so
        that seeds are denser where creases are; exactly k, in O(N log N log k) in practice. Several
        components begin with the central cell of each that has half of the measure of a region or
        more, the largest first. ``"flood"``: cells are visited in the order of their path length
        from that first cell, and one that no region has reached yet starts a region, which expands
        to 2 r; each further component is flooded from its lowest cell. ``"grid"``: the cells in
        each cube of edge 2 r of a grid over the bounds are one region, whose center is taken.
        Flood and grid give about as many seeds as the radius asks for. An array: these cells.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of int32, shape (K,)
        Distinct cells. Ties go to the lowest index.

    Raises
    ------
    ValueError
        If an argument is out of range, `n_segments` does not agree with given seeds, or the cells
        have no area that a radius for flood or grid could be derived from.
    TypeError
        If an argument has the wrong type.

    Examples
    --------
    >>> line = CellGraph([[x, 0, 0] for x in range(5)], [1] * 5, [0, 1, 3, 5, 7, 8],
    ...                  [1, 0, 2, 1, 3, 2, 4, 3], [1] * 8)
    >>> place_seeds(line, 3)
    array([2, 0, 4], dtype=int32)
    """
    checked_graph(graph)
    threads = checked_threads(n_threads)
    cells = graph.ordered(threads)
    size = region_size(cells, n_segments, radius, init)
    return run_seeding(cells, size, n_segments, init, threads)


def run_seeding(
    cells: OrderedCells,
    size: RegionSize,
    n_segments: int | None,
    init: str | npt.ArrayLike,
    n_threads: int,
) -> npt.NDArray[np.int32]:
    """Place seeds for regions of a size that is known; `n_segments` as it was asked for."""
    if not isinstance(init, str):
        return _given_seeds(cells, init, n_segments)
    checked_choice(init, "init", INITS)
    if init == "grid":
        x, y, z = cells.bounds[0].tolist()
        side = SEED_SPACING * _positive_radius(size, init)
        return _core.grid_seeds(cells.graph, (x, y, z), side, n_threads)
    first = _core.central_cell(cells.graph, n_threads)
    if init == "farthest":
        return _core.farthest_seeds(cells.graph, first, size.n_segments, n_threads)
    if init == "geodesic":
        return _core.geodesic_seeds(cells.graph, first, size.n_segments, n_threads)
    reach = SEED_SPACING * _positive_radius(size, init)
    return _core.flood_seeds(cells.graph, first, reach, n_threads)


def _given_seeds(cells: OrderedCells, seeds: Any, n_segments: int | None) -> npt.NDArray[np.int32]:
    array = checked_seeds(seeds, cells.graph.n_cells, "init")
    if n_segments is not None and n_segments != len(array):
        raise ValueError(f"n_segments is {n_segments} but {len(array)} seeds are given")
    return array


def _positive_radius(size: RegionSize, init: str) -> float:
    if size.radius > 0:
        return size.radius
    raise ValueError(f"init={init!r} needs a radius, and the faces have no area to derive it from")
