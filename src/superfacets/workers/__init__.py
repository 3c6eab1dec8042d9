"""One pool of worker processes for batches, tiles and studies.

`calls` says what a team of workers does, wherever they are; `pool` is the team of this machine,
`start` begins its processes, and `child` is the code that runs in them.
"""
