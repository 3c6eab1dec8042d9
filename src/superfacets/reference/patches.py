"""Stage 5: groups of regions that move their faces in turn."""

from __future__ import annotations

from ..cells.face_graph import FaceGraph

SMALLEST, LARGEST, MANY = 64, 1024, 512
FEWEST_COLORS = 8


class Patches:
    """Groups of neighboring regions, each with a color that no group beside it has."""

    def __init__(self, graph: FaceGraph, labels: list[int]) -> None:
        self.of_region: dict[int, int] = {}
        self.colors: list[int] = []
        self._sizes: dict[int, int] = dict.fromkeys(range(max(labels) + 1), 0)
        self._touching: dict[int, dict[int, None]] = {region: {} for region in self._sizes}
        for face, region in enumerate(labels):
            begin, end = graph.offsets[face : face + 2]
            others = [labels[neighbor] for neighbor in graph.neighbors[begin:end]]
            if any(other != region for other in others):
                self._sizes[region] += 1
                self._touching[region].update(dict.fromkeys(others))
        self._color_sizes = [0] * FEWEST_COLORS
        self._least = min(max(sum(self._sizes.values()) // MANY, SMALLEST), LARGEST)
        for region in self._sizes:
            seed = None if region in self.of_region else region
            while seed is not None:
                seed = self._grow(seed)

    def _grow(self, seed: int) -> int | None:
        """Make a patch, breadth first; return the first region that it reached but left."""
        patch = len(self.colors)
        reached, size, forbidden = [seed], 0, set()
        n_taken = 0
        while n_taken < len(reached) and size < self._least:
            region = reached[n_taken]
            n_taken += 1
            self.of_region[region] = patch
            size += self._sizes[region]
            for other in self._touching[region]:
                known = self.of_region.get(other)
                if known is None and other not in reached:
                    reached.append(other)
                elif known not in (None, patch):
                    forbidden.add(self.colors[known])
        self.colors.append(self._choose_color(forbidden, size))
        return reached[n_taken] if n_taken < len(reached) else None

    def _choose_color(self, forbidden: set[int], size: int) -> int:
        """The allowed color with the fewest faces, a new one if there is none."""
        allowed = [c for c in range(len(self._color_sizes)) if c not in forbidden]
        if not allowed:
            allowed = [len(self._color_sizes)]
            self._color_sizes.append(0)
        color = min(allowed, key=lambda c: (self._color_sizes[c], c))
        self._color_sizes[color] += size
        return color

    def turn(self, region: int) -> tuple[int, int]:
        """When it is the turn of the patch of a region."""
        patch = self.of_region[region]
        return self.colors[patch], patch

    def may_touch(self, region: int, others: list[int]) -> bool:
        """Whether no other patch of these regions has the color of that of the first."""
        mine = self.turn(region)
        turns = [self.turn(other) for other in others]
        return all(turn == mine or turn[0] != mine[0] for turn in turns)
