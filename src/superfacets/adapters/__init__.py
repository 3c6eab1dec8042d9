"""Conversion of paths, arrays and meshes of other libraries to our classes, and results back."""
