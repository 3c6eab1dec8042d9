"""Stages 3 and 4 of `segment`: place seeds, and run the loop of classification and update.

The module `parts` belongs to stage 2: it lengthens arcs from one part of a shape to another, such
as from a finger to the palm of a hand.
"""
