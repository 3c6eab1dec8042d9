"""Labeling meshes by regions in a browser: a server on this machine, and what it keeps.

The painted state is one class per cell. Regions are only the brush, so a new segmentation never
loses paint.
"""
