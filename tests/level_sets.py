"""Level sets on a grid, as extracted from volumes, with many slivers in a regular pattern."""

from itertools import permutations

import numpy as np

from superfacets import Mesh

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])

# Six tetrahedra of a cube, each along three edges from a corner to the opposite corner.
TETS = np.array([
    [int(np.dot(np.eye(3, dtype=int)[list(order[:n])].sum(axis=0), [4, 2, 1])) for n in range(4)]
    for order in permutations(range(3))
])  # fmt: skip


def level_set(function, n):
    """Return the surface function = 0 in [-1, 1]^3, on a grid of n^3 cubes.

    Normals point to larger values. `function` takes points, (..., 3), and must not be 0 at a point
    of the grid.
    """
    side = n + 1
    at = np.stack(np.meshgrid(*[np.linspace(-1, 1, side)] * 3, indexing="ij"), -1).reshape(-1, 3)
    values = function(at)
    lows = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    cubes = (lows + CORNERS) @ [side * side, side, 1]
    is_cut = (values[cubes] > 0).any(axis=1) & (values[cubes] < 0).any(axis=1)
    tets = cubes[is_cut][:, TETS].reshape(-1, 4)
    tets = np.take_along_axis(tets, np.argsort(values[tets], axis=1), axis=1)  # low values first
    n_low = (values[tets] < 0).sum(axis=1)
    crossed = [
        tets[n_low == 1][:, [[0, 1], [0, 2], [0, 3]]],
        tets[n_low == 3][:, [[0, 3], [1, 3], [2, 3]]],
        tets[n_low == 2][:, [[0, 2], [0, 3], [1, 3]]],
        tets[n_low == 2][:, [[0, 2], [1, 3], [1, 2]]],
    ]
    edges = np.sort(np.concatenate(crossed), axis=2).reshape(-1, 2)
    edges, faces = np.unique(edges, axis=0, return_inverse=True)
    one, other = values[edges].T
    share = (one / (one - other))[:, None]
    vertices = at[edges[:, 0]] * (1 - share) + at[edges[:, 1]] * share
    return turned_up(vertices, faces.reshape(-1, 3), function)


def turned_up(vertices, faces, function):
    """Return a mesh whose normals point to larger values."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    steps = 1e-3 * normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    middles = (a + b + c) / 3
    is_down = function(middles + steps) < function(middles - steps)
    return Mesh(vertices, np.where(is_down[:, None], faces[:, ::-1], faces))
