"""
Quads and other polygons
========================

Label the faces of a polygon mesh without triangulation.
"""

import numpy as np

import superfacets as sf


def knot(n_along=360, n_around=24):
    """Return a knotted tube of quads, with varying thickness."""
    along, around = np.meshgrid(*(np.arange(n) / n for n in (n_along, n_around)), indexing="ij")
    t, turn = 2 * np.pi * along, 2 * np.pi * around
    path = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    ahead = [np.cos(t) + 4 * np.cos(2 * t), 4 * np.sin(2 * t) - np.sin(t), -3 * np.cos(3 * t)]
    ahead = np.stack(ahead, axis=-1) / np.linalg.norm(ahead, axis=0)[..., np.newaxis]
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    radius = (0.42 + 0.16 * np.cos(9 * t))[..., np.newaxis]
    up = np.cross(ahead, side)
    out = np.cos(turn)[..., np.newaxis] * side + np.sin(turn)[..., np.newaxis] * up
    points = np.stack(path, axis=-1) + radius * out
    i, j = np.arange(n_along)[:, np.newaxis], np.arange(n_around)
    next_i, next_j = (i + 1) % n_along, (j + 1) % n_around
    corners = [n_around * a + b for a, b in ((i, j), (next_i, j), (next_i, next_j), (i, next_j))]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    return sf.PolygonMesh.of_faces(points.reshape(-1, 3), quads)


mesh = knot()
result = sf.segment(mesh, 90)
sf.plot(mesh, result, view=sf.View(up="z", elevation=55))

# %%
# There is one label per quad, and borders follow the edges of quads.

print(mesh, len(result.labels), "labels")

# %%
# If a program needs triangles, convert the mesh and the labels:

triangles, sources = mesh.triangulate()
print(triangles.n_faces, "triangles,", len(result.labels[sources]), "labels")
