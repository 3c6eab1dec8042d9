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
    allowed: Sequence[set[int]],
) -> list[int]:
    """Extend labels to unlabeled vertices (-1) with Prim's algorithm; return all labels.

    `edges` are all edges, as pairs (a, b). Among edges with equal weights, edges between vertices
    with equal `hints` are used first. Vertices that no label in `allowed` reaches keep -1.
    """

    def rank(to: int, start: int) -> tuple[float, bool, int, int]:
        step = positions[to] - positions[start]
        is_convex = dot(normals[to], step) > 0 or dot(normals[start], step) < 0
        weight = crease_weight(normals[to], normals[start], bool(is_convex))
        return weight, bool(hints[to] != hints[start]), to, start

    both_ways = [*edges, *((b, a) for a, b in edges)]
    found: list[int] = np.array(labels).tolist()
    while True:
        steps = [(to, start) for to, start in both_ways if found[to] < 0 <= found[start]]
        ranks = [rank(*step) for step in steps if found[step[1]] in allowed[step[0]]]
        if not ranks:
            return found
        *_, to, start = min(ranks)
        found[to] = found[start]


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
