"""How good regions are: variants of `superfacets.segment` on the models of the Princeton benchmark.

What counts is the trade-off between two numbers, both better if lower: the undersegmentation error
(UE) and compactness. Labels do not depend on threads: but for times, results are the same on each
run.

- `variants`: what is compared.
- `subjects`: models at several resolutions, and their creases. `measure`: a row for each run.
- `tables`: what the rows say. `study`: all of it. `command`: ``superfacets quality``.
"""
