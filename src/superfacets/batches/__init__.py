"""Many files: one place for what is done with a file, and teams of workers that do it to thousands.

Not called ``batch``: that is the function, and a module of its name would take its place.
"""
