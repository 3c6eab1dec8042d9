"""How thick a body is below points of its surface: rays that are tried on every triangle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .._types import Floats, Ints

COS_GOLDEN, SIN_GOLDEN = -0.7373688780783197, 0.6754902942615237


def cone_of_rays(n_rays: int) -> tuple[Floats, Floats]:
    """Directions in a cone of 60 degrees about the z axis, (R, 3), and the weight of each."""
    directions, weights = [], []
    x, y = 1.0, 0.0
    for ray in range(n_rays):
        height = 1.0 - 0.5 * (ray + 0.5) / n_rays
        radius = math.sqrt(1.0 - height * height)
        directions.append([radius * x, radius * y, height])
        weights.append(1.0 / (math.atan2(radius, height) + 0.2))
        x, y = x * COS_GOLDEN - y * SIN_GOLDEN, x * SIN_GOLDEN + y * COS_GOLDEN
    return np.array(directions), np.array(weights)


def typical_length(lengths: Sequence[float], weights: Sequence[float]) -> float:
    """The weighted mean of the lengths within one standard deviation of the median."""
    given = np.array(lengths)
    median = float(np.median(given))
    is_kept = np.abs(given - median) <= given.std() + 1e-9 * median
    return float(np.average(given[is_kept], weights=np.array(weights)[is_kept]))


def ray_thickness(
    vertices: Floats,
    triangles: Ints,
    starts: Floats,
    axes: Floats,
    n_rays: int,
    least_distance: float = 0.0,
) -> Floats:
    """The thickness along inward unit vectors; NaN where fewer than a quarter of the rays leave."""
    corners = vertices[triangles]
    spokes = list(zip(*cone_of_rays(n_rays), strict=True))
    result = np.full(len(starts), np.nan)
    for i, (start, axis) in enumerate(zip(starts, axes, strict=True)):
        right, up = frame_about(axis)
        hits = [
            (first_exit(corners, start, d[0] * right + d[1] * up + d[2] * axis, least_distance), w)
            for d, w in spokes
        ]
        kept = [(length, weight) for length, weight in hits if length is not None]
        if len(kept) >= n_rays / 4:
            result[i] = typical_length(*zip(*kept, strict=True))
    return result


def frame_about(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors that make a right-handed frame with the axis (Duff et al., 2017)."""
    x, y, z = axis.tolist()
    sign = -1.0 if z < 0 else 1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    return (
        np.array([1.0 + sign * x * x * a, sign * b, -sign * x]),
        np.array([b, sign + y * y * a, -y]),
    )


def first_exit(corners: Floats, start: Floats, ray: Floats, least: float) -> float | None:
    """Distance to the first triangle, corners (F, 3, 3), if the ray leaves through its back."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = normals @ ray
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = np.einsum("ij,ij->i", normals, corners[:, 0] - start) / along
        is_hit = (along != 0) & (distances > least)
    at = start + np.where(is_hit, distances, 0.0)[:, None] * ray
    for side in range(3):
        edge = corners[:, (side + 1) % 3] - corners[:, side]
        inside = np.einsum("ij,ij->i", np.cross(edge, at - corners[:, side]), normals)
        is_hit &= inside >= -1e-12 * np.einsum("ij,ij->i", normals, normals)
    distances = np.where(is_hit, distances, np.inf)
    first = int(np.argmin(distances))
    is_exit = np.isfinite(distances[first]) and along[first] > 0
    return float(distances[first]) if is_exit else None
