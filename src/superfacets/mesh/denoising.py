"""Removal of noise from the positions of meshes, before `segment` measures creases."""

from __future__ import annotations

import math
from typing import Literal, cast

import numpy as np

from .. import _core
from .._types import Floats, Ints
from .._validate import checked_count
from .cells import lowest_vertices
from .faces import (
    FaceMesh,
    VertexGraph,
    corners_in_a_row,
    face_sizes,
    mean_normals,
    mesh_like,
    vertex_graph,
)

Denoise = int | Literal["auto"] | None

AUTO_STEPS = 5
"""Number of smoothing steps that ``"auto"`` uses for noisy meshes. In synthetic rooms, borders are
better with 5 steps than with 2, 8 or 20 steps."""

NOISE_LIMIT = 0.05
"""Estimated noise, in mean edge lengths, from which ``"auto"`` smooths a mesh. On 32 benchmark
models, the estimate is at most 0.03. With added noise of 0.1, it is at least 0.08."""

NOISE_SCALE = 0.118
"""Ratio of the square root of the median product in `estimated_noise` to the noise. Measured on
closed meshes of equal triangles."""

STEPS_WITH_SLACK = 10
"""Minimum number of smoothing steps for which `slack_of` is not 0."""

LEAST_SLACK, SLACK_PER_STEP = 2.25, 0.1
"""Minimum of `slack_of`, and its increase per step, in degrees. They exceed three standard
deviations of the angles that remain on smoothed height fields. The fields had noise of 0.05 to 0.5
edge lengths, and 200 steps per edge length of noise."""

MOST_STEPS = 1000
"""Maximum number of smoothing steps. Far fewer steps already remove all details of a shape."""


def checked_denoise(denoise: object) -> Denoise:
    """Check the argument `denoise` of `segment`."""
    if denoise is None or denoise == "auto":
        return denoise
    if isinstance(denoise, str):
        raise ValueError(f"denoise must be 'auto', a number of steps, or None, got {denoise!r}")
    n_steps = checked_count(denoise, "denoise", low=0)
    if n_steps > MOST_STEPS:
        raise ValueError(f"denoise must be at most {MOST_STEPS}, got {n_steps}")
    return n_steps


def denoised(
    mesh: FaceMesh, denoise: int | Literal["auto"], *, weld: bool, n_threads: int
) -> tuple[FaceMesh, int]:
    """Return the mesh with smoothed vertex positions, and the number of smoothing steps.

    With ``"auto"``, the number of steps is 0 if the noise is below `NOISE_LIMIT`, else
    `AUTO_STEPS`. With `weld`, vertices at the same position stay at the same position.
    """
    if denoise == 0:
        return mesh, 0
    lowest = lowest_vertices(mesh.vertices, weld, n_threads)
    graph = vertex_graph(mesh, lowest, n_threads)

    def smoothed(n_steps: int) -> FaceMesh:
        positions = _core.taubin_smooth(
            mesh.vertices, graph.offsets, graph.neighbors, n_steps, n_threads
        )
        offsets = np.concatenate([[0], np.cumsum(face_sizes(mesh))])
        made = mesh_like(mesh, positions[lowest], corners_in_a_row(mesh), offsets)
        return cast(FaceMesh, made)

    if denoise == "auto":
        noise = 0.0
        if len(graph.lengths):
            products = noise_products(mesh.vertices, smoothed(1), graph, lowest)
            is_used = np.diff(graph.offsets) > 0
            noise = estimated_noise(products[is_used], float(graph.lengths.mean()))
        if not noise >= NOISE_LIMIT:
            return mesh, 0
        denoise = AUTO_STEPS
    return smoothed(denoise), denoise


def slack_of(n_steps: int) -> float:
    """Return the angle in radians below which edges of a smoothed mesh are treated as flat.

    After `n_steps` smoothing steps, small random angles remain at the edges. On regular grids,
    these angles would stretch regions along the diagonal.
    """
    degrees = max(LEAST_SLACK, SLACK_PER_STEP * n_steps)
    return math.radians(degrees) if n_steps >= STEPS_WITH_SLACK else 0.0


def noise_products(vertices: Floats, smooth: FaceMesh, graph: VertexGraph, lowest: Ints) -> Floats:
    """Multiply the signed distance of each vertex from `smooth` by the mean of its neighbors.

    If noise moves a vertex to one side of the smoothed surface, the neighbors of the vertex are on
    the other side, and the product is negative. Vertices without neighbors get the product 0.
    """
    normals = mean_normals(smooth, lowest)
    lengths = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)
    off = np.einsum("ij,ij->i", vertices - smooth.vertices, normals) / lengths
    n_neighbors, sums = np.diff(graph.offsets), np.zeros(len(vertices))
    is_used = n_neighbors > 0
    sums[is_used] = np.add.reduceat(off[graph.neighbors], graph.offsets[:-1][is_used])
    return np.asarray(off * sums / np.maximum(n_neighbors, 1))


def estimated_noise(products: Floats, mean_length: float) -> float:
    """Estimate the standard deviation of the noise in units of the mean edge length.

    The estimate is proportional to the square root of the median of the negated `noise_products`.
    Products are positive on curved parts and creases without noise, so the estimate is 0 there.
    """
    median = math.sqrt(max(-float(np.median(products)), 0.0))
    return median / NOISE_SCALE / mean_length
