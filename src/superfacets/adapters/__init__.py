"""Convert input to meshes or point clouds, and store results in objects of other libraries."""
