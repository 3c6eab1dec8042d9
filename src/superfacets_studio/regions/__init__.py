"""Compute regions of the mesh, split them, and store numbered revisions of their labels."""
