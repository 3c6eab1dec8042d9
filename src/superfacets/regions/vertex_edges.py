"""Stage 5: vertices of a mesh or points, with edges between them, for regions of vertices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.checks import check_spread
from ..base.types import Floats, Ints, Longs
from ..graph.cell_graph import CellGraph
from ..graph.point_graph import PointGraph, point_surface
from ..graph.surface import NO_NORMALS
from ..mesh.faces import AnyMesh, mean_normals, vertex_graph
from ..weights.formulas import WEIGHTS, EdgeFactors, weights_of


class VertexEdges(NamedTuple):
    """Vertices of a mesh, or points, and the edges between them in CSR form, in both directions.

    Apps that label vertices or points use it to segment them, and to change small regions.
    """

    offsets: Longs  # (V + 1,) index in `neighbors` of the first edge of each vertex
    neighbors: Ints  # (M,) vertex at the other end of each edge
    positions: Floats  # (V, 3) position of each vertex
    normals: Floats  # (V, 3) mean unit normal of the faces around each vertex; 0 in a volume

    @classmethod
    def of_mesh(cls, mesh: AnyMesh, lowest: Ints, n_threads: int) -> VertexEdges:
        """Return the vertices of a mesh; `lowest` is a result of `lowest_vertices`.

        Vertices that are not in `lowest` have no edges, and the normal 0.
        """
        graph = vertex_graph(mesh, lowest, n_threads)
        return cls(*graph[:2], mesh.vertices, mean_normals(mesh, lowest))

    @classmethod
    def of_pairs(cls, positions: Floats, normals: Floats, pairs: Ints) -> VertexEdges:
        """Return points that edges join; `pairs`, (E, 2), may have duplicates and loops."""
        n = len(positions)
        first, second = np.concatenate([pairs, pairs[:, ::-1]]).T.astype(np.int64)
        sources, targets = np.divmod(np.unique((first * n + second)[first != second]), n)
        offsets = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=n))])
        return cls(offsets.astype(np.int64), targets.astype(np.int32), positions, normals)

    def count_segments(self, pairs: Ints, threshold: float, least: int, n_threads: int) -> int:
        """Return how many segments of `least` or more vertices the usual method for scans finds.

        This is the method of Felzenszwalb and Huttenlocher (2004) with the weights of Karpathy et
        al. (2013); `threshold` is divided by the size of a segment. `pairs`, (E, 2), are the edges
        in the order in which edges of equal weight are visited; the weights of an edge and of its
        reverse may differ, so both may be in `pairs`. Time is O(E log V).
        """
        ends = np.ascontiguousarray(pairs, np.int32).ravel()
        if ends.size and not 0 <= ends.min() <= ends.max() < len(self.positions):
            raise ValueError(f"pairs must be vertices from 0 to {len(self.positions) - 1}")
        return _core.count_graph_segments(
            self.positions, self.normals, ends, threshold, least, n_threads
        )

    def grown(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Grow regions of vertices to `least` vertices, and return the new labels of all vertices.

        A small region takes vertices from neighboring regions, as long as these stay connected and
        keep `least` vertices. A region that cannot get enough vertices does not change. `counts`
        is the number of mesh vertices at each welded vertex. All vertices with edges must have a
        label >= 0.
        """
        size = (counts, int(labels.max()) + 1, least)
        return labels if least < 2 else _core.grow_small_regions(*self, labels, *size)

    def merged(self, labels: Ints, counts: Ints, least: int) -> Ints:
        """Merge regions with fewer than `least` vertices with neighbors; return the new labels.

        The new region gets the lower of the two labels. Arguments are the same as in `grown`.
        """
        size = (counts, int(labels.max()) + 1, least)
        return labels if least < 2 else _core.merge_small_regions(*self, labels, *size)

    def cell_graph(self, n_regions: int, n_threads: int) -> CellGraph:
        """Return the graph of the points, whose arcs have `crease_weights` for `n_regions` regions.

        The areas around points are computed from the lengths of their edges as in
        `build_point_graph`. Raises a MeshError if all points are at one position.
        """
        bounds = np.array([self.positions.min(axis=0), self.positions.max(axis=0)])
        check_spread(bounds)
        counts = np.diff(self.offsets)
        sources = np.repeat(np.arange(len(counts)), counts)
        steps = self.positions[self.neighbors] - self.positions[sources]
        squares = np.bincount(sources, np.einsum("ij,ij->i", steps, steps), len(counts))
        areas = 2 * np.pi * squares / np.maximum(counts * (counts + 1), 1)
        graph = PointGraph(
            self.positions, areas, self.normals, self.offsets, self.neighbors,
            np.arange(len(counts), dtype=np.int32), bounds,
        )  # fmt: skip
        creases = WEIGHTS["creases"].defaults
        radius = float(np.sqrt(areas.sum() / (np.pi * n_regions)))
        factors = EdgeFactors.of_radius(radius, creases["alpha"], creases["eta_convex"])
        cells = (graph.positions, graph.measures, NO_NORMALS)
        weights = weights_of(point_surface(graph, n_threads), cells, factors)
        return CellGraph(
            graph.positions, areas, graph.offsets, graph.neighbors, weights, bounds,
            weight_unit=graph.diagonal,
        )  # fmt: skip
