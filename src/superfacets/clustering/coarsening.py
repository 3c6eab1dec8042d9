"""Coarse to fine: graphs of larger cells, on which most of the loop runs."""

from __future__ import annotations

from .. import _core
from .._options import LoopOptions
from .graphs import AnyGraph, CoarseCells, coarsened

__all__ = ["can_be_coarse", "coarse_graphs"]

CELL_SIZES = (16, 8, 4)
"""Cells per coarse cell on the first level, if that leaves regions enough coarse cells."""

NEXT_CELL_SIZE = 4
"""The same on all further levels."""

CELLS_PER_REGION = 24
"""Coarse cells that regions must have on average.

With 16 to 32, and one to three iterations on all cells after the coarse ones, undersegmentation
error and compactness of the 95 benchmark models are those of the loop on all cells or better
(k = 50: .2088 to .2109 / 4.21 to 4.22, against .2143 / 4.23; k = 150: .1279 to .1287 / 4.47 to
4.48, against .1283 / 4.48)."""

ENOUGH_OF_SEEDED = 0.75
"""The share of these cells that must be in components that get seeds."""

MIN_REDUCTION = 2
"""How many times fewer cells a level must have."""


def can_be_coarse(graph: AnyGraph, loop: LoopOptions) -> bool:
    """Whether the loop may begin on coarse cells.

    It must not in the halted mode, with ``tol=0``, for one iteration, and where arcs lead one way
    or are longer one way.
    """
    is_exact = loop.radius_factor is None and loop.tol > 0 and loop.max_num_iter > 1
    return is_exact and graph.is_symmetric


def coarse_graphs(graph: AnyGraph, n_segments: int, n_threads: int) -> list[CoarseCells]:
    """Return graphs of ever larger cells, the finest first, while regions have enough of them."""
    coarse: list[CoarseCells] = []
    sizes: tuple[int, ...] = CELL_SIZES
    n_enough = CELLS_PER_REGION * n_segments
    while fitting := [size for size in sizes if graph.n_cells >= size * n_enough]:
        larger = coarsened(graph, fitting[0], n_threads)
        if larger.graph.n_cells > graph.n_cells / MIN_REDUCTION:
            break  # nearly all cells are alone
        n_seeded = _core.n_cells_of_large_components(larger.graph, n_segments, n_threads)
        if n_seeded < ENOUGH_OF_SEEDED * n_enough:
            break  # most cells are those of islands, which get no seeds
        coarse.append(larger)
        graph = larger.graph
        sizes = (NEXT_CELL_SIZE,)
    return coarse
