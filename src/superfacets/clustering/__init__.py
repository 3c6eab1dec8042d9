"""Stages 3 and 4: seeding, and the clustering loop of classification and update."""
