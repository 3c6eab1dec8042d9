"""Stage 5: convert labels of cells to labels of vertices, with borders along creases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints, Longs
from ..cells.kinds import kind_of, measures_of
from ..cells.sums import Majority, weighted_majority
from ..errors import MeshError
from ..mesh.faces import Corners, mean_normals, vertex_graph
from ..mesh.weld import lowest_vertices


class VertexEdges(NamedTuple):
    """Vertices of a mesh, or points, and their edges in CSR form, each edge in both directions."""

    offsets: Longs  # (V + 1,) index of the first edge of each vertex
    neighbors: Ints  # (M,) vertex at the other end of each edge
    positions: Floats  # (V, 3) position of each vertex
    normals: Floats  # (V, 3) mean of the unit normals of the adjacent cells; 0 if it is not defined


class _Regions(NamedTuple):
    """Cells of a mesh and their labels."""

    cells: Any
    corners: Corners  # vertex at each corner of the cells; equal positions are welded
    labels: Ints  # (N,) region of each cell
    n: int  # number of regions, some of which may have no cells


def crease_labels(
    cells: Any, labels: Ints, n_labels: int, n_threads: int, *, least: int = 1, merge: bool = False
) -> Ints:
    """Convert labels of cells to labels of vertices by the method "creases" of `vertex_labels`.

    The cells must have corners, and their labels must be from -1 to `n_labels` - 1. With `merge`,
    regions that cannot grow to `least` vertices are merged with other regions. A merged region gets
    the lower of the two labels.
    """
    found = np.full(cells.n_vertices, -1, np.int32)
    if labels.max() < 0:
        return found
    cells, labels = _labeled_part(cells, labels)
    lowest = lowest_vertices(cells.vertices, True, n_threads)
    corners = corners_in(cells)
    graph = vertex_graph(cells, lowest, n_threads)
    edges = VertexEdges(*graph[:2], cells.vertices, mean_normals(cells, lowest))
    welded = Corners(lowest[corners.vertices], corners.size, corners.offsets)
    regions = _Regions(cells, welded, labels, n_labels)
    of_positions = _labels_along_creases(edges, regions, n_threads)
    is_used = np.zeros(cells.n_vertices, bool)
    is_used[corners.vertices] = True
    counts = np.bincount(lowest[is_used], minlength=cells.n_vertices).astype(np.int32)
    of_positions = large_regions(edges, of_positions, counts, least, merge=merge)
    found[is_used] = of_positions[lowest[is_used]]
    return found


def corners_in(cells: Any) -> Corners:
    """Return the vertices at the corners of cells, or raise a MeshError for points and graphs."""
    kind = kind_of(cells)
    corners = kind.corners(cells)
    if corners is None:
        raise MeshError(f"labels of vertices need a mesh, got {kind.plural} without vertices")
    return corners


def large_regions(
    edges: VertexEdges, labels: Ints, counts: Ints, least: int, *, merge: bool
) -> Ints:
    """Grow regions to `least` vertices, and return the new labels.

    Small regions take vertices from regions that stay connected and keep `least` vertices. With
    `merge`, regions that are still too small are merged with neighbors. `counts` is the number of
    vertices of the mesh at each welded vertex. Labels are >= 0, or -1 at vertices without edges.
    """
    if least < 2:
        return labels
    size = (counts, int(labels.max()) + 1, least)
    labels = _core.grow_small_regions(*edges, labels, *size)
    return _core.merge_small_regions(*edges, labels, *size) if merge else labels


def _labeled_part(cells: Any, labels: Ints) -> tuple[Any, Ints]:
    """Return a mesh of the cells whose label is not -1 but with all vertices, and their labels."""
    if labels.min() >= 0:
        return cells, labels
    kept = np.flatnonzero(labels >= 0)
    kind = kind_of(cells)
    corners, offsets = corners_in(cells).of(kept)
    return kind.with_corners(cells, cells.vertices, corners, offsets, cells.bounds), labels[kept]


def _labels_along_creases(edges: VertexEdges, regions: _Regions, n_threads: int) -> Ints:
    """Label welded vertices: inside a region directly, at borders with Kruskal's algorithm.

    If all vertices of a region are at borders, they keep the majority label of their cells. If a
    region is not connected, only its largest piece keeps the label; other pieces are labeled again.
    """
    majority, at_border = _majority(regions, len(edges.positions), n_threads)
    inside = majority[~at_border]
    has_inside = np.bincount(inside[inside >= 0], minlength=regions.n) > 0
    seeds = np.where(at_border & has_inside[majority], np.int32(-1), majority)
    found = _core.spread_labels(*edges, seeds, majority, n_threads)
    found = np.where(found < 0, majority, found)  # components with no vertex inside a region
    found[_in_stray_pieces(edges, regions, found, n_threads)] = -1
    return _core.spread_labels(*edges, found, majority, n_threads)


def _majority(regions: _Regions, n_vertices: int, n_threads: int) -> Majority:
    """Return the label with the largest total area of cells around each welded vertex.

    Each region gets at least one vertex if there are enough vertices.
    """
    sizes = regions.corners.sizes
    majority = weighted_majority(
        regions.corners.vertices,
        np.repeat(regions.labels, sizes),
        np.repeat(measures_of(regions.cells, n_threads), sizes),
        n_vertices,
    )
    _give_vertices(majority.winners, regions)
    return majority


def _give_vertices(of_vertices: Ints, regions: _Regions) -> None:
    """Assign, in place, a vertex of its cells to each region that has no vertices, if possible."""
    counts = np.bincount(of_vertices[of_vertices >= 0], minlength=regions.n)
    lost = np.flatnonzero((counts == 0) & (np.bincount(regions.labels, minlength=regions.n) > 0))
    if not len(lost):
        return
    order = np.argsort(regions.labels, kind="stable")
    starts = np.searchsorted(regions.labels[order], np.arange(regions.n + 1))

    def vertices_of(region: int) -> Ints:
        cells = order[starts[region] : starts[region + 1]]
        return np.unique(regions.corners.of(cells)[0])

    searched: set[int] = set()
    for region in lost.tolist():
        _give_vertex(region, vertices_of, of_vertices, counts, searched)


def _give_vertex(
    region: int,
    vertices_of: Callable[[int], Ints],
    of_vertices: Ints,
    counts: Array,
    searched: set[int],
) -> None:
    """Assign a vertex to a region along an augmenting path, as in bipartite matching.

    If the region takes the only vertex of another region, that region takes a vertex from the next
    region of the path. The path ends at a region with several vertices. If there is no path, all
    visited regions are added to `searched`, and later searches skip them.
    """
    reached: dict[int, tuple[int, int] | None] = {region: None}
    queue = [region]
    for taker in queue:
        own = vertices_of(taker)
        givers = of_vertices[own]
        spare = own[counts[givers] > 1]
        if len(spare):
            counts[of_vertices[spare[0]]] -= 1
            counts[region] = 1
            step: tuple[int, int] | None = (taker, int(spare[0]))
            while step is not None:
                of_vertices[step[1]] = step[0]
                step = reached[step[0]]
            return
        for giver, vertex in zip(givers.tolist(), own.tolist(), strict=True):
            if giver not in reached and giver not in searched:
                reached[giver] = (taker, vertex)
                queue.append(giver)
    searched |= reached.keys()


def _in_stray_pieces(edges: VertexEdges, regions: _Regions, found: Ints, n_threads: int) -> Array:
    """Return for each vertex whether it must be labeled again, because its region is not connected.

    The cells of a region may have several connected parts. The largest piece on each part is kept.
    """
    pieces, n_pieces = _core.find_components(edges.offsets, edges.neighbors, found)
    label_of_piece = np.empty(n_pieces, np.int32)
    label_of_piece[pieces] = found
    in_regions = np.flatnonzero(label_of_piece >= 0)
    is_divided = np.bincount(label_of_piece[in_regions], minlength=regions.n) > 1
    divided = in_regions[is_divided[label_of_piece[in_regions]]]
    is_stray = np.zeros(n_pieces, bool)
    if len(divided):
        is_stray[divided] = True
        part_of_piece = _part_of_piece(regions, is_divided, found, pieces, n_threads)
        sizes = np.bincount(pieces, minlength=n_pieces)
        order = divided[np.lexsort((-divided, sizes[divided]))]
        largest = dict(zip(part_of_piece[order].tolist(), order.tolist(), strict=True))
        is_stray[list(largest.values())] = False
    return is_stray[pieces]


def _part_of_piece(
    regions: _Regions, is_divided: Array, found: Ints, pieces: Ints, n_threads: int
) -> Ints:
    """Return, for each piece of vertices of a divided region, the connected part of cells there."""
    kind = kind_of(regions.cells)
    chosen = np.flatnonzero(is_divided[regions.labels])
    labels = regions.labels[chosen]
    corners, offsets = regions.corners.of(chosen)
    cells = kind.with_corners(
        regions.cells, regions.cells.vertices, corners, offsets, regions.cells.bounds
    )
    graph, _ = kind.build_graph(cells, False, n_threads)
    parts, _ = _core.find_components(graph.offsets, graph.neighbors, labels)
    sizes = np.diff(offsets)
    is_own = np.repeat(labels, sizes) == found[corners]
    part_of_piece = np.full(int(pieces.max()) + 1, -1, np.int32)
    part_of_piece[pieces[corners[is_own]]] = np.repeat(parts, sizes)[is_own]
    return part_of_piece
