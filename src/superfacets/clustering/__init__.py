"""Stages 3 and 4 of `segment`: place seeds, and run the loop of classification and update."""
