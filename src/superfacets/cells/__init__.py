"""Stages 1 and 2 of `segment`: build graphs of cells, and compute the weights of their arcs."""
