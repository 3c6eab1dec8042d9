"""Stage 5: convert labels of cells to labels of vertices, with borders along creases."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..base.checks import check_extent, check_length, checked_classes
from ..base.errors import MeshError
from ..base.types import Array, Bools, Floats, Ints, Longs
from ..graph.kinds import kind_of, labels_of_corners
from ..graph.point_graph import PointGraph, point_surface
from ..graph.sums import Majority, weighted_majority
from ..mesh.faces import AnyMesh, Corners, mean_normals, vertex_graph
from ..mesh.weld import lowest_vertices
from ..weights.formulas import creases_of


class VertexEdges(NamedTuple):
    """Vertices of a mesh, or points, and edges in CSR form; apps that label vertices use it."""

    offsets: Longs  # (V + 1,) index in `neighbors` of the first edge of each vertex
    neighbors: Ints  # (M,) vertex at the other end of each edge
    positions: Floats  # (V, 3) position of each vertex
    normals: Floats  # (V, 3) mean unit normal of the faces around each vertex; 0 in a volume

    @classmethod
    def of_mesh(cls, mesh: AnyMesh, lowest: Ints, n_threads: int) -> VertexEdges:
        """Return the edges of a mesh between the vertices in `lowest`, see `lowest_vertices`."""
        graph = vertex_graph(mesh, lowest, n_threads)
        return cls(*graph[:2], mesh.vertices, mean_normals(mesh, lowest))

    def within(self, groups: Ints) -> VertexEdges:
        """Return the edges between vertices of the same group, (V,), which must be >= 0."""
        sources = np.repeat(np.arange(len(groups)), np.diff(self.offsets))
        is_kept = (groups[sources] == groups[self.neighbors]) & (groups[sources] >= 0)
        counts = np.bincount(sources[is_kept], minlength=len(groups))
        offsets = np.concatenate([[0], np.cumsum(counts)])
        return self._replace(offsets=offsets, neighbors=self.neighbors[is_kept])

    def count_segments(self, pairs: Ints, threshold: float, least: int, n_threads: int) -> int:
        """Return the number of segments of `least` or more vertices by Felzenszwalb's method.

        `threshold` is divided by the size of a segment. `pairs`, (E, 2), are the edges in the order
        in which edges of equal weight are visited. An edge and its reverse may differ in weight.
        """
        ends = np.ascontiguousarray(pairs, np.int32).ravel()
        if ends.size and not 0 <= ends.min() <= ends.max() < len(self.positions):
            raise ValueError(f"pairs must be vertices from 0 to {len(self.positions) - 1}")
        segments = _core.graph_segments(*self[2:], ends, threshold, least, n_threads)
        sizes = np.bincount(segments)[np.flatnonzero(np.bincount(segments[ends]))]
        return int(np.count_nonzero(sizes >= least))

    def grown(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Return new labels of all vertices, after growing regions to `least` vertices if possible.

        A small region takes vertices from neighboring regions, as long as these stay connected and
        keep `least` vertices. `counts` is the number of mesh vertices at each welded vertex. All
        vertices with edges must have a label >= 0.
        """
        given = self._checked(labels, counts)
        return given[0] if least < 2 else _core.grow_small_regions(*self, *given, least)

    def merged(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Merge small regions with neighbors, where `grown` enlarges them; keep the lower label."""
        given = self._checked(labels, counts)
        return given[0] if least < 2 else _core.merge_small_regions(*self, *given, least)

    def _checked(self, labels: Ints, counts: Ints) -> tuple[Ints, Ints, int]:
        """Return checked labels and counts, and the number of labels."""
        array = checked_classes(labels, len(self.positions), "labels", "vertex")
        check_length(counts, len(array), "counts", "vertex")
        return array, counts, int(array.max()) + 1

    def crease_weights(self, areas: Floats, n_regions: int, n_threads: int) -> tuple[Floats, float]:
        """Return the weights of edges as in `build_point_graph`, for `n_regions`, and their unit.

        Raises a MeshError if all points are at one position.
        """
        check_length(areas, len(self.positions), "areas", "point")
        bounds = np.array([self.positions.min(axis=0), self.positions.max(axis=0)])
        check_extent(bounds, "points", "cloud")
        graph = PointGraph(
            self.positions, areas, self.normals, self.offsets, self.neighbors,
            np.arange(len(areas), dtype=np.int32), bounds,
        )  # fmt: skip
        radius = float(np.sqrt(areas.sum() / (np.pi * n_regions)))
        return creases_of(point_surface(graph, n_threads), radius, 0.0), graph.diagonal


class _Regions(NamedTuple):
    """Cells (faces or tetrahedra) of a mesh, their corners, and their labels."""

    cells: Any
    corners: Corners  # vertex at each corner of the cells, after welding of equal positions
    labels: Ints  # (N,) region of each cell, 0 to n - 1
    n: int  # number of regions, some of which may have no cells
    votes: Bools  # whether each corner may get the label of its cell


def own_corners(cells: Any, corners: Corners, groups: Ints | None) -> Bools:
    """Return whether the group of each corner, from `groups` (V,), is the majority in its cell."""
    if groups is None:
        return np.ones(len(corners.vertices), bool)
    of_cells = labels_of_corners(cells, groups)
    return np.asarray(np.repeat(of_cells, corners.sizes) == groups[corners.vertices])


def crease_labels(
    cells: Any, labels: Ints, n_labels: int, n_threads: int, *, least: int = 1,
    groups: Ints | None = None,
) -> Ints:  # fmt: skip
    """Convert labels of cells, -1 to `n_labels` - 1, to labels of vertices along creases."""
    found = np.full(cells.n_vertices, -1, np.int32)
    if labels.max() < 0:
        return found
    cells, labels = _labeled_part(cells, labels)
    lowest = lowest_vertices(cells.vertices, True, n_threads)
    corners = corners_in(cells)
    edges = VertexEdges.of_mesh(cells, lowest, n_threads)
    welded = Corners(lowest[corners.vertices], corners.size, corners.offsets)
    groups = None if groups is None else groups[lowest]
    regions = _Regions(cells, welded, labels, n_labels, own_corners(cells, welded, groups))
    if groups is not None:
        edges = edges.within(groups)
    of_positions = _labels_along_creases(edges, regions, n_threads)
    if groups is not None:  # vertices that no label reaches
        edges = edges.within(np.where(of_positions < 0, np.int32(-1), groups))
    is_used = np.zeros(cells.n_vertices, bool)
    is_used[corners.vertices] = True
    counts = np.bincount(lowest[is_used], minlength=cells.n_vertices).astype(np.int32)
    of_positions = edges.grown(of_positions, counts, least)
    found[is_used] = of_positions[lowest[is_used]]
    return found


def corners_in(cells: Any) -> Corners:
    """Return the vertices at the corners of cells; raise a MeshError for points and graphs."""
    kind = kind_of(cells)
    corners = kind.corners(cells)
    if corners is None:
        raise MeshError(f"labels of vertices need a mesh, got {kind.plural} without vertices")
    return corners


def _labeled_part(cells: Any, labels: Ints) -> tuple[Any, Ints]:
    """Return a mesh of the cells with a label >= 0, which keeps all vertices, and their labels."""
    if labels.min() >= 0:
        return cells, labels
    kept = np.flatnonzero(labels >= 0)
    kind = kind_of(cells)
    corners, offsets = corners_in(cells).of(kept)
    return kind.with_corners(cells, cells.vertices, corners, offsets, cells.bounds), labels[kept]


def _labels_along_creases(edges: VertexEdges, regions: _Regions, n_threads: int) -> Ints:
    """Return the label of each welded vertex; Prim's algorithm labels vertices at borders.

    Seeds are inside each region, or where it has the majority. Stray pieces are then labeled again.
    """
    majority, at_border = _majority(regions, len(edges.positions), n_threads)
    inside = majority[~at_border]
    has_inside = np.bincount(inside[inside >= 0], minlength=regions.n) > 0
    seeds = np.where(at_border & has_inside[majority], np.int32(-1), majority)
    is_free = regions.votes & (seeds < 0)[regions.corners.vertices]
    of_corners = np.repeat(regions.labels, regions.corners.sizes)[is_free]
    own = np.unique(regions.corners.vertices[is_free].astype(np.int64) * regions.n + of_corners)
    found = _core.spread_labels(*edges, seeds, majority, own, regions.n)
    found = np.where(found < 0, majority, found)  # no seed within reach
    found[_in_stray_pieces(edges, regions, found, n_threads)] = -1
    return _core.spread_labels(*edges, found, majority, np.empty(0, np.int64), regions.n)


def _majority(regions: _Regions, n_vertices: int, n_threads: int) -> Majority:
    """Return the label with the largest area at each vertex; each region has one if possible."""
    vertices, sizes = regions.corners.vertices[regions.votes], regions.corners.sizes
    of_corners = np.repeat(regions.labels, sizes)[regions.votes]
    measures = kind_of(regions.cells).measures(regions.cells, n_threads)
    areas = np.repeat(measures, sizes)[regions.votes]
    winners, is_divided = weighted_majority(vertices, of_corners, areas, n_vertices)
    winners = _core.share_vertices(vertices, of_corners, winners, regions.n, n_threads)
    return Majority(winners, is_divided)


def _in_stray_pieces(edges: VertexEdges, regions: _Regions, found: Ints, n_threads: int) -> Array:
    """Return whether each vertex is in a stray piece of its region and must be labeled again.

    Each connected part of a region's cells keeps its largest set of connected vertices. All smaller
    sets are stray.
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
        order = divided[np.lexsort((-divided, np.bincount(pieces, minlength=n_pieces)[divided]))]
        largest = np.empty(int(part_of_piece.max()) + 1, np.int64)
        largest[part_of_piece[order]] = order  # if indices are equal, the last value counts
        is_stray[largest[part_of_piece[divided]]] = False
    return is_stray[pieces]


def _part_of_piece(
    regions: _Regions, is_divided: Array, found: Ints, pieces: Ints, n_threads: int
) -> Ints:
    """Return the number of each piece's connected part, or -1 if its region is not divided."""
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
