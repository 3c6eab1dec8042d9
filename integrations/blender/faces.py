"""What the extension does without Blender: arrays in, arrays out."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import Mesh, PolygonMesh, Segmentation, Weights, segment

__all__ = ["border_edges", "face_sets", "polygons_of", "segment_polygons"]


def polygons_of(
    positions: npt.NDArray[np.float32],
    loop_starts: npt.NDArray[np.int32],
    loop_vertices: npt.NDArray[np.int32],
    matrix: npt.NDArray[np.float64],
) -> Mesh | PolygonMesh:
    """Return the polygons of a mesh of Blender, as large as its object is in the scene.

    Parameters
    ----------
    positions : ndarray, shape (V, 3)
        Of the vertices, in the space of the object.
    loop_starts : ndarray of integers, shape (F,)
        First corner of each polygon; those of one follow those of the one before it.
    loop_vertices : ndarray of integers, shape (C,)
        Vertex of each corner.
    matrix : ndarray, shape (3, 3) or (4, 4)
        From the space of the object to that of the scene: what is scaled more along one axis has
        other regions. Where it has no inverse, the space of the object is taken.
    """
    turn = np.asarray(matrix, dtype=np.float64)[:3, :3]
    vertices = np.asarray(positions, dtype=np.float64)
    if np.linalg.matrix_rank(turn) == 3:
        vertices = vertices @ turn.T
    offsets = np.append(loop_starts, len(loop_vertices)).astype(np.int64)
    if (np.diff(offsets) == 3).all():
        return Mesh(vertices, loop_vertices.reshape(-1, 3))
    return PolygonMesh(vertices, offsets, loop_vertices)


def segment_polygons(
    mesh: Mesh | PolygonMesh, n_segments: int, *, follow_ridges: float, keep_islands: bool
) -> Segmentation:
    """Return the regions of a mesh, no more than it has polygons.

    Parameters
    ----------
    follow_ridges : float
        What a convex edge counts against a groove of the same angle, 0 to 1: `eta_convex` of
        `segment`. Sharp edges between flat faces count 0.35 at least.
    keep_islands : bool
        Whether each part that touches no other has regions of its own.
    """
    return segment(
        mesh,
        min(n_segments, mesh.n_faces),
        weights=Weights(eta_convex=follow_ridges),
        islands="keep" if keep_islands else "nearest",
    )


def face_sets(labels: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the numbers of face sets, from 1: 0 is none in Blender."""
    return labels + np.int32(1)


def border_edges(
    loop_edges: npt.NDArray[Any],
    loop_starts: npt.NDArray[Any],
    labels: npt.NDArray[np.int32],
    n_edges: int,
) -> npt.NDArray[np.bool_]:
    """Whether polygons of different regions meet at each edge, shape (E,).

    `loop_edges` holds, for each corner, the edge to the next one.
    """
    sizes = np.diff(np.append(loop_starts, len(loop_edges)))
    corners = np.repeat(labels, sizes)
    lowest = np.full(n_edges, np.iinfo(np.int32).max, dtype=np.int32)
    highest = np.full(n_edges, np.iinfo(np.int32).min, dtype=np.int32)
    np.minimum.at(lowest, loop_edges, corners)
    np.maximum.at(highest, loop_edges, corners)
    return lowest < highest
