"""Stage 5: regions that merge with their neighbors, and bridges between components."""

from __future__ import annotations

import math

import numpy as np

from .._types import Floats
from .vectors import norm


def find_bridges(positions: Floats, ranks: list[int]) -> list[tuple[int, int]]:
    """For each rank above 0, its cell and the cell of a lower rank that are nearest."""
    found = []
    for rank in range(1, max(ranks) + 1):
        pairs = [
            (float(np.sum((positions[b] - positions[a]) ** 2)), a, b)
            for a in range(len(ranks))
            for b in range(len(ranks))
            if ranks[a] == rank and ranks[b] < rank
        ]
        _, a, b = min(pairs)
        found.append((a, b))
    return found


def merge_tree(
    areas: list[float],
    positions: list[Floats],
    features: list[Floats] | None,
    borders: dict[tuple[int, int], tuple[float, float]],
    *,
    crease_weight: float,
    dimension: int,
) -> tuple[list[tuple[int, int]], list[float]]:
    """Pairs of nodes that merge, and their costs.

    ``borders`` are (length, cost) of each pair of regions, the lower first.
    """
    groups = _Groups(areas, positions, features, borders, crease_weight, dimension)
    children, costs = [], []
    while groups.borders:
        key, pair = min((groups.key_of(pair), pair) for pair in groups.borders)
        children.append(pair)
        costs.append(key[0])
        groups.merge(*pair)
    return children, costs


class _Groups:
    """Nodes that have not merged, and what pairs of them share."""

    def __init__(
        self,
        areas: list[float],
        positions: list[Floats],
        features: list[Floats] | None,
        borders: dict[tuple[int, int], tuple[float, float]],
        crease_weight: float,
        dimension: int,
    ) -> None:
        self.areas = list(areas)
        self.positions = list(positions)
        self.features = None if features is None else list(features)
        self.borders = dict(borders)
        self.crease_weight = crease_weight
        self.dimension = dimension

    def key_of(self, pair: tuple[int, int]) -> tuple[float, float]:
        """The cost of a merge, and what decides between equal ones."""
        if self.features is None:
            return self.cost_of(pair), 0.0
        a, b = pair
        squared = 0.0
        for step in self.features[a] - self.features[b]:
            squared += float(step) * float(step)
        return self.ward_factor(a, b) * squared, self.cost_of(pair)

    def cost_of(self, pair: tuple[int, int]) -> float:
        """The cost by geometry."""
        a, b = pair
        factor = self.ward_factor(a, b)
        if not factor > 0:
            return 0.0
        length, cost = self.borders[pair]
        radius = self.radius_of(self.areas[a] + self.areas[b])
        openness = cost / length if length > 0 else 0.0
        if not length > 0:  # a gap
            length = radius if self.dimension == 2 else radius * radius
        distance = float(norm(self.positions[a] - self.positions[b]))
        return factor * (distance + self.crease_weight * radius * (1.0 - openness)) / length

    def ward_factor(self, a: int, b: int) -> float:
        """The product of the areas over their sum."""
        area = self.areas[a] + self.areas[b]
        return self.areas[a] / area * self.areas[b] if area > 0 else 0.0

    def radius_of(self, area: float) -> float:
        """Of a disk or a ball."""
        if self.dimension == 2:
            return math.sqrt(area / math.pi)
        return math.cbrt(0.75 * area / math.pi)

    def merge(self, a: int, b: int) -> None:
        """Make a new node of two."""
        area = self.areas[a] + self.areas[b]
        share = self.areas[b] / area if area > 0 else 0.5
        node = len(self.areas)
        self.areas.append(area)
        for values in (self.positions, self.features):
            if values is not None:
                values.append(values[a] + share * (values[b] - values[a]))
        merged: dict[tuple[int, int], tuple[float, float]] = {}
        for pair, border in self.borders.items():
            if pair == (a, b):
                continue
            low, high = sorted(node if end in (a, b) else end for end in pair)
            before = merged.get((low, high), (0.0, 0.0))
            merged[low, high] = (before[0] + border[0], before[1] + border[1])
        self.borders = merged
