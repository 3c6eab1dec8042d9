"""Sort cells along a space-filling curve, so that results do not depend on their order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.types import Floats, Ints, Longs
from ..mesh.faces import Corners
from ..mesh.weld import lowest_vertices


class SortedCorners(NamedTuple):
    """Vertices and cells of a mesh, both sorted along a space-filling curve."""

    vertices: Floats  # (V', 3) sorted positions, without duplicates if vertices were welded
    corners: Ints  # (C,) vertex at each corner, as an index in `vertices`, grouped by sorted cell
    offsets: Longs  # (N + 1,) first corner of each sorted cell; empty if `Corners.size` is not None
    order: Ints  # (N,) index in the input of each sorted cell
    places: Ints  # (V,) index in `vertices` of each vertex of the input


def sorted_corners(
    vertices: Floats, corners: Corners, weld: float, n_threads: int, *, are_faces: bool
) -> SortedCorners:
    """Sort vertices and cells, after welding; each face begins with its lowest vertex.

    The result does not depend on the order of the input, except for `order`, and for vertices at
    the same position that are not welded. Corners of cells that are not faces are sorted.
    """
    chosen = _representatives(vertices, weld, n_threads)
    return SortedCorners(*_core.sort_mesh(vertices, chosen, *corners.lists, are_faces, n_threads))


def _representatives(vertices: Floats, weld: float, n_threads: int) -> Ints:
    """Return the vertex with the lowest position that is welded to each vertex, (V,)."""
    if isinstance(weld, bool):
        return lowest_vertices(vertices, weld, n_threads)
    order = np.lexsort(vertices.T).astype(np.int32)
    chosen = np.empty_like(order)
    chosen[order] = order[lowest_vertices(vertices[order], weld, n_threads)]
    return chosen
