"""Quality of regions: variants of `superfacets.segment` on models of the Princeton benchmark.

Two numbers are compared, both better if lower: the undersegmentation error (UE) and compactness.
Everything but times is reproducible.

- `measure`: variants, models at several scales, and a row of numbers for each run.
- `tables`: tables of these rows. `study`: all stages in order. Options: `superfacets.cli.studies`.
"""
