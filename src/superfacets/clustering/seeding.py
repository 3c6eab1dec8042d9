"""Stage 3: the first centers."""

from __future__ import annotations

from .. import _core
from .._options import INITS, ISLANDS, Init, Islands, Seeds, SizeOptions
from .._types import Floats, Ints
from .._validate import checked_choice, checked_seeds, checked_threads
from ..cells.cell_graph import CellGraph, checked_graph
from ..cells.size import RegionSize, region_size

SEED_SPACING = 2.0
"""Reach of a flooded region, and edge of a grid cube, in radii."""

CORE_ISLANDS = {"keep": _core.Islands.KEEP, "nearest": _core.Islands.NEAREST}
"""The enumeration of the core, by the names that users give."""


def place_seeds(
    graph: CellGraph,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    init: Init | Seeds = "geodesic",
    islands: Islands = "keep",
    n_threads: int | None = None,
) -> Ints:
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
        ``"farthest"``: the cell nearest to the centroid of all, then repeatedly the cell
        farthest (Euclidean) from all seeds so far; exactly k seeds, in O((N + k) log N) in
        practice. ``"geodesic"``: likewise the cell with the longest path to all seeds so far, so
        that seeds are denser where creases are; exactly k, in O(N log N log k) in practice. Several
        components begin with the central cell of each that is no island, the largest first.
        ``"flood"``: cells are visited in the order of their path length
        from that first cell, and one that no region has reached yet starts a region, which expands
        to 2 r; each further component is flooded from its lowest cell. ``"grid"``: the cells in
        each cube of edge 2 r of a grid over the bounds are one region, whose center is taken.
        Flood and grid give about as many seeds as the radius asks for. An array: these cells.
    islands : {"keep", "nearest"}
        Islands are components with less than half of the measure of a region (A / k), as long as
        the larger ones have k cells, and all but the k largest components. They get no geodesic
        seeds. Where they are to join the nearest region, they get no seeds of ``"farthest"``, which
        then begins with the same central cells, and of ``"flood"`` either.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of int32, shape (K,)
        Distinct cells. Ties go to the lowest index.

    Notes
    -----
    Arcs that lead one way connect as all others do. Cells that no seed reaches are then the
    farthest by path length, and the last to be visited of their component by ``"flood"``.

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
    options = SizeOptions.checked(n_segments, radius, init)
    size = region_size(options, graph.measures, graph.diagonal, threads, graph.dimension)
    checked_choice(islands, "islands", ISLANDS)
    ordered = graph.ordered(threads)
    return run_seeding(ordered, graph.bounds, size, options, init, islands, threads)


def run_seeding(
    graph: _core.OrderedGraph, bounds: Floats, size: RegionSize,
    options: SizeOptions, init: Init | Seeds, islands: str, n_threads: int,
) -> Ints:  # fmt: skip
    """Place seeds as asked for, for regions of a known size."""
    if not isinstance(init, str):
        return _given_seeds(options, graph.n_cells)
    checked_choice(init, "init", INITS)
    if init == "grid":
        x, y, z = bounds[0].tolist()
        side = SEED_SPACING * _positive_radius(size, init)
        return _core.grid_seeds(graph, (x, y, z), side, n_threads)
    first = _core.central_cell(graph, n_threads)
    of_islands = CORE_ISLANDS[islands]
    if init == "farthest":
        return _core.farthest_seeds(graph, first, size.n_segments, of_islands, n_threads)
    if init == "geodesic":
        return _core.geodesic_seeds(graph, first, size.n_segments, n_threads)
    reach = SEED_SPACING * _positive_radius(size, init)
    return _core.flood_seeds(graph, first, size.n_segments, reach, of_islands, n_threads)


def _given_seeds(options: SizeOptions, n_cells: int) -> Ints:
    array = checked_seeds(options.seeds, n_cells, "init")
    if options.n_segments is not None and options.n_segments != len(array):
        raise ValueError(f"n_segments is {options.n_segments} but {len(array)} seeds are given")
    return array


def _positive_radius(size: RegionSize, init: str) -> float:
    if size.radius > 0:
        return size.radius
    raise ValueError(f"init={init!r} needs a radius, and the faces have no area to derive it from")
