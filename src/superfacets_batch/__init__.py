"""Segment many files, one after the other or on Dask workers."""
