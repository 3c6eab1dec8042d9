"""
A graph of your own: the pixels of an image
===========================================

Segment any cells with positions, measures, neighbors and features.
"""

import matplotlib.pyplot as plt
import numpy as np

import superfacets as sf

# %%
# In this example, the cells are the pixels of an image of overlapping disks with noise.

rows, columns = np.indices((120, 180))
rng = np.random.default_rng(3)
image = np.full((120, 180, 3), 0.9)
for _ in range(14):
    distance = np.hypot(rows - rng.uniform(0, 120), columns - rng.uniform(0, 180))
    image[distance < rng.uniform(12, 30)] = rng.uniform(0.1, 1, 3)
image = np.clip(image + rng.normal(scale=0.02, size=image.shape), 0, 1)

# %%
# A graph has a position and a measure (area or volume) for each cell. Its arcs are in CSR form:
# the neighbors of cell *i* are ``neighbors[offsets[i]:offsets[i + 1]]``. Each pixel has up to four
# neighbors.

cells = np.arange(rows.size).reshape(rows.shape)
right, down = (cells[:, :-1], cells[:, 1:]), (cells[:-1], cells[1:])
pairs = np.concatenate([np.stack([a.ravel(), b.ravel()]) for a, b in (right, down)], axis=1)
source, target = np.concatenate([pairs, pairs[::-1]], axis=1)
order = np.argsort(source, kind="stable")
offsets = np.concatenate([[0], np.cumsum(np.bincount(source))])
positions = np.stack([columns.ravel(), -rows.ravel(), 0 * rows.ravel()], axis=1)
steps = np.ones(len(source))
graph = sf.CellGraph(positions, np.ones(cells.size), offsets, target[order], steps)

# %%
# The features add the difference of colors to the cost of each step.

result = sf.segment_graph(graph, 120, features=image.reshape(-1, 3))
is_border = sf.find_boundaries(graph, result.labels).reshape(cells.shape)

figure, axes = plt.subplots(1, 2, figsize=(9, 3.2))
axes[0].imshow(image)
axes[1].imshow(np.where(is_border[..., np.newaxis], 0, image))
for axis in axes:
    axis.axis("off")
figure.tight_layout()
