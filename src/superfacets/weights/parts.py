"""Compute the costs of arcs between parts of a shape, such as a finger and the palm of a hand.

The cost of an arc is proportional to the distance of its two cells in a spectral embedding. The
coordinates of the embedding are the eigenvectors of the graph Laplacian with the smallest
eigenvalues. In this embedding, cells in different parts are far from each other. Eigenvectors are
computed on coarse cells (groups of cells), and interpolated to finer cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.checks import checked_count, checked_threads
from ..base.types import ArcLists, Floats, Ints, Singles
from ..graph.constraints import NO_GROUPS
from ..graph.kinds import kind_of
from ..graph.size import DEFAULT_N_SEGMENTS, radius_of
from ..mesh.convert import CloudLike, MeshLike, as_cells
from .formulas import WeightOptions, weights_of_kind

PART_CREASE_SCALE = 7.0
"""Value that replaces `cleanup.edit.CREASE_SCALE` for weights ``"parts"``. With a value of 6, the
compactness is 0.01 higher (worse)."""

UNIT_FACTOR = 4.0
"""Factor by which the unit of integer path lengths is increased if there are costs between parts.
These costs increase the total length of all arcs by a factor of up to 1 + gamma. With the larger
unit, path lengths stay within the range of integers."""

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

GROUP_SIZE = 8
"""Approximate number of cells per group in `groups_to_embed`."""

GROUP_STEP = 0.5
"""Factor that reduces the costs between parts in the costs of region borders, if the embedding has
one vector per group of cells. Arcs inside a group then have no costs between parts. Without the
reduction, borders of regions would therefore follow the borders of groups. On meshes of 200,000
faces, compactness would be 0.1 higher (worse)."""

CREASE_STEEPNESS = 20.0
"""Conductances across creases are multiplied by exp(-CREASE_STEEPNESS * eta * theta / pi). Theta is
the angle between the normals of the two faces. Eta is the relative cost of the crease: usually 1
for concave edges and ridges, and 0 for other convex edges."""

MIN_BLOCKED, FULL_BLOCKED = 0.001, 0.03
"""Costs between parts are 0 if `_ConductingGraph.blocked_fraction` is at most the first value, and
have their full value if it is at least the second. In between, they increase linearly. The fraction
is 0 for surfaces without concave edges and ridges, such as smooth convex bodies, which have no
parts. It is at least 0.037 for all benchmark models."""

MIN_CONDUCTANCE = 1e-6
"""Minimum conductance of an arc, so that neighboring cells stay connected. `_core` uses the same
value."""

N_VECTORS = 8
"""Default number of eigenvectors. On the benchmark models, regions are worse with 12 eigenvectors.
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

FAR_STEPS, SHORT_STEPS = 3, 2
"""A far arc is an additional arc between faces that are not neighbors. These are the maximum
distances between two faces that are joined by a far arc, counted in arcs. SHORT_STEPS is used in a
short loop (see `Coarsening.is_short`), and for graphs with groups (see `groups_to_embed`). With
SHORT_STEPS, there are 9 instead of 20 far arcs per face. Regions are then 0.2 % to 0.4 % more
compact, but 5 % longer on regular grids."""


@dataclass(frozen=True, eq=False)
class PartCosts:
    """Costs of arcs between parts of a shape, proportional to distances in a spectral embedding."""

    vectors: Singles
    """Coordinates of each group of cells in the embedding, (G, Q). Q is 0 if there are no costs."""
    group_of: Ints
    """Group of each cell, (N,); empty if each cell is its own group."""
    factor: float
    """Cost of an arc between cells at a distance of 1 in the embedding, in units of integer path
    lengths."""

    @classmethod
    def of(
        cls, graph: _core.OrderedGraph, groups: list[_core.CoarseGraph],
        factors: tuple[float, float], n_threads: int,
    ) -> PartCosts:  # fmt: skip
        """Compute the spectral embedding of a graph, and the factor of the costs.

        `groups` contains successively coarser graphs. The cells of the last graph are embedded, or
        the cells of `graph` if `groups` is empty. `factors` contains gamma, and the cost of a
        concave crease of angle pi in the unit of the positions. The cost of an arc is gamma times
        the distance of its ends in the embedding. Distances are scaled so that, over all arcs of
        the embedded graph, their sum equals the sum of the arc lengths without crease costs. On
        shapes with few creases, gamma is reduced (see `MIN_BLOCKED`).
        """
        gamma, crease_cost = factors
        embedded = groups[-1].graph if groups else graph
        base = _conducting_graph(embedded, crease_cost, n_threads)
        vectors = _embedding(base, embedded, n_threads)
        strength = (base.blocked_fraction - MIN_BLOCKED) / (FULL_BLOCKED - MIN_BLOCKED)
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
        """Add far arcs, and the costs between parts, to `graph` and to the graphs in `coarse`.

        Far arcs join cells of `graph` that are 2 to `far_steps` arcs apart. If `far_steps` is 1,
        `graph` gets no far arcs. Pass 1 unless `has_small_regions` is True: with larger regions,
        far arcs between all cells would dominate the run time.
        """
        graph.add_far_arcs(n_threads, far_steps)
        graph.add_part_costs(self.group_of, self.vectors, self.factor, n_threads)
        rows, group_of = self.vectors, self.group_of
        for level in coarse:
            rows = self._add_to(level, _means(level, rows, group_of, n_threads), n_threads)
            group_of = NO_GROUPS

    def add_to_coarse(self, coarse: list[_core.CoarseGraph], n_threads: int) -> None:
        """Add far arcs, and the costs between parts, to the coarse graphs in `coarse`.

        The first graph in `coarse` is the embedded graph.
        """
        rows = self._add_to(coarse[0], self.vectors, n_threads)
        for level in coarse[1:]:
            rows = self._add_to(level, _means(level, rows, NO_GROUPS, n_threads), n_threads)

    def _add_to(self, level: _core.CoarseGraph, rows: Singles, n_threads: int) -> Singles:
        """Add far arcs, and the costs between parts, to a graph of coarse cells.

        `rows` is the vector of each coarse cell, and is returned.
        """
        level.add_far_arcs(n_threads)
        level.add_part_costs(rows, self.factor, n_threads)
        return rows

    def border_lengths(self, arcs: ArcLists, lengths: Singles, n_threads: int) -> Singles:
        """Return `lengths` plus costs between parts, for the computation of border costs.

        If there are groups, the costs between parts are reduced by `GROUP_STEP`.
        """
        factor = self.factor * (GROUP_STEP if len(self.group_of) else 1.0)
        return _core.add_part_costs(*arcs, lengths, self.group_of, self.vectors, factor, n_threads)


def _means(level: _core.CoarseGraph, rows: Singles, group_of: Ints, n_threads: int) -> Singles:
    """Return the mean vector of the cells in each coarse cell of `level`.

    `rows` is the vector of each group of cells, and `group_of` is the group of each cell.
    """
    return level.means_of(rows, group_of, n_threads).reshape(-1, rows.shape[1])


def _group_of(groups: list[_core.CoarseGraph], n_threads: int) -> Ints:
    """Return, for each cell, the cell of the last graph in `groups` that contains the cell.

    The result is empty if `groups` is empty.
    """
    if not groups:
        return NO_GROUPS
    found = groups[0].coarse_cells(n_threads)
    for level in groups[1:]:
        found = level.coarse_cells(n_threads)[found]
    return found


class _ConductingGraph(NamedTuple):
    """Graph of the cells of one level: either all cells, or groups of cells of the finer level."""

    arcs: ArcLists
    steps: Floats  # (M,) length of each arc without the cost of creases
    conductances: Floats  # (M,) conductance of each arc, which is low across creases
    measures: Floats  # (N,) area of each cell
    coarse_of: Ints | None = None  # (N,) cell of the next coarser level that contains each cell
    blocked_fraction: float = 0.0  # fraction of the total border length that is blocked by creases


def spectral_embedding(
    mesh: MeshLike | CloudLike,
    n_vectors: int = N_VECTORS,
    *,
    weld: bool = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return coordinates for each face, such that different parts of a shape are far apart.

    The coordinates are the eigenvectors of the smallest eigenvalues of :math:`L \phi = \lambda A
    \phi`, with areas A and the Laplacian L of the face graph. The conductance of an arc is

    .. math:: c_{ij} = \frac{\sqrt{A_i + A_j}}{g} \exp(-20 \kappa) + 10^{-6}

    where g is the distance between the centroids of the two faces, and kappa = eta theta / pi.
    Theta is the angle between the normals. Eta is the relative cost of the edge with the weights
    ``"parts"``: usually 1 for concave edges and ridges, and 0 for other convex edges. The
    conductance across creases is therefore low. For example, coordinates of fingers are far from
    coordinates of the palm, because creases separate fingers and palm. Vector q is scaled by
    :math:`(\lambda_q / \lambda_1)^{-1/2}`.

    Eigenvectors are computed on about 700 groups of faces, interpolated to the faces, and smoothed
    by relaxation. Vectors that are constant on each component are excluded. Eigenvalues below 0.001
    times the 15th eigenvalue are raised to this value.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, PointCloud, TetMesh or mesh-like
        Same as in `segment`.
    n_vectors : int, default 8
        Number of coordinates, from 1 to 15.
    weld, n_threads
        Same as in `segment`. The result does not depend on the number of threads.

    Returns
    -------
    ndarray of float64, shape (N, n_vectors)
        Coordinates of each face. Only ratios of distances are meaningful. The sign of each column
        is chosen so that, over the groups of faces, the coordinate with the largest absolute value
        is positive. If eigenvalues are equal, as for symmetric shapes, the basis of their
        eigenvectors is arbitrary. If a mesh has too few faces for `n_vectors` eigenvectors, the
        last columns are 0. All columns are 0 for meshes with thousands of components. The run time
        is about 2 microseconds per face.

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
    normals = None if shapes is None else shapes.normals
    weights = weights_of_kind(kind, surface, graph, radius, options, normals)
    lengths, unit = graph.quantized(weights.weights, threads)
    placed = _core.PlacedCells(graph.positions, graph.measures, threads)
    unit *= surface.weight_unit
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, threads, True, unit)
    base = _conducting_graph(ordered, options.crease_cost(radius), threads)
    vectors = _embedding(base, ordered, threads, n_vectors)
    table = np.zeros((surface.n_cells, n_vectors))
    n_there = min(n_vectors, vectors.shape[1])
    table[:, :n_there] = vectors[:, :n_there]
    return table


def groups_to_embed(graph: _core.OrderedGraph, n_threads: int) -> list[_core.CoarseGraph]:
    """Group the cells of a large graph; return the graph of the groups in a list of one graph.

    The list is empty if the graph has fewer than `MIN_GROUPED` cells, and for triangle soup, in
    which most cells have no neighbors.
    """
    if graph.n_cells < MIN_GROUPED:
        return []
    groups = _core.CoarseGraph(graph, GROUP_SIZE, n_threads)
    return [groups] if 2 * groups.graph.n_cells <= graph.n_cells else []


def _conducting_graph(
    graph: _core.OrderedGraph, crease_cost: float, n_threads: int
) -> _ConductingGraph:
    """Return the arcs of a graph with their conductances, which are low across creases.

    `crease_cost` is the cost of a concave crease of angle pi, in the unit of the positions.
    """
    offsets, neighbors, steps, conductances, share = _core.conducting_arcs(
        graph, crease_cost / graph.straight_unit, CREASE_STEEPNESS, n_threads
    )
    arcs = (offsets, neighbors)
    return _ConductingGraph(arcs, steps, conductances, graph.measures(), blocked_fraction=share)


def _scale(level: _ConductingGraph, vectors: Singles, n_threads: int) -> float:
    """Return the total length of all arcs, divided by their total length in the embedding.

    Lengths do not include crease costs. If the total length in the embedding is 0, the result is 0.
    """
    zeros, table = np.zeros(len(level.steps)), vectors.astype(np.float64)
    distances = _core.add_feature_steps(*level.arcs, zeros, table, 1.0, n_threads)
    total = _core.sum_of(distances, n_threads)
    return _core.sum_of(level.steps, n_threads) / total if total > 0.0 else 0.0


def _embedding(
    base: _ConductingGraph, graph: _core.OrderedGraph, n_threads: int, n_vectors: int = N_VECTORS
) -> Singles:
    """Return the coordinates of the cells of `graph` in the spectral embedding, (N, Q).

    `base` has the conductances of the arcs of `graph`. Q is 0 if there are more than `MAX_COARSE`
    coarse cells.
    """
    levels = _coarser(base, graph, n_threads)
    if len(levels[-1].measures) > MAX_COARSE:
        return np.zeros((graph.n_cells, 0), np.float32)
    return _prolonged(levels, _eigenvectors(levels[-1], n_vectors), n_threads)


def _coarser(
    level: _ConductingGraph, graph: _core.OrderedGraph, n_threads: int
) -> list[_ConductingGraph]:
    """Return a list of `level` and of successively coarser levels.

    `level` and `graph` have the same cells and arcs.
    """
    levels: list[_ConductingGraph] = []
    coarse: list[_core.CoarseGraph] = []  # keeps the owner of `graph` in memory
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
        level = _ConductingGraph((offsets, neighbors), steps, conductances, graph.measures())
    return [*levels, level]


def _cell_size(ratio: float) -> int:
    """Return the number of cells per coarse cell that reduces the number of cells by `ratio`.

    The reduction takes several levels if `ratio` is larger than `MAX_CELLS`. The result is the
    same for all levels.
    """
    n_levels: int = math.ceil(math.log(ratio) / math.log(MAX_CELLS))
    return round(math.pow(ratio, 1 / n_levels))


def _crossing_conductances(level: _ConductingGraph, arcs: ArcLists, steps: Floats) -> Floats:
    """Return the conductance of each arc between coarse cells.

    It is the sum of conductance times length over all arcs of `level` between the two coarse cells,
    divided by the length of the coarse arc in `steps`.
    """
    assert level.coarse_of is not None
    flows = _core.sum_between(*level.arcs, level.conductances, level.steps, level.coarse_of, *arcs)
    return np.where(flows > 0.0, flows / steps, MIN_CONDUCTANCE)


def _eigenvectors(level: _ConductingGraph, n_vectors: int) -> Floats:
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
    """Return the number of vectors to use: `n_vectors`, or more to include equal eigenvalues.

    If all eigenvalues from number `n_vectors` on are equal, no vectors are added.
    """
    wanted = min(n_vectors, len(values))

    def is_end(last: int) -> bool:
        return bool(values[last] > (1 + EQUAL) * values[last - 1])

    return next((last for last in range(wanted, len(values)) if is_end(last)), wanted)


def _prolonged(levels: list[_ConductingGraph], values: Floats, n_threads: int) -> Singles:
    """Interpolate `values` from the cells of the last level to the cells of the first level."""
    rows = values.astype(np.float32)
    for level in reversed(levels[:-1] if rows.size else ()):
        assert level.coarse_of is not None
        rows = _relaxed(rows, level.coarse_of, level, n_threads)
    return rows if rows.size else np.zeros((len(levels[0].measures), values.shape[1]), np.float32)


def _relaxed(rows: Singles, coarse_of: Ints, level: _ConductingGraph, n_threads: int) -> Singles:
    """Copy the row of each coarse cell to its finer cells, and smooth the copies by relaxation."""
    n_sweeps = math.ceil(2.0 * math.sqrt(len(coarse_of) / len(rows))) + 2
    copied = np.take(rows, coarse_of, axis=0)
    relaxed = _core.relax(*level.arcs, level.conductances, copied, n_sweeps, n_threads)
    return relaxed.reshape(-1, rows.shape[1])
