"""Compare superfacets with other methods on benchmarks, and reproduce the figures of the paper."""
