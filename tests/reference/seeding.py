"""Stage 3: compute shortest paths, connected components, centers of regions, and seeds."""

from __future__ import annotations

import heapq
import math

import numpy as np

from superfacets.base.types import Array, Floats
from superfacets.graph.cell_graph import CellGraph

from .arithmetic import dot, norm


def find_components(graph: CellGraph, labels: Array) -> list[int]:
    """Return the connected component of each cell, using only arcs between equal labels.

    The direction of arcs is ignored. Components are numbered in the order of their lowest cells.
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
    """Return a dict from each cell reached from `center` to the length of its path.

    Cells farther from `center` than the Euclidean distance `reach` are reached but not expanded.
    """
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
    """Return the cell that is nearest to the centroid of all cells."""
    return update_centers(graph, np.zeros(graph.n_cells, dtype=np.int32))[0]


def arcs_of(graph: CellGraph, cell: int) -> list[tuple[int, int]]:
    """Return (neighbor, integer length) for each arc of a cell."""
    arcs = slice(graph.offsets[cell], graph.offsets[cell + 1])
    return [
        (int(n), int(length))
        for n, length in zip(graph.neighbors[arcs], graph.lengths[arcs], strict=True)
    ]


def update_centers(graph: CellGraph, labels: Array) -> list[int]:
    """Return the cell nearest to the centroid of each region, ignoring cells labeled -1."""
    n_regions = int(labels.max()) + 1
    labels = np.where(labels < 0, n_regions, labels)
    means = _fixed_point_means(graph, labels)
    areas = np.bincount(labels, graph.measures)  # bincount adds in the order of the cells
    weights = np.where(areas[labels] > 0, graph.measures, 1.0)
    totals = np.bincount(labels, weights)
    for axis, coordinates in enumerate(graph.positions.T):
        in_order = np.bincount(labels, weights * coordinates) / totals
        means[:, axis] = np.where(np.isnan(means[:, axis]), in_order, means[:, axis])
    step = graph.positions - means[labels]
    squared = dot(step, step)
    cells = np.arange(graph.n_cells)
    return [int(min(cells[labels == r], key=lambda cell: squared[cell])) for r in range(n_regions)]


def _fixed_point_means(graph: CellGraph, labels: Array) -> Floats:
    """Return the centroids of regions from fixed-point sums, or NaN for very small measures."""
    # The area (or volume) of a cell, and its product with the offset of the cell from the minimum
    # corner, are scaled and rounded to integers. Sums of these integers are exact in any order and
    # below 2**61.
    # The rounding errors, multiplied by 2**31, are rounded and summed in the same way.
    low = graph.positions.min(axis=0)
    extent = float((graph.positions.max(axis=0) - low).max())
    total = float(graph.measures.sum())
    moments = graph.measures[:, None] * (graph.positions - low)
    scales = [_fixed_point_scale(total * extent)] * 3 + [_fixed_point_scale(total)]
    sums = np.zeros((int(labels.max()) + 1, 4))
    for column, scale in enumerate(scales):
        numbers = scale * (moments[:, column] if column < 3 else graph.measures)
        upper = [[0, 0] for _ in sums]
        for label, number in zip(labels.tolist(), numbers.tolist(), strict=True):
            upper[label][0] += round(number)
            upper[label][1] += round((number - round(number)) * 2**31)
        sums[:, column] = [float(first) + float(second) / 2**31 for first, second in upper]
        if column == 3:
            sums[[first < 2**20 for first, _ in upper]] = np.nan
    with np.errstate(invalid="ignore"):
        means: Floats = low + sums[:, :3] * (scales[3] / scales[0] / sums[:, 3:])
    return means


def _fixed_point_scale(total: float) -> float:
    return 2.0 ** (61 - math.frexp(total)[1]) if total > 0 else 1.0


def _seeded_components(graph: CellGraph, n_seeds: int) -> tuple[Array, list[int]]:
    """Return the component of each cell, and the components that get seeds, largest first.

    A component gets seeds if its measure is at least half of the mean measure of `n_seeds` regions.
    Smaller components also get seeds until the components with seeds have `n_seeds` cells.
    """
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
    """Choose seeds by farthest-point sampling with Euclidean distances.

    The first seed is the cell nearest to the centroid. If `islands` is "nearest", the first seeds
    are the central cells of all components that get seeds, and other components get no seed.
    """
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
    """Choose seeds by farthest-point sampling with path lengths in the graph.

    The first seeds are the central cells of all components that get seeds.
    """
    components, seeded = _seeded_components(graph, n_seeds)
    central = update_centers(graph, components)
    seeds = [central[component] for component in seeded]
    return _with_farthest(graph, seeds, n_seeds, components, seeded)


def curve_seeds(graph: CellGraph, order: list[int], n_seeds: int) -> list[int]:
    """Place 60 % of the seeds in the middles of equal parts of a curve through all cells.

    `order` contains all cells in the order of the curve. The remaining seeds are chosen one after
    another: each is the cell with the longest path from its nearest seed.
    """
    components, seeded = _seeded_components(graph, n_seeds)
    n_along = max(math.ceil(0.6 * n_seeds), len(seeded))
    weights = [_curve_weight(graph, cell) for cell in range(graph.n_cells)]
    cells = {which: [cell for cell in order if components[cell] == which] for which in seeded}
    totals = [sum(weights[cell] for cell in cells[which]) for which in seeded]
    seeds: list[int] = []
    for i in reversed(range(len(seeded))):  # smallest component first
        own = cells[seeded[i]]
        n_others = sum(len(cells[which]) for which in seeded[:i])
        exact = n_along * (totals[i] / sum(totals[: i + 1]))
        n_own = min(max(math.floor(exact + 0.5), 1, n_along - n_others), len(own), n_along - i)
        n_along -= n_own
        passed, n_placed = 0.0, 0
        for index, cell in enumerate(own):
            passed += weights[cell]
            is_middle = passed * n_own > (n_placed + 0.5) * totals[i]
            if n_placed < n_own and (is_middle or len(own) - index <= n_own - n_placed):
                seeds.append(cell)
                n_placed += 1
    seeds.sort(key=list(map(int, order)).index)
    return _with_farthest(graph, seeds, n_seeds, components, seeded)


def _curve_weight(graph: CellGraph, cell: int) -> float:
    """Return area * sqrt(sum of arc lengths / sum of distances to neighbors) of a cell."""
    lengths = steps = 0.0
    for neighbor, length in arcs_of(graph, cell):
        if neighbor == cell:
            continue
        lengths += length
        steps += norm(graph.positions[neighbor] - graph.positions[cell])
    if not steps > 0:
        return 1e-300
    return max(float(graph.measures[cell]) * math.sqrt(lengths / steps), 1e-300)


def _with_farthest(
    graph: CellGraph, seeds: list[int], n_seeds: int, components: Array, seeded: list[int]
) -> list[int]:
    """Add seeds until there are `n_seeds`.

    Each new seed is the cell with the longest path from its nearest seed.
    """
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
    """Visit cells in the order of path length from a start cell of each component; return seeds.

    A visited cell becomes a seed if no earlier seed has reached it. Each seed expands to the
    Euclidean distance 2 r. If `islands` is "nearest", small components get no seeds.
    """
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
    """Return, for each cube of edge length 2 r, the cell nearest to the centroid of its cells.

    Cubes are sorted by their lowest cell.
    """
    label_of: dict[tuple[float, ...], int] = {}
    cubes = np.floor((graph.positions - graph.bounds[0]) / (2.0 * radius))
    labels = [label_of.setdefault(tuple(cube), len(label_of)) for cube in cubes.tolist()]
    return update_centers(graph, np.array(labels))
