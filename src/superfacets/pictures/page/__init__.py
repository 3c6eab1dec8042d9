"""Pages with a mesh and its regions: single files that a browser opens offline."""
