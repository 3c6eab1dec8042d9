"""Reading of meshes and labels: one file per format, on `text` and `guards`.

lagrange is not used: it does not notice cut files, misrounds decimals, takes the memory that a
header claims, and hangs, crashes or returns wrong numbers on some damaged files.
"""
