"""Reproduce the paper's comparison of methods on a benchmark, with figures and a page of results.

- `methods` defines the table of methods and how each method is run.
- `plan` lists all runs and pictures for the requested figures.
- `measure` applies one method to one mesh (a run), and stores the results in a record.
- `results` reads the records, and computes curves and means.
- `figures` draws plots, and `gallery` draws pictures of meshes.
- `page` writes one page with all results, from the templates in the folder ``templates``.
- `reproduction` runs all stages in order.

The command-line options are in `superfacets_cli.studies`.
"""
