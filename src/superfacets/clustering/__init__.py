"""Stages 3 and 4: seeds, and the loop of classification and update."""
