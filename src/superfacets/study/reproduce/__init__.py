"""The paper's comparison, run again: methods and settings on a benchmark, its figures and a page.

- `methods`: the table of methods, and how each is run.
- `measure`: a run and its record.
- `gallery`: pictures of meshes. `plan`: all runs for the figures that are asked for.
- `results`: curves and means of the records. `figures`: plots.
- `page`: one page with everything, from the templates beside it.
- `reproduction`: the stages in order. Options: `superfacets.cli.studies`.
"""
