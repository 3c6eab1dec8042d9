"""A page with a mesh and its regions: one file that opens offline in a browser."""
