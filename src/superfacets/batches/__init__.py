"""Batches: a function that processes one file, and teams of workers that call it for many files.

The package is not called ``batch``, because a module of this name would hide the function.
"""
