"""Write files of meshes, point clouds and labels."""
