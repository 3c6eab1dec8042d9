"""Every check of what users pass in, and the only place that converts it.

The core checks nothing: arrays that leave this module have the exact dtype and layout it expects.
"""

from __future__ import annotations

import math
import operator
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import MeshError

MAX_CELLS = 2**31 - 1
"""Cells, labels and vertices are int32 in the core."""

EXTENT_RANGE = (1e-60, 1e60)
"""Diagonals at which products of four edge lengths, down to 1e-8 of the diagonal, stay normal."""


def checked_vertices(vertices: Any) -> npt.NDArray[np.float64]:
    """Vertex positions as a contiguous (V, 3) float64 array; a MeshError if they are not."""
    array = _numeric_array(vertices, "vertices")
    if array.ndim != 2 or array.shape[1] != 3:
        raise MeshError(f"vertices must have shape (V, 3), got {array.shape}")
    if len(array) > MAX_CELLS:
        raise MeshError(f"the mesh has {len(array)} vertices; at most {MAX_CELLS} are supported")
    array = np.ascontiguousarray(array, dtype=np.float64)
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        raise MeshError(f"vertices[{first}] is not finite: {array[first].tolist()}")
    return array


def checked_faces(faces: Any, n_vertices: int) -> npt.NDArray[np.int32]:
    """Triangles as a contiguous (F, 3) int32 array of valid indices; a MeshError if they are not."""
    array = _numeric_array(faces, "faces")
    if array.size == 0:
        raise MeshError("the mesh has no faces")
    if array.ndim == 2 and array.shape[1] > 3:
        raise MeshError(f"faces have {array.shape[1]} corners; only triangles are supported yet")
    if array.ndim != 2 or array.shape[1] != 3:
        raise MeshError(f"faces must have shape (F, 3), got {array.shape}")
    if array.dtype.kind not in "iu":
        raise MeshError(f"faces must be integers, got {array.dtype}")
    if len(array) > MAX_CELLS:
        raise MeshError(f"the mesh has {len(array)} faces; at most {MAX_CELLS} are supported")
    if array.min() < 0 or array.max() >= n_vertices:
        _raise_index_error(array, n_vertices)
    return np.ascontiguousarray(array, dtype=np.int32)


def _raise_index_error(faces: npt.NDArray[Any], n_vertices: int) -> None:
    face, corner = np.argwhere((faces < 0) | (faces >= n_vertices))[0]
    raise MeshError(
        f"faces[{face}] refers to vertex {faces[face, corner]} but the mesh has {n_vertices} vertices"
    )


def check_extent(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]) -> None:
    """Raise a MeshError where the used vertices coincide, or span an absurd range."""
    low = np.array([axis[faces].min() for axis in vertices.T])
    high = np.array([axis[faces].max() for axis in vertices.T])
    if np.array_equal(low, high):
        raise MeshError("all faces lie at one point: the bounding box has no size")
    with np.errstate(over="ignore"):
        diagonal = float(np.max(high - low))
    if not EXTENT_RANGE[0] <= diagonal <= EXTENT_RANGE[1]:
        raise MeshError(
            f"the bounding box is {diagonal:.3g} across: rescale the mesh to between"
            f" {EXTENT_RANGE[0]:g} and {EXTENT_RANGE[1]:g}"
        )


def _numeric_array(value: Any, name: str) -> npt.NDArray[Any]:
    try:
        array = np.asarray(value)
    except ValueError as error:  # ragged nested lists
        raise MeshError(f"{name} must be a rectangular array: {error}") from None
    if array.dtype.kind not in "fiub" or array.dtype.kind == "b":
        raise MeshError(f"{name} must be numbers, got {array.dtype}")
    return array
