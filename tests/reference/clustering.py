"""Stage 4: classify cells, run the clustering loop, relocate centers, and find coarse cells."""

from __future__ import annotations

import heapq
import math
from collections.abc import Container, Iterable, Sequence

import numpy as np

from superfacets.graph.cell_graph import CellGraph

from .arithmetic import dot
from .seeding import arcs_of, expand, find_components, update_centers

Path = tuple[int, int]
"""Length of a path, and label of its center. Paths are compared by length, then by label."""


def classify_exact(
    graph: CellGraph, centers: list[int], *, islands: str = "keep"
) -> tuple[list[int], list[int]]:
    """Give each cell the label of the center with the shortest path; return labels and centers.

    In a connected component without a center, the lowest cell becomes a new center. If `islands` is
    "nearest", such a component gets the label -1 instead.
    """
    all_centers = list(centers)
    while True:
        starts = ((0, label, cell) for label, cell in enumerate(all_centers))
        best = _shortest_paths(graph, starts)
        if len(best) == graph.n_cells or islands == "nearest":
            return [best.get(cell, (0, -1))[1] for cell in range(graph.n_cells)], all_centers
        all_centers.append(min(set(range(graph.n_cells)) - best.keys()))


def _shortest_paths(
    graph: CellGraph, starts: Iterable[tuple[int, int, int]], allowed: Container[int] | None = None
) -> dict[int, Path]:
    """Return the shortest path from `starts` to each cell that can be reached.

    A start is (initial length, label, cell). Paths are within `allowed`, or within all cells if it
    is None.
    """
    best: dict[int, Path] = {}
    queue = sorted(starts)
    while queue:
        length, label, cell = heapq.heappop(queue)
        if cell in best or (allowed is not None and cell not in allowed):
            continue
        best[cell] = (length, label)
        for neighbor, step in arcs_of(graph, cell):
            heapq.heappush(queue, (length + step, label, neighbor))
    return best


def classify_halted(
    graph: CellGraph, centers: list[int], reach: float, *, islands: str = "keep"
) -> tuple[list[int], list[int]]:
    """Label cells by a limited expansion from each center; return labels and centers.

    Cells farther from the center than the Euclidean distance `reach` are labeled but not expanded.
    If `islands` is "keep", the lowest unreached cell becomes a new center, until all cells are
    reached. If `islands` is "nearest", unreached cells get the label -1.
    """
    best = [(math.inf, -1)] * graph.n_cells  # shortest path so far to each cell
    all_centers: list[int] = []
    waiting = list(centers)
    while waiting:
        label, center = len(all_centers), waiting.pop(0)
        all_centers.append(center)
        for cell, length in expand(graph, center, reach).items():
            best[cell] = min(best[cell], (length, label))
        if not waiting and (math.inf, -1) in best and islands == "keep":
            waiting.append(best.index((math.inf, -1)))  # lowest cell without a path
    return [label for _, label in best], all_centers


def join_islands(
    graph: CellGraph, labels: list[int], groups: list[int] | None = None
) -> tuple[list[int], int, list[int]]:
    """Join islands to the nearest regions. An island is a connected component of cells labeled -1.

    An island gets the label of the labeled cell that is nearest to any of its cells. If several
    labeled cells are equally near, the lowest index is used. `groups` are groups of cells or None.
    With groups, the labeled cell must be in the group of the island, unless that group is -1. If
    there is no such labeled cell, the island becomes a new region with its lowest cell as center.
    Returns all labels, the number of joined islands, and the new centers.
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


def iterate(
    graph: CellGraph,
    seeds: list[int],
    radius: float,
    *,
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    islands: str = "keep",
) -> tuple[list[tuple[list[int], list[int]]], str]:
    """Run the clustering loop; return labels and centers of each iteration, and the stop reason."""
    history: list[tuple[list[int], list[int]]] = []
    centers = seeds
    while True:
        if radius_factor is None:
            labels, centers = classify_exact(graph, centers, islands=islands)
        else:
            reach = radius_factor * radius
            labels, centers = classify_halted(graph, centers, reach, islands=islands)
        history.append((labels, centers))
        moved_to = update_centers(graph, np.array(labels))
        moves = graph.positions[moved_to] - graph.positions[centers]
        if moved_to == centers or math.sqrt(np.mean(dot(moves, moves))) <= tol * radius:
            return history, "converged"
        if sorted(moved_to) in [sorted(earlier) for _, earlier in history]:
            return history, "settled"
        if len(history) == max_num_iter:
            return history, "max_num_iter"
        centers = moved_to


def second_nearest(graph: CellGraph, centers: Sequence[int]) -> list[list[Path]]:
    """Return the paths to each cell from its nearest and second-nearest center, if they exist."""
    found: list[list[Path]] = [[] for _ in range(graph.n_cells)]
    for label, center in enumerate(centers):
        for cell, length in expand(graph, center, math.inf).items():
            found[cell].append((length, label))
    return [sorted(paths)[:2] for paths in found]


def relocate_centers(
    graph: CellGraph, order: Sequence[int], centers: Sequence[int], n_moves: int,
    has_crease_limit: bool = False,
) -> list[int]:  # fmt: skip
    """Move up to `n_moves` centers of regions that cost least to remove; return all centers.

    Centers move into the regions with the largest distortions. The distortion of a region is the
    sum of measure times squared path length, where longer paths count as four times the mean
    length if there is no crease limit. The cost of removing a region is the increase of the total
    distortion. It must be less than half of the distortion of the region that gets the center, or
    less than a quarter if `has_crease_limit` is true. Sums are computed in the order of `order`.
    """
    paths = second_nearest(graph, centers)
    mean = _mean_length(graph, order, paths, len(centers))
    most = math.inf if has_crease_limit else 4.0 * mean
    gain = 0.25 if has_crease_limit else 0.5
    costs = [0.0] * len(centers)
    distortions = [0.0] * len(centers)
    regions: list[list[int]] = [[] for _ in centers]
    for cell in map(int, order):
        if not paths[cell]:
            continue
        first, label = paths[cell][0]
        measure = float(graph.measures[cell])
        regions[label].append(cell)
        nearer = min(most, float(first))
        distortions[label] += measure * nearer * nearer
        if len(paths[cell]) == 1:
            costs[label] = math.inf
        else:
            farther = min(most, float(paths[cell][1][0]))
            costs[label] += measure * (farther - nearer) * (farther + nearer)
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
        if not receiving or not costs[label] < gain * distortions[receiving[0]]:
            break
        target = receiving.pop(0)
        moved[label] = min(regions[target], key=lambda cell: (-paths[cell][0][0], cell))
        have_left.add(label)
        must_stay |= {target} | {paths[cell][1][1] for cell in regions[label]}
    return moved


def _mean_length(
    graph: CellGraph, order: Sequence[int], paths: list[list[tuple[int, int]]], n_centers: int
) -> float:
    """Return the mean path length, weighted by measure; cells without a path count as 0."""
    sums = [0.0] * n_centers
    for cell in map(int, order):
        if paths[cell]:
            length, label = paths[cell][0]
            sums[label] += float(graph.measures[cell]) * float(length)
    placed = [float(graph.measures[cell]) for cell in map(int, order)]
    return sum(sums) / sum(placed) if sum(placed) > 0.0 else 0.0


RANGE = 4096
"""`coarse_cells` divides the order of cells into ranges of this number of cells. Each coarse cell
is within one range."""


def coarse_cells(
    graph: CellGraph, order: Sequence[int], spacing: int
) -> tuple[list[int], list[int], list[int]]:
    """Group cells into coarse cells; return the centers of all coarse cells, and two lists.

    The lists contain the coarse cell of each cell, and the path length from its center. In each
    range of `order`, centers are `spacing` cells apart, and paths stay within the range. If cells
    of the range have no path from a center, the first of them becomes an additional center. This is
    repeated until all cells have a path.
    """
    centers: list[int] = []
    coarse_of = [-1] * graph.n_cells
    lengths = [0] * graph.n_cells
    for begin in range(0, len(order), RANGE):
        members = [int(cell) for cell in order[begin : begin + RANGE]]
        first = (min(spacing, len(members)) - 1) // 2
        starts = [(0, len(centers) + i, cell) for i, cell in enumerate(members[first::spacing])]
        best = _shortest_paths(graph, starts, set(members))
        centers += members[first::spacing]
        for cell in members:
            if cell not in best:
                left = set(members) - best.keys()
                best |= _shortest_paths(graph, [(0, len(centers), cell)], left)
                centers.append(cell)
        for cell, (length, coarse) in best.items():
            coarse_of[cell], lengths[cell] = coarse, length
    return centers, coarse_of, lengths


def coarse_arcs(
    graph: CellGraph, coarse_of: list[int], lengths: list[int]
) -> dict[tuple[int, int], float]:
    """Return a dict from each pair of adjacent coarse cells to the length of the arc between them.

    It is the length of the shortest path between the two centers that crosses their border once.
    """
    arcs: dict[tuple[int, int], float] = {}
    for cell in range(graph.n_cells):
        for neighbor, step in arcs_of(graph, cell):
            a, b = coarse_of[cell], coarse_of[neighbor]
            if a == b:
                continue
            paths = np.float32(lengths[cell]) + np.float32(lengths[neighbor])
            length = float(paths + np.float32(step))
            arcs[a, b] = min(arcs.get((a, b), length), length)
    return arcs
