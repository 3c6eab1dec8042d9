"""Quality of regions: variants of `superfacets.segment` on models of the Princeton benchmark.

Two measures are compared: the undersegmentation error (UE) and compactness. Both are better if
lower. All results except times are reproducible.

- `measure`: variants, models at several scales, and a row of numbers for each run.
- `tables`: tables of these rows. `study`: all stages in order. Options: `superfacets.cli.studies`.
"""
