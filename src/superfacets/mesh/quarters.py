"""Each triangle split into four."""

from __future__ import annotations

import numpy as np

from .._types import Array, Floats, Ints


def split_in_four(vertices: Floats, faces: Array) -> tuple[Floats, Ints]:
    """Return vertices and faces with each face split at the middles of its sides.

    Neighbors share the middle of the edge between them. Orientation, area and shape stay; so do
    boundary and non-manifold edges. One sort of the sides: O(F log F).

    Parameters
    ----------
    vertices : ndarray of float64, shape (V, 3)
    faces : ndarray of int, shape (F, 3)

    Returns
    -------
    vertices : ndarray of float64, shape (V + E, 3)
        The old ones, then the middle of each edge.
    faces : ndarray of int32, shape (4 F, 3)
        Face f becomes 4 f to 4 f + 3: at corners 0, 1 and 2, and the middle one.

    Examples
    --------
    >>> vertices, faces = split_in_four(np.eye(3), np.array([[0, 1, 2]]))
    >>> faces.tolist()
    [[0, 3, 4], [3, 1, 5], [4, 5, 2], [3, 5, 4]]
    """
    corners = faces.astype(np.int64)
    ends = np.stack([corners, np.roll(corners, -1, axis=1)])  # of sides 0, 1, 2
    key_of_side = (ends.min(axis=0) * len(vertices) + ends.max(axis=0)).ravel()
    order = np.argsort(key_of_side)
    sorted_keys = key_of_side[order]
    is_first = np.diff(sorted_keys, prepend=-1) != 0
    edge_of_side = np.empty(len(order), dtype=np.int64)
    edge_of_side[order] = np.cumsum(is_first) - 1
    low, high = np.divmod(sorted_keys[is_first], len(vertices))
    middles = 0.5 * (vertices[low] + vertices[high])
    a, b, c = corners.T
    ab, bc, ca = len(vertices) + edge_of_side.reshape(-1, 3).T
    quarters = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([vertices, middles]), quarters.reshape(-1, 3).astype(np.int32)
