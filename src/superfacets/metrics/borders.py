"""Where regions meet: border edges, and the perimeters of regions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .surface import Surface, sums_by_label

__all__ = ["Borders", "find_borders", "region_perimeters"]


class Borders(NamedTuple):
    """The edges between faces of different labels, as points that stand for lengths.

    Each edge is there by its two ends, each of which stands for half of it.
    """

    vertices: npt.NDArray[np.int32]
    """Ends of border edges, ascending, none twice, shape (B,)."""
    lengths: npt.NDArray[np.float64]
    """Length of border that each stands for, in the unit of the vertices."""


def find_borders(surface: Surface, labels: npt.NDArray[np.int32]) -> Borders:
    """Return the borders between labels; the boundary of an open mesh is none."""
    arcs = np.flatnonzero(labels[surface.sources] != labels[surface.graph.neighbors])
    edges = surface.edges_of(surface.sources[arcs], surface.graph.sides[arcs])
    edges = _distinct(edges, surface.mesh.n_vertices)
    lengths = surface.lengths_of(edges)
    vertices, places = np.unique(edges, return_inverse=True)
    halves = np.repeat(0.5 * lengths, 2)
    return Borders(vertices, sums_by_label(places.ravel(), halves, len(vertices)))


def region_perimeters(
    surface: Surface, labels: npt.NDArray[np.int32], n_regions: int
) -> npt.NDArray[np.float64]:
    """Return the length of the border of each region, shape (K,).

    An edge counts once for each region on it that has not all of its faces, and for the region of
    the only face on it: the boundary of an open mesh counts.
    """
    graph = surface.graph
    has_arc = np.zeros((graph.n_cells, 3), dtype=bool)
    has_arc[surface.sources, graph.sides] = True
    open_faces, open_sides = np.nonzero(~has_arc)
    arcs = np.flatnonzero(labels[surface.sources] != labels[graph.neighbors])
    faces = np.concatenate([surface.sources[arcs], open_faces.astype(np.int32)])
    sides = np.concatenate([graph.sides[arcs], open_sides.astype(np.uint16)])
    edges = surface.edges_of(faces, sides)
    regions = labels[faces]
    # Around a non-manifold edge a region may have several of these arcs.
    keys = edges[:, 0].astype(np.int64) * surface.mesh.n_vertices + edges[:, 1]
    order = np.lexsort((regions, keys))
    is_first = np.ones(len(order), dtype=bool)
    is_first[1:] = (np.diff(keys[order]) != 0) | (np.diff(regions[order]) != 0)
    kept = order[is_first]
    return sums_by_label(regions[kept], surface.lengths_of(edges[kept]), n_regions)


def _distinct(edges: npt.NDArray[np.int32], n_vertices: int) -> npt.NDArray[np.int32]:
    keys = np.unique(edges[:, 0].astype(np.int64) * n_vertices + edges[:, 1])
    return np.stack([keys // n_vertices, keys % n_vertices], axis=1).astype(np.int32)
