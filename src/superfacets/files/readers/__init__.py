"""Readers of meshes and labels: one module per format, built on `text` and `guards`.

The library lagrange is not used: it accepts truncated files, rounds decimals wrongly, allocates the
memory that a header declares, and hangs, crashes or returns wrong numbers on some damaged files.
"""
