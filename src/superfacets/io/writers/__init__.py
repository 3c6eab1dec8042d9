"""Writing of meshes and labels: one file per format, on `atomic`."""
