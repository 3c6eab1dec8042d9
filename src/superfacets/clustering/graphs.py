"""Graphs for the loop: in memory or not, and coarser ones on which most of it runs."""

from __future__ import annotations

from typing import Protocol, TypeAlias

from .. import _core
from .._core import OrderedGraph
from .._options import LoopOptions
from .._types import Ints


class Regions(Protocol):
    """Regions around centers, after the loop; `_core.Clustering` is one."""

    def centers(self) -> Ints:
        """The centers, then unreached cells that became centers."""

    def labels(self) -> Ints:
        """The label of each cell."""


class CoarseCells(Protocol):
    """Coarse cells of a graph; `_core.CoarseGraph` is one."""

    @property
    def graph(self) -> OrderedGraph:
        """The graph of coarse cells."""

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Return centers among the cells for regions of coarse cells."""


class LargeGraph(Protocol):
    """A graph that is not in memory: the loop runs on coarse cells, then labels all cells once."""

    @property
    def n_cells(self) -> int:
        """Number of cells."""

    @property
    def is_symmetric(self) -> bool:
        """Whether each arc has one back of the same length."""

    def coarsened(self, cell_size: int, n_threads: int) -> CoarseCells:
        """Coarse cells of about so many cells."""

    def regions(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> Regions:
        """Regions around centers."""

    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]:
        """Labels of all cells, the number of islands that joined a region, and new centers."""

    def gathered(self, n_threads: int) -> OrderedGraph:
        """The graph in memory."""


AnyGraph: TypeAlias = OrderedGraph | LargeGraph

CELL_SIZES = (16, 8, 4)
"""Cells per coarse cell on the first level: the first size that leaves regions enough of them."""

NEXT_CELL_SIZE = 4
"""Cells per coarse cell on each further level."""

CELLS_PER_REGION = 24
"""Least mean number of coarse cells in a region.

With 16 to 32, and one to three iterations on all cells after the coarse ones, undersegmentation
error and compactness of the 95 benchmark models are those of the loop on all cells or better
(k = 50: .2088 to .2109 / 4.21 to 4.22, against .2143 / 4.23; k = 150: .1279 to .1287 / 4.47 to
4.48, against .1283 / 4.48)."""

ENOUGH_OF_SEEDED = 0.75
"""Share of these coarse cells that must be in components with seeds."""

MIN_REDUCTION = 2
"""Least factor by which the number of cells must fall from level to level."""


def _coarsened(graph: AnyGraph, cell_size: int, n_threads: int) -> CoarseCells:
    """Coarse cells of about so many cells."""
    if isinstance(graph, OrderedGraph):
        return _core.CoarseGraph(graph, cell_size, n_threads)
    return graph.coarsened(cell_size, n_threads)


def in_memory(graph: AnyGraph, n_threads: int) -> OrderedGraph:
    """Return the graph with all cells in memory."""
    return graph if isinstance(graph, OrderedGraph) else graph.gathered(n_threads)


def regions_of(
    graph: AnyGraph, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
) -> Regions:
    """Regions around centers."""
    if isinstance(graph, OrderedGraph):
        return _core.Clustering(graph, centers, reach, n_threads, islands)
    return graph.regions(centers, reach, n_threads, islands)


def join_islands(
    graph: AnyGraph, labels: Ints, groups: Ints, n_threads: int
) -> tuple[Ints, int, Ints]:
    """Labels of all cells, where islands join the nearest region."""
    if isinstance(graph, OrderedGraph):
        return _core.join_islands(graph, labels, groups, n_threads)
    return graph.join_islands(labels, groups, n_threads)


def can_be_coarse(graph: AnyGraph, loop: LoopOptions) -> bool:
    """Whether the loop may begin on coarse cells.

    Not in the halted mode, with ``tol=0``, for a single iteration, or if some arcs have no arc back
    of the same length.
    """
    is_exact = loop.radius_factor is None and loop.tol > 0 and loop.max_num_iter > 1
    return is_exact and graph.is_symmetric


def coarse_graphs(graph: AnyGraph, n_segments: int, n_threads: int) -> list[CoarseCells]:
    """Return coarser and coarser graphs, the finest first, as long as regions have enough cells."""
    coarse: list[CoarseCells] = []
    sizes: tuple[int, ...] = CELL_SIZES
    n_enough = CELLS_PER_REGION * n_segments
    while fitting := [size for size in sizes if graph.n_cells >= size * n_enough]:
        larger = _coarsened(graph, fitting[0], n_threads)
        if larger.graph.n_cells > graph.n_cells / MIN_REDUCTION:
            break  # nearly all cells are alone
        n_seeded = _core.n_cells_of_large_components(larger.graph, n_segments, n_threads)
        if n_seeded < ENOUGH_OF_SEEDED * n_enough:
            break  # most cells belong to islands, which get no seeds
        coarse.append(larger)
        graph = larger.graph
        sizes = (NEXT_CELL_SIZE,)
    return coarse
