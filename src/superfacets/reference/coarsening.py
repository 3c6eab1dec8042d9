"""Stages 3 and 4: coarse cells, on which most of the loop runs."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np

from ..cells.cell_graph import CellGraph
from .graphs import arcs_of

RANGE = 4096
"""Cells in a row, on the curve, that coarse cells do not extend beyond."""


def coarse_cells(
    graph: CellGraph, order: Sequence[int], spacing: int
) -> tuple[list[int], list[int], list[int]]:
    """Center of each coarse cell; the coarse cell of each cell, and the length of the path from it.

    Centers are `spacing` apart in this order of the cells, in each range of it.
    """
    centers: list[int] = []
    coarse_of = [-1] * graph.n_cells
    lengths = [0] * graph.n_cells
    for begin in range(0, len(order), RANGE):
        members = [int(cell) for cell in order[begin : begin + RANGE]]
        best: dict[int, tuple[int, int]] = {}
        first = (min(spacing, len(members)) - 1) // 2
        _expand(graph, members, members[first::spacing], len(centers), best)
        centers += members[first::spacing]
        for cell in members:
            if cell not in best:
                _expand(graph, members, [cell], len(centers), best)
                centers.append(cell)
        for cell, (length, coarse) in best.items():
            coarse_of[cell], lengths[cell] = coarse, length
    return centers, coarse_of, lengths


def _expand(
    graph: CellGraph,
    members: list[int],
    centers: list[int],
    first_label: int,
    best: dict[int, tuple[int, int]],
) -> None:
    """Reach what no earlier center reaches, by the shortest path from one of these."""
    inside = set(members) - set(best)
    queue = [(0, first_label + i, center) for i, center in enumerate(centers)]
    while queue:
        length, label, cell = heapq.heappop(queue)
        if cell in best:
            continue
        best[cell] = (length, label)
        for neighbor, step in arcs_of(graph, cell):
            if neighbor in inside:
                heapq.heappush(queue, (length + step, label, neighbor))


def coarse_arcs(
    graph: CellGraph, coarse_of: list[int], lengths: list[int]
) -> dict[tuple[int, int], float]:
    """The shortest way between the centers of two coarse cells that touch, over one border arc."""
    arcs: dict[tuple[int, int], float] = {}
    for cell in range(graph.n_cells):
        for neighbor, step in arcs_of(graph, cell):
            a, b = coarse_of[cell], coarse_of[neighbor]
            if a == b:
                continue
            paths = np.float32(lengths[cell]) + np.float32(lengths[neighbor])
            way = float(paths + np.float32(step))
            arcs[a, b] = min(arcs.get((a, b), way), way)
    return arcs
