"""
Regions of equal size
=====================

Make regions of equal area, regions with a maximum area, or regions with an exact number of faces.
"""

import numpy as np

import superfacets as sf

# sphinx_gallery_thumbnail_number = 2
mesh = sf.sample_mesh(20_000)
usual = sf.segment(mesh, 60)
equal = sf.segment(mesh, 60, sizes=sf.Sizes(balance=1))
titles = ["default", "balance=1"]
sf.plot(mesh, usual.labels, compare=[equal.labels], titles=titles, size=(480, 480))

# %%
# If all areas are equal, borders cannot follow every crease.

for name, result in (("default", usual), ("balance=1", equal)):
    areas = result.regions.areas
    print(f"{name}: areas vary by {areas.std() / areas.mean():.0%}")

# %%
# ``bounds`` are the lowest and the highest area of a region.

most = 1.2 * equal.regions.areas.mean()
print(sf.segment(mesh, 60, sizes=sf.Sizes(bounds=(None, most))).regions.areas.max() <= most)

# %%
# With ``cells``, all regions have the same number of faces, as required by neural
# networks that process patches. Only one region has fewer than 64 faces: it has the faces that
# remain.

patches = sf.segment(mesh, sizes=sf.Sizes(cells=64))
print(np.unique(np.bincount(patches.labels), return_counts=True))
sf.plot(mesh, patches)
