"""Measure the speed of superfacets: ``make bench``, or ``python -m benchmarks --help``.

meshes     the meshes to segment: files, and finer meshes made from files
plan       meshes, numbers of regions, settings and numbers of threads to run
checks     comparison of labels with stored hashes, or check of invariants, before a time is kept
clock      times of interleaved jobs, and their medians
runs       times from arrays to labels, stage by stage
passes     times of a single classification of all faces
rivals     METIS, pyacvd, SLIC and SciPy, called in the way that their users call them
races      times of rivals and of superfacets, side by side
memory     peak memory, in a fresh process
processes  times of imports, and of whole runs of the command, in fresh processes
sections   all of these measurements, mesh by mesh
targets    measurements that have a target
balance    regions of equal area, compared with METIS and pyacvd
batch      times of the command `superfacets batch`
doubling   growth of times with the number of cells
pages      sizes and times of HTML pages in a browser
machine    facts about the machine
report     tables in Markdown from a file of results
cli        the command line
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tests"))  # the package `reference`
