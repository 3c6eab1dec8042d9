"""Quality of regions: variants of `superfacets.segment` on models of the Princeton benchmark.

Two measures are compared: the undersegmentation error (UE) and compactness. Both are better if
lower. All results except times are reproducible.

- `measure`: variants, models at several resolutions, and the measurements of each run.
- `tables`: tables of the measurements. `study`: all stages of the study in order.
- The command-line options are in `superfacets.cli.studies`.
"""
