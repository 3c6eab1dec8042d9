"""The paper's comparison, run again: methods x settings over a benchmark, its figures and a page.

- `methods`: what is compared, and how each method is run.
- `sources`: the meshes, of the benchmark and of the user.
- `gallery`: which pictures are made. `plan`: which runs all of that takes.
- `records`: a file per run. `measure`: from a task to its records. `processes`: workers for tasks.
- `tables`: means and CSV. `figures`: plots. `pictures`: rendered meshes. `page`: all on one page.
- `reproduction`: the stages in order. Its options: `superfacets.cli.reproduce`.
"""
