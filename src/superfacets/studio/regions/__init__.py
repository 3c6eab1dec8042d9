"""Regions of the mesh: segmentation, splits, and numbered revisions of their labels."""
