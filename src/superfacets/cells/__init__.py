"""Stages 1 and 2: graphs of cells, and the weights of their arcs."""
