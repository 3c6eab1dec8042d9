"""Classes for meshes and point clouds, which check their arrays when they are made."""
