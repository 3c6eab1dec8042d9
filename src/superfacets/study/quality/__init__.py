"""Compare variants of `superfacets.segment` on models of the Princeton benchmark.

Two measures are compared, and lower values of both measures are better: the undersegmentation error
(UE) and compactness. All results except times are reproducible.

- `measure` changes the resolution of models, and measures the regions of each variant.
- `tables` makes tables of the measurements. `study` runs all stages of the study in order.

The command-line options are in `superfacets.cli.studies`.
"""
