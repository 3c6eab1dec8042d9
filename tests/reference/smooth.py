"""Stage 5: smooth the borders of regions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from superfacets.base.types import Floats
from superfacets.graph.face_graph import FaceGraph
from superfacets.mesh.meshes import Mesh

from .arithmetic import exponential, norm


def smooth_borders(
    graph: FaceGraph,
    mesh: Mesh,
    steps: Floats,
    labels: list[int],
    fixed: set[int],
    *,
    max_distance: float,
    crease_scale: float,
    max_chain: int,
    max_sweeps: int,
    stiffness: float = 0.0,
    roundness: float = 0.0,
    sizes: Sequence[float] = (),
    goals: Sequence[float] = (),
) -> list[int]:
    """Smooth borders by moving chains of faces to neighboring regions; return the labels.

    ``steps`` are the lengths of the arcs in the unit of the vertices. Regions are processed in
    groups (`Patches`), as in the parallel C++ code. A patch uses only area changes made by itself
    and by patches of earlier colors. ``goals`` are target sizes of regions. The default is the
    initial areas. If ``goals`` are given, ``sizes`` are used instead of the areas of faces.
    """
    regions = MovingRegions(graph, mesh, steps, labels, fixed, max_distance, crease_scale)
    regions.stiffness = _Stiffness(graph, labels, stiffness, roundness)
    if goals:
        regions.stiffness.set_goals(labels, sizes, goals, stiffness)
    waiting = set(range(graph.n_cells))
    for _ in range(max_sweeps):
        at_border = [face for face in sorted(waiting) if regions.neighboring_labels(face)]
        listed = sorted((regions.sort_key(face), face) for face in at_border)
        waiting = set()
        for key, face in listed:
            regions.stiffness.begin(key)
            if regions.sort_key(face) != key:  # the face has moved to another patch
                continue
            waiting.discard(face)
            for label in regions.neighboring_labels(face):
                moved = regions.move_chain(face, label, max_chain)
                waiting.update(moved, *(regions.neighbors(f) for f in moved))
                if moved:
                    break
        regions.stiffness.begin(None)
    return regions.labels


class _Stiffness:
    """Cost of area changes of regions, and of distances of faces from initial region centroids."""

    def __init__(
        self, graph: FaceGraph, labels: list[int], stiffness: float, roundness: float
    ) -> None:
        self.of_faces: list[float] = graph.measures.tolist()
        self.sizes: list[float] = self.of_faces
        self.positions = graph.positions
        areas, moments = [0.0] * (max(labels) + 1), np.zeros((max(labels) + 1, 3))
        for faces in _runs(labels):
            label = labels[faces[0]]
            areas[label] += sum(self.of_faces[face] for face in faces)
            moment = np.zeros(3)
            for face in faces:
                moment += self.of_faces[face] * self.positions[face]
            moments[label] += moment
        mean = sum(areas) / len(areas)
        firsts = [max(area, 1e-6 * mean) for area in areas]
        is_on = stiffness > 0.0 and mean > 0.0
        self.weights = [stiffness * mean / area / area if is_on else 0.0 for area in firsts]
        self.roundness = roundness if is_on else 0.0
        inverses = [[1.0 / area] if is_on else [0.0] for area in firsts]
        self.centroids = np.array(inverses) * moments
        self.known, self.own = [0.0] * len(areas), [0.0] * len(areas)
        self._key: tuple[int, int] | None = None
        self._others: list[list[float]] = []  # area changes by patches of this color so far

    def set_goals(
        self, labels: list[int], sizes: Sequence[float], goals: Sequence[float], stiffness: float
    ) -> None:
        least = 1e-6 * sum(self.of_faces) / len(goals)
        self.weights = [stiffness / max(goal, least) for goal in goals]
        self.sizes, self.known = list(sizes), [0.0] * len(goals)
        for label, size in zip(labels, sizes, strict=True):
            self.known[label] += size
        self.known = [size - goal for size, goal in zip(self.known, goals, strict=True)]

    def begin(self, key: tuple[int, int] | None) -> None:
        """Begin the patch with the sort key (color, patch), or end the sweep if `key` is None."""
        if key == self._key:
            return
        self._others.append(self.own)
        self.own = [0.0] * len(self.known)
        if key is None or self._key is None or key[0] != self._key[0]:
            for changes in self._others:
                self.known = [a + b for a, b in zip(self.known, changes, strict=True)]
            self._others = []
        self._key = key

    def gain(self, face: int, before: int, label: int) -> float:
        """Return the decrease of the cost if a face moves from the region `before` to `label`."""
        area, size = self.of_faces[face], self.sizes[face]
        far, near = (_squared(self.positions[face] - self.centroids[i]) for i in (before, label))
        lost, won = (self.known[i] + self.own[i] for i in (before, label))
        slope = self.weights[label] * won - self.weights[before] * lost
        curvature = 0.5 * (self.weights[label] + self.weights[before])
        return self.roundness * area * (far - near) - size * (slope + curvature * size)

    def change(self, before: int, label: int, area: float) -> None:
        self.own[before] -= area
        self.own[label] += area


def _runs(labels: list[int], block: int = 1 << 14) -> list[list[int]]:
    """Return lists of consecutive faces with the same label, for the faces of each block in turn.

    A block consists of `block` consecutive faces.
    """
    runs: list[list[int]] = []
    for face, label in enumerate(labels):
        if face % block == 0 or labels[face - 1] != label:
            runs.append([])
        runs[-1].append(face)
    return runs


def _squared(step: Floats) -> float:
    x, y, z = step.tolist()
    return float(x * x + y * y + z * z)


MAX_ARCS = 256
"""A face with more arcs does not move."""


class MovingRegions:
    """Current labels of faces, and border costs. Used by `smooth_borders` and `move_cells`."""

    def __init__(
        self,
        graph: FaceGraph,
        mesh: Mesh,
        steps: Floats,
        labels: list[int],
        fixed: set[int],
        max_distance: float,
        crease_scale: float,
    ) -> None:
        self.graph = graph
        self.mesh = mesh
        self.steps = steps.tolist()
        self.costs = _border_costs(graph, mesh, steps, crease_scale)
        self.patches = Patches(graph, labels)
        self.stiffness = _Stiffness(graph, labels, 0.0, 0.0)
        self.first, self.labels = list(labels), list(labels)
        self.travels = [0.0] * len(labels)
        self.fixed, self.max_distance = fixed, max_distance

    def arcs(self, face: int) -> list[tuple[int, int]]:
        """Return (arc index, neighbor) for each arc of a face."""
        numbers = range(self.graph.offsets[face], self.graph.offsets[face + 1])
        return [(number, int(self.graph.neighbors[number])) for number in numbers]

    def neighbors(self, face: int) -> list[int]:
        """Return the neighbors of a face, in the order of its arcs."""
        return [neighbor for _, neighbor in self.arcs(face)]

    def neighboring_labels(self, face: int) -> list[int]:
        """Return the distinct labels of neighbors in other regions, in the order of the arcs."""
        around = [self.labels[neighbor] for neighbor in self.neighbors(face)]
        return [label for label in dict.fromkeys(around) if label != self.labels[face]]

    def sort_key(self, face: int) -> tuple[int, int]:
        """Return (color, patch) of the region of a face; faces are processed in this order."""
        return self.patches.sort_key(self.labels[face])

    def gain(self, face: int, label: int) -> float:
        """Return the decrease of the cost of borders if a face moves to the region `label`."""
        gain = 0.0
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == label:
                gain += self.costs[number]
            if self.labels[neighbor] == self.labels[face]:
                gain -= self.costs[number]
        return gain

    def travel(self, face: int, label: int) -> float:
        """Return the length of a path from the initial border of the region `label` to a face.

        The face would move to this region. The path is the shortest path through a neighbor of the
        face in the region. The length is 0 if the face was in the region at the start.
        """
        if self.first[face] == label:
            return 0.0
        lengths = [math.inf]
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == label:
                at_border = self.first[neighbor] == label
                step = self.steps[number]
                lengths.append(0.5 * step if at_border else step + self.travels[neighbor])
        return min(lengths)

    def may_leave(self, face: int) -> bool:
        """Return whether a face may leave its region, because the region then stays connected.

        Only the faces around a corner of the face are examined, so the result may be False although
        the region would stay connected. Faces in `fixed` never leave their regions.
        """
        side_of: dict[int, int] = {}  # side of the face toward each neighbor in its region
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == self.labels[face]:
                side_of.setdefault(neighbor, int(self.graph.sides[number]))
        is_movable = face not in self.fixed and len(self.arcs(face)) <= MAX_ARCS
        if not is_movable or len(side_of) not in (1, 2):
            return False
        if len(side_of) == 1:
            return True
        (here, side), (goal, other_side) = side_of.items()
        if side == other_side:
            return False
        corner = other_side if (side + 1) % 3 == other_side else side
        before = face
        for _ in range(65):
            if here == goal:
                return True
            onward = self.around(int(self.mesh.faces[face, corner]), before, here)
            if onward in (None, face) or self.labels[onward] != self.labels[face]:
                return False
            before, here = here, onward
        return False

    def around(self, vertex: int, before: int, here: int) -> int | None:
        """Return the next face around a vertex after the faces `before` and `here`.

        Returns None if there is no next face, or more than one.
        """
        corners = self.mesh.faces[here].tolist()
        positions = [tuple(p) for p in self.mesh.vertices[[*corners, vertex]].tolist()]
        if vertex in corners:
            corner = corners.index(vertex)
        elif positions[3] in positions[:3]:
            corner = positions.index(positions[3])
        else:
            return None
        onward = [
            neighbor
            for number, neighbor in self.arcs(here)
            if self.graph.sides[number] != (corner + 1) % 3 and neighbor != before
        ]
        return onward[0] if len(onward) == 1 else None

    def move_chain(self, first: int, label: int, max_chain: int) -> list[int]:
        """Move a chain of adjacent faces to the region `label`, and return these faces.

        The chain begins with the face `first`. Each next face is the neighbor of the chain with the
        largest gain (decrease of cost). The chain is cut off where the total gain is maximal. If no
        total gain is positive, no face is moved.
        """
        before = self.labels[first]
        limit = sum(self.costs[number] for number, _ in self.arcs(first))
        gain, best_gain, best_size, area, best_area = 0.0, 1e-9 * limit, 0, 0.0, 0.0
        chain: list[tuple[int, float]] = []
        borders = {first: self.gain(first, label)}
        while borders and len(chain) < max_chain:
            gains = {f: g + self.stiffness.gain(f, before, label) for f, g in borders.items()}
            face = max(gains, key=lambda f: (gains[f], -f))
            step = gains[face]
            del borders[face]
            if step < -0.5 * limit - gain:
                break
            if self.travel(face, label) > self.max_distance or not self.may_leave(face):
                continue
            if not self.patches.may_touch(label, self.neighboring_labels(face)):
                continue
            gain += step
            chain.append((face, self.travels[face]))
            self.travels[face] = float(np.float32(self.travel(face, label)))
            self.labels[face] = label
            area += self.stiffness.sizes[face]
            self.stiffness.change(before, label, self.stiffness.sizes[face])
            if gain > best_gain:
                best_gain, best_size, best_area = gain, len(chain), area
            around = [f for f in self.neighbors(face) if self.labels[f] == before]
            borders.update({f: self.gain(f, label) for f in around})
        self.stiffness.change(before, label, best_area - area)
        for face, travel in chain[best_size:]:
            self.labels[face], self.travels[face] = before, travel
        return [face for face, _ in chain[:best_size]]


def _border_costs(graph: FaceGraph, mesh: Mesh, steps: Floats, crease_scale: float) -> list[float]:
    """Return the border cost of each arc: the length of its edge, reduced in creases."""
    lengths, excesses = [], []
    for face in range(graph.n_cells):
        for arc in range(graph.offsets[face], graph.offsets[face + 1]):
            side = graph.sides[arc]
            start, end = mesh.vertices[mesh.faces[face, [side, (side + 1) % 3]]]
            middle = 0.5 * (start + end)
            c_i, c_j = graph.positions[face], graph.positions[graph.neighbors[arc]]
            lengths.append(norm(end - start))
            geodesic = norm(c_i - middle) + norm(middle - c_j)
            excesses.append(max(0.0, steps[arc] - geodesic))
    costs = np.array(lengths) * exponential(-np.array(excesses) / crease_scale)
    return [float(cost) for cost in costs.astype(np.float32)]


SMALLEST, LARGEST = 64, 1024
"""Limits of `Patches._least`, the number of border faces at which a patch stops growing."""

MANY = 512
"""Target number of patches, within the limits `SMALLEST` and `LARGEST`."""

FEWEST_COLORS = 8
"""Minimum number of colors of patches."""


class Patches:
    """Groups of adjacent regions, called patches. Adjacent patches have different colors."""

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
        """Grow a patch from the region `seed`; return the seed of the next patch, or None."""
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
        """Return the allowed color with the fewest faces, or a new color if all are `forbidden`."""
        allowed = [c for c in range(len(self._color_sizes)) if c not in forbidden]
        if not allowed:
            allowed = [len(self._color_sizes)]
            self._color_sizes.append(0)
        color = min(allowed, key=lambda c: (self._color_sizes[c], c))
        self._color_sizes[color] += size
        return color

    def sort_key(self, region: int) -> tuple[int, int]:
        """Return the color and the patch of a region; regions are processed in this order."""
        patch = self.of_region[region]
        return self.colors[patch], patch

    def may_touch(self, region: int, others: list[int]) -> bool:
        """Return whether all regions `others` are in the patch of `region` or have other colors."""
        own = self.sort_key(region)
        keys = [self.sort_key(other) for other in others]
        return all(key == own or key[0] != own[0] for key in keys)
