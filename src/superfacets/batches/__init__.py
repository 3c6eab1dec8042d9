"""Batches: one function that processes a file, and teams of workers that apply it to thousands.

The package is not called ``batch``, because a module of that name would hide the function.
"""
