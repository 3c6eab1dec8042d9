"""Stage 3: the first centers."""

from __future__ import annotations

import math

import numpy as np

from .._types import Array
from ..cells.cell_graph import CellGraph
from .graphs import expand, find_components, first_cell
from .update import update_centers
from .vectors import dot


def _seeded_components(graph: CellGraph, n_seeds: int) -> tuple[Array, list[int]]:
    """Component of each cell, and the components that are no islands, the largest first."""
    components = np.array(find_components(graph, np.zeros(graph.n_cells)))
    measures = np.bincount(components, graph.measures)  # bincount adds in the order of the cells
    enough = 0.5 * float(np.cumsum(graph.measures)[-1]) / n_seeds
    first = components[first_cell(graph)]
    order = sorted(range(len(measures)), key=lambda c: (-measures[c], c != first, c))
    seeded: list[int] = []
    for component in order[:n_seeds]:
        n_cells = int(np.count_nonzero(np.isin(components, seeded)))
        if measures[component] >= enough or n_cells < n_seeds:
            seeded.append(component)
    return components, seeded


def farthest_seeds(graph: CellGraph, n_seeds: int, *, islands: str = "keep") -> list[int]:
    """Iterative farthest points, by a search over all cells for every seed."""
    seeds = [first_cell(graph)]
    squared_distance = np.full(graph.n_cells, np.inf)
    if islands == "nearest":
        components, seeded = _seeded_components(graph, n_seeds)
        central = update_centers(graph, components)
        seeds = [central[component] for component in seeded]
        squared_distance[~np.isin(components, seeded)] = -1.0
    for n_placed in range(n_seeds):
        if n_placed == len(seeds):
            seeds.append(int(np.argmax(squared_distance)))
        step = graph.positions - graph.positions[seeds[n_placed]]
        squared_distance = np.minimum(squared_distance, dot(step, step))
        squared_distance[seeds[n_placed]] = -1.0
    return seeds


def geodesic_seeds(graph: CellGraph, n_seeds: int) -> list[int]:
    """Iterative longest paths, by an expansion over everything from every seed."""
    components, seeded = _seeded_components(graph, n_seeds)
    central = update_centers(graph, components)
    seeds = [central[component] for component in seeded]
    cells = np.flatnonzero(np.isin(components, seeded)).tolist()
    lengths = dict.fromkeys(cells, math.inf)
    for n_placed in range(n_seeds):
        if n_placed == len(seeds):
            seeds.append(max(cells, key=lambda cell: (lengths[cell], -cell)))
        for cell, length in expand(graph, seeds[n_placed], math.inf).items():
            lengths[cell] = min(length, lengths[cell])
    return seeds


def flood_seeds(
    graph: CellGraph, radius: float, n_seeds: int = 1, *, islands: str = "keep"
) -> list[int]:
    """Cells in the order of their path length, that no region which expanded to 2 r had reached."""
    seeds: list[int] = []
    reached: set[int] = set()
    components, seeded = _seeded_components(graph, n_seeds)
    first = first_cell(graph)
    others = [components.tolist().index(number) for number in range(max(components) + 1)]
    for start in [first, *(cell for cell in others if components[cell] != components[first])]:
        if islands == "nearest" and components[start] not in seeded:
            continue
        lengths: dict[int, float] = dict.fromkeys(
            np.flatnonzero(components == components[start]).tolist(), math.inf
        )
        lengths.update(expand(graph, start, math.inf))
        for cell in sorted(lengths, key=lambda cell: (lengths[cell], cell)):
            if cell not in reached:
                seeds.append(cell)
                reached.update(expand(graph, cell, 2.0 * radius))
    return seeds


def grid_seeds(graph: CellGraph, radius: float) -> list[int]:
    """Centers of the cells in each cube of edge 2 r, numbered by their lowest cell."""
    label_of: dict[tuple[float, ...], int] = {}
    cubes = np.floor((graph.positions - graph.bounds[0]) / (2.0 * radius))
    labels = [label_of.setdefault(tuple(cube), len(label_of)) for cube in cubes.tolist()]
    return update_centers(graph, np.array(labels))
