"""Run the work of batches, tiles and studies in worker processes and threads.

`calls` defines the interface of a team of workers. `pool` implements a team of processes on this
machine, `start` starts these processes, and `child` contains the code that they run. `threads`
implements a team of threads, and `scratch` stores arrays on disk that all workers can read.
"""
