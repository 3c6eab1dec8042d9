"""Stage 4: centers that leave where they are needed least for where most is to be won."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..cells.cell_graph import CellGraph
from .graphs import expand

Path = tuple[int, int]
"""Length and label: the lower is the better."""


def second_nearest(graph: CellGraph, centers: Sequence[int]) -> list[list[Path]]:
    """The paths to each cell, at most two, from the nearest and the second-nearest center."""
    found: list[list[Path]] = [[] for _ in range(graph.n_cells)]
    for label, center in enumerate(centers):
        for cell, length in expand(graph, center, math.inf).items():
            found[cell].append((length, label))
    return [sorted(paths)[:2] for paths in found]


def relocate_centers(
    graph: CellGraph, order: Sequence[int], centers: Sequence[int], n_moves: int
) -> list[int]:
    """The centers, of which at most `n_moves` have moved; cells are summed in this order."""
    paths = second_nearest(graph, centers)
    costs = [0.0] * len(centers)
    distortions = [0.0] * len(centers)
    regions: list[list[int]] = [[] for _ in centers]
    for cell in map(int, order):
        if not paths[cell]:
            continue
        first, label = paths[cell][0]
        measure = float(graph.measures[cell])
        regions[label].append(cell)
        distortions[label] += measure * float(first) * float(first)
        if len(paths[cell]) == 1:
            costs[label] = math.inf
        else:
            second = paths[cell][1][0]
            costs[label] += measure * float(second - first) * float(second + first)
    labels = range(len(centers))
    leaving = sorted(labels, key=lambda label: (costs[label], label))[:n_moves]
    receiving = sorted(labels, key=lambda label: (-distortions[label], label))
    moved = list(centers)
    have_left: set[int] = set()
    must_stay: set[int] = set()
    for label in leaving:
        if label in must_stay:
            continue
        while receiving and (receiving[0] == label or receiving[0] in have_left):
            receiving.pop(0)
        if not receiving or not costs[label] < 0.5 * distortions[receiving[0]]:
            break
        target = receiving.pop(0)
        moved[label] = min(regions[target], key=lambda cell: (-paths[cell][0][0], cell))
        have_left.add(label)
        must_stay |= {target} | {paths[cell][1][1] for cell in regions[label]}
    return moved
