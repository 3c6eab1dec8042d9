"""Documents: meshes that are being labeled, with their state, undo history and work file."""
