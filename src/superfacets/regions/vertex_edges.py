"""Stage 5: vertices of a mesh or points, with edges between them, for regions of vertices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.checks import check_spread
from ..base.types import Floats, Ints, Longs
from ..graph.point_graph import PointGraph, point_surface
from ..mesh.faces import AnyMesh, mean_normals, vertex_graph
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

    def count_segments(self, pairs: Ints, threshold: float, least: int, n_threads: int) -> int:
        """Return the number of segments of `least` or more vertices by Felzenszwalb's method.

        `threshold` is divided by the size of a segment. `pairs`, (E, 2), are the edges in the order
        in which edges of equal weight are visited. An edge and its reverse may differ in weight.
        """
        ends = np.ascontiguousarray(pairs, np.int32).ravel()
        if ends.size and not 0 <= ends.min() <= ends.max() < len(self.positions):
            raise ValueError(f"pairs must be vertices from 0 to {len(self.positions) - 1}")
        return _core.count_graph_segments(
            self.positions, self.normals, ends, threshold, least, n_threads
        )

    def grown(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Return new labels of all vertices, after growing regions to `least` vertices if possible.

        A small region takes vertices from neighboring regions, as long as these stay connected and
        keep `least` vertices. `counts` is the number of mesh vertices at each welded vertex. All
        vertices with edges must have a label >= 0.
        """
        size = (counts, int(labels.max()) + 1, least)
        return labels if least < 2 else _core.grow_small_regions(*self, labels, *size)

    def merged(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Return new labels like `grown`, after merging regions of fewer than `least` vertices.

        A merged region gets the lower of the two labels.
        """
        size = (counts, int(labels.max()) + 1, least)
        return labels if least < 2 else _core.merge_small_regions(*self, labels, *size)

    def crease_weights(self, areas: Floats, n_regions: int, n_threads: int) -> tuple[Floats, float]:
        """Return the weights of edges as in `build_point_graph`, for `n_regions`, and their unit.

        Raises a MeshError if all points are at one position.
        """
        bounds = np.array([self.positions.min(axis=0), self.positions.max(axis=0)])
        check_spread(bounds)
        graph = PointGraph(
            self.positions, areas, self.normals, self.offsets, self.neighbors,
            np.arange(len(areas), dtype=np.int32), bounds,
        )  # fmt: skip
        radius = float(np.sqrt(areas.sum() / (np.pi * n_regions)))
        return creases_of(point_surface(graph, n_threads), radius, 0.0), graph.diagonal
