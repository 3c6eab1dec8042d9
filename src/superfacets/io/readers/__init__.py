"""Reading of meshes and labels: one file per format, on `text` and `guards`."""
