"""Label meshes region by region in a browser: the server on this machine, and its work files.

Each cell has a class and an object as its labels. Regions only select cells for labeling, so a new
segmentation does not change any labels.
"""
