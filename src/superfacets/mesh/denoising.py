"""Positions of meshes without noise, by which `segment` measures creases."""

from __future__ import annotations

import math
from typing import Literal, cast

import numpy as np

from .. import _core
from .._types import Floats, Ints, Longs
from .._validate import checked_count
from .cells import lowest_vertices
from .faces import (
    FaceMesh,
    corners_in_a_row,
    corners_of,
    face_sizes,
    mesh_like,
    unit_normals,
    vertex_graph,
)

Denoise = int | Literal["auto"] | None

NOISE_LIMIT = 0.05
"""Noise from which ``"auto"`` smooths, in edge lengths. Without added noise, the estimate is at most
0.033 on the 95 benchmark models, and 0.045 on the sample mesh of 20,000 faces."""

STEPS_OF_NOISE = 200
"""Number of steps per unit of noise. Fewer steps leave more noise, and more blur more."""

LEAST_STEPS, MOST_AUTO_STEPS = 10, 100
"""Bounds of the number of steps that ``"auto"`` takes; from the lower one on, there is a slack."""

LEAST_FACES = 1000
"""Number of faces from which ``"auto"`` smooths: smaller meshes have no faces to spare."""

SAMPLES = 256
"""Least number of faces by which noise is estimated; at most twice as many."""

ESTIMATE_OF_NOISE = 0.113
"""Value of the estimate per unit of noise, on meshes of like triangles."""

MOST_STEPS = 1000
"""Largest number of steps: far fewer smooth all details of a shape away."""


def checked_denoise(denoise: object) -> Denoise:
    """Return the checked argument of `segment`."""
    if denoise is None or denoise == "auto":
        return denoise
    if isinstance(denoise, str):
        raise ValueError(f"denoise must be 'auto', a number of steps, or None, got {denoise!r}")
    n_steps = checked_count(denoise, "denoise", low=0)
    if n_steps > MOST_STEPS:
        raise ValueError(f"denoise must be at most {MOST_STEPS} steps, got {n_steps}")
    return n_steps


def denoised(
    mesh: FaceMesh, denoise: int | Literal["auto"], *, weld: bool, n_threads: int
) -> tuple[FaceMesh, int]:
    """Return the mesh with smoothed positions, and the number of steps.

    With ``"auto"``, the number follows from the noise. With `weld`, vertices at one position stay
    together.
    """
    if denoise == 0 or (denoise == "auto" and mesh.n_faces < LEAST_FACES):
        return mesh, 0
    lowest = lowest_vertices(mesh.vertices, weld, n_threads)
    if denoise == "auto":
        sample = sampled_faces(mesh.n_faces)
        denoise = steps_of(noise_products(mesh, lowest, sample, n_threads))
        if denoise == 0:
            return mesh, 0
    graph = vertex_graph(mesh, lowest, n_threads)
    positions = _core.taubin_smooth(
        mesh.vertices, graph.offsets, graph.neighbors, denoise, n_threads
    )
    offsets = np.concatenate([[0], np.cumsum(face_sizes(mesh))])
    made = mesh_like(mesh, positions[lowest], corners_in_a_row(mesh), offsets)
    return cast(FaceMesh, made), denoise


def slack_of(n_steps: int) -> float:
    """Return the angle up to which edges count as flat after so many steps of smoothing.

    Edges still bend by about a degree at random. On regular grids such small creases would stretch
    regions along the diagonal.
    """
    return math.radians(max(2.25, 0.1 * n_steps)) if n_steps >= LEAST_STEPS else 0.0


def sampled_faces(n_faces: int) -> Ints:
    """Return the faces by which noise is estimated: one in each of about `SAMPLES` blocks.

    The places within the blocks differ, because faces often repeat in a pattern.
    """
    size = max(n_faces // SAMPLES, 1)
    blocks = np.arange(n_faces // size)
    return (blocks * size + blocks * 2654435761 % 2**32 * size // 2**32).astype(np.int32)


def noise_products(mesh: FaceMesh, lowest: Ints, sample: Ints, n_threads: int) -> Floats:
    """Return a measure of noise for each face of a sample: more than 0 if it looks like noise.

    The heights of the vertices above the smoothed surface are multiplied for both ends of each side
    of the face. Noise moves neighbors to opposite sides of the smoothed surface: the products are
    negative. The result is minus their mean, for sides of mean length 1. Only faces within two
    rings of the sample matter. Faces without area are left out.
    """
    part, rows = _around(mesh, lowest, sample)
    graph = vertex_graph(part, np.arange(len(part.vertices), dtype=np.int32), n_threads)
    smooth = _core.taubin_smooth(part.vertices, graph.offsets, graph.neighbors, 1, n_threads)
    normals = unit_normals(part, n_threads)[rows]
    exists = normals.any(axis=1)
    corners, offsets = corners_of(part).of(rows[exists])
    if not len(corners):
        return np.empty(0)
    firsts, sizes = offsets[:-1], np.diff(offsets)
    following = np.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = firsts
    sides = part.vertices[corners[following]] - part.vertices[corners]
    lengths = np.add.reduceat(np.linalg.norm(sides, axis=1), firsts) / sizes
    heights = (part.vertices - smooth)[corners] / np.repeat(lengths, sizes)[:, np.newaxis]
    offs = np.einsum("ij,ij->i", heights, np.repeat(normals[exists], sizes, axis=0))
    return np.asarray(-np.add.reduceat(offs * offs[following], firsts) / sizes)


def _around(mesh: FaceMesh, lowest: Ints, sample: Ints) -> tuple[FaceMesh, Longs]:
    """Return the faces within two rings of a sample, and the sample as rows of these.

    Their vertices are welded, in the same order.
    """
    corners = corners_of(mesh)
    faces = _core.cells_around(*corners.lists, lowest, sample)
    chosen, offsets = corners.of(faces)
    chosen = lowest[chosen]
    is_used = np.zeros(len(lowest), bool)
    is_used[chosen] = True
    used = np.flatnonzero(is_used)
    rank = np.empty(len(lowest), np.int32)
    rank[used] = np.arange(len(used), dtype=np.int32)
    part = mesh_like(mesh, mesh.vertices[used], rank[chosen], offsets, mesh.bounds)
    return cast(FaceMesh, part), np.searchsorted(faces, sample)


def steps_of(products: Floats) -> int:
    """Return the number of steps for the `noise_products` of a sample; 0 if there is no noise."""
    noise = estimated_noise(products)
    if noise < NOISE_LIMIT:
        return 0
    return min(max(round(STEPS_OF_NOISE * noise), LEAST_STEPS), MOST_AUTO_STEPS)


def estimated_noise(products: Floats) -> float:
    """Estimate the standard deviation of the noise, in edge lengths.

    The estimate is the root of a value that 60 % of the `noise_products` exceed: creases, and faces
    where the shape bends, are fewer.
    """
    if not len(products):
        return 0.0
    low = float(np.sort(products)[int(0.4 * len(products))])
    return math.sqrt(max(low, 0.0)) / ESTIMATE_OF_NOISE
