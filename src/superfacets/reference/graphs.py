"""What the twins of stages 3 to 5 ask of a cell graph."""

from __future__ import annotations

import heapq

import numpy as np

from .._types import Array
from ..cells.cell_graph import CellGraph
from .update import update_centers
from .vectors import dot


def find_components(graph: CellGraph, labels: Array) -> list[int]:
    """Component of each cell: arcs between cells of one label join them, whichever way they lead.

    Components are numbered in the order of their lowest cells.
    """
    around: list[set[int]] = [set() for _ in labels]
    for cell in range(graph.n_cells):
        for neighbor, _ in arcs_of(graph, cell):
            if labels[cell] == labels[neighbor]:
                around[cell].add(neighbor)
                around[neighbor].add(cell)
    components = [-1] * graph.n_cells
    n_components = 0
    for lowest in range(graph.n_cells):
        if components[lowest] >= 0:
            continue
        waiting = [lowest]
        while waiting:
            cell = waiting.pop()
            components[cell] = n_components
            waiting += [other for other in around[cell] if components[other] < 0]
        n_components += 1
    return components


def expand(graph: CellGraph, center: int, reach: float) -> dict[int, int]:
    """Path lengths from a center, by Dijkstra's algorithm halted at `reach` (Euclidean)."""
    lengths: dict[int, int] = {}
    queue = [(0, center)]
    while queue:
        length, cell = heapq.heappop(queue)
        if cell in lengths:
            continue
        lengths[cell] = length
        step = graph.positions[cell] - graph.positions[center]
        if dot(step, step) <= reach * reach:
            for neighbor, step_length in arcs_of(graph, cell):
                heapq.heappush(queue, (length + step_length, neighbor))
    return lengths


def first_cell(graph: CellGraph) -> int:
    """The cell nearest to the centroid of all."""
    return update_centers(graph, np.zeros(graph.n_cells, dtype=np.int32))[0]


def arcs_of(graph: CellGraph, cell: int) -> list[tuple[int, int]]:
    """Neighbor and length, in units, of each arc of a cell."""
    arcs = slice(graph.offsets[cell], graph.offsets[cell + 1])
    return [
        (int(n), int(length))
        for n, length in zip(graph.neighbors[arcs], graph.lengths[arcs], strict=True)
    ]
