"""Graphs of the loop, in memory or in tiles, and coarser graphs for most iterations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

from .. import _core
from .._core import OrderedGraph
from .._options import LoopOptions
from .._types import Array, Ints
from .plan import Plan


class Regions(Protocol):
    """Regions around centers, after the loop. `_core.Clustering` implements this protocol."""

    def centers(self) -> Ints:
        """Return the centers, then unreached cells that became centers."""

    def labels(self) -> Ints:
        """Return the label of each cell."""


class CoarseCells(Protocol):
    """Coarse cells of a graph. `_core.CoarseGraph` implements this protocol."""

    @property
    def graph(self) -> OrderedGraph:
        """The graph of coarse cells."""

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Return the centers of regions of coarse cells, as finer cells."""

    def spread(
        self, lengths: Array, labels: Ints, centers: Ints, n_threads: int, *, needs_lengths: bool
    ) -> tuple[Array, Ints]:
        """Extend paths from coarse cells to all finer cells; return their lengths and labels.

        The lengths may be empty unless they are needed.
        """


class LargeGraph(Protocol):
    """A graph on disk: the loop runs on coarse cells in memory, then labels all cells once."""

    @property
    def n_cells(self) -> int:
        """Number of cells."""

    @property
    def is_symmetric(self) -> bool:
        """Whether each arc has a reverse arc of the same length."""

    @property
    def straight_unit(self) -> float:
        """Unit of arc lengths if steps are straight; otherwise 0."""

    def coarsened(self, cell_size: int, n_threads: int) -> CoarseCells:
        """Return coarse cells of about `cell_size` cells each."""

    def regions(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> Regions:
        """Return regions around centers."""

    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]:
        """Return labels of all cells, the number of joined islands, and the centers."""

    def gathered(self, n_threads: int) -> OrderedGraph:
        """Return the whole graph in memory."""


AnyGraph: TypeAlias = OrderedGraph | LargeGraph

CELL_SIZES = (16, 8, 4)
"""Cells per coarse cell on the first level: the first of these that gives enough coarse cells."""

NEXT_CELL_SIZE = 4
"""Cells per coarse cell on each further level."""

CELLS_PER_REGION = 24
"""Smallest mean number of coarse cells per region.

With values of 16 to 32, and one to three iterations on all cells after the coarse levels, the
undersegmentation error and compactness of the 95 benchmark models are about as good as without
coarse levels, or better: at k = 50, .2088 to .2109 and 4.21 to 4.22, against .2143 and 4.23; at k =
150, .1279 to .1287 and 4.47 to 4.48, against .1283 and 4.48."""

FINEST_PER_REGION = 48
"""Value of CELLS_PER_REGION for straight steps, if paths on coarse cells determine the labels of
all cells. With 24, the undersegmentation error is 0.003 to 0.006 higher; with 96, 0.001 to 0.003
lower."""

COARSEST_PER_REGION = 12
"""Value of CELLS_PER_REGION for straight steps on further levels, where seeds are placed and
moved."""

MANY_REGIONS = 10_000
"""Number of small regions from which the default loop is a short one, see `Levels.is_short`. On 14
meshes of 43,000 to 420,000 faces, with 17 and 40 faces per region, the undersegmentation error is
0.0261 (0.0259 with the long loop), and compactness is lower by 0.5%."""

ENOUGH_OF_SEEDED = 0.75
"""Fraction of the required coarse cells that must be in components with seeds."""

MIN_REDUCTION = 2
"""Smallest factor by which the number of cells must fall from level to level."""


def _coarsened(graph: AnyGraph, cell_size: int, n_threads: int) -> CoarseCells:
    """Return coarse cells of about `cell_size` cells each."""
    if isinstance(graph, OrderedGraph):
        return _core.CoarseGraph(graph, cell_size, n_threads)
    return graph.coarsened(cell_size, n_threads)


def in_memory(graph: AnyGraph, n_threads: int) -> OrderedGraph:
    """Return the whole graph in memory."""
    return graph if isinstance(graph, OrderedGraph) else graph.gathered(n_threads)


def regions_of(
    graph: AnyGraph, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
) -> Regions:
    """Return regions around centers."""
    if isinstance(graph, OrderedGraph):
        return _core.Clustering(graph, centers, reach, n_threads, islands)
    return graph.regions(centers, reach, n_threads, islands)


def join_islands(
    graph: AnyGraph, labels: Ints, groups: Ints, n_threads: int
) -> tuple[Ints, int, Ints]:
    """Join islands to the nearest regions; return labels, number of joined islands, and centers."""
    if isinstance(graph, OrderedGraph):
        return _core.join_islands(graph, labels, groups, n_threads)
    return graph.join_islands(labels, groups, n_threads)


def can_be_coarse(is_symmetric: bool, plan: Plan, loop: LoopOptions) -> bool:
    """Return whether the loop may begin on coarse cells.

    The loop must run on all cells if seeds are given, in the halted mode, with ``tol=0``, for a
    single iteration, or if an arc has no reverse arc of the same length.
    """
    is_exact = loop.radius_factor is None and loop.tol > 0 and loop.max_num_iter > 1
    return not plan.has_seeds and is_exact and is_symmetric


@dataclass
class Levels:
    """The coarse graphs, and which of them the loop runs on."""

    coarse: list[CoarseCells]
    """The finest first. The loop removes graphs after their last use, to free memory."""
    n_finer: int = 0
    """Number of finest graphs on which the loop does not run. Paths are only extended to their
    cells."""
    on_all: bool = True
    """Whether the loop also runs on all cells. If not, all cells are labeled once at the end."""
    is_short: bool = False
    """Whether the loop has only a few iterations, with seeds along the curve and fewer far arcs."""

    @classmethod
    def of(cls, graph: AnyGraph, plan: Plan, n_threads: int) -> Levels:
        """Build coarser graphs while regions have enough coarse cells."""
        n_segments = plan.size.n_segments
        if not is_straight(graph):
            enough = (CELLS_PER_REGION * n_segments, CELLS_PER_REGION * n_segments)
            coarse = _coarser(graph, CELL_SIZES, enough, n_segments, n_threads)
            return cls(coarse, on_all=not coarse)
        finest, coarsest = FINEST_PER_REGION * n_segments, COARSEST_PER_REGION * n_segments
        if has_small_regions(graph, n_segments):
            enough = (CELLS_PER_REGION * n_segments, coarsest)
            coarse = _coarser(graph, (NEXT_CELL_SIZE,), enough, n_segments, n_threads)
            is_short = not coarse and n_segments >= MANY_REGIONS and plan.init is None
            return cls(coarse, is_short=is_short)
        coarse = _coarser(graph, CELL_SIZES, (finest, coarsest), n_segments, n_threads)
        n_fine = sum(level.graph.n_cells >= finest for level in coarse)
        return cls(coarse, max(n_fine - 1, 0), on_all=not coarse)


def has_small_regions(graph: AnyGraph, n_segments: int) -> bool:
    """Return whether regions have too few cells for labels from paths on coarse cells."""
    return graph.n_cells < CELL_SIZES[-1] * FINEST_PER_REGION * n_segments


def is_straight(graph: AnyGraph) -> bool:
    """Return whether arc lengths are distances between positions plus prices."""
    return graph.straight_unit > 0.0


def _coarser(
    graph: AnyGraph,
    sizes: tuple[int, ...],
    enough: tuple[int, int],
    n_segments: int,
    n_threads: int,
) -> list[CoarseCells]:
    """Return successively coarser graphs, the finest first.

    `sizes` lists sizes of the first coarse cells in order of preference. `enough` holds the
    smallest number of coarse cells on the first level and on further levels.
    """
    coarse: list[CoarseCells] = []
    n_enough, n_next = enough
    while fitting := [size for size in sizes if graph.n_cells >= size * n_enough]:
        larger = _coarsened(graph, fitting[0], n_threads)
        if larger.graph.n_cells > graph.n_cells / MIN_REDUCTION:
            break  # most cells have no neighbor to merge with
        n_seeded = _core.n_cells_of_large_components(larger.graph, n_segments, n_threads)
        if n_seeded < ENOUGH_OF_SEEDED * n_enough:
            break  # most cells are in islands, which get no seeds
        coarse.append(larger)
        graph = larger.graph
        sizes, n_enough = (NEXT_CELL_SIZE,), n_next
    return coarse
