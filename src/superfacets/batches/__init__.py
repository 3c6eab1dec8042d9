"""Segment one file, or a batch of many files in worker processes.

The package is not called ``batch``, because this name would hide the function `batch`.
"""
