"""
Creases, and noise in a scan
============================

Choose the weight of creases, and reduce the effect of noise on the borders.
"""

import numpy as np

import superfacets as sf

# %%
# ``alpha`` is the weight of creases relative to distance. With 0, regions are roundest. With 100,
# borders follow even faint creases.

mesh = sf.sample_mesh()
labels = [sf.segment(mesh, 80, alpha=alpha).labels for alpha in (0, 12, 100)]
titles = ["alpha 0", "alpha 12, the default", "alpha 100"]
sf.plot(mesh, labels[0], compare=labels[1:], titles=titles, size=(420, 480))

# %%
# This function simulates a scan of the bear from one side, with noise and holes.


def scan(n_faces=60_000):
    """Return the side of the bear that faces a scanner, with noise and 25 holes."""
    mesh = sf.sample_mesh(n_faces)
    rng = np.random.default_rng(0)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    centroids = corners.mean(axis=1)
    is_seen = normals @ np.array([0.35, 0.1, 0.93]) > rng.uniform(0.1, 0.3, mesh.n_faces)
    for hole in rng.choice(mesh.n_faces, 25):
        radius = rng.uniform(0.02, 0.06)
        is_seen &= np.linalg.norm(centroids - centroids[hole], axis=1) > radius
    noise = rng.normal(scale=0.002, size=mesh.vertices.shape)
    return sf.Mesh(mesh.vertices + noise, mesh.faces[is_seen])


# %%
# Noise makes many small creases. By default, creases of a noisy mesh are measured on a smoothed
# copy of the mesh.
# ``islands="nearest"`` joins loose fragments to the nearest region. ``merge_small_regions`` joins
# regions with less than a fifth of the mean area to a neighbor.

noisy = scan()
plain = sf.segment(noisy, 150, islands="nearest", denoise=0).labels
smoothed = sf.segment(noisy, 150, islands="nearest").labels
merged = sf.merge_small_regions(noisy, smoothed, 0.2, islands="nearest").labels
sf.plot(noisy, plain, compare=[merged], titles=["denoise=0", "default, small regions merged"])
