"""Stage 0: classes for checked meshes and point clouds."""
