"""Slow, readable twins of the kernels: what each stage computes, as plainly as it can be said.

These are the oracle of the tests: on the same input the compiled stages give the same numbers, bit
for bit. Where floats are added, the order is that of the kernels and part of the contract. Every
function follows the stage of the same name; nothing here is meant to be fast.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..cells.cell_graph import CellGraph
from ..cells.face_graph import FaceGraph
from ..mesh.triangle_mesh import Mesh
from .elementary import arctangent, exponential

__all__ = [
    "Arc",
    "Part",
    "build_face_graph",
    "classify_exact",
    "classify_halted",
    "farthest_seeds",
    "find_components",
    "flood_seeds",
    "geodesic_seeds",
    "grid_seeds",
    "iterate",
    "join_islands",
    "measure_faces",
    "quantize_weights",
    "smooth_borders",
    "subdivide",
    "superfacet_weights",
    "update_centers",
]

Floats = npt.NDArray[np.float64]


class Arc(NamedTuple):
    """A step from a face, over one of its sides, to a neighbor."""

    face: int
    side: int
    neighbor: int
    same_turn: bool


class _Edge(NamedTuple):
    """A side of a face, or an edge within it, and what it is bisected into."""

    start: int
    end: int
    halves: tuple[_Edge, _Edge] | None  # None: short enough

    def reversed(self) -> _Edge:
        halves = self.halves and (self.halves[1].reversed(), self.halves[0].reversed())
        return _Edge(self.end, self.start, halves)


class Part(NamedTuple):
    """What a face is after it was bisected `depth` times."""

    corners: tuple[int, ...]
    depth: int


def subdivide(mesh: Mesh, max_edge: float) -> tuple[Floats, list[list[Part]]]:
    """All vertices, and the parts of each face."""
    points = mesh.vertices.tolist()
    faces = mesh.faces.tolist()
    sides = {(min(e), max(e)) for a, b, c in faces for e in ((a, b), (b, c), (c, a))}
    edges = {ends: _bisected(points, *ends, max_edge) for ends in sorted(sides)}
    edges |= {(high, low): edge.reversed() for (low, high), edge in edges.items() if low != high}
    parts = [
        _cut(points, [edges[a, b], edges[b, c], edges[c, a]], max_edge, 0) for a, b, c in faces
    ]
    return np.array(points), parts


def _bisected(points: list[list[float]], start: int, end: int, max_edge: float) -> _Edge:
    """Bisect an edge, and its halves, until they are short enough; add midpoints to `points`."""
    if _squared_length(points, start, end) <= max_edge * max_edge:
        return _Edge(start, end, None)
    middle = len(points)
    points.append([(a + b) / 2 for a, b in zip(points[start], points[end], strict=True)])
    first = _bisected(points, start, middle, max_edge)
    return _Edge(start, end, (first, _bisected(points, middle, end, max_edge)))


def _cut(points: list[list[float]], sides: list[_Edge], max_edge: float, depth: int) -> list[Part]:
    """Cut a face from the middle of its longest side to the opposite corner, and both parts."""
    lengths = [_squared_length(points, edge.start, edge.end) for edge in sides]
    side = lengths.index(max(lengths))
    halves = sides[side].halves
    if halves is None:
        return [Part(tuple(edge.start for edge in sides), depth)]
    second, third = (side + 1) % 3, (side + 2) % 3
    inner = _bisected(points, halves[0].end, sides[third].start, max_edge)
    one, other = list(sides), list(sides)
    one[side], one[second] = halves[0], inner
    other[side], other[third] = halves[1], inner.reversed()
    parts = _cut(points, one, max_edge, depth + 1)
    return parts + _cut(points, other, max_edge, depth + 1)


def _squared_length(points: list[list[float]], start: int, end: int) -> float:
    x, y, z = (b - a for a, b in zip(points[start], points[end], strict=True))
    return float(x * x + y * y + z * z)


def build_face_graph(mesh: Mesh, *, weld: bool = True) -> list[Arc]:
    """All arcs, sorted by face, side and neighbor."""
    vertex_at: dict[tuple[float, ...], int] = {}
    corners = [
        [vertex_at.setdefault(tuple(mesh.vertices[v].tolist()), v) if weld else v for v in face]
        for face in mesh.faces.tolist()
    ]
    sides_on_edge: dict[tuple[int, int], dict[int, tuple[int, bool]]] = defaultdict(dict)
    for face, (a, b, c) in enumerate(corners):
        for side, (start, end) in enumerate(((a, b), (b, c), (c, a))):
            if start != end:
                edge = (min(start, end), max(start, end))
                sides_on_edge[edge].setdefault(face, (side, start < end))
    arcs = [
        Arc(face, side, neighbor, ascending == neighbor_ascending)
        for faces in sides_on_edge.values()
        for face, (side, ascending) in faces.items()
        for neighbor, (_, neighbor_ascending) in faces.items()
        if face != neighbor
    ]
    return sorted(arcs)


def measure_faces(mesh: Mesh) -> tuple[Floats, Floats]:
    """Centroids, shape (F, 3), and areas, shape (F,)."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return (a + b + c) / 3.0, 0.5 * _norm(_cross(b - a, c - a))


def superfacet_weights(
    mesh: Mesh,
    arcs: list[Arc],
    *,
    alpha: float,
    eta_convex: float,
    crease_length: float | None = None,
    weld: bool = True,
) -> Floats:
    """Weight of each arc, eq. 1-3 of the paper; `crease_length` stands for |e| in eq. 2."""
    used = mesh.vertices[np.unique(mesh.faces)]
    diagonal = float(_norm(used.max(axis=0) - used.min(axis=0)))
    inside_out = _is_inside_out(mesh, arcs, diagonal, weld)
    centroids, areas = measure_faces(mesh)
    normals = _unit_normals(mesh)
    terms = []
    for face, side, neighbor, same_turn in arcs:
        start = mesh.vertices[mesh.faces[face, side]]
        end = mesh.vertices[mesh.faces[face, (side + 1) % 3]]
        middle = 0.5 * (start + end)
        geodesic = _norm(centroids[face] - middle) + _norm(middle - centroids[neighbor])  # eq. 1
        n_i, n_j = normals[face], normals[neighbor]
        if same_turn:
            a_i, a_j = areas[face], areas[neighbor]
            as_large = abs(a_i - a_j) <= 1e-9 * max(a_i, a_j)
            turn_j = face < neighbor if as_large else a_i > a_j
            n_i, n_j = (n_i, -n_j) if turn_j else (-n_i, n_j)
        rise = _dot(n_i - n_j, centroids[neighbor] - centroids[face])
        concave = rise < 0 if inside_out else rise > 0
        eta = 1.0 if concave else eta_convex
        length = _norm(end - start) if crease_length is None else crease_length
        terms.append((geodesic, alpha * eta * length, _norm(_cross(n_i, n_j)), _dot(n_i, n_j)))
    geodesics, prices, sines, cosines = np.array(terms).reshape(-1, 4).T
    angular = prices * arctangent(sines, cosines) / math.pi  # eq. 2
    weights: Floats = (geodesics + angular) / diagonal  # eq. 3
    return weights


def _unit_normals(mesh: Mesh) -> Floats:
    """Unit normals; zero where a face has none."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    normals = _cross(b - a, c - a)
    lengths = _norm(normals)
    longest = np.max([_dot(b - a, b - a), _dot(c - b, c - b), _dot(a - c, a - c)], axis=0)
    exists = lengths > 8 * np.finfo(np.float64).eps * longest
    return np.where(exists[:, None], normals / np.where(exists, lengths, 1.0)[:, None], 0.0)


def _is_inside_out(mesh: Mesh, arcs: list[Arc], diagonal: float, weld: bool) -> bool:
    """Whether the mesh is closed and encloses a negative volume."""
    corners = mesh.vertices[mesh.faces]
    names = corners.tolist() if weld else [[[v] for v in face] for face in mesh.faces.tolist()]
    # A side without an arc is on the boundary, unless its two ends are one vertex or its face runs
    # through the same edge twice.
    with_arc = {(arc.face, arc.side) for arc in arcs}
    for face, ends in enumerate(names):
        edges = [frozenset((tuple(ends[s]), tuple(ends[(s + 1) % 3]))) for s in range(3)]
        reached = {edges[side] for side in range(3) if (face, side) in with_arc}
        if any(len(edge) == 2 and edge not in reached for edge in edges):
            return False
    centroids, areas = measure_faces(mesh)
    weights = areas if areas.any() else np.ones(mesh.n_faces)
    origin = np.cumsum(weights[:, None] * centroids, axis=0)[-1] / np.cumsum(weights)[-1]
    a, b, c = (corners[:, corner] - origin for corner in range(3))
    return float(np.sum(_dot(a, _cross(b, c)))) / 6.0 < -1e-12 * diagonal**3


def quantize_weights(weights: Floats) -> tuple[npt.NDArray[np.float32], float]:
    """Weights as whole numbers of a unit, and the unit."""
    chunks = np.zeros((-(-len(weights) // 4096), 4096))
    chunks.flat[: len(weights)] = weights
    partial_sums = np.cumsum(chunks, axis=1)[:, -1]  # cumsum adds from left to right
    total = float(np.cumsum(partial_sums)[-1]) if len(weights) else 0.0
    unit = 2.0 ** (math.frexp(total)[1] - 48) if total > 0 else 1.0
    return np.maximum(1.0, np.rint(weights / unit)).astype(np.float32), unit


def find_components(graph: CellGraph, labels: npt.NDArray[Any]) -> list[int]:
    """Component of each cell: arcs between cells of one label join them, whichever way they lead.

    Components are numbered in the order of their lowest cells.
    """
    around: list[set[int]] = [set() for _ in labels]
    for cell in range(graph.n_cells):
        for neighbor, _ in _arcs_of(graph, cell):
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


def _seeded_components(graph: CellGraph, n_seeds: int) -> tuple[npt.NDArray[Any], list[int]]:
    """Component of each cell, and the components that are no islands, the largest first."""
    components = np.array(find_components(graph, np.zeros(graph.n_cells)))
    measures = np.bincount(components, graph.measures)  # bincount adds in the order of the cells
    enough = 0.5 * float(np.cumsum(graph.measures)[-1]) / n_seeds
    first = components[_first_cell(graph)]
    order = sorted(range(len(measures)), key=lambda c: (-measures[c], c != first, c))
    seeded: list[int] = []
    for component in order[:n_seeds]:
        n_cells = int(np.count_nonzero(np.isin(components, seeded)))
        if measures[component] >= enough or n_cells < n_seeds:
            seeded.append(component)
    return components, seeded


def farthest_seeds(graph: CellGraph, n_seeds: int, *, islands: str = "keep") -> list[int]:
    """Iterative farthest points, by looking at all cells for every seed."""
    seeds = [_first_cell(graph)]
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
        squared_distance = np.minimum(squared_distance, _dot(step, step))
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
        for cell, length in _expand(graph, seeds[n_placed], math.inf).items():
            lengths[cell] = min(length, lengths[cell])
    return seeds


def flood_seeds(
    graph: CellGraph, radius: float, n_seeds: int = 1, *, islands: str = "keep"
) -> list[int]:
    """Cells in the order of their path length, that no region which expanded to 2 r had reached."""
    seeds: list[int] = []
    reached: set[int] = set()
    components, seeded = _seeded_components(graph, n_seeds)
    first = _first_cell(graph)
    others = [components.tolist().index(number) for number in range(max(components) + 1)]
    for start in [first, *(cell for cell in others if components[cell] != components[first])]:
        if islands == "nearest" and components[start] not in seeded:
            continue
        lengths: dict[int, float] = dict.fromkeys(
            np.flatnonzero(components == components[start]).tolist(), math.inf
        )
        lengths.update(_expand(graph, start, math.inf))
        for cell in sorted(lengths, key=lambda cell: (lengths[cell], cell)):
            if cell not in reached:
                seeds.append(cell)
                reached.update(_expand(graph, cell, 2.0 * radius))
    return seeds


def grid_seeds(graph: CellGraph, radius: float) -> list[int]:
    """Centers of the cells in each cube of edge 2 r, numbered by their lowest cell."""
    label_of: dict[tuple[float, ...], int] = {}
    cubes = np.floor((graph.positions - graph.bounds[0]) / (2.0 * radius))
    labels = [label_of.setdefault(tuple(cube), len(label_of)) for cube in cubes.tolist()]
    return update_centers(graph, np.array(labels))


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
                for neighbor, step in _arcs_of(graph, cell):
                    heapq.heappush(queue, (length + step, label, neighbor))
        if len(labels) == graph.n_cells or islands == "nearest":
            return [labels.get(cell, -1) for cell in range(graph.n_cells)], all_centers
        all_centers.append(min(set(range(graph.n_cells)) - labels.keys()))


def classify_halted(
    graph: CellGraph, centers: list[int], reach: float, *, islands: str = "keep"
) -> tuple[list[int], list[int]]:
    """Labels by one expansion of each center, as the paper tells it, and all centers.

    For islands see `classify_exact`.
    """
    best = [(math.inf, -1)] * graph.n_cells  # path length and label
    all_centers: list[int] = []
    waiting = list(centers)
    while waiting:
        label, center = len(all_centers), waiting.pop(0)
        all_centers.append(center)
        for cell, length in _expand(graph, center, reach).items():
            best[cell] = min(best[cell], (length, label))
        if not waiting and (math.inf, -1) in best and islands == "keep":
            waiting.append(best.index((math.inf, -1)))  # the first orphan
    return [label for _, label in best], all_centers


def join_islands(graph: CellGraph, labels: list[int]) -> tuple[list[int], int]:
    """Labels without -1, and how many connected pieces had it.

    Each takes the label of the nearest cell, the lowest of equals, to any of its own.
    """
    joined = list(labels)
    labeled = np.flatnonzero(np.array(labels) >= 0)
    pieces = np.array(find_components(graph, np.array(labels)))
    islands = np.unique(pieces[np.array(labels) < 0])
    for piece in islands:
        cells = np.flatnonzero(pieces == piece)
        steps = graph.positions[labeled] - graph.positions[cells, None]
        nearest = labeled[int(np.argmin(_dot(steps, steps).min(axis=0)))]
        for cell in cells:
            joined[cell] = labels[nearest]
    return joined, len(islands)


def update_centers(graph: CellGraph, labels: npt.NDArray[Any]) -> list[int]:
    """The cell of each region nearest to the weighted mean of its positions; -1 is no region."""
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
    squared = _dot(step, step)
    cells = np.arange(graph.n_cells)
    return [int(min(cells[labels == r], key=lambda cell: squared[cell])) for r in range(n_regions)]


def _fixed_point_means(graph: CellGraph, labels: npt.NDArray[Any]) -> Floats:
    """Means whose sums are exact, whatever their order; NaN for regions too small for that.

    Each cell adds whole numbers: its measure, and its measure times its position from the low
    corner, both scaled to just under 2**61 in all, and what rounding leaves of them, times 2**31.
    """
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
    """Labels and centers of every iteration, and why the loop stopped."""
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
        if moved_to == centers or math.sqrt(np.mean(_dot(moves, moves))) <= tol * radius:
            return history, "converged"
        if sorted(moved_to) in [sorted(earlier) for _, earlier in history]:
            return history, "cycle"
        if len(history) == max_num_iter:
            return history, "max_num_iter"
        centers = moved_to


def smooth_borders(
    graph: FaceGraph,
    mesh: Mesh,
    weights: Floats,
    labels: list[int],
    fixed: set[int],
    *,
    max_distance: float,
    crease_scale: float,
    max_chain: int,
    max_sweeps: int,
) -> list[int]:
    """Labels with borders moved by chains of faces, from one region to the next."""
    regions = _MovingRegions(graph, mesh, weights, labels, fixed, max_distance, crease_scale)
    waiting = [f for f in range(graph.n_cells) if regions.neighboring_labels(f)]
    for _ in range(max_sweeps):
        touched: set[int] = set()
        for face in waiting:
            for label in regions.neighboring_labels(face):
                moved = regions.move_chain(face, label, max_chain)
                touched.update(moved, *(regions.neighbors(f) for f in moved))
                if moved:
                    break
        waiting = sorted(touched)
    return regions.labels


class _MovingRegions:
    """Labels that change, with what it takes to judge a change."""

    def __init__(
        self,
        graph: FaceGraph,
        mesh: Mesh,
        weights: Floats,
        labels: list[int],
        fixed: set[int],
        max_distance: float,
        crease_scale: float,
    ) -> None:
        self.graph = graph
        self.mesh = mesh
        self.steps = (weights * graph.diagonal).tolist()
        self.costs = _border_costs(graph, mesh, weights, crease_scale)
        self.first, self.labels = list(labels), list(labels)
        self.travels = [0.0] * len(labels)
        self.fixed, self.max_distance = fixed, max_distance

    def arcs(self, face: int) -> list[tuple[int, int]]:
        """Number and neighbor of each arc."""
        numbers = range(self.graph.offsets[face], self.graph.offsets[face + 1])
        return [(number, int(self.graph.neighbors[number])) for number in numbers]

    def neighbors(self, face: int) -> list[int]:
        return [neighbor for _, neighbor in self.arcs(face)]

    def neighboring_labels(self, face: int) -> list[int]:
        """Other labels around a face, each once, in the order of the arcs."""
        around = [self.labels[neighbor] for neighbor in self.neighbors(face)]
        return [label for label in dict.fromkeys(around) if label != self.labels[face]]

    def gain(self, face: int, label: int) -> float:
        """How much cheaper borders get if a face takes a label."""
        gain = 0.0
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == label:
                gain += self.costs[number]
            if self.labels[neighbor] == self.labels[face]:
                gain -= self.costs[number]
        return gain

    def travel(self, face: int, label: int) -> float:
        """How far a face would be from where the region of a label began."""
        if self.first[face] == label:
            return 0.0
        ways = [math.inf]
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == label:
                at_border = self.first[neighbor] == label
                step = self.steps[number]
                ways.append(0.5 * step if at_border else step + self.travels[neighbor])
        return min(ways)

    def may_leave(self, face: int) -> bool:
        """Whether its region hangs together without a face, around the corner next to it."""
        ways: dict[int, int] = {}  # the side that leads to each neighbor in the region
        for number, neighbor in self.arcs(face):
            if self.labels[neighbor] == self.labels[face]:
                ways.setdefault(neighbor, int(self.graph.sides[number]))
        if face in self.fixed or len(ways) not in (1, 2):
            return False
        if len(ways) == 1:
            return True
        (here, side), (goal, other_side) = ways.items()
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
        """The face that follows around a vertex, if there is just one."""
        corners = self.mesh.faces[here].tolist()
        places = [tuple(p) for p in self.mesh.vertices[[*corners, vertex]].tolist()]
        if vertex in corners:
            corner = corners.index(vertex)
        elif places[3] in places[:3]:
            corner = places.index(places[3])
        else:
            return None
        onward = [
            neighbor
            for number, neighbor in self.arcs(here)
            if self.graph.sides[number] != (corner + 1) % 3 and neighbor != before
        ]
        return onward[0] if len(onward) == 1 else None

    def move_chain(self, first: int, label: int, max_chain: int) -> list[int]:
        """Move faces to a region, the best first, up to where it pays most; return them."""
        before = self.labels[first]
        limit = sum(self.costs[number] for number, _ in self.arcs(first))
        gain, best_gain, best_size = 0.0, 1e-9 * limit, 0
        chain: list[tuple[int, float]] = []
        candidates = {first: self.gain(first, label)}
        while candidates and len(chain) < max_chain:
            face = max(candidates, key=lambda f: (candidates[f], -f))
            step = candidates.pop(face)
            if step < -0.5 * limit - gain:
                break
            if self.travel(face, label) > self.max_distance or not self.may_leave(face):
                continue
            gain += step
            chain.append((face, self.travels[face]))
            self.travels[face] = float(np.float32(self.travel(face, label)))
            self.labels[face] = label
            if gain > best_gain:
                best_gain, best_size = gain, len(chain)
            around = [f for f in self.neighbors(face) if self.labels[f] == before]
            candidates.update({f: self.gain(f, label) for f in around})
        for face, travel in chain[best_size:]:
            self.labels[face], self.travels[face] = before, travel
        return [face for face, _ in chain[:best_size]]


def _border_costs(
    graph: FaceGraph, mesh: Mesh, weights: Floats, crease_scale: float
) -> list[float]:
    """What a border through each arc costs: the length of its edge, less in a crease."""
    lengths, excesses = [], []
    for face in range(graph.n_cells):
        for arc in range(graph.offsets[face], graph.offsets[face + 1]):
            side = graph.sides[arc]
            start, end = mesh.vertices[mesh.faces[face, [side, (side + 1) % 3]]]
            middle = 0.5 * (start + end)
            c_i, c_j = graph.positions[face], graph.positions[graph.neighbors[arc]]
            lengths.append(_norm(end - start))
            geodesic = _norm(c_i - middle) + _norm(middle - c_j)
            excesses.append(max(0.0, weights[arc] * graph.diagonal - geodesic))
    costs = np.array(lengths) * exponential(-np.array(excesses) / crease_scale)
    return [float(cost) for cost in costs.astype(np.float32)]


def _expand(graph: CellGraph, center: int, reach: float) -> dict[int, int]:
    """Path lengths from a center, by Dijkstra's algorithm halted at `reach` (Euclidean)."""
    lengths: dict[int, int] = {}
    queue = [(0, center)]
    while queue:
        length, cell = heapq.heappop(queue)
        if cell in lengths:
            continue
        lengths[cell] = length
        step = graph.positions[cell] - graph.positions[center]
        if _dot(step, step) <= reach * reach:
            for neighbor, step_length in _arcs_of(graph, cell):
                heapq.heappush(queue, (length + step_length, neighbor))
    return lengths


def _first_cell(graph: CellGraph) -> int:
    """The cell nearest to the centroid of all."""
    return update_centers(graph, np.zeros(graph.n_cells, dtype=np.int32))[0]


def _arcs_of(graph: CellGraph, cell: int) -> list[tuple[int, int]]:
    """Neighbor and length, in units, of each arc of a cell."""
    arcs = slice(graph.offsets[cell], graph.offsets[cell + 1])
    return [
        (int(n), int(length))
        for n, length in zip(graph.neighbors[arcs], graph.lengths[arcs], strict=True)
    ]


# Sums of products from left to right, as the kernels add them: numpy's own may take another order.


def _dot(a: Floats, b: Floats) -> Any:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _norm(a: Floats) -> Any:
    return np.sqrt(_dot(a, a))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
