"""Speed of superfacets: ``make bench``, or ``python -m benchmarks --help``.

meshes     the meshes to segment: files, and finer meshes made from them
plan       which meshes, numbers of regions, settings and threads are run
checks     labels are compared with stored hashes, or with invariants, before a time is kept
clock      jobs that take turns, their times, medians
runs       arrays to labels, stage by stage
passes     one classification of all faces, on its own
rivals     METIS, pyacvd, SLIC, SciPy, each as its users would call it
races      rivals and superfacets side by side
memory     peak memory, in a fresh process
processes  imports and whole runs of the command, in fresh processes
machine    facts about the machine
report     tables in Markdown from a file of results
"""
