"""Read and write files of meshes, point clouds and labels."""
