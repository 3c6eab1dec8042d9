"""What the loop asks of a graph, whether its cells are in memory or not."""

from __future__ import annotations

from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core

__all__ = [
    "AnyGraph", "CoarseCells", "LargeGraph", "Regions", "coarsened", "in_memory",
    "join_islands", "regions_of",
]  # fmt: skip

Ints = npt.NDArray[np.int32]


class Regions(Protocol):
    """What `_core.Clustering` is: regions around centers, and where the centers should be."""

    def classify(self, centers: Ints) -> None: ...
    def update(self) -> Ints: ...
    def centers(self) -> Ints: ...
    def labels(self) -> Ints: ...


class CoarseCells(Protocol):
    """What `_core.CoarseGraph` is: the coarse cells of a graph."""

    @property
    def graph(self) -> _core.OrderedGraph: ...
    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints: ...


class LargeGraph(Protocol):
    """A graph that offers what is done with `_core.OrderedGraph`, but is not in memory."""

    @property
    def n_cells(self) -> int: ...
    @property
    def is_symmetric(self) -> bool: ...
    def coarsened(self, cell_size: int, n_threads: int) -> CoarseCells: ...
    def regions(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> Regions: ...
    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]: ...
    def gathered(self, n_threads: int) -> _core.OrderedGraph: ...
    def positions_of(self, cells: Ints) -> npt.NDArray[np.float64]: ...


AnyGraph: TypeAlias = _core.OrderedGraph | LargeGraph


def coarsened(graph: AnyGraph, cell_size: int, n_threads: int) -> CoarseCells:
    """Coarse cells of about so many cells."""
    if isinstance(graph, _core.OrderedGraph):
        return _core.CoarseGraph(graph, cell_size, n_threads)
    return graph.coarsened(cell_size, n_threads)


def in_memory(graph: AnyGraph, n_threads: int) -> _core.OrderedGraph:
    """Return the graph with all cells in memory."""
    return graph if isinstance(graph, _core.OrderedGraph) else graph.gathered(n_threads)


def regions_of(
    graph: AnyGraph, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
) -> Regions:
    """Regions around centers."""
    if isinstance(graph, _core.OrderedGraph):
        return _core.Clustering(graph, centers, reach, n_threads, islands)
    return graph.regions(centers, reach, n_threads, islands)


def join_islands(
    graph: AnyGraph, labels: Ints, groups: Ints, n_threads: int
) -> tuple[Ints, int, Ints]:
    """Labels of all cells, where islands join the nearest region."""
    if isinstance(graph, _core.OrderedGraph):
        return _core.join_islands(graph, labels, groups, n_threads)
    return graph.join_islands(labels, groups, n_threads)
