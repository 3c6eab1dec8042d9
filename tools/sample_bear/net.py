"""Make the surface net of a lattice, and move its vertices onto the solids."""

from __future__ import annotations

import numpy as np

from .bear import FloatArray, cut_into_blocks, ellipsoids
from .lattice import IndexArray, Lattice, cells_around, crossed_edges
from .quads import QuadSurface, solids_of_vertices

# Number of smoothing steps per call of `relax`. These steps remove slivers; further steps would
# change little.
_RELAX_STEPS = 6


def surface_net(lattice: Lattice) -> QuadSurface:
    """Return a surface with a vertex in each crossed cell, and a quad across each crossed edge."""
    inside = lattice.inside.ravel()
    quads, middles = [], []
    for axis, edges in enumerate(crossed_edges(lattice)):
        around = cells_around(lattice, axis, edges)
        leaves_upward = inside[edges]
        quads.append(np.where(leaves_upward[:, None], around, around[:, ::-1]))
        middles.append(lattice.positions(edges))
        middles[-1][:, axis] += lattice.spacing / 2
    cells, corners = np.unique(np.concatenate(quads), return_inverse=True)
    corners = corners.reshape(-1, 4)
    n_quads_at = np.bincount(corners.ravel(), minlength=len(cells))
    sums = _sum_at(corners.ravel(), np.repeat(np.concatenate(middles), 4, axis=0), len(cells))
    points = sums / n_quads_at[:, None]
    nearest = ellipsoids().nearest(points).astype(np.int64)
    points = _project(points, _groups(np.int64(1) << nearest), lattice.spacing, n_steps=2)
    return QuadSurface(points, corners, np.zeros(len(corners), dtype=np.int64))


def relax(surface: QuadSurface, spacing: float) -> QuadSurface:
    """Spread the vertices evenly over the surface; vertices on creases stay on the creases.

    A vertex moves toward the mean of its neighbors that are on all of its solids. In a closed,
    oriented surface, the sides of the quads contain each pair of neighbors once in each direction.
    """
    solids_of_vertex = solids_of_vertices(surface)
    targets = surface.quads.ravel()
    sources = np.roll(surface.quads, -1, axis=1).ravel()
    guides = (solids_of_vertex[targets] & ~solids_of_vertex[sources]) == 0
    targets, sources = targets[guides], sources[guides]
    n_vertices = len(surface.points)
    n_guides = np.bincount(targets, minlength=n_vertices)[:, None]
    groups = _groups(solids_of_vertex)
    points = _project(surface.points, groups, spacing, n_steps=3)
    for _ in range(_RELAX_STEPS):
        means = _sum_at(targets, points[sources], n_vertices) / np.maximum(n_guides, 1)
        # With a factor of 1 instead of 0.7, vertices of a checkerboard pattern would oscillate.
        points = np.where(n_guides > 0, points + 0.7 * (means - points), points)
        points = _project(points, groups, spacing, n_steps=1)
    points = _project(points, groups, spacing, n_steps=3)
    return QuadSurface(points, surface.quads, surface.owners)


def _groups(solids_of_vertex: IndexArray) -> list[tuple[list[int], IndexArray]]:
    """Return the vertices grouped by the solids that they must be on: (solids, vertices) pairs."""
    masks, group = np.unique(solids_of_vertex, return_inverse=True)
    order = np.argsort(group, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(group))[:-1])
    solids = [[s for s in range(len(ellipsoids().centers)) if int(mask) >> s & 1] for mask in masks]
    return list(zip(solids, parts, strict=True))


def _project(
    points: FloatArray,
    groups: list[tuple[list[int], IndexArray]],
    spacing: float,
    n_steps: int,
) -> FloatArray:
    """Move points onto all of their solids, by Newton steps of minimum length."""
    projected = points.copy()
    for solids, members in groups:
        for block in cut_into_blocks(members):
            moved = points[block]
            for _ in range(n_steps):
                moved = moved - _newton_step(moved, solids, spacing)
            projected[block] = moved
    return projected


def _newton_step(points: FloatArray, solids: list[int], longest: float) -> FloatArray:
    """Return the Newton steps to subtract from points, (N, 3).

    Of all possible steps of a point, the shortest is used. If it is longer than `longest`, it is
    scaled to this length.
    """
    levels = [ellipsoids().levels(solid, points) for solid in solids]
    values = np.stack([value for value, _ in levels], axis=1)
    gradients = np.stack([gradient for _, gradient in levels], axis=1)
    gram = gradients @ gradients.transpose(0, 2, 1)
    if len(solids) == 1:
        factors = values / gram[:, :, 0]
    else:  # a slight regularization, for points on more than three solids
        ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(len(solids))
        factors = np.linalg.solve(gram + ridge, values[:, :, None])[:, :, 0]
    step = np.einsum("ns,nsd->nd", factors, gradients)
    length = np.sqrt(np.einsum("nd,nd->n", step, step))
    return np.asarray(step * np.minimum(1.0, longest / np.maximum(length, 1e-30))[:, None])


def _sum_at(targets: IndexArray, rows: FloatArray, n_targets: int) -> FloatArray:
    """Return the sum of the rows with the same target, for each target, (n_targets, 3)."""
    sums = [np.bincount(targets, weights=column, minlength=n_targets) for column in rows.T]
    return np.stack(sums, axis=1)
