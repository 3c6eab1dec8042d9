"""Stage 1: graphs of cells, kinds of cells, surfaces, constraints and sizes."""
