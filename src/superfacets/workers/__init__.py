"""The pool of worker processes for batches, tiles and studies.

`calls` is the interface of a team of workers. `pool` is the team on this machine, `start` starts
its processes, and `child` is the code of these processes.
"""
