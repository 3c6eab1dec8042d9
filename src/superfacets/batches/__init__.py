"""Process one file, or a batch of many files with a team of workers.

The package is not called ``batch``, because a module of this name would hide the function `batch`.
"""
