"""What the loop asks of a graph, whether its cells are in memory or not."""

from __future__ import annotations

from typing import Protocol, TypeAlias

from .. import _core
from .._core import OrderedGraph
from .._types import Ints

__all__ = [
    "AnyGraph", "CoarseCells", "LargeGraph", "Regions", "coarsened", "in_memory",
    "join_islands", "regions_of",
]  # fmt: skip


class Regions(Protocol):
    """What is asked of `_core.Clustering`, regions around centers, when the loop has ended."""

    def centers(self) -> Ints:
        """The centers, followed by those made of unreached cells."""

    def labels(self) -> Ints:
        """The label of each cell."""


class CoarseCells(Protocol):
    """What `_core.CoarseGraph` is: the coarse cells of a graph."""

    @property
    def graph(self) -> OrderedGraph:
        """The graph of coarse cells."""

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Centers among cells for regions of coarse cells."""


class LargeGraph(Protocol):
    """A graph that is not in memory: the loop runs on coarse cells, and classifies all once."""

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
        """Labels of all cells; the number of islands that joined a region, and new centers."""

    def gathered(self, n_threads: int) -> OrderedGraph:
        """The graph in memory."""


AnyGraph: TypeAlias = OrderedGraph | LargeGraph


def coarsened(graph: AnyGraph, cell_size: int, n_threads: int) -> CoarseCells:
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
