"""
From regions to a graph for learning
====================================

Make a graph of regions with their areas, shapes, neighbors and creases, and group regions into
parts.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import superfacets as sf

mesh = sf.sample_mesh()
result = sf.segment(mesh, 150)
regions = result.regions

# %%
# ``to_pandas`` makes a table with one row per region. ``to_networkx``, ``to_scipy`` and ``to_pyg``
# make graphs for other libraries.

regions.to_pandas().iloc[:5, :6]

# %%
# The nodes of the graph have features of regions. The edges have the length and the mean angle of
# the border between two regions. The angle is positive at a concave crease and negative at a
# ridge.

nodes = np.column_stack([regions.areas, regions.compactness, regions.planarity])
edges = np.column_stack([regions.border_lengths, regions.concavities])
print("nodes", nodes.shape, "edges", regions.edge_index.shape, edges.shape)

# %%
# Concave creases separate the parts of the bear. This code keeps only graph edges with an angle of
# less than 25 degrees. Each connected component of the remaining graph is a part.

first, second = regions.edge_index
is_open = regions.concavities < np.radians(25)
shape = (regions.n_regions, regions.n_regions)
joined = coo_array((np.ones(is_open.sum()), (first[is_open], second[is_open])), shape)
n_parts, part_of_region = connected_components(joined, directed=False)
print(n_parts, "parts")
sf.plot(mesh, part_of_region[result.labels])

# %%
# The last plot shows the number of neighbors of each region:

degree = np.bincount(regions.edge_index.ravel(), minlength=regions.n_regions)
sf.plot(mesh, result, color_by=degree, scale_title="neighbors")
