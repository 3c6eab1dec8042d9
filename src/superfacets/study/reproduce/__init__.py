"""Reproduction of the paper's comparison: runs on a benchmark, figures, and a page of results.

- `methods`: the table of methods, and how each method is run.
- `measure`: a run and its record.
- `gallery`: pictures of meshes. `plan`: all runs for the requested figures.
- `results`: curves and means of the records. `figures`: plots.
- `page`: one page with all results, from the templates in the same folder.
- `reproduction`: all stages in order.
- The command-line options are in `superfacets.cli.studies`.
"""
