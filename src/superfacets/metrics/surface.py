"""A mesh with what metrics need of it: which faces and which vertices share an edge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import checked_threads
from ..adapters.convert import as_mesh
from ..cells.face_graph import FaceGraph, build_face_graph
from ..mesh.triangle_mesh import Mesh

__all__ = ["EdgePaths", "Surface", "positive_total", "sums_by_label"]


@dataclass(frozen=True)
class EdgePaths:
    """Paths along the edges of a mesh, from vertex to vertex."""

    graph: _core.OrderedGraph  # of the vertices that have edges, with the lengths of those
    unit: float  # of path lengths
    places: npt.NDArray[np.int32]  # (V,) among these, -1 for a vertex that has none
    n_threads: int

    @classmethod
    def of(cls, mesh: Mesh, representative: npt.NDArray[np.int32], n_threads: int) -> EdgePaths:
        """Order the vertices of a mesh for paths along its edges."""
        offsets, neighbors, edge_lengths = _core.build_vertex_graph(
            mesh.vertices, mesh.faces, representative, n_threads
        )
        has_edges = np.diff(offsets) > 0
        places = np.where(has_edges, np.cumsum(has_edges, dtype=np.int32) - np.int32(1), -1)
        used = np.flatnonzero(has_edges)
        lengths, unit = _core.quantize_weights(edge_lengths, n_threads)
        graph = _core.OrderedGraph(
            mesh.vertices[used],
            np.ones(len(used)),
            np.append(offsets[:-1][has_edges], offsets[-1:]),
            places[neighbors],
            lengths,
            n_threads,
        )
        return cls(graph, unit, places, n_threads)

    def distances(self, sources: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
        """Length of the shortest way along edges from any source to each vertex, shape (V,).

        Infinite where there is no way.
        """
        distances = np.full(len(self.places), np.inf)
        if len(sources):
            paths = _core.Clustering(self.graph, self.places[sources], np.inf, self.n_threads)
            # Vertices that no source reaches have sources of their own, with labels beyond ours.
            is_reached = paths.labels() < len(sources)
            reached = np.where(is_reached, paths.lengths() * self.unit, np.inf)
            has_edges = self.places >= 0
            distances[has_edges] = reached[self.places[has_edges]]
        return distances


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh, the graph of its faces, and the paths along its edges."""

    mesh: Mesh
    graph: FaceGraph
    representative: npt.NDArray[np.int32]  # (V,) lowest vertex at the same position
    n_threads: int

    @classmethod
    def of(cls, mesh: object, *, weld: bool, n_threads: int | None) -> Surface:
        """Find out which faces share an edge; arguments as for `segment`."""
        mesh = as_mesh(mesh)
        threads = checked_threads(n_threads)
        graph = build_face_graph(mesh, weld=weld, n_threads=threads)
        if weld:
            representative = _core.weld_vertices(mesh.vertices, threads)
        else:
            representative = np.arange(mesh.n_vertices, dtype=np.int32)
        return cls(mesh, graph, representative, threads)

    @property
    def areas(self) -> npt.NDArray[np.float64]:
        """Area of each face, shape (F,)."""
        return self.graph.measures

    @cached_property
    def area(self) -> float:
        """Area of the surface, > 0.

        Raises
        ------
        ValueError
            If there is none.
        """
        return positive_total(self.areas)

    @cached_property
    def sources(self) -> npt.NDArray[np.int32]:
        """The face that each arc leaves, shape (M,)."""
        faces = np.arange(self.graph.n_cells, dtype=np.int32)
        return np.repeat(faces, np.diff(self.graph.offsets))

    @cached_property
    def edge_paths(self) -> EdgePaths:
        """Made when first asked for: not all metrics need it."""
        return EdgePaths.of(self.mesh, self.representative, self.n_threads)

    @cached_property
    def mean_radius(self) -> float:
        """Mean distance of the surface from its centroid, in the unit of the vertices."""
        centroid = self.areas @ self.graph.positions / self.area
        offsets = np.linalg.norm(self.graph.positions - centroid, axis=1)
        return float(self.areas @ offsets) / self.area

    def edges_of(
        self, faces: npt.NDArray[np.int32], sides: npt.NDArray[np.uint16]
    ) -> npt.NDArray[np.int32]:
        """Ends of these sides of faces, the lower vertex first, shape (n, 2)."""
        ends = np.stack(
            [self.mesh.faces[faces, sides], self.mesh.faces[faces, (sides + 1) % 3]], axis=1
        )
        return np.sort(self.representative[ends], axis=1)

    def lengths_of(self, edges: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
        """Lengths of edges given by their ends."""
        start, end = self.mesh.vertices[edges[:, 0]], self.mesh.vertices[edges[:, 1]]
        return np.asarray(np.linalg.norm(end - start, axis=1))


def positive_total(areas: npt.NDArray[np.float64]) -> float:
    """Sum of areas; a ValueError if it is 0."""
    total = float(areas.sum())
    if not total > 0:
        raise ValueError("the faces have no area to measure by")
    return total


def sums_by_label(
    labels: npt.NDArray[np.integer], values: npt.NDArray[np.float64], n_labels: int
) -> npt.NDArray[np.float64]:
    """Sum of the values of each label, shape (n_labels,)."""
    sums = np.bincount(labels, weights=values, minlength=n_labels)
    return np.asarray(sums, dtype=np.float64)
