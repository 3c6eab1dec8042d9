"""Batches: process one file, or many files with a team of workers.

The package is not called ``batch``, because a module of this name would hide the function `batch`.
"""
