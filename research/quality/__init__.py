"""Compare variants of `superfacets.segment` on models of the Princeton benchmark.

The variants are compared by their undersegmentation error (UE) and compactness. Lower values of
both are better. All results except times are reproducible.

- `measure` changes the resolution of models, segments them, and measures the regions.
- `tables` makes tables of the measurements. `study` runs all stages in order.

The command-line options are in `superfacets_cli.studies`.
"""
