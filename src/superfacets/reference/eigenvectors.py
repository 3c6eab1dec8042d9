"""The smoothest functions on a graph, by a dense eigensolver."""

from __future__ import annotations

import numpy as np

from .._types import Floats, Ints, Longs


def smallest_eigenpairs(
    offsets: Longs,
    neighbors: Ints,
    conductances: Floats,
    measures: Floats,
    n_constants: int,
    n_wanted: int,
) -> tuple[Floats, Floats]:
    """Eigenvalues of L x = lambda A x above those of the constants, and vectors, (N, m).

    Eigenvalues are the core's but for rounding; so are vectors of single eigenvalues, but for their
    signs.
    """
    n = len(measures)
    laplacian = np.zeros((n, n))
    sources = np.repeat(np.arange(n), np.diff(offsets))
    np.add.at(laplacian, (sources, neighbors), -conductances)
    laplacian[np.diag_indices(n)] -= laplacian.sum(axis=1)
    scale = 1.0 / np.sqrt(measures)
    values, vectors = np.linalg.eigh(scale[:, None] * laplacian * scale)
    some = slice(n_constants, n_constants + n_wanted)
    return values[some], (scale[:, None] * vectors)[:, some]
