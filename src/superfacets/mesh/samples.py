"""Points spread evenly over the faces of a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Floats
from .faces import FaceMesh, cut_into_triangles

MAX_STEPS = 8
"""Parts of a side of a triangle: 64 samples tell which label most of a face has."""


class Samples(NamedTuple):
    """Points of the faces of a mesh."""

    points: Floats  # (S, 3)
    faces: Array  # (S,), of which each is a point
    areas: Floats  # (S,), that each stands for


def sample_faces(mesh: FaceMesh, n_samples: int, n_threads: int) -> Samples:
    """Return about n_samples points over the whole area, at least one per face.

    Each triangle is cut into n^2 equal ones, n from 1 to `MAX_STEPS`, whose centroids are the
    samples; with n = 1 that is the centroid of the triangle.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> triangle = Mesh([[0, 0, 0], [6, 0, 0], [0, 6, 0]], [[0, 1, 2]])
    >>> sample_faces(triangle, 1, 1).points.tolist()
    [[2.0, 2.0, 0.0]]
    >>> sample_faces(triangle, 4, 1).points[:, :2].tolist()
    [[1.0, 1.0], [1.0, 4.0], [4.0, 1.0], [2.0, 2.0]]
    """
    triangles, sources = cut_into_triangles(mesh)
    _, areas = _core.measure_faces(mesh.vertices, triangles, n_threads)
    total = float(areas.sum())
    shares = areas / total * n_samples if total > 0 else np.zeros(len(areas))
    n_steps = np.clip(np.rint(np.sqrt(shares)), 1, MAX_STEPS).astype(int)
    parts = []
    for n in np.unique(n_steps).tolist():
        chosen = np.flatnonzero(n_steps == n)
        faces = chosen if sources is None else sources[chosen]
        points = _centroids_of_parts(mesh.vertices[triangles[chosen]], n)
        parts.append((points, np.repeat(faces, n * n), np.repeat(areas[chosen] / n**2, n * n)))
    return Samples(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _centroids_of_parts(corners: Floats, n: int) -> Floats:
    """Centroids of the n^2 equal parts of each triangle, those of a triangle in a row."""
    i, j = np.mgrid[:n, :n].reshape(2, -1)
    upright = np.stack([i, j])[:, i + j < n] + 1 / 3
    turned = np.stack([i, j])[:, i + j < n - 1] + 2 / 3
    of_second, of_third = np.concatenate([upright, turned], axis=1)[..., np.newaxis] / n
    a, b, c = (corners[:, np.newaxis, corner] for corner in range(3))
    centroids = a + of_second * (b - a) + of_third * (c - a)
    return np.ascontiguousarray(centroids.reshape(-1, 3))
