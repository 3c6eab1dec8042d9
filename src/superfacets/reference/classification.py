"""Stage 4a: labels from centers."""

from __future__ import annotations

import heapq
import math

import numpy as np

from ..cells.cell_graph import CellGraph
from .graphs import arcs_of, expand, find_components
from .vectors import dot


def classify_exact(
    graph: CellGraph, centers: list[int], *, islands: str = "keep"
) -> tuple[list[int], list[int]]:
    """Labels by one expansion from all centers, and the centers with those of orphans.

    Where islands are not kept, there are none of these, and cells without a center have label -1.
    """
    all_centers = list(centers)
    while True:
        labels: dict[int, int] = {}
        queue = [(0, label, center) for label, center in enumerate(all_centers)]
        while queue:
            length, label, cell = heapq.heappop(queue)
            if cell not in labels:
                labels[cell] = label
                for neighbor, step in arcs_of(graph, cell):
                    heapq.heappush(queue, (length + step, label, neighbor))
        if len(labels) == graph.n_cells or islands == "nearest":
            return [labels.get(cell, -1) for cell in range(graph.n_cells)], all_centers
        all_centers.append(min(set(range(graph.n_cells)) - labels.keys()))


def classify_halted(
    graph: CellGraph, centers: list[int], reach: float, *, islands: str = "keep"
) -> tuple[list[int], list[int]]:
    """Labels by one expansion of each center, as in the paper, and all centers.

    For islands see `classify_exact`.
    """
    best = [(math.inf, -1)] * graph.n_cells  # path length and label
    all_centers: list[int] = []
    waiting = list(centers)
    while waiting:
        label, center = len(all_centers), waiting.pop(0)
        all_centers.append(center)
        for cell, length in expand(graph, center, reach).items():
            best[cell] = min(best[cell], (length, label))
        if not waiting and (math.inf, -1) in best and islands == "keep":
            waiting.append(best.index((math.inf, -1)))  # the first orphan
    return [label for _, label in best], all_centers


def join_islands(
    graph: CellGraph, labels: list[int], groups: list[int] | None = None
) -> tuple[list[int], int, list[int]]:
    """Labels without -1, the number of connected pieces that joined, and centers of the others.

    Each takes the label of the nearest cell, the lowest of equals, to any of its own. With groups,
    of the nearest cell of its own group, unless that is -1; if there is none, it is a region, and
    its lowest cell the center.
    """
    joined = list(labels)
    new_centers: list[int] = []
    labeled = np.flatnonzero(np.array(labels) >= 0)
    pieces = np.array(find_components(graph, np.array(labels)))
    islands = np.unique(pieces[np.array(labels) < 0])
    for piece in islands:
        cells = np.flatnonzero(pieces == piece)
        group = -1 if groups is None else groups[cells[0]]
        fitting = labeled if group == -1 else labeled[np.array(groups)[labeled] == group]
        label = max(labels) + 1 + len(new_centers)
        if len(fitting):
            steps = graph.positions[fitting] - graph.positions[cells, None]
            label = labels[fitting[int(np.argmin(dot(steps, steps).min(axis=0)))]]
        else:
            new_centers.append(int(cells[0]))
        for cell in cells:
            joined[cell] = label
    return joined, len(islands) - len(new_centers), new_centers
