"""Stage 5: move cells to change the sizes of regions, and sort the cells of each region."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from superfacets.base.types import Floats
from superfacets.graph.face_graph import FaceGraph
from superfacets.mesh.meshes import Mesh

from .smooth import MovingRegions

MAX_STUCK = 4
"""A pass stops after this number of failed attempts, multiplied by the number of regions."""


def move_cells(
    graph: FaceGraph,
    mesh: Mesh,
    steps: Floats,
    labels: list[int],
    sizes: Sequence[float],
    bounds: tuple[Sequence[float], Sequence[float]],
    *,
    crease_scale: float,
    may_split: bool = False,
) -> list[int]:
    """Move faces until the sizes of regions are within `bounds` if possible; return labels.

    A face moves only if its region stays connected without it. The first pass tests this only with
    the faces at the corners of the face, and the second pass with the whole region. If `may_split`
    is true, a third pass moves faces without a test. `sizes` are the sizes of faces, and `bounds`
    are the minimum and the maximum size of each region.
    """
    moving = _Moves(graph, mesh, steps, labels, crease_scale)
    moving.begin(sizes, *bounds)
    for test in (0, 1, 2) if may_split else (0, 1):
        moving.test, moving.n_stuck = test, 0
        while moving.sweep():
            pass
    return moving.labels


class _Moves(MovingRegions):
    """State of `move_cells`: labels of faces and sizes of regions.

    `blocked` contains pairs of regions (from, to) between which no face could be moved.
    """

    test, n_stuck = 0, 0

    def __init__(
        self, graph: FaceGraph, mesh: Mesh, steps: Floats, labels: list[int], crease_scale: float
    ) -> None:
        super().__init__(graph, mesh, steps, labels, set(), math.inf, crease_scale)

    def begin(self, sizes: Sequence[float], lows: Sequence[float], highs: Sequence[float]) -> None:
        self.sizes, self.lows, self.highs = sizes, lows, highs
        self.totals = [0.0] * len(lows)
        self.blocked: set[tuple[int, int]] = set()
        for face, label in enumerate(self.labels):
            self.totals[label] += sizes[face]
        total = sum(self.totals)
        self.rounding = 1e-9 * total / len(lows)
        self.step = total / len(sizes) - self.rounding

    def room(self, region: int) -> float:
        return self.highs[region] - self.totals[region]

    def spare(self, region: int) -> float:
        return self.totals[region] - self.lows[region]

    def may_go_on(self) -> bool:
        return self.n_stuck < MAX_STUCK * len(self.totals)

    def sweep(self) -> bool:
        """Improve each region once; return whether another sweep may improve the regions more."""
        has_moved = False
        for region in range(len(self.totals)):
            for is_full in (True, False):
                self.blocked = set()
                while self.may_go_on() and self.improve(region, is_full):
                    has_moved = True
        return has_moved and self.may_go_on()

    def improve(self, region: int, is_full: bool) -> bool:
        """Move faces along a path of regions, and return whether any face has moved.

        The path leads out of `region` if `is_full` is true, and into it otherwise.
        """
        margin, next_of = (self.room, self.targets) if is_full else (self.spare, self.sources)
        while -margin(region) > self.rounding and self.may_go_on():
            path = _search(region, lambda other: margin(other) >= self.step, next_of)
            if not path:
                break
            path_of_faces = path if is_full else path[::-1]
            if self.push(path_of_faces, min(-margin(region), margin(path[-1]))):
                return True
        return False

    def targets(self, region: int) -> list[int]:
        """Return the regions to which faces of `region` may move, except pairs in `blocked`."""
        return [to for to in self.exits(region) if (region, to) not in self.blocked]

    def sources(self, region: int) -> list[int]:
        """Return the regions whose faces may move to `region`, except pairs in `blocked`."""
        around = {b for face in self.faces_of(region) for b in self.neighboring_labels(face)}
        return [other for other in sorted(around) if region in self.targets(other)]

    def faces_of(self, region: int) -> list[int]:
        return [face for face, label in enumerate(self.labels) if label == region]

    def exits(self, region: int) -> list[int]:
        """Return the regions to which at least one face of `region` can move."""
        leaving = [face for face in self.faces_of(region) if self.neighboring_labels(face)]
        leaving = [face for face in leaving if self.test == 2 or self.can_leave(face)]
        return sorted({b for face in leaving for b in self.neighboring_labels(face)})

    def can_leave(self, face: int) -> bool:
        if len(self.faces_of(self.labels[face])) < 2:
            return False
        return self.test == 2 or self.may_leave(face) or (self.test == 1 and self.is_joined(face))

    def is_joined(self, face: int) -> bool:
        """Return whether the neighbors of a face in its region stay connected without the face.

        Paths between these neighbors may use all other faces of the region. Returns False if there
        are no such neighbors.
        """
        region = set(self.faces_of(self.labels[face])) - {face}
        wanted = region & set(self.neighbors(face))
        reached = set(list(wanted)[:1])
        front = list(reached)
        while front:
            more = {near for at in front for near in self.neighbors(at)} & region - reached
            reached |= more
            front = list(more)
        return bool(wanted) and wanted <= reached

    def push(self, path: list[int], amount: float) -> bool:
        room = max(self.room(path[-1]), 0.0)
        for i, (region, to) in enumerate(pairwise(path)):
            amount = self.move_between(region, to, amount, room if to == path[-1] else math.inf)
            if amount == 0.0:
                self.n_stuck += 1
                self.blocked.add((region, to))
                return i > 0
        self.blocked.clear()
        return True

    def move_between(self, region: int, to: int, amount: float, most: float) -> float:
        moved = 0.0
        while moved < amount - self.rounding:
            face = self.best_face(region, to, most - moved)
            if face is None:
                break
            size = self.sizes[face]
            self.labels[face] = to
            self.totals[region] -= size
            self.totals[to] += size
            moved += size
        return moved

    def best_face(self, region: int, to: int, most: float) -> int | None:
        touching = [face for face in self.faces_of(region) if to in self.neighboring_labels(face)]
        for face in sorted(touching, key=lambda face: (-self.gain(face, to), face)):
            fits = self.sizes[face] <= min(most, self.spare(region)) + self.rounding
            if fits and self.can_leave(face):
                return face
        return None


def _search(
    first: int, is_wanted: Callable[[int], bool], next_of: Callable[[int], Iterable[int]]
) -> list[int]:
    """Return a shortest path from `first` to a region for which `is_wanted` is true, or []."""
    parents = {first: first}
    queue = [first]
    for at in queue:
        for region in next_of(at):
            if region in parents:
                continue
            parents[region] = at
            queue.append(region)
            if is_wanted(region):
                path = [region]
                while path[-1] != first:
                    path.append(parents[path[-1]])
                return path[::-1]
    return []


def walk_regions(neighbors: Sequence[Sequence[int]], labels: Sequence[int]) -> list[int]:
    """Return the cells of all regions, sorted by label, then in the order of a depth-first search.

    The search in a region starts at the cell with the fewest neighbors in the region. The next cell
    is the unvisited neighbor with the fewest unvisited neighbors. If no neighbor is unvisited, the
    search backtracks. Cells with a negative label are left out.
    """
    walked: list[int] = []
    left = {cell for cell, label in enumerate(labels) if label >= 0}

    def waiting(cell: int) -> list[int]:
        return [near for near in neighbors[cell] if near in left and labels[near] == labels[cell]]

    starts = sorted(left, key=lambda cell: (labels[cell], len(waiting(cell)), cell))
    for start in starts:
        stack = [start] if start in left else []
        left.discard(start)
        walked += stack
        while stack:
            onward = waiting(stack[-1])
            if not onward:
                stack.pop()
                continue
            stack.append(min(onward, key=lambda cell: (len(waiting(cell)), cell)))
            left.discard(stack[-1])
            walked.append(stack[-1])
    return walked
