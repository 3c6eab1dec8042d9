"""Edges of a mesh, paths along them, and the border edges of labels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints
from .._validate import checked_threads
from ..adapters.convert import MeshLike, as_mesh
from ..cells.face_graph import FaceGraph, build_face_graph
from ..cells.sums import positive_total, sums_by_label
from ..cells.surface import Surface
from ..mesh.cells import lowest_vertices
from ..mesh.faces import FaceMesh, ends_of_sides, vertex_graph

_POINT = 1e-12
"""Fraction of the diagonal up to which the mean radius of a mesh is a rounding error."""


@dataclass(frozen=True)
class EdgePaths:
    """Paths along the edges of a mesh, from vertex to vertex."""

    graph: _core.OrderedGraph  # cells are vertices with edges, arcs are edges
    unit: float  # unit of the integer path lengths of the graph
    places: Ints  # (V,) cell of each vertex in the graph; -1 for a vertex without edges
    n_threads: int

    @classmethod
    def of(cls, mesh: FaceMesh, representative: Ints, n_threads: int) -> EdgePaths:
        """Order the vertices of a mesh for paths along its edges."""
        offsets, neighbors, edge_lengths = vertex_graph(mesh, representative, n_threads)
        has_edges = np.diff(offsets) > 0
        places = np.where(has_edges, np.cumsum(has_edges, dtype=np.int32) - np.int32(1), -1)
        used = np.flatnonzero(has_edges)
        lengths, unit = _core.quantize_weights(edge_lengths, n_threads)
        graph = _core.OrderedGraph(
            _core.PlacedCells(mesh.vertices[used], np.ones(len(used)), n_threads),
            np.append(offsets[:-1][has_edges], offsets[-1:]),
            places[neighbors],
            lengths,
            n_threads,
        )
        return cls(graph, unit, places, n_threads)

    def distances(self, sources: Ints) -> Floats:
        """Return the length of the shortest path from any source to each vertex, shape (V,).

        A distance is infinite if there is no path.
        """
        distances = np.full(len(self.places), np.inf)
        if len(sources):
            paths = _core.Clustering(self.graph, self.places[sources], np.inf, self.n_threads)
            # Unreached vertices become sources with labels above the labels of the given sources.
            is_reached = paths.labels() < len(sources)
            reached = np.where(is_reached, paths.lengths() * self.unit, np.inf)
            has_edges = self.places >= 0
            distances[has_edges] = reached[self.places[has_edges]]
        return distances


@dataclass(frozen=True, eq=False)
class MeshEdges:
    """A mesh with its faces as cells, and its edges."""

    mesh: FaceMesh
    graph: FaceGraph
    surface: Surface
    representative: Ints  # (V,) lowest vertex at the same position

    @classmethod
    def of(cls, source: MeshLike, *, weld: bool, n_threads: int | None) -> MeshEdges:
        """Build the face graph; arguments as for `segment`."""
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
        """Paths along the edges, computed on first use, because not all metrics need paths."""
        return EdgePaths.of(self.mesh, self.representative, self.surface.n_threads)

    @cached_property
    def mean_radius(self) -> float:
        """Mean distance of face centroids from their mean position, weighted by area, > 0.

        If all centroids coincide, as for a single face, the diagonal of the bounding box.
        """
        total = positive_total(self.areas)
        centroid = self.areas @ self.graph.positions / total
        offsets = np.linalg.norm(self.graph.positions - centroid, axis=1)
        radius = float(self.areas @ offsets) / total
        return radius if radius > _POINT * self.graph.diagonal else self.graph.diagonal

    def ends_of(self, faces: Ints, sides: Array) -> Ints:
        """Return the ends of the given sides of faces, the lower vertex first, shape (n, 2)."""
        return np.sort(self.representative[ends_of_sides(self.mesh, faces, sides)], axis=1)

    def lengths_of(self, edges: Ints) -> Floats:
        """Return the lengths of edges given by their ends."""
        start, end = self.mesh.vertices[edges[:, 0]], self.mesh.vertices[edges[:, 1]]
        return np.asarray(np.linalg.norm(end - start, axis=1))


class Borders(NamedTuple):
    """Border edges (edges between faces of different labels) as weighted points.

    Each end of a border edge represents half of its length.
    """

    vertices: Ints
    """Ends of border edges, ascending and distinct, shape (B,)."""
    lengths: Floats
    """Length of border per point, in the unit of the vertices."""


def find_borders(mesh: MeshEdges, labels: Ints) -> Borders:
    """Return the borders between labels, without the boundary of an open mesh."""
    graph = mesh.graph
    sources = graph.sources
    arcs = np.flatnonzero(labels[sources] != labels[graph.neighbors])
    edges = _distinct(mesh.ends_of(sources[arcs], graph.sides[arcs]), mesh.mesh.n_vertices)
    lengths = mesh.lengths_of(edges)
    vertices, places = np.unique(edges, return_inverse=True)
    halves = np.repeat(0.5 * lengths, 2)
    return Borders(vertices, sums_by_label(places.ravel(), halves, len(vertices)))


def _distinct(edges: Ints, n_vertices: int) -> Ints:
    keys = np.unique(edges[:, 0].astype(np.int64) * n_vertices + edges[:, 1])
    return np.stack([keys // n_vertices, keys % n_vertices], axis=1).astype(np.int32)
