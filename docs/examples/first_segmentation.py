"""
A first segmentation
====================

Label every face of a mesh with one of 150 regions, look at them, and save the labels.
"""

import numpy as np

import superfacets as sf

# %%
# The package comes with a toy bear of 60,220 triangles. ``sf.read_mesh("scan.ply")`` reads a
# mesh of your own.

mesh = sf.sample_mesh()
result = sf.segment(mesh, n_segments=150)
sf.plot(mesh, result)

# %%
# No region crosses from the head to an ear, or from the body to a limb: borders follow the
# concave creases of the surface. The labels are an array with one number per face, in the order
# of the mesh.

labels = result.labels
print(labels.shape, labels.dtype, labels.min(), "to", labels.max())
print("the smallest region has", np.bincount(labels).min(), "faces")

# %%
# Values of faces become values of regions. Here each region shows its mean height.

height = sf.pool(mesh.vertices[:, 1], result.labels, cells=mesh)
sf.plot(mesh, result, color_by=height, scale_title="mean height")

# %%
# A PLY with labels and colors opens in MeshLab; a ``.npy`` holds the labels alone.

sf.write_mesh("bear.ply", mesh, result.labels)
sf.write_labels("bear.npy", result.labels)
