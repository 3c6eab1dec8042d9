"""
Nested levels
=============

Merge regions step by step. Every coarse region is a union of finer regions.
"""

import numpy as np

import superfacets as sf

# sphinx_gallery_thumbnail_number = 3
mesh = sf.sample_mesh()
nested = sf.hierarchy(mesh, [400, 100, 25])
fine, middle, coarse = nested.levels
titles = ["400 regions", "100", "25"]
sf.plot(mesh, fine, compare=[middle, coarse], titles=titles, size=(420, 480))

# %%
# ``parents`` contains, for each region, the region of the next coarser level that contains it.

of_middle = nested.parents[0][fine]
print("nested:", np.array_equal(of_middle, middle))

# %%
# ``nested`` contains the merge tree, so ``cut`` returns any other number of regions in
# milliseconds.

sf.plot(mesh, nested.cut(10))

# %%
# With ``features``, regions with similar values merge first. In this example, the feature is the
# height, so coarse regions are horizontal layers.

by_height = sf.hierarchy(mesh, [400, 8], features=mesh.vertices[:, 1])
sf.plot(mesh, by_height.levels[1])
