"""Classes for meshes and point clouds, with arrays that are checked when an object is made."""
