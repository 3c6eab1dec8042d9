"""Stages 3 and 4 of `segment`: place seeds, and run the loop of classification and update.

`parts` belongs to stage 2: it adds costs between parts of a shape to the arcs of all graphs.
"""
