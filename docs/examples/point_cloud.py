"""
A point cloud
=============

Label points that have no faces and no normals.
"""

import numpy as np

import superfacets as sf


def points(n=60_000):
    """Return points at random places on the bear, in no order."""
    mesh = sf.sample_mesh()
    rng = np.random.default_rng(0)
    areas = sf.build_face_graph(mesh).measures
    chosen = rng.choice(mesh.n_faces, n, p=areas / areas.sum())
    within = rng.dirichlet([1, 1, 1], n)
    return sf.PointCloud(np.einsum("pc,pcx->px", within, mesh.vertices[mesh.faces[chosen]]))


# %%
# An (N, 3) array is a cloud, too, and ``sf.read_cloud`` reads PLY, XYZ, LAS, LAZ and E57.
# Neighbors, normals and the area around each point are estimated.

cloud = points()
result = sf.segment(cloud, 150, min_size=0.1)
sf.plot(cloud, result)

# %%
# Each point has a label. The graph of regions is the same as that of a mesh.

regions = result.regions
print(len(result.labels), "labels;", regions.edge_index.shape[1], "pairs of regions touch")

# %%
# Labels go from the points to a mesh of the same place, and back, by the nearest point.

mesh = sf.sample_mesh(6_000)
of_faces = sf.transfer(cloud, result.labels, mesh)
sf.plot(mesh, of_faces)
