"""Many files: one place for what is done with a file, and Dask for doing it to thousands.

Not called ``batch``: that is the function, and a module of its name would take its place.
"""
