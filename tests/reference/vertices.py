"""Stage 5: label vertices along creases, and count segments like ScanNet's Segmentator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from superfacets.base.types import Array, Floats
from superfacets.mesh.meshes import Mesh

from .arithmetic import dot, norm


def mean_normals(mesh: Mesh) -> Floats:
    """Return the mean of the unit normals of the faces at each vertex, (V, 3); 0 without faces."""
    sums, counts = np.zeros((mesh.n_vertices, 3)), np.zeros(mesh.n_vertices, int)
    for face in mesh.faces.tolist():
        p, q, r = mesh.vertices[face]
        direction = np.cross(q - p, r - p)
        for vertex in face:
            sums[vertex] += direction / norm(direction)
            counts[vertex] += 1
    return sums / np.maximum(counts, 1)[:, np.newaxis]


def crease_weight(a: Floats, b: Floats, is_convex: bool) -> float:
    """Return the weight of an edge, from the normals a and b of its ends; see `vertex_labels`."""
    weight = max(1.0 - float(dot(a, b)), 0.0)
    return weight * weight if is_convex else weight


def spread_labels(
    edges: Sequence[tuple[int, int]],
    positions: Floats,
    normals: Floats,
    labels: Array,
    hints: Array,
) -> list[int]:
    """Extend labels to unlabeled vertices (-1) with Kruskal's algorithm; return all labels.

    `edges` are all edges, sorted, as pairs (a, b) with a < b. Among edges with equal weights, edges
    between vertices with equal `hints` are used first. Connected components without any label keep
    -1.
    """

    def weight(a: int, b: int) -> float:
        step = positions[b] - positions[a]
        is_convex = dot(normals[b], step) > 0 or dot(normals[a], step) < 0
        return crease_weight(normals[a], normals[b], bool(is_convex))

    # Edges with equal weights and hints are sorted by vertices. Each edge starts at its unlabeled
    # vertex, or at the vertex with the lower index if both are unlabeled.
    free = [
        (b, a) if labels[a] >= 0 else (a, b) for a, b in edges if labels[a] < 0 or labels[b] < 0
    ]
    ranks = [(weight(a, b), bool(hints[a] != hints[b]), a, b) for a, b in sorted(free)]
    sets = {vertex: [vertex] for vertex in range(len(labels))}
    found: list[int] = np.array(labels).tolist()
    for *_, a, b in sorted(ranks):
        if sets[a] is sets[b] or (found[a] >= 0 and found[b] >= 0):
            continue
        united = sets[a] + sets[b]
        label = max(found[a], found[b])
        for vertex in united:
            sets[vertex], found[vertex] = united, label
    return found


def share_vertices(corners: Sequence[Sequence[int]], labels: Sequence[int]) -> list[int]:
    """Change labels of vertices so that as many regions as possible have a vertex.

    `corners` are, for each region, the vertices at the corners of its cells, ascending. The
    algorithm is that of Hopcroft and Karp for matchings: each round finds the shortest chains.
    """
    found = list(labels)
    while True:
        counts = Counter(found)
        reached = [taker for taker, own in enumerate(corners) if own and not counts[taker]]
        levels, last = dict.fromkeys(reached, 0), None
        lost = list(reached)
        for taker in reached:
            givers = [found[vertex] for vertex in corners[taker]]
            if last is None and any(counts[giver] > 1 for giver in givers):
                last = levels[taker]
            for giver in givers if last is None else ():
                if giver not in levels:
                    levels[giver] = levels[taker] + 1
                    reached.append(giver)
        if last is None:
            return found
        for taker in lost:
            counts[taker] += _takes_vertex(taker, corners, found, counts, (levels, last))


def _takes_vertex(
    taker: int,
    corners: Sequence[Sequence[int]],
    found: list[int],
    counts: Counter[int],
    levels: tuple[dict[int, int], int],
) -> bool:
    """Let a region take a vertex, and return whether it could; `levels` ends with the last level.

    Each region is tried once, because its level is removed.
    """
    level = levels[0].pop(taker)
    for vertex in corners[taker]:
        giver = found[vertex]
        is_spare = level == levels[1] and counts[giver] > 1
        is_next = level < levels[1] and levels[0].get(giver) == level + 1
        if is_spare or (is_next and _takes_vertex(giver, corners, found, counts, levels)):
            counts[giver] -= is_spare
            found[vertex] = taker
            return True
    return False


def count_segments(
    positions: Floats,
    normals: Floats,
    edges: Sequence[tuple[int, int]],
    threshold: float,
    least: int,
) -> int:
    """Return the number of segments with at least `least` nodes.

    Segments are found by the method of Felzenszwalb and Huttenlocher. Nodes without edges are not
    counted.
    """
    ranks = []
    for index, (a, b) in enumerate(edges):
        is_convex = dot(normals[b], positions[b] - positions[a]) > 0
        ranks.append((crease_weight(normals[a], normals[b], bool(is_convex)), index))
    sets = {node: [node] for node in range(len(positions))}
    # Maximum weight, for each node, of edges that may join its segment to another segment.
    limits = [threshold] * len(positions)

    def join(may_join: Callable[[int, int, float], bool]) -> None:
        for weight, index in sorted(ranks):
            a, b = edges[index]
            if sets[a] is sets[b] or not may_join(a, b, weight):
                continue
            united = sets[a] + sets[b]
            for node in united:
                sets[node] = united
                limits[node] = weight + threshold / len(united)

    join(lambda a, b, weight: weight <= min(limits[a], limits[b]))
    join(lambda a, b, weight: min(len(sets[a]), len(sets[b])) < least)
    used = {id(sets[node]): len(sets[node]) for edge in edges for node in edge}
    return sum(size >= least for size in used.values())
