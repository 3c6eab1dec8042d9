"""The paper's comparison, run again: methods x settings over a benchmark, its figures and a page.

- `methods`: what is compared, and how each method is run.
- `sources`: the meshes, of the benchmark and of the user.
- `gallery`: which pictures are made. `plan`: which runs all of that takes.
- `runs`: a run and its record. `measure`: tasks, and what they record of a run.
- `results`: what the records say. `rows`: CSV files. `figures`: plots. `pictures`: rendered meshes.
- `page`: all of it on one page, from the templates beside it.
- `reproduction`: the stages in order. Its options: `superfacets.cli.reproduce`.
"""
