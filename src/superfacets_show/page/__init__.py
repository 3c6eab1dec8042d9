"""HTML pages that show a mesh and its regions, as single files for offline use."""
