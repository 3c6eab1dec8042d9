"""Conversion of paths, arrays and meshes of other libraries to cells, and of results back."""
