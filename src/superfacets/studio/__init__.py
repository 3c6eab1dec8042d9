"""Labeling of meshes by regions in a browser: the server on this machine, and its work files.

The painted state is one class and object per cell. Regions are only brushes, so a new segmentation
never loses paint.
"""
