"""Graphs whose arcs are as long as the straight line between their cells, plus a price.

And slow reference implementations of their arcs and paths.
"""

import heapq
import math

import numpy as np

from superfacets import _core

KEEP = _core.Islands.KEEP


class StraightGraph:
    """Cells, and undirected edges with prices, as whole multiples of `unit`."""

    def __init__(self, positions, edges, prices, unit=1e-3, measures=None):
        self.positions = np.asarray(positions, float)
        self.n_cells = len(self.positions)
        self.unit = unit
        self.measures = np.ones(self.n_cells) if measures is None else measures
        ends = np.asarray(edges)
        sources, targets = np.concatenate([ends, ends[:, ::-1]]).T
        order = np.argsort(sources, kind="stable")
        self.sources, self.neighbors = sources[order], targets[order].astype(np.int32)
        self.offsets = np.concatenate(
            [[0], np.cumsum(np.bincount(sources, minlength=self.n_cells))]
        )
        lengths = self.straight(self.sources, self.neighbors) + np.tile(prices, 2)[order]
        self.lengths = np.maximum(1, np.rint(lengths)).astype(np.float32)

    @classmethod
    def of_mesh(cls, graph, price=300.0, unit=1e-3, seed=0):
        """Return the graph of a mesh; half of the edges have random prices up to `price`."""
        sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
        edges = np.stack([sources, graph.neighbors], axis=1)[sources < graph.neighbors]
        rng = np.random.default_rng(seed)
        prices = price * rng.random(len(edges)) * (rng.random(len(edges)) < 0.5)
        return cls(graph.positions, edges, prices, unit, graph.measures)

    def straight(self, ends, others):
        """Return the distances between cells, in units."""
        x, y, z = (self.positions[ends] - self.positions[others]).T
        return np.sqrt(x * x + y * y + z * z) / self.unit

    def ordered(self, n_threads=1):
        placed = _core.PlacedCells(self.positions, self.measures, n_threads)
        return _core.OrderedGraph(
            placed, self.offsets, self.neighbors, self.lengths, n_threads, True, self.unit
        )

    def prices(self):
        """Return the excess of each arc's length over the straight line."""
        lengths = self.lengths.astype(float)
        return np.maximum(0.0, lengths - self.straight(self.sources, self.neighbors))

    def arcs(self):
        """Return the length of the shortest arc for each pair of cells with an arc."""
        return shortest(zip(self.sources.tolist(), self.neighbors.tolist(), strict=True),
                        self.lengths.tolist())  # fmt: skip


def shortest(pairs, lengths):
    """Return the least length of each pair."""
    found = {}
    for pair, length in zip(pairs, lengths, strict=True):
        found[pair] = min(length, found.get(pair, math.inf))
    return found


def far_arcs(graph):
    """Reference for `add_far_arcs`: lengths by pairs of cells, or the arcs unchanged."""
    mean = len(graph.neighbors) / graph.n_cells
    n_steps = 3 if mean <= 3.5 else 2 if mean <= 8 else 1
    if n_steps == 1:
        return graph.arcs()
    prices = np.rint(graph.prices()).astype(np.float32).astype(int).tolist()
    arcs = [[] for _ in range(graph.n_cells)]
    for source, to, price in zip(graph.sources, graph.neighbors.tolist(), prices, strict=True):
        if to != source:
            arcs[source].append((to, price))
    least = {}
    for start in range(graph.n_cells):
        walks = [(None, start, 0)]
        for step in range(n_steps):
            walks = [
                (here, to, sum_before + price)
                for before, here, sum_before in walks
                if step == 0 or len(arcs[here]) <= 24
                for to, price in arcs[here]
                if to != before
            ]
            for _, to, price in walks:
                if to != start:
                    least[start, to] = min(price, least.get((start, to), math.inf))
    ends, others = np.array(list(least)).T
    lengths = np.maximum(1, np.rint(graph.straight(ends, others) + list(least.values())))
    return dict(zip(least, lengths.astype(np.float32).tolist(), strict=True))


def paths(n_cells, arcs, starts):
    """Return length and label of the shortest path to each cell; among equals, the lowest label.

    `starts` are (length, label, cell); cells without a path get (inf, -1).
    """
    leaving = [[] for _ in range(n_cells)]
    for (source, to), length in arcs.items():
        leaving[source].append((to, int(length)))
    found = [(math.inf, -1)] * n_cells
    queue = list(starts)
    heapq.heapify(queue)
    while queue:
        length, label, cell = heapq.heappop(queue)
        if found[cell][1] >= 0:
            continue
        found[cell] = (length, label)
        for to, step in leaving[cell]:
            heapq.heappush(queue, (length + step, label, to))
    return found


def distances(ordered, n_threads=1):
    """Return the lengths of the shortest paths between all pairs of cells, by the kernel."""
    table = []
    for center in range(ordered.n_cells):
        of_one = _core.Clustering(ordered, np.array([center], np.int32), math.inf, n_threads, KEEP)
        lengths = of_one.lengths().astype(float)
        lengths[of_one.labels() > 0] = math.inf  # not connected to the start
        table.append(lengths)
    return np.array(table)


def all_paths(n_cells, arcs):
    """Return the same lengths by the reference."""
    return np.array([
        [length for length, _ in paths(n_cells, arcs, [(0, 0, cell)])] for cell in range(n_cells)
    ])  # fmt: skip
