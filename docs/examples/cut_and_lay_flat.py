"""
Cut regions out and lay them flat
=================================

Turn regions into a sewing pattern: cut faces along smooth borders, then project each piece onto a
plane.
"""

import matplotlib.pyplot as plt
import numpy as np

import superfacets as sf

# %%
# Borders follow edges of faces, in zigzag. ``cut_borders`` replaces the borders by smooth curves
# and cuts the faces along the curves.

mesh = sf.sample_mesh(6_000)
labels = sf.segment(mesh, 60).labels
cut = sf.cut_borders(mesh, labels)
print(mesh.n_faces, "faces before,", cut.mesh.n_faces, "after")
sf.plot(cut.mesh, cut.labels, border_width=2)

# %%
# ``split_regions`` makes a mesh of each region. A region is nearly flat, so this example projects
# the region onto the plane of its two principal axes.

pieces = list(sf.split_regions(cut.mesh, cut.labels))
# sphinx_gallery_thumbnail_number = 2
figure, axes = plt.subplots(4, 6, figsize=(9, 6))
colors = sf.face_colors(cut.mesh, cut.labels) / 255
for place, i in zip(axes.flat, range(24), strict=True):
    piece = pieces[i].mesh
    centered = piece.vertices - piece.vertices.mean(axis=0)
    flat = centered @ np.linalg.svd(centered, full_matrices=False)[2][:2].T
    color = colors[cut.labels == i][0]
    place.tripcolor(*flat.T, piece.faces, facecolors=np.zeros(piece.n_faces), cmap="gray")
    place.collections[0].set(array=None, facecolor=color, edgecolor="face")
    place.set_aspect("equal")
    place.axis("off")
figure.suptitle("The first 24 pieces")
figure.tight_layout()
