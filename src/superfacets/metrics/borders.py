"""Where regions of a mesh meet: its border edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._types import Floats, Ints
from ..cells.sums import sums_by_label
from .edges import MeshEdges

__all__ = ["Borders", "find_borders"]


class Borders(NamedTuple):
    """The edges between faces of different labels, as points that stand for lengths.

    Each edge is there by its two ends, each of which stands for half of it.
    """

    vertices: Ints
    """Ends of border edges, ascending, none twice, shape (B,)."""
    lengths: Floats
    """Length of border that each stands for, in the unit of the vertices."""


def find_borders(mesh: MeshEdges, labels: Ints) -> Borders:
    """Return the borders between labels; the boundary of an open mesh is none."""
    graph = mesh.graph
    sources = np.repeat(np.arange(graph.n_cells, dtype=np.int32), np.diff(graph.offsets))
    arcs = np.flatnonzero(labels[sources] != labels[graph.neighbors])
    edges = _distinct(mesh.ends_of(sources[arcs], graph.sides[arcs]), mesh.mesh.n_vertices)
    lengths = mesh.lengths_of(edges)
    vertices, places = np.unique(edges, return_inverse=True)
    halves = np.repeat(0.5 * lengths, 2)
    return Borders(vertices, sums_by_label(places.ravel(), halves, len(vertices)))


def _distinct(edges: Ints, n_vertices: int) -> Ints:
    keys = np.unique(edges[:, 0].astype(np.int64) * n_vertices + edges[:, 1])
    return np.stack([keys // n_vertices, keys % n_vertices], axis=1).astype(np.int32)
