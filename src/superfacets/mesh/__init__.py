"""Stage 0: checked meshes and point clouds."""
