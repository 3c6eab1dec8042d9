"""Read meshes, point clouds and labels from files, and write files atomically."""
