"""
A point cloud
=============

Label the points of a cloud that has neither faces nor normals.
"""

import numpy as np

import superfacets as sf


def points(n=60_000):
    """Return n random points on the surface of the bear."""
    mesh = sf.sample_mesh()
    rng = np.random.default_rng(0)
    areas = sf.build_face_graph(mesh).measures
    chosen = rng.choice(mesh.n_faces, n, p=areas / areas.sum())
    within = rng.dirichlet([1, 1, 1], n)
    return sf.PointCloud(np.einsum("pc,pcx->px", within, mesh.vertices[mesh.faces[chosen]]))


# %%
# ``segment`` also takes an (N, 3) array, and ``sf.read_cloud`` reads PLY, XYZ, LAS, LAZ and E57.
# ``segment`` estimates neighbors, normals and the area around each point.

cloud = points()
result = sf.segment(cloud, 150)
sf.plot(cloud, result)

# %%
# There is one label per point. ``result.regions`` contains areas, neighbors and borders of regions,
# as for a mesh.

regions = result.regions
print(len(result.labels), "labels;", regions.edge_index.shape[1], "pairs of regions touch")

# %%
# ``transfer`` gives each face of a mesh the label of the nearest point.

mesh = sf.sample_mesh(6_000)
of_faces = sf.transfer(cloud, result.labels, mesh)
sf.plot(mesh, of_faces)
