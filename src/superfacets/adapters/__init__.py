"""Conversion of input to meshes and point clouds, and of results to objects of other libraries."""
