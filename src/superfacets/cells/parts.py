"""Stage 2: weights that keep regions within the parts of a shape.

Parts are far apart in the spectral embedding: the smallest eigenvectors of the Laplacian, computed
on coarse cells and interpolated to all cells.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import ArcLists, Floats, Ints, Singles
from .._validate import checked_count, checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cells
from .cell_graph import checked_weights
from .kinds import kind_of
from .size import DEFAULT_N_SEGMENTS, radius_of
from .surface import Surface
from .thickness import rays_from, rays_from_patches, smoothed
from .weights import WeightOptions

SMOOTH_DISTANCE = 2.3
"""Largest distance by which smoothing moves borders with these weights, in r. With 2, compactness
is 0.02 higher at the same undersegmentation error; with 3, it is 0.05 lower and the error 0.002
higher."""

THICKNESS_POWER = 0.125
"""Arc lengths are multiplied by (s_i s_j / s_mean^2)^(1/8): thin parts get smaller regions."""

N_COARSE = 1_500
"""Approximate number of coarse cells that eigenvectors are computed on."""

MOST_COARSE = 8 * N_COARSE
"""Maximum number of coarse cells for which eigenvectors are computed. Only meshes in thousands of
components, like soup, have more, and these have no parts."""

MOST_CELLS = 16
"""Maximum number of cells in a coarse cell, on each level."""

N_BASE = 12_000
"""Smallest number of groups. Meshes with at least `N_BASE` * `LEAST_GROUP` cells are embedded by
groups of cells in place of cells: 12,000 are enough to tell parts apart."""

LEAST_GROUP = 8
"""Smallest number of cells in a group. With groups of 4, the undersegmentation error of five models
of 50,000 faces is 0.008 higher than without groups."""

GROUP_STEP = 0.5
"""Factor of distances between groups. Paths cross the whole distance in one arc, at the border of
two groups, and borders of regions gather there: with 1, compactness is 0.1 higher on meshes of
200,000 faces."""

CREASE_STEEPNESS = 20.0
"""Conductances across creases are multiplied by exp(-20 kappa), kappa = eta theta / pi."""

LEAST_CONDUCTANCE = 1e-6
"""Smallest conductance, as in the core, so that connected cells stay connected."""

THICKNESS_STEEPNESS = 10.0
"""The conductance is multiplied by exp(-10 |log s_i - log s_j|), thickness s."""

SMOOTHING = 0.3
"""Length over which thickness is smoothed, in r."""

N_RAYS = 12
"""Rays from the center of each coarse cell. After smoothing, 12 are as good as 30."""

N_VECTORS = 8
"""Number of eigenvectors. 12 are worse on the benchmark models, 4 are unstable."""

N_COMPARED = 15
"""Number of eigenvalues that are computed, without those of constant vectors. The last of them is
the scale for `LEAST_VALUE`."""

LEAST_VALUE = 1e-3
"""Lower bound of eigenvalues, as a fraction of the last one computed. Smaller eigenvalues belong to
pieces that are barely connected with the rest; as vectors are scaled by the inverse root of their
eigenvalues, these pieces would hide all other parts."""

EQUAL = 1e-3
"""Relative difference up to which eigenvalues count as equal. Their vectors are taken all or none,
because a single one of them is arbitrary."""

NO_GROUPS = np.empty(0, np.int32)


class Embedding(NamedTuple):
    """Coordinates of groups of cells, in which the parts of a shape are far apart."""

    vectors: Singles
    """psi, (G, Q): Q may be 0."""
    logs: Floats | None
    """Logarithm of the thickness of each group, (G,), NaN if unknown; None if all are unknown."""
    measures: Floats
    """Area of each group, (G,)."""
    group_of: Ints
    """The group of each cell, (N,); empty if every cell is a group of its own."""
    unit: float
    """Ratio of the sum of all steps to the sum of distances between the vectors of their ends."""
    graph: _core.OrderedGraph
    """All cells, ordered; arc lengths are those without parts and thickness."""


class _Level(NamedTuple):
    """Cells of one size, and the conductances of the arcs between them."""

    arcs: ArcLists
    steps: Floats
    conductances: Floats
    measures: Floats
    positions: Floats
    coarse_of: Ints | None = None  # coarse cell, on this level, of each cell of the level above


def spectral_embedding(
    mesh: MeshLike | CloudLike,
    n_vectors: int = N_VECTORS,
    *,
    weld: bool = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return coordinates of each face in which the parts of a shape are far apart.

    They are the smallest eigenvectors :math:`L \phi = \lambda A \phi`, with areas A and the
    Laplacian L of the face graph, whose arcs have the conductances

    .. math:: c_{ij} = \frac{\sqrt{A_i + A_j}}{g} \exp(-20 \kappa - 10 |\log s_i - \log s_j|)

    (at least 1e-6), with the step g between centroids. Conductances are low across concave creases,
    kappa = theta / pi, and where the thickness s changes (see `shape_diameter`). Fingers, which are
    joined to the hand by a narrow passage, get coordinates of their own. Vector q is scaled by
    :math:`(\lambda_q / \lambda_1)^{-1/2}`.

    Eigenvectors are computed on about 1,500 coarse cells, interpolated to the faces, and relaxed
    there. Vectors that are constant on each component are left out. Eigenvalues below a thousandth
    of the 15th are raised to it.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, PointCloud, TetMesh or mesh-like
        As for `segment`. Points, tetrahedra and single sheets have no thickness: it counts as the
        same everywhere. Each component has vectors of its own.
    n_vectors : int, default 8
        How many, 1 to 15.
    weld, n_threads
        As for `segment`. The result does not depend on the number of threads.

    Returns
    -------
    ndarray of float64, shape (N, n_vectors)
        Only ratios of distances matter, not the unit. The coordinate of largest size in each column
        is positive. Where eigenvalues are equal, as on symmetric shapes, the basis is arbitrary:
        distances between faces have a meaning, single coordinates do not. Columns are 0 where there
        are fewer vectors: on meshes of few faces, and in soup of thousands of components. Takes
        about 2 microseconds per face.

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
    n_vectors = checked_count(n_vectors, "n_vectors", N_COMPARED, "vectors that are computed")
    threads = checked_threads(n_threads)
    cells = as_cells(mesh)
    kind = kind_of(cells)
    graph, shapes = kind.build_graph(cells, weld, threads)
    surface = kind.surface(cells, graph, threads)
    n_regions = min(DEFAULT_N_SEGMENTS, surface.n_cells)
    radius = radius_of(graph.measures, n_regions, threads, kind.dimension)
    options = WeightOptions.checked("creases", None, None)
    weights = np.asarray(kind.weights(surface, graph, shapes, radius, options))
    embedding = embed(cells, graph, surface, weights, radius, options, n_vectors)
    vectors = embedding.vectors
    if len(embedding.group_of) and vectors.size:
        level = _level_of_cells(graph, surface, weights, options.crease_price(radius))
        vectors = _relaxed(vectors, embedding.group_of, level, threads)
    table = np.zeros((surface.n_cells, n_vectors))
    n_there = min(n_vectors, vectors.shape[1])
    table[:, :n_there] = vectors[:, :n_there]
    return table


def part_weights(
    cells: Any,
    graph: Any,
    surface: Surface,
    given: npt.ArrayLike,
    radius: float,
    options: WeightOptions,
) -> tuple[Floats, _core.PlacedCells | None]:
    """Return crease weights with a price for steps between parts, and the cells in order.

    The price is gamma times the distance between the cells in the spectral embedding, scaled so
    that distances and steps have the same sum over all arcs. The sum of weight and price is then
    multiplied by a power of the thickness. With a radius of 0 (no cell has an area) weights stay as
    they are, and None is returned for the ordered cells.
    """
    weights = checked_weights(given, surface.n_arcs, surface.n_threads)
    if radius == 0.0:
        return weights, None
    embedding = embed(cells, graph, surface, weights, radius, options)
    return _core.part_weights(
        *surface.arcs,
        weights,
        embedding.group_of,
        embedding.vectors,
        _exponents(embedding, surface.n_threads),
        options.params["gamma"] * embedding.unit / graph.diagonal,
        surface.n_threads,
    ), embedding.graph


def _exponents(embedding: Embedding, n_threads: int) -> Floats:
    """Exponents of the factors of weights, by thickness; 0 for cells without a thickness."""
    logs, measures = embedding.logs, embedding.measures
    if logs is None:
        return np.zeros(len(measures))
    known = np.isfinite(logs)
    logs = np.where(known, logs, 0.0)
    total = _core.sum_of(np.where(known, measures, 0.0), n_threads)
    if total == 0.0:
        return np.zeros(len(measures))
    mean = _core.sum_of(measures * logs, n_threads) / total
    return np.where(known, THICKNESS_POWER * (logs - mean), 0.0)


def embed(
    cells: Any,
    graph: Any,
    surface: Surface,
    weights: Floats,
    radius: float,
    options: WeightOptions,
    n_vectors: int = N_VECTORS,
) -> Embedding:
    """Return the embedding of cells, given crease weights for regions of this radius."""
    n_threads, price = surface.n_threads, options.crease_price(radius)
    lengths, quantum = _core.quantize_weights(weights, n_threads)
    placed = _core.PlacedCells(graph.positions, graph.measures, n_threads)
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, n_threads, True)
    groups = _groups(ordered, n_threads)
    if groups is None:
        base = _level_of_cells(graph, surface, weights, price)
    else:
        given = (_areas(graph, surface), quantum * graph.diagonal, price, CREASE_STEEPNESS)
        base = _level_of(groups, groups.crossing_conductances(*given, n_threads), n_threads)
    levels, centers = _coarser(base, ordered if groups is None else groups.graph, n_threads)
    group_of = NO_GROUPS if groups is None else groups.coarse_cells(n_threads)
    vectors, logs = np.zeros((len(base.measures), 0), np.float32), None
    if len(levels[-1].measures) <= MOST_COARSE:
        coarse = _thickness(cells, graph, surface, groups, centers)
        if coarse is not None and np.isfinite(coarse).any():
            last, length = levels[-1], SMOOTHING * radius
            smooth = smoothed(
                last.arcs, last.conductances, last.measures, coarse, length, n_threads
            )
            logs = _prolonged(levels, smooth[:, np.newaxis], n_threads)[:, 0].astype(np.float64)
            levels = _hindered(levels, logs, n_threads)
        vectors = _prolonged(levels, _eigenvectors(levels[-1], n_vectors), n_threads)
    unit = _unit(base, vectors, n_threads) * (1.0 if groups is None else GROUP_STEP)
    return Embedding(vectors, logs, base.measures, group_of, unit, ordered)


def _areas(graph: Any, surface: Surface) -> Floats:
    areas = graph.measures if surface.dimension == 2 else np.cbrt(graph.measures) ** 2
    return np.asarray(areas)


def _level_of_cells(graph: Any, surface: Surface, weights: Floats, crease_unit: float) -> _Level:
    steps, conductances = _core.crease_conductances(
        surface.handle, _areas(graph, surface), weights, graph.diagonal, crease_unit,
        CREASE_STEEPNESS, surface.n_threads,
    )  # fmt: skip
    return _Level(surface.arcs, steps, conductances, graph.measures, graph.positions)


def _groups(ordered: _core.OrderedGraph, n_threads: int) -> _core.CoarseGraph | None:
    """Groups of cells that are embedded in place of cells; None for small meshes and soup."""
    size = min(MOST_CELLS, ordered.n_cells // N_BASE)
    if size < LEAST_GROUP:
        return None
    groups = _core.CoarseGraph(ordered, size, n_threads)
    return groups if 2 * groups.graph.n_cells <= ordered.n_cells else None  # most are not alone


def _unit(level: _Level, vectors: Singles, n_threads: int) -> float:
    """See `Embedding.unit`; 0 if all distances are 0."""
    none, table = np.zeros(len(level.steps)), vectors.astype(np.float64)
    distances = _core.add_feature_steps(*level.arcs, none, table, 1.0, n_threads)
    total = _core.sum_of(distances, n_threads)
    return _core.sum_of(level.steps, n_threads) / total if total > 0.0 else 0.0


def _coarser(level: _Level, graph: _core.OrderedGraph, n_threads: int) -> tuple[list[_Level], Ints]:
    """Return coarser and coarser levels, and the central first-level cell of each coarsest cell."""
    centers = np.arange(len(level.measures), dtype=np.int32)
    levels: list[_Level] = []
    coarse: list[_core.CoarseGraph] = []  # keeps the finer graphs alive
    while len(centers) >= 2 * N_COARSE:
        size = _cell_size(len(centers) / N_COARSE)
        coarse.append(_core.CoarseGraph(graph, size, n_threads))
        if 2 * coarse[-1].graph.n_cells > len(centers):
            break  # nearly all cells are alone
        levels.append(level._replace(coarse_of=coarse[-1].coarse_cells(n_threads)))
        offsets, neighbors, _ = coarse[-1].arcs()
        level = _level_of(coarse[-1], _crossed(levels[-1], (offsets, neighbors)), n_threads)
        graph, centers = coarse[-1].graph, centers[coarse[-1].centers()]
    return [*levels, level], centers


def _cell_size(ratio: float) -> int:
    """Cells per coarse cell: the same on all levels, which together reduce cells by the ratio."""
    n_levels: int = math.ceil(math.log(ratio) / math.log(MOST_CELLS))
    return round(math.pow(ratio, 1 / n_levels))


def _level_of(coarse: _core.CoarseGraph, crossed: Floats, n_threads: int) -> _Level:
    """A level of coarse cells; `crossed` as returned by `_crossed`."""
    offsets, neighbors, _ = coarse.arcs()
    positions, measures = coarse.cells()
    steps = coarse.steps(n_threads)
    return _Level((offsets, neighbors), steps, _per_step(crossed, steps), measures, positions)


def _per_step(crossed: Floats, steps: Floats) -> Floats:
    """Conductances of steps; the smallest where a step has no length."""
    return np.where(crossed > 0.0, crossed / steps, LEAST_CONDUCTANCE)


def _thickness(
    cells: Any, graph: Any, surface: Surface, groups: _core.CoarseGraph | None, centers: Ints
) -> Floats | None:
    """Thickness of coarse cells, by rays from their centers; None for cells without normals.

    It is in diagonals: the same numbers in every unit of length.
    """
    handle, n_threads = surface.handle, surface.n_threads
    if not isinstance(handle, (_core.TriangleSurface, _core.PolygonSurface)):
        return None
    if groups is None:
        thickness = rays_from(cells, graph, centers, N_RAYS, n_threads)
    else:
        patches = (groups.cells()[0], groups.area_vectors(handle, n_threads))
        options = (N_RAYS, graph.diagonal, handle.is_inside_out)
        thickness = rays_from_patches(patches, centers, *options, n_threads)
    return np.asarray(thickness / graph.diagonal)


def _hindered(levels: list[_Level], logs: Floats, n_threads: int) -> list[_Level]:
    """The same levels with arcs that conduct less where the thickness of cells changes."""
    hindered: list[_Level] = []
    for level in levels:
        if not hindered:
            conductances = _core.hindered_conductances(
                *level.arcs, level.conductances, np.nan_to_num(logs), THICKNESS_STEEPNESS, n_threads
            )
        else:
            conductances = _per_step(_crossed(hindered[-1], level.arcs), level.steps)
        hindered.append(level._replace(conductances=conductances))
    return hindered


def _crossed(level: _Level, arcs: ArcLists) -> Floats:
    """Sum of conductance times step over the fine arcs between each two coarse cells, per arc."""
    assert level.coarse_of is not None
    return _core.sum_between(*level.arcs, level.conductances, level.steps, level.coarse_of, *arcs)


def _eigenvectors(level: _Level, n_vectors: int) -> Floats:
    """Return psi on the coarse cells, (C, Q)."""
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
    """Number of vectors to take: n_vectors, or more so that equal values are not split."""
    wanted = min(n_vectors, len(values))

    def is_end(last: int) -> bool:
        return bool(values[last] > (1 + EQUAL) * values[last - 1])

    return next((last for last in range(wanted, len(values)) if is_end(last)), wanted)


def _prolonged(levels: list[_Level], values: Floats, n_threads: int) -> Singles:
    """Prolong rows of the last level to the first, level by level."""
    rows = values.astype(np.float32)
    for level in reversed(levels[:-1] if rows.size else ()):
        assert level.coarse_of is not None
        rows = _relaxed(rows, level.coarse_of, level, n_threads)
    return rows if rows.size else np.zeros((len(levels[0].measures), values.shape[1]), np.float32)


def _relaxed(rows: Singles, coarse_of: Ints, level: _Level, n_threads: int) -> Singles:
    """Copy the row of each coarse cell to its cells, and relax the copies."""
    n_sweeps = math.ceil(2.0 * math.sqrt(len(coarse_of) / len(rows))) + 2
    copied = np.take(rows, coarse_of, axis=0)
    relaxed = _core.relax(*level.arcs, level.conductances, copied, n_sweeps, n_threads)
    return relaxed.reshape(-1, rows.shape[1])
