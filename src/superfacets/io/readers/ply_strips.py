"""The triangles of the strips that some PLY files hold in place of faces."""

from __future__ import annotations

import numpy as np

from ..._types import Array, Longs
from ...errors import MeshError

__all__ = ["STRIPS", "triangles_of_strips"]

STRIPS = "tristrips"
"""Name of the element; each row is a list of vertices."""

RESTART = -1
"""Stands in a list where one strip ends and the next begins."""


def triangles_of_strips(lengths: Array, corners: Array) -> Longs:
    """Triangles, (F, 3), in the order of the strips: each vertex from the third on makes one.

    Every other triangle of a strip is turned, so that all have the orientation of the first.
    Triangles that name a vertex twice, by which some programs tie strips together, are kept: what
    other programs count as the faces of the file, and labels for these, stay in step.
    """
    begins = np.zeros(len(corners) + 1, dtype=bool)
    begins[np.cumsum(lengths, dtype=np.int64)] = True
    begins = begins[:-1] if len(corners) else begins[:0]
    is_restart = corners == RESTART
    begins[1:] |= is_restart[:-1]
    begins[:1] = True
    # The place of each corner in its strip.
    places = np.arange(len(corners))
    places -= np.maximum.accumulate(np.where(begins, places, 0))
    ends = np.flatnonzero((places >= 2) & ~is_restart)
    if not len(ends):
        raise MeshError("the PLY file has no faces: no strip has three vertices")
    triangles = np.stack([corners[ends - 2], corners[ends - 1], corners[ends]], axis=1)
    is_turned = places[ends] % 2 == 1
    triangles[is_turned] = triangles[is_turned][:, [1, 0, 2]]
    return triangles.astype(np.int64)
