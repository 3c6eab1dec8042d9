"""One pool of worker processes for batches, tiles and studies.

`calls` is the interface of a team of workers. `pool` is the team of this machine, `start` starts
its processes, and `child` is the code that runs in them.
"""
