"""Comparison and reproduction: other methods, the Princeton benchmark, the figures of the paper."""
