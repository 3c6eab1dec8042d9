"""
A first segmentation
====================

Label every face of a mesh with one of 150 regions, draw the regions, and save the labels.
"""

import numpy as np

import superfacets as sf

# %%
# The package contains a toy bear of 60,220 triangles. ``sf.read_mesh("scan.ply")`` reads your
# own mesh.

mesh = sf.sample_mesh()
result = sf.segment(mesh, n_segments=150)
sf.plot(mesh, result)

# %%
# No region crosses from the head to an ear, or from the body to a limb: borders follow the
# concave creases of the surface. ``result.labels`` has one number per face, in the order of the
# mesh.

labels = result.labels
print(labels.shape, labels.dtype, labels.min(), "to", labels.max())
print("the smallest region has", np.bincount(labels).min(), "faces")

# %%
# ``pool`` computes one value per region from values of faces or vertices. This example computes
# the mean height.

height = sf.pool(result.labels, mesh.vertices[:, 1], mesh=mesh)
sf.plot(mesh, result, color_by=height, scale_title="mean height")

# %%
# The PLY file contains the mesh with labels and colors, and can be opened in MeshLab. The ``.npy``
# file contains only the labels.

sf.write_mesh("bear.ply", mesh, result.labels)
sf.write_labels("bear.npy", result.labels)
