"""Batches: one function that processes a file, and teams of workers that apply it to thousands.

Not called ``batch``: that is the function, and a module of its name would take its place.
"""
