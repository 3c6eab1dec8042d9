"""Stage 2: costs of arcs between the parts of a shape, such as a finger and the palm of a hand.

Parts are far apart in the spectral embedding, whose coordinates are eigenvectors of the Laplacian
for the smallest eigenvalues. The eigenvectors are computed on coarse cells and interpolated to
finer cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import ArcLists, Floats, Ints, Singles
from .._validate import checked_count, checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..cells.kinds import kind_of
from ..cells.size import DEFAULT_N_SEGMENTS, radius_of
from ..cells.weights import WeightOptions

PART_CREASE_SCALE = 7.0
"""Value of `regions.edit.CREASE_SCALE` for weights ``"parts"``. With 6, compactness is higher by
0.01."""

SPARE = 4.0
"""Factor that makes the unit of path lengths coarser, because costs between parts make paths up to
1 + gamma times as long."""

N_COARSE = 700
"""Approximate number of coarse cells for which eigenvectors are computed. The regions are not
better with 1,500 coarse cells."""

MOST_COARSE = 8 * N_COARSE
"""Maximum number of coarse cells for which eigenvectors are computed. Only meshes with thousands of
components, such as triangle soup, have more coarse cells. These meshes get no costs between
parts."""

MOST_CELLS = 16
"""Maximum number of cells that are merged into one cell of the next coarser level."""

LEAST_GROUPED = 96_000
"""Minimum number of cells for `groups_to_embed`, if the loop runs on all cells."""

GROUP_SIZE = 8
"""Number of cells per group in `groups_to_embed`."""

GROUP_STEP = 0.5
"""Factor of the costs between groups in border costs. The whole distance between two groups is
assigned to the arcs between them, which attracts borders of regions to borders of groups. With a
factor of 1, the compactness is 0.1 higher on meshes of 200,000 faces."""

CREASE_STEEPNESS = 20.0
"""Conductances across creases are multiplied by exp(-20 kappa), where kappa = eta theta / pi."""

LEAST_HINDERED, ENOUGH_HINDERED = 0.001, 0.03
"""Costs increase from zero to their full value between these two values of `hindered_share`. A
surface without concave creases, such as a plane or a convex body, has no parts, and its
`hindered_share` is 0. All benchmark models have 0.037 or more."""

LEAST_CONDUCTANCE = 1e-6
"""Minimum conductance, as in the C++ core, which ensures that connected cells stay connected."""

N_VECTORS = 8
"""Number of eigenvectors. On the benchmark models, 12 are worse, and results of 4 are unstable."""

N_COMPARED = 15
"""Number of computed eigenvalues, in addition to the eigenvalues of constant vectors."""

LEAST_VALUE = 1e-3
"""Minimum of eigenvalues, as a fraction of the last computed eigenvalue. Smaller eigenvalues belong
to barely connected pieces. Vectors are scaled by the inverse square root of their eigenvalues, so
these pieces would dominate all other parts."""

EQUAL = 1e-3
"""Maximum relative difference of eigenvalues that are treated as equal. Eigenvectors of equal
eigenvalues have an arbitrary basis, so they are used together or not at all."""

FAR_STEPS, SHORT_STEPS = 3, 2
"""A far arc joins two faces that are at least two arcs apart. The numbers are the maximum distances
between these faces, counted in arcs: in a normal loop, and in a short loop or a graph with groups.
With the smaller maximum, there are 9 far arcs per face instead of 20. The regions are then 0.2 % to
0.4 % more compact, but 5 % longer on regular grids."""

NO_GROUPS = np.empty(0, np.int32)
"""Value of `PartPrices.group_of` if there are no groups."""


@dataclass(frozen=True, eq=False)
class PartPrices:
    """Costs of arcs between parts of a shape, proportional to distances in a spectral embedding."""

    vectors: Singles
    """Coordinates of each group of cells, (G, Q); Q may be 0."""
    group_of: Ints
    """Group of each cell, (N,); empty if each cell is a group."""
    factor: float
    """Cost of a distance of 1 in the embedding, in the unit of path lengths."""

    @classmethod
    def of(
        cls, graph: _core.OrderedGraph, groups: list[_core.CoarseGraph],
        factors: tuple[float, float], n_threads: int,
    ) -> PartPrices:  # fmt: skip
        """Compute the embedding of the cells, or groups of cells, of a graph with straight steps.

        `groups` are successively coarser graphs, and the cells of the last graph are embedded.
        Without groups, the cells of the graph itself are embedded. `factors` are gamma, and the
        cost of a crease of angle pi in the unit of the positions. The cost of a step is gamma times
        the distance in the embedding. Distances are scaled so that their sum over all arcs equals
        the sum of the lengths of all steps.
        """
        gamma, crease_price = factors
        embedded = groups[-1].graph if groups else graph
        base = _level_of(embedded, crease_price, n_threads)
        vectors = _embedding(base, embedded, n_threads)
        strength = (base.hindered_share - LEAST_HINDERED) / (ENOUGH_HINDERED - LEAST_HINDERED)
        gamma *= min(max(strength, 0.0), 1.0)
        factor = gamma * _scale(base, vectors, n_threads) / graph.straight_unit
        return cls(vectors, _group_of(groups, n_threads), factor)

    def add_to_all(
        self,
        graph: _core.OrderedGraph,
        coarse: list[_core.CoarseGraph],
        n_threads: int,
        *,
        far_steps: int,
    ) -> None:
        """Add far arcs, and the costs between parts, to the graph and to coarser graphs.

        Far arcs join cells that are two or more arcs apart, in the graph itself at most
        `far_steps`. With `far_steps` 1, the graph itself has no far arcs, because they would
        dominate the run time if regions have thousands of cells.
        """
        graph.add_far_arcs(n_threads, far_steps)
        graph.add_part_prices(self.group_of, self.vectors, self.factor, n_threads)
        rows, group_of = self.vectors, self.group_of
        for level in coarse:
            rows = self._add_to(level, _means(level, rows, group_of, n_threads), n_threads)
            group_of = NO_GROUPS

    def add_to_coarse(self, coarse: list[_core.CoarseGraph], n_threads: int) -> None:
        """Like `add_to_all`, but only for the embedded graph and for coarser graphs."""
        rows = self._add_to(coarse[0], self.vectors, n_threads)
        for level in coarse[1:]:
            rows = self._add_to(level, _means(level, rows, NO_GROUPS, n_threads), n_threads)

    def _add_to(self, level: _core.CoarseGraph, rows: Singles, n_threads: int) -> Singles:
        """Add far arcs and costs to one coarse graph; return `rows`, the vectors of its cells."""
        level.add_far_arcs(n_threads)
        level.add_part_prices(rows, self.factor, n_threads)
        return rows

    def border_lengths(self, arcs: ArcLists, lengths: Singles, n_threads: int) -> Singles:
        """Return lengths of arcs plus costs between parts, from which border costs are computed."""
        factor = self.factor * (GROUP_STEP if len(self.group_of) else 1.0)
        return _core.add_part_prices(*arcs, lengths, self.group_of, self.vectors, factor, n_threads)


def _means(level: _core.CoarseGraph, rows: Singles, group_of: Ints, n_threads: int) -> Singles:
    """Return the mean vector of the cells in each coarse cell; `rows` has one vector per group."""
    return level.means_of(rows, group_of, n_threads).reshape(-1, rows.shape[1])


def _group_of(groups: list[_core.CoarseGraph], n_threads: int) -> Ints:
    """Return the cell of the coarsest graph, the last of `groups`, that contains each cell."""
    if not groups:
        return NO_GROUPS
    found = groups[0].coarse_cells(n_threads)
    for level in groups[1:]:
        found = level.coarse_cells(n_threads)[found]
    return found


class _Level(NamedTuple):
    """Cells of one level of coarseness, and the conductances of the arcs between them."""

    arcs: ArcLists
    steps: Floats  # (M,) length of each arc, without creases
    conductances: Floats  # (M,)
    measures: Floats  # (N,) area of each cell
    coarse_of: Ints | None = None  # (N,) cell of the next level that contains each cell
    hindered_share: float = 0.0  # fraction of the total flow that is blocked by creases


def spectral_embedding(
    mesh: MeshLike | CloudLike,
    n_vectors: int = N_VECTORS,
    *,
    weld: bool = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return coordinates of each face in which the parts of a shape are far apart.

    The coordinates are the eigenvectors of the smallest eigenvalues of :math:`L \phi = \lambda A
    \phi`, with areas A and the Laplacian L of the face graph. The conductance of an arc is

    .. math:: c_{ij} = \frac{\sqrt{A_i + A_j}}{g} \exp(-20 \kappa) + 10^{-6}

    where g is the distance between centroids, and kappa = theta / pi for concave edges with the
    angle theta between normals. The conductance across concave creases is low. For example, fingers
    have coordinates far from the palm, because creases separate them. Vector q is scaled by
    :math:`(\lambda_q / \lambda_1)^{-1/2}`.

    Eigenvectors are computed on about 700 coarse cells, interpolated to the faces, and smoothed by
    relaxation. Vectors that are constant on each component are excluded. Eigenvalues below a
    thousandth of the 15th eigenvalue are raised to this value.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, PointCloud, TetMesh or mesh-like
        As for `segment`.
    n_vectors : int, default 8
        Number of coordinates, from 1 to 15.
    weld, n_threads
        As for `segment`. The result does not depend on the number of threads.

    Returns
    -------
    ndarray of float64, shape (N, n_vectors)
        Coordinates of each face. Only ratios of distances are meaningful. The coordinate with the
        largest absolute value in each column is positive. If eigenvalues are equal, as for
        symmetric shapes, their basis is arbitrary. Columns are zero for meshes with few faces, and
        for triangle soup with thousands of components. The run time is about 2 microseconds per
        face.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> import superfacets
    >>> bear = superfacets.sample_mesh(5_000)
    >>> superfacets.spectral_embedding(bear).shape
    (4892, 8)
    """
    n_vectors = checked_count(n_vectors, "n_vectors", N_COMPARED)
    threads = checked_threads(n_threads)
    cells = as_cells(mesh)
    kind = kind_of(cells)
    graph, shapes = kind.build_graph(cells, weld, threads)
    surface = kind.surface(cells, graph, threads)
    n_regions = min(DEFAULT_N_SEGMENTS, surface.n_cells)
    radius = radius_of(graph.measures, n_regions, threads, kind.dimension)
    options = WeightOptions.checked("parts", None, None)
    weights = kind.weights(surface, graph, shapes, radius, options)
    lengths, unit = graph.quantized(weights.weights, threads)
    placed = _core.PlacedCells(graph.positions, graph.measures, threads)
    unit *= surface.weight_unit
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, threads, True, unit)
    base = _level_of(ordered, options.crease_price(radius), threads)
    vectors = _embedding(base, ordered, threads, n_vectors)
    table = np.zeros((surface.n_cells, n_vectors))
    n_there = min(n_vectors, vectors.shape[1])
    table[:, :n_there] = vectors[:, :n_there]
    return table


def groups_to_embed(graph: _core.OrderedGraph, n_threads: int) -> list[_core.CoarseGraph]:
    """Group the cells of a large graph, because embedding groups is faster than embedding cells.

    The result is empty for small graphs, and for triangle soup, where most cells have no neighbors.
    """
    if graph.n_cells < LEAST_GROUPED:
        return []
    groups = _core.CoarseGraph(graph, GROUP_SIZE, n_threads)
    return [groups] if 2 * groups.graph.n_cells <= graph.n_cells else []


def _level_of(graph: _core.OrderedGraph, crease_price: float, n_threads: int) -> _Level:
    """Return the level of a graph; `crease_price` is the cost of a crease of angle pi."""
    offsets, neighbors, steps, conductances, share = _core.conducting_arcs(
        graph, crease_price / graph.straight_unit, CREASE_STEEPNESS, n_threads
    )
    arcs = (offsets, neighbors)
    return _Level(arcs, steps, conductances, graph.measures(), hindered_share=share)


def _scale(level: _Level, vectors: Singles, n_threads: int) -> float:
    """Return the sum of the lengths of arcs divided by the sum of distances in the embedding.

    The result is 0 if all distances are 0.
    """
    zeros, table = np.zeros(len(level.steps)), vectors.astype(np.float64)
    distances = _core.add_feature_steps(*level.arcs, zeros, table, 1.0, n_threads)
    total = _core.sum_of(distances, n_threads)
    return _core.sum_of(level.steps, n_threads) / total if total > 0.0 else 0.0


def _embedding(
    base: _Level, graph: _core.OrderedGraph, n_threads: int, n_vectors: int = N_VECTORS
) -> Singles:
    """Return the coordinates of the cells of a graph; `base` is the level of this graph."""
    levels = _coarser(base, graph, n_threads)
    if len(levels[-1].measures) > MOST_COARSE:
        return np.zeros((graph.n_cells, 0), np.float32)
    return _prolonged(levels, _eigenvectors(levels[-1], n_vectors), n_threads)


def _coarser(level: _Level, graph: _core.OrderedGraph, n_threads: int) -> list[_Level]:
    """Return the given level, followed by successively coarser levels."""
    levels: list[_Level] = []
    coarse: list[_core.CoarseGraph] = []  # keeps references to all graphs
    while graph.n_cells >= 2 * N_COARSE:
        size = _cell_size(graph.n_cells / N_COARSE)
        coarse.append(_core.CoarseGraph(graph, size, n_threads))
        if 2 * coarse[-1].graph.n_cells > graph.n_cells:
            break  # most cells have no neighbors, as in triangle soup
        levels.append(level._replace(coarse_of=coarse[-1].coarse_cells(n_threads)))
        graph = coarse[-1].graph
        offsets, neighbors, _ = coarse[-1].arcs()
        steps = _core.straight_steps(graph, n_threads)
        conductances = _crossing_conductances(levels[-1], (offsets, neighbors), steps)
        level = _Level((offsets, neighbors), steps, conductances, graph.measures())
    return [*levels, level]


def _cell_size(ratio: float) -> int:
    """Return the number of cells per coarse cell, equal on all levels, for a total ratio."""
    n_levels: int = math.ceil(math.log(ratio) / math.log(MOST_CELLS))
    return round(math.pow(ratio, 1 / n_levels))


def _crossing_conductances(level: _Level, arcs: ArcLists, steps: Floats) -> Floats:
    """Return the conductances between coarse cells, summed over the finer arcs between them."""
    assert level.coarse_of is not None
    flows = _core.sum_between(*level.arcs, level.conductances, level.steps, level.coarse_of, *arcs)
    return np.where(flows > 0.0, flows / steps, LEAST_CONDUCTANCE)


def _eigenvectors(level: _Level, n_vectors: int) -> Floats:
    """Return the coordinates of the coarsest cells, (C, Q)."""
    n_cells = len(level.measures)
    mean = float(level.measures.mean()) or 1.0
    measures = np.maximum(level.measures / mean, 1e-6)
    components, n_components = _core.find_components(*level.arcs, np.zeros(n_cells, np.int32))
    values, table = _core.smallest_eigenpairs(
        *level.arcs, level.conductances, measures, components, n_components, N_COMPARED
    )
    if not len(values):
        return np.zeros((n_cells, 0))
    values = np.maximum(values, LEAST_VALUE * values[-1])
    n_taken = _end_of_group(values, n_vectors)
    scales = np.sqrt(values[0] / values[:n_taken])
    return np.asarray(table.reshape(n_cells, -1)[:, :n_taken] * scales)


def _end_of_group(values: Floats, n_vectors: int) -> int:
    """Return `n_vectors`, or a larger number if the next eigenvalues are equal to the last one."""
    wanted = min(n_vectors, len(values))

    def is_end(last: int) -> bool:
        return bool(values[last] > (1 + EQUAL) * values[last - 1])

    return next((last for last in range(wanted, len(values)) if is_end(last)), wanted)


def _prolonged(levels: list[_Level], values: Floats, n_threads: int) -> Singles:
    """Interpolate the rows of the coarsest cells to the finest cells, level by level."""
    rows = values.astype(np.float32)
    for level in reversed(levels[:-1] if rows.size else ()):
        assert level.coarse_of is not None
        rows = _relaxed(rows, level.coarse_of, level, n_threads)
    return rows if rows.size else np.zeros((len(levels[0].measures), values.shape[1]), np.float32)


def _relaxed(rows: Singles, coarse_of: Ints, level: _Level, n_threads: int) -> Singles:
    """Copy the row of each coarse cell to its cells, and smooth the copies by relaxation."""
    n_sweeps = math.ceil(2.0 * math.sqrt(len(coarse_of) / len(rows))) + 2
    copied = np.take(rows, coarse_of, axis=0)
    relaxed = _core.relax(*level.arcs, level.conductances, copied, n_sweeps, n_threads)
    return relaxed.reshape(-1, rows.shape[1])
