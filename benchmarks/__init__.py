"""Speed of superfacets: ``make bench``, or ``python -m benchmarks --help``.

meshes     the meshes to segment: files, and finer meshes made from them
plan       which meshes, numbers of regions, settings and threads are run
checks     labels are compared with stored hashes, or with invariants, before a time is kept
clock      interleaved jobs, their times, medians
runs       arrays to labels, stage by stage
passes     a single classification of all faces
rivals     METIS, pyacvd, SLIC and SciPy, called as their users call them
races      comparisons of rivals with superfacets
memory     peak memory, in a fresh process
processes  imports and whole runs of the command, in fresh processes
machine    facts about the machine
report     tables in Markdown from a file of results
"""
