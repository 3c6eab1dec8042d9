"""Place the seeds: the initial centers of regions."""

from __future__ import annotations

from .. import _core
from ..base.checks import checked_choice, checked_seeds, checked_threads
from ..base.options import ANY_INITS, ISLANDS, AnyInit, CountOptions, Islands, Seeds
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph, checked_graph
from ..graph.size import RegionSize, region_size

SEED_SPACING = 2.0
"""Radius of the regions of ``"flood"``, and edge of the cubes of ``"grid"``, in multiples of the
expected radius r."""

CORE_ISLANDS = {"keep": _core.Islands.KEEP, "nearest": _core.Islands.NEAREST}
"""Map from values of the argument `islands` to the enumeration in `_core`."""


def place_seeds(
    graph: CellGraph, n_segments: int | None = None, *, radius: float | None = None,
    init: AnyInit | Seeds = "geodesic", islands: Islands = "keep", n_threads: int | None = None,
) -> Ints:  # fmt: skip
    """Return the seeds: the initial centers of regions.

    Parameters
    ----------
    graph : CellGraph
    n_segments : int, optional
        Number of regions k, from 1 to N. The expected radius is then r = sqrt(A / (pi k)), where A
        is the sum of all measures. By default as in `segment`.
    radius : float, optional
        Expected radius r, > 0, in the unit of the positions; k is then A / (pi r^2), rounded.
    init : {"geodesic", "curve", "farthest", "flood", "grid"} or array_like of int
        Seeding method, or the seeds.

        - ``"geodesic"``: Start with the central cell (nearest to the centroid) of each component
          except islands, from the largest component to the smallest. Then repeatedly add the cell
          with the longest path from its nearest seed. Seeds are denser near creases. There are
          exactly k seeds, and time is O(N log N log k) in practice.
        - ``"farthest"``: The same with Euclidean distances, in O((N + k) log N) in practice.
        - ``"curve"``: Divide the Morton curve through all cells into 0.6 k parts of about equal
          weight, and use the middle cell of each as a seed. Place the other 0.4 k seeds as
          ``"geodesic"`` does. The weight of a cell is its measure times the square root of the
          ratio of the total length of its arcs to the total distance of its neighbors. There are
          exactly k seeds. Time is O(N + k log N).
        - ``"flood"``: Visit cells in the order of their path length from the central cell (in
          further components, from the lowest cell). A cell that no region has reached becomes the
          seed of a new region, which expands to a distance of 2 r. There are about k seeds.
        - ``"grid"``: Divide the bounding box into cubes of edge 2 r. In each cube, the seed is the
          cell nearest to the centroid of the cells in it. There are about k seeds.
        - An array: the indices of the seed cells.
    islands : {"keep", "nearest"}
        Whether ``"farthest"`` and ``"flood"`` place seeds on islands (``"keep"``); ``"geodesic"``
        and ``"curve"`` never do. With ``"nearest"``, ``"farthest"`` starts with the same cells as
        ``"geodesic"``. An island is a small component: in descending order of measure, any after
        the first k, or with a measure below A / (2 k) if the components before it have at least k
        cells.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    ndarray of int32, shape (K,)
        Indices of distinct cells. If a method finds several equally good cells, it uses the lowest.

    Raises
    ------
    ValueError
        If an argument is out of range, if `n_segments` differs from the number of given seeds, or
        if ``"flood"`` or ``"grid"`` has no radius because all measures are 0.
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
    options = CountOptions.checked(n_segments, radius, init)
    size = region_size(options, graph.measures, threads, graph.dimension)
    checked_choice(islands, "islands", ISLANDS)
    ordered = graph.ordered(threads)
    return run_seeding(ordered, graph.bounds, size, options, init, islands, threads)[0]


def run_seeding(
    graph: _core.OrderedGraph, bounds: Floats, size: RegionSize,
    options: CountOptions, init: AnyInit | Seeds, islands: str, n_threads: int,
) -> tuple[Ints, _core.PathArrays | None]:  # fmt: skip
    """Return the result of `place_seeds` for options that are already checked.

    Also returns the paths from the seeds to all cells, if the seeding method computes them.
    """
    if not isinstance(init, str):
        return _given_seeds(options, graph.n_cells), None
    checked_choice(init, "init", ANY_INITS)
    if init == "grid":
        x, y, z = bounds[0].tolist()
        side = SEED_SPACING * _positive_radius(size, init)
        return _core.grid_seeds(graph, (x, y, z), side, n_threads), None
    first = _core.central_cell(graph, n_threads)
    of_islands = CORE_ISLANDS[islands]
    if init == "farthest":
        return _core.farthest_seeds(graph, first, size.n_segments, of_islands, n_threads), None
    if init == "curve":
        return _core.curve_seeds(graph, first, size.n_segments, n_threads)
    if init == "geodesic":
        return _core.geodesic_seeds(graph, first, size.n_segments, n_threads)
    reach = SEED_SPACING * _positive_radius(size, init)
    return _core.flood_seeds(graph, first, size.n_segments, reach, of_islands, n_threads), None


def _given_seeds(options: CountOptions, n_cells: int) -> Ints:
    array = checked_seeds(options.seeds, n_cells, "init")
    if options.n_segments is not None and options.n_segments != len(array):
        raise ValueError(
            f"n_segments must be the number of seeds in init, {len(array)}, got"
            f" {options.n_segments}: leave n_segments out"
        )
    return array


def _positive_radius(size: RegionSize, init: str) -> float:
    if size.radius > 0:
        return size.radius
    raise ValueError(
        f"init={init!r} needs a radius above 0, but all cells have area 0: use init='geodesic'"
    )
