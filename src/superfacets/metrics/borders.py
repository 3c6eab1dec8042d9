"""Find the borders of regions, and metrics that compare them with those of true segments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.checks import checked_threads
from ..base.types import Floats, Ints
from ..graph.constraints import edge_keys, edge_lengths, edges_of_keys
from ..graph.face_graph import FaceGraph, build_face_graph
from ..graph.sums import positive_total, sums_by_label
from ..graph.surface import Surface
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, corners_of, vertex_graph
from ..mesh.weld import lowest_vertices

DEFAULT_TOLERANCE = 0.01
"""Default tolerance, as a fraction of the diagonal of the bounding box. This is about a third of
the radius of a region if a compact object has 150 regions."""

_POINT = 1e-12
"""If the mean radius is at most this fraction of the diagonal, `MeshEdges` treats it as 0."""


@dataclass(frozen=True)
class EdgePaths:
    """Graph for shortest paths along the edges of a mesh."""

    graph: _core.OrderedGraph  # nodes are the vertices that have edges; path lengths are integers
    unit: float  # unit of path lengths in `graph`, as a length on the mesh
    nodes: Ints  # (V,) node of each vertex in the graph, or -1 if the vertex has no edges
    n_threads: int

    @classmethod
    def of(cls, mesh: FaceMesh, representative: Ints, n_threads: int) -> EdgePaths:
        """Build the graph of edges between vertices, each replaced by its `representative`."""
        offsets, neighbors, edge_lengths = vertex_graph(mesh, representative, n_threads)
        has_edges = np.diff(offsets) > 0
        nodes = np.where(has_edges, np.cumsum(has_edges, dtype=np.int32) - np.int32(1), -1)
        used = np.flatnonzero(has_edges)
        lengths, unit = _core.quantize_weights(edge_lengths, n_threads)
        graph = _core.OrderedGraph(
            _core.PlacedCells(mesh.vertices[used], np.ones(len(used)), n_threads),
            np.append(offsets[:-1][has_edges], offsets[-1:]), nodes[neighbors], lengths, n_threads,
        )  # fmt: skip
        return cls(graph, unit, nodes, n_threads)

    def distances(self, sources: Ints) -> Floats:
        """Return the distance of each vertex from a source along edges, (V,); infinity if none."""
        distances = np.full(len(self.nodes), np.inf)
        if len(sources):
            paths = _core.Clustering(self.graph, self.nodes[sources], np.inf, self.n_threads)
            # `Clustering` adds sources, with higher labels, in components without a source.
            reached = np.where(paths.labels() < len(sources), paths.lengths() * self.unit, np.inf)
            has_edges = self.nodes >= 0
            distances[has_edges] = reached[self.nodes[has_edges]]
        return distances


@dataclass(frozen=True, eq=False)
class MeshEdges:
    """A mesh, the graph of its faces, and shortest paths along its edges, for border metrics."""

    mesh: FaceMesh
    graph: FaceGraph
    surface: Surface
    representative: Ints  # (V,) lowest index of a vertex at the same position

    @classmethod
    def of(cls, source: MeshLike, *, weld: float, n_threads: int | None) -> MeshEdges:
        """Convert `source` to a mesh and build its face graph; for `weld`, see `segment`."""
        mesh = as_mesh(source)
        threads = checked_threads(n_threads)
        graph = build_face_graph(mesh, weld=weld, n_threads=threads)
        representative = lowest_vertices(mesh.vertices, weld, threads)
        return cls(mesh, graph, Surface.of_faces(mesh, graph, threads), representative)

    @property
    def areas(self) -> Floats:
        """Area of each face, shape (F,)."""
        return self.graph.measures

    @cached_property
    def paths(self) -> EdgePaths:
        """Graph for shortest paths along edges, which is built at the first access."""
        return EdgePaths.of(self.mesh, self.representative, self.surface.n_threads)

    @cached_property
    def mean_radius(self) -> float:
        """Mean distance of face centroids from the centroid of the mesh, weighted by area.

        If all face centroids coincide, the value is the diagonal of the bounding box instead.
        """
        total = positive_total(self.areas)
        centroid = self.areas @ self.graph.positions / total
        radius = float(self.areas @ np.linalg.norm(self.graph.positions - centroid, axis=1)) / total
        return radius if radius > _POINT * self.graph.diagonal else self.graph.diagonal


class Borders(NamedTuple):
    """Vertices at borders. A border consists of edges between faces with different labels."""

    vertices: Ints
    """Distinct end vertices of the border edges in ascending order, shape (B,)."""
    lengths: Floats
    """Half the total length of the border edges at each vertex, shape (B,)."""


def find_borders(mesh: MeshEdges, labels: Ints) -> Borders:
    """Return the borders between labels of faces, without the boundary and faces labeled -1."""
    graph = mesh.graph
    sources = graph.sources
    start, end = labels[sources], labels[graph.neighbors]
    arcs = np.flatnonzero((start != end) & (start >= 0) & (end >= 0))
    ends = corners_of(mesh.mesh).ends_of_sides(sources[arcs], graph.sides[arcs])
    keys = np.unique(edge_keys(mesh.representative[ends]))
    vertices, indices = np.unique(edges_of_keys(keys), return_inverse=True)
    halves = np.repeat(0.5 * edge_lengths(mesh.mesh, keys), 2)
    return Borders(vertices, sums_by_label(indices.ravel(), halves, len(vertices)))


@dataclass(frozen=True, eq=False)
class Cuts:
    """Borders between labels, and the distance of each vertex from the nearest border.

    Distances are infinite at vertices without a path to a border, and at welded vertices other than
    `MeshEdges.representative`.
    """

    borders: Borders
    distances: Floats  # (V,) length of the shortest path along edges to a border

    @classmethod
    def of(cls, mesh: MeshEdges, labels: Ints) -> Cuts:
        """Find the borders between labels, and compute the distances of all vertices from them."""
        borders = find_borders(mesh, labels)
        return cls(borders, mesh.paths.distances(borders.vertices))


def boundary_agreement(
    mesh: MeshEdges, found: Cuts, true: Cuts, tolerance: float
) -> tuple[float, float]:
    """Return the recall and the precision of the borders of regions; 1 is best.

    Martin, Fowlkes and Malik, "Learning to detect natural image boundaries", 2004. The recall is
    the fraction of true borders whose distance from borders of regions is at most `tolerance` times
    the diagonal; 1 without true borders. The precision exchanges the roles. Distances are measured
    along edges, so they exceed geodesic distances, and from both ends of each border edge.
    """
    within = tolerance * mesh.graph.diagonal
    recall = _fraction_near(true.borders, found.distances, within)
    return recall, _fraction_near(found.borders, true.distances, within)


def cut_discrepancy(mesh: MeshEdges, found: Cuts, true: Cuts) -> float:
    """Return the relative distance between borders of regions and true borders; 0 is best.

    Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009: the mean
    distance from borders of regions to true borders, plus the reverse, as a multiple of
    `MeshEdges.mean_radius`. Where no path leads to a border, the distance is the diagonal of the
    bounding box. If there are no borders to measure from, a mean distance is 0.
    """
    farthest = mesh.graph.diagonal
    there = _mean_distance(found.borders, true.distances, farthest)
    return (there + _mean_distance(true.borders, found.distances, farthest)) / mesh.mean_radius


def _fraction_near(borders: Borders, distances: Floats, within: float) -> float:
    total = float(borders.lengths.sum())
    if not total > 0:
        return 1.0
    return float(borders.lengths[distances[borders.vertices] <= within].sum()) / total


def _mean_distance(borders: Borders, distances: Floats, farthest: float) -> float:
    total = float(borders.lengths.sum())
    if not total > 0:
        return 0.0
    reached = distances[borders.vertices]
    return float(borders.lengths @ np.where(np.isinf(reached), farthest, reached)) / total
