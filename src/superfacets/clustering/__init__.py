"""Stages 3 and 4: seeding, and the clustering loop of classification and update.

`parts` belongs to stage 2: it adds costs between parts of a shape to the arcs of coarse graphs.
"""
