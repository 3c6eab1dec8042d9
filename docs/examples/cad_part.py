"""
A CAD part
==========

Segment a CAD part that consists of long thin triangles.
"""

import numpy as np

import superfacets as sf

# %%
# CAD programs divide a cylinder into long thin triangles. This flange is a pipe with a plate at
# one end.


def flange(n_around=96):
    """Return the surface that a profile sweeps around the z axis."""
    profile = [[0.3, 0], [1, 0], [1, 0.2], [0.5, 0.2], [0.5, 0.9], [0.3, 0.9], [0.3, 0]]
    angles = 2 * np.pi * np.arange(n_around) / n_around
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.insert(radius * around, 2, z, axis=1) for radius, z in profile]
    step, ring = np.meshgrid(np.arange(n_around), np.arange(len(profile) - 1))
    a, b = (ring * n_around + step).ravel(), (ring * n_around + (step + 1) % n_around).ravel()
    c, d = b + n_around, a + n_around
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return sf.Mesh(np.concatenate(rings), faces)


part = flange()
sf.mesh_info(part)

# %%
# Regions consist of whole faces, so long thin faces lead to regions in stripes, and ``segment``
# gives a warning. Therefore this example bisects long edges with ``subdivide`` first.

fine = sf.subdivide(part, max_edge=0.05)
result = sf.segment(fine.mesh, 150)
sf.plot(fine.mesh, result, view=sf.View(up="z", elevation=35))

# %%
# By default, borders follow sharp convex edges between flat faces. With ``eta_convex``, borders
# also follow rounded convex edges.

rounded = sf.segment(fine.mesh, 150, weights=sf.Weights(eta_convex=0.2))
print(f"compactness {sf.metrics.compactness(fine.mesh, rounded):.2f}; a square has 4")

# %%
# ``labels_back`` converts labels of the subdivided mesh to labels of the original faces.

old_labels = fine.labels_back(result.labels)
print(len(old_labels), "labels for", part.n_faces, "original faces")
