"""Compute the input of the baseline methods: the weighted face graph and its components."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from superfacets import _core
from superfacets.base.checks import compact_partial_labels
from superfacets.base.timing import timed
from superfacets.base.types import Array, Floats, Ints, Longs
from superfacets.clustering.result import Segmentation
from superfacets.clustering.update import update_centers
from superfacets.graph.cell_graph import CellGraph
from superfacets.graph.face_graph import FaceGraph, build_face_graph
from superfacets.graph.size import checked_n_segments, radius_of
from superfacets.graph.surface import Surface
from superfacets.mesh.convert import MeshLike, as_mesh
from superfacets.mesh.faces import FaceMesh
from superfacets.weights.formulas import WeightOptions, arc_weights


@dataclass(frozen=True)
class Component:
    """A connected component of the face graph. Its n faces have local indices from 0 to n - 1."""

    faces: Longs  # (n,) indices of the faces in the mesh, in ascending order
    arcs: Longs  # (m,) indices of the arcs in the whole graph, sorted by their first face
    offsets: Longs  # (n + 1,) index in `arcs` of the first arc of each face, then m
    neighbors: Ints  # (m,) local index of the face to which each arc leads


@dataclass(frozen=True)
class FaceCells:
    """A mesh, its weighted face graph, and the timings and parameters collected so far."""

    mesh: FaceMesh
    faces: FaceGraph
    graph: CellGraph
    n_segments: int
    radius: float  # expected radius r of a region, in the unit of the vertices
    timings: dict[str, float]
    params: dict[str, Any]

    def components(self) -> list[Component]:
        """Return the connected components of the face graph, sorted by their lowest face index."""
        graph = self.graph
        no_labels = np.zeros(graph.n_cells, np.int32)
        piece, n_pieces = _core.find_components(graph.offsets, graph.neighbors, no_labels)
        by_piece = np.argsort(piece, kind="stable")
        local = np.empty(graph.n_cells, np.int64)  # local index of each face in its component
        components = []
        for faces in np.split(by_piece, np.cumsum(np.bincount(piece, minlength=n_pieces))[:-1]):
            local[faces] = np.arange(len(faces))
            counts = graph.offsets[faces + 1] - graph.offsets[faces]
            offsets = np.concatenate([[0], np.cumsum(counts)])
            arcs = np.arange(offsets[-1]) + np.repeat(graph.offsets[faces] - offsets[:-1], counts)
            neighbors = local[graph.neighbors[arcs]].astype(np.int32)
            components.append(Component(faces, arcs, offsets, neighbors))
        return components

    def segmentation(self, labels: Array, n_threads: int) -> Segmentation:
        """Return a `Segmentation` with `labels`, renumbered without gaps, and computed centers."""
        compact, _ = compact_partial_labels(labels, self.graph.n_cells)
        timings = dict(self.timings)
        with timed(timings, "update"):
            centers = update_centers(self.graph, compact, n_threads=n_threads)
        return Segmentation(compact, centers, 1, "converged", timings, dict(self.params))


def component_graph(cells: FaceCells, component: Component) -> CellGraph:
    """Return one component as a weighted cell graph."""
    graph = cells.graph
    return CellGraph(
        graph.positions[component.faces],
        graph.measures[component.faces],
        component.offsets,
        component.neighbors,
        graph.weights[component.arcs],
    )


def read_face_cells(
    mesh: MeshLike, n_segments: int | None, chosen: WeightOptions, weld: bool, n_threads: int
) -> FaceCells:
    """Read a mesh, and compute its face graph and arc weights as `superfacets.segment` does.

    One exception: if the caller gives an array of weights, an arc and its reverse arc get the mean
    of their weights.
    """
    timings: dict[str, float] = {}
    with timed(timings, "mesh"):
        surface = as_mesh(mesh)
    n_segments = checked_n_segments(n_segments, surface.n_faces)
    with timed(timings, "face_graph"):
        faces = build_face_graph(surface, weld=weld, n_threads=n_threads)
    with timed(timings, "weights"):
        radius = radius_of(faces.measures, n_segments, n_threads)
        weights = arc_weights(Surface.of_faces(surface, faces, n_threads), faces, radius, chosen)
        graph = faces.with_weights(weights.weights, n_threads=n_threads)
        if chosen.given is not None:
            graph = replace(graph, weights=_means_of_pairs(graph))
    params = {"n_segments": n_segments, "weld": weld, **chosen.params}
    return FaceCells(surface, faces, graph, n_segments, radius, timings, params)


def _means_of_pairs(graph: CellGraph) -> Floats:
    """Return, for each arc, the mean of the weights of the arc and its reverse arc."""
    there = np.lexsort((graph.neighbors, graph.sources))
    back = np.lexsort((graph.sources, graph.neighbors))
    weights = np.empty(graph.n_arcs)
    weights[there] = 0.5 * (graph.weights[there] + graph.weights[back])
    return weights
