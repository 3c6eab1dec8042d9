"""Embed the cells of a shape so that its parts, such as a finger and the palm, are far apart.

The coordinates of the spectral embedding are the eigenvectors of the graph Laplacian with the
smallest eigenvalues. In this embedding, cells in different parts are far from each other.
Eigenvectors are computed on coarse cells (groups of cells), and interpolated to finer cells.
`stages.part_costs` makes the costs of arcs between parts from the embedding.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.types import ArcLists, Floats, Ints, Singles

N_COARSE = 700
"""Approximate number of coarse cells for which eigenvectors are computed. More coarse cells would
take more time, but not improve regions: with 1,500 coarse cells, regions are equally good."""

MAX_COARSE = 8 * N_COARSE
"""Maximum number of coarse cells for which eigenvectors are computed. Only meshes with thousands of
components, such as triangle soup, have more coarse cells. For these meshes, costs between parts are
0."""

MAX_CELLS = 16
"""Maximum number of cells that are grouped into one cell of the next coarser level."""

MIN_GROUPED = 96_000
"""Minimum number of cells of a graph for which `groups_to_embed` makes groups."""

CREASE_STEEPNESS = 13.0
"""Conductances across creases are multiplied by exp(-CREASE_STEEPNESS * eta * theta / pi). Theta is
the angle between the normals of the two faces. Eta is the relative cost of the crease: usually 1
for concave edges and ridges, and 0 for other convex edges."""

MIN_CONDUCTANCE = 1e-6
"""Minimum conductance of an arc, so that neighboring cells stay connected. `_core` uses the same
value."""

N_VECTORS = 8
"""Number of eigenvectors. On the benchmark models, regions are worse with 12 eigenvectors.
With 4 eigenvectors, small changes of a mesh change the regions strongly."""

N_COMPARED = 15
"""Number of positive eigenvalues to compute. The eigenvalue 0, which belongs to vectors that are
constant on each component, is left out."""

MIN_VALUE = 1e-3
"""Eigenvalues are raised to at least this fraction of the largest computed eigenvalue. Vectors are
divided by the square root of their eigenvalues. If two pieces of a mesh are barely connected, the
vector that separates them has a tiny eigenvalue. Without the minimum, this vector would dominate
the embedding."""

EQUAL = 1e-3
"""Maximum relative difference of eigenvalues that are treated as equal. Eigenvectors of equal
eigenvalues are used together, because choosing some of them would be arbitrary."""

MIN_BLOCKED, FULL_BLOCKED = 0.001, 0.03
"""Costs between parts, and of likely borders, are 0 if `ConductingGraph.blocked_fraction` is at
most the first value, and have their full value if it is at least the second. In between, they
increase linearly. The fraction is 0 for surfaces without concave edges and ridges, such as smooth
convex bodies, which have no parts. It is at least 0.037 for all benchmark models."""

BORDER_COEFFICIENTS = np.array([-0.2, 3.48, 7.67, 0.98, -0.94, -0.02, 1.31, 2.74, -7.74, -5.52])
"""Coefficients of the rate of borders (see `_core.border_rates`). Each is the mean of two values.
research/border_rates.py fits one to borders that people drew, and research/tune.py finds the other.
With the latter alone, areas vary more on smooth bodies with sharp creases."""


class ConductingGraph(NamedTuple):
    """Graph of the cells of one level: either all cells, or groups of cells of the finer level."""

    arcs: ArcLists
    steps: Floats  # (M,) length of each arc without the cost of creases
    conductances: Floats  # (M,) conductance of each arc, which is low across creases
    measures: Floats  # (N,) area of each cell
    coarse_of: Ints | None = None  # (N,) cell of the next coarser level that contains each cell
    blocked_fraction: float = 0.0  # fraction of the total border length that is blocked by creases


def conducting_graph(
    graph: _core.OrderedGraph, crease_cost: float, n_threads: int
) -> ConductingGraph:
    """Return arcs and conductances. `crease_cost` is for a concave crease of angle pi."""
    offsets, neighbors, steps, conductances, share = _core.conducting_arcs(
        graph, crease_cost / graph.straight_unit, CREASE_STEEPNESS, n_threads
    )
    arcs = (offsets, neighbors)
    return ConductingGraph(arcs, steps, conductances, graph.measures(), blocked_fraction=share)


def strength_of_parts(level: ConductingGraph) -> float:
    """Return the factor from 0 to 1 of costs between parts, and of likely borders."""
    return min(max((level.blocked_fraction - MIN_BLOCKED) / (FULL_BLOCKED - MIN_BLOCKED), 0.0), 1.0)


def scale(level: ConductingGraph, vectors: Singles, n_threads: int) -> float:
    """Return the length of all arcs, divided by their length in the embedding; 0 if that is 0."""
    zeros, table = np.zeros(len(level.steps)), vectors.astype(np.float64)
    distances = _core.add_feature_steps(*level.arcs, zeros, table, 1.0, n_threads)
    total = _core.sum_of(distances, n_threads)
    return _core.sum_of(level.steps, n_threads) / total if total > 0.0 else 0.0


def embedding(
    base: ConductingGraph, graph: _core.OrderedGraph, n_threads: int, n_vectors: int = N_VECTORS
) -> Singles:
    """Return the coordinates of cells in the embedding, (N, Q); Q is 0 for triangle soup."""
    levels = _coarser(base, graph, n_threads)
    if len(levels[-1].measures) > MAX_COARSE:
        return np.zeros((graph.n_cells, 0), np.float32)
    return _prolonged(levels, _eigenvectors(levels[-1], n_vectors), n_threads)


def _coarser(
    level: ConductingGraph, graph: _core.OrderedGraph, n_threads: int
) -> list[ConductingGraph]:
    """Return a list of `level`, with the cells of `graph`, and of successively coarser levels."""
    levels: list[ConductingGraph] = []
    coarse: list[_core.CoarseGraph] = []  # keeps the owner of `graph` in memory
    while graph.n_cells >= 2 * N_COARSE:
        # the same number of cells per coarse cell on all levels
        ratio = graph.n_cells / N_COARSE
        size = round(math.pow(ratio, 1 / math.ceil(math.log(ratio) / math.log(MAX_CELLS))))
        coarse.append(_core.CoarseGraph(graph, size, n_threads))
        if 2 * coarse[-1].graph.n_cells > graph.n_cells:
            break  # most cells have no neighbors, as in triangle soup
        coarse_of = coarse[-1].coarse_cells(n_threads)
        levels.append(level._replace(coarse_of=coarse_of))
        graph = coarse[-1].graph
        arcs = coarse[-1].arcs()[:2]
        steps = _core.straight_steps(graph, n_threads)
        # sum of conductance times length over the arcs that a coarse arc joins
        flows = _core.sum_between(*level.arcs, level.conductances, level.steps, coarse_of, *arcs)
        conductances = np.where(flows > 0.0, flows / steps, MIN_CONDUCTANCE)
        level = ConductingGraph(arcs, steps, conductances, graph.measures())
    return [*levels, level]


def _eigenvectors(level: ConductingGraph, n_vectors: int) -> Floats:
    """Return the coordinates in the embedding of the cells of the coarsest level, (C, Q)."""
    n_cells = len(level.measures)
    mean = float(level.measures.mean()) or 1.0
    measures = np.maximum(level.measures / mean, 1e-6)
    components, n_components = _core.find_components(*level.arcs, np.zeros(n_cells, np.int32))
    values, table = _core.smallest_eigenpairs(
        *level.arcs, level.conductances, measures, components, n_components, N_COMPARED
    )
    if not len(values):
        return np.zeros((n_cells, 0))
    values = np.maximum(values, MIN_VALUE * values[-1])
    n_taken = _end_of_group(values, n_vectors)
    scales = np.sqrt(values[0] / values[:n_taken])
    return np.asarray(table.reshape(n_cells, -1)[:, :n_taken] * scales)


def _end_of_group(values: Floats, n_vectors: int) -> int:
    """Return `n_vectors`, or more to include equal eigenvalues, unless all others are equal."""
    wanted = min(n_vectors, len(values))
    lasts = range(wanted, len(values))
    return next((last for last in lasts if values[last] > (1 + EQUAL) * values[last - 1]), wanted)


def _prolonged(levels: list[ConductingGraph], values: Floats, n_threads: int) -> Singles:
    """Copy `values` from the last to the first level, and smooth the copies by relaxation."""
    rows = values.astype(np.float32)
    for level in reversed(levels[:-1] if rows.size else ()):
        assert level.coarse_of is not None
        n_sweeps = math.ceil(2.0 * math.sqrt(len(level.coarse_of) / len(rows))) + 2
        copied = np.take(rows, level.coarse_of, axis=0)
        relaxed = _core.relax(*level.arcs, level.conductances, copied, n_sweeps, n_threads)
        rows = relaxed.reshape(-1, rows.shape[1])
    return rows if rows.size else np.zeros((len(levels[0].measures), values.shape[1]), np.float32)
