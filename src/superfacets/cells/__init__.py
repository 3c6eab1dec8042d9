"""Stages 1 and 2: cells, the arcs between them, and the weights of these."""
