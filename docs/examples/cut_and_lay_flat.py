"""
Cut regions out and lay them flat
=================================

Make a sewing pattern from regions: cut faces along smooth borders, and project each piece onto a
plane.
"""

import matplotlib.pyplot as plt
import numpy as np

import superfacets as sf

# %%
# Borders zigzag along the edges of faces. ``cut_borders`` replaces them by smooth curves, and cuts
# the faces along these curves.

mesh = sf.sample_mesh(6_000)
labels = sf.segment(mesh, 60).labels
cut = sf.cut_borders(mesh, labels)
print(mesh.n_faces, "faces before,", cut.mesh.n_faces, "after")
sf.plot(cut.mesh, cut.labels, border_width=2)

# %%
# ``split_regions`` makes one mesh per region. Regions are nearly flat, so this example projects
# each region onto the plane of its two principal axes.

pieces = list(sf.split_regions(cut.mesh, cut.labels))
# sphinx_gallery_thumbnail_number = 2
figure, axes = plt.subplots(4, 6, figsize=(9, 6))
colors = sf.face_colors(cut.mesh, cut.labels) / 255
for axis, i in zip(axes.flat, range(24), strict=True):
    piece = pieces[i].mesh
    centered = piece.vertices - piece.vertices.mean(axis=0)
    flat = centered @ np.linalg.svd(centered, full_matrices=False)[2][:2].T
    color = colors[cut.labels == i][0]
    axis.tripcolor(*flat.T, piece.faces, facecolors=np.zeros(piece.n_faces), cmap="gray")
    axis.collections[0].set(array=None, facecolor=color, edgecolor="face")
    axis.set_aspect("equal")
    axis.axis("off")
figure.suptitle("The first 24 pieces")
figure.tight_layout()
