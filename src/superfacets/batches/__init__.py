"""Segment one file, or a batch of many files, one after the other or on Dask workers.

The package is not called ``batch``, because this name would hide the function `batch`.
"""
