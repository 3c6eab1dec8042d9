"""Segment meshes by normalized cuts, from leading eigenvectors of a matrix of face affinities."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from superfacets.base.checks import checked_count, checked_number, checked_threads
from superfacets.base.timing import timed
from superfacets.base.types import Floats, Ints, Longs, Singles
from superfacets.clustering.result import Segmentation
from superfacets.graph.cell_graph import CellGraph
from superfacets.mesh.convert import MeshLike
from superfacets.weights.formulas import WeightName, WeightOptions, Weights

from ..checks import import_package
from .face_cells import Component, FaceCells, component_graph, read_face_cells

SIGMA = 0.1
"""Width s of the affinity exp(-d / s), as a fraction of the mean path length. On small benchmark
models with alpha > 0, no width from 0.02 to 1 has a smaller undersegmentation error."""

ALPHA = 100.0  # best alpha for normalized cuts, according to the superfacets paper

MAX_MEMORY = 6e9  # default memory limit in bytes, sufficient for all pairs of 37,000 faces

_N_SAMPLES = 256  # number of faces from which the mean path length is estimated; its error is 2 %

# The block Krylov space has _N_POWERS blocks. The width of a block is _BLOCK_SHARE times the number
# of computed eigenvectors, plus _BLOCK_SLACK. On benchmark models, the error of eigenvalues is 1e-6
# with twelve blocks, but 1e-3 with nine blocks.
_BLOCK_SHARE, _BLOCK_SLACK = 1 / 3, 8
_N_POWERS = 12

_N_ROWS = 1024  # number of rows of a sparse array that are processed together

_MAX_ROTATIONS = 50  # maximum number of iterations of `_discretize`; about 30 are usual
_ROTATION_TOL = 1e-9  # iterations stop if the fit improves by at most this fraction

# Memory in bytes for each pair of faces at a distance of at most R (see `reach` of
# `affinity_embedding`), including temporary arrays.
_BYTES_PER_NEAR_PAIR = 32


class _EmbeddedComponent(NamedTuple):
    """Leading eigenvalues and eigenvectors of one connected component of the mesh."""

    faces: Longs  # (n,) index of each face in the mesh
    eigenvalues: Singles  # (m,) in descending order; the first is 1
    vectors: Singles  # (n, m) eigenvectors as columns, in the order of `eigenvalues`


@dataclass(frozen=True, eq=False)
class AffinityEmbedding:
    """Result of `affinity_embedding`: eigenvectors from which `segment` computes regions."""

    _cells: FaceCells
    _components: list[_EmbeddedComponent]
    _n_threads: int

    @property
    def n_vectors(self) -> int:
        """Number of leading eigenvectors, and maximum number of regions that `segment` accepts."""
        return self._cells.n_segments

    @property
    def timings(self) -> dict[str, float]:
        """Wall time of each stage, in seconds."""
        return self._cells.timings

    @property
    def params(self) -> dict[str, Any]:
        """All parameters; ``sigma_length`` is the width of the affinity in units of arc weights."""
        return self._cells.params

    @property
    def eigenvalues(self) -> Singles:
        """Leading eigenvalues of D^-1/2 W D^-1/2 (see `normalized_cuts`), in descending order.

        The first value is 1. There are `n_vectors` values, or one value per connected component if
        there are more components.
        """
        values = np.concatenate([component.eigenvalues for component in self._components])
        return np.sort(values)[::-1][: max(self.n_vectors, len(self._components))]

    def segment(self, n_segments: int | None = None) -> Segmentation:
        """Label every face with one of k regions, using the k leading eigenvectors.

        Parameters
        ----------
        n_segments : int, optional
            Number of regions k, from 1 to `n_vectors`. The default is `n_vectors`.

        Returns
        -------
        Segmentation
            Same as in `normalized_cuts`.

        Raises
        ------
        ValueError, TypeError
            If `n_segments` is out of range or not an integer.
        """
        k = self.n_vectors
        if n_segments is not None:
            k = checked_count(n_segments, "n_segments", k, "eigenvectors")
        labels = np.empty(self._cells.graph.n_cells, np.int64)
        seconds: dict[str, float] = {}
        n_labels = 0
        with timed(seconds, "discretize"):
            for component, n in zip(self._components, self._n_leading(k), strict=True):
                labels[component.faces] = n_labels + _discretize(component.vectors[:, :n])
                n_labels += n
        cells = replace(
            self._cells, timings=self.timings | seconds, params=self.params | {"n_segments": k}
        )
        return cells.segmentation(labels, self._n_threads)

    def _n_leading(self, k: int) -> Longs:
        """Return how many of the k leading eigenvectors belong to each component, at least one."""
        counts = [len(component.eigenvalues) for component in self._components]
        owner = np.repeat(np.arange(len(counts)), counts)
        values = np.concatenate([component.eigenvalues for component in self._components])
        firsts = np.cumsum([0, *counts[:-1]])
        values[firsts] = np.inf
        leading = np.argsort(-values, kind="stable")[: max(k, len(counts))]
        return np.bincount(owner[leading], minlength=len(counts))


def normalized_cuts(mesh: MeshLike, n_segments: int | None = None, **options: Any) -> Segmentation:
    """Label every face of a mesh with one of k regions, computed by normalized cuts.

    The affinity of two faces is ``exp(-d / s)``, where d is the length of the shortest path between
    them in the face graph. W is the matrix of affinities, and D is the diagonal matrix of its row
    sums. The k leading eigenvectors of D^-1/2 W D^-1/2 map each face to a point in k dimensions. A
    rotation moves these points close to the axes, and the label of a face is the index of the axis
    nearest to its point. The rotation is computed by a pivoted QR factorization and iterations.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any surface mesh, as for `superfacets.segment`. Faces in different connected components
        have the affinity 0, so each region is within one component.
    n_segments : int, optional
        Number of regions k, from 1 to the number of faces. The default is 150, or the number of
        faces if that is less. There are more regions if the mesh has more than k components. In
        rare cases, an axis is not nearest to any point, and there is one region fewer.
    **options
        Keywords of `affinity_embedding`: `alpha`, `weights`, `sigma`, `reach`, `max_memory`,
        `weld` and `n_threads`.

    Returns
    -------
    Segmentation
        ``centers`` are computed by `update_centers`. Regions may be disconnected.

    Raises
    ------
    MeshError, ValueError, TypeError, MissingGroupError
        Same as in `affinity_embedding`.

    References
    ----------
    Shi and Malik, "Normalized Cuts and Image Segmentation", 2000. Yu and Shi, "Multiclass Spectral
    Clustering", 2003, for the rotation; Damle, Minden and Ying, "Simple, Direct and Efficient
    Multi-way Spectral Clustering", 2019, for the first rotation; Musco and Musco, "Randomized Block
    Krylov Methods for Stronger and Faster Approximate Singular Value Decomposition", 2015.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> normalized_cuts(square, 2)
    Segmentation(2 cells, 2 regions, 1 iteration, converged)
    """
    return affinity_embedding(mesh, n_segments, **options).segment()


def affinity_embedding(
    mesh: MeshLike,
    n_vectors: int | None = None,
    *,
    alpha: float | None = None,
    weights: WeightName | Weights = "superfacets",
    sigma: float = SIGMA,
    reach: float | None = None,
    max_memory: float = MAX_MEMORY,
    weld: bool = True,
    n_threads: int | None = None,
) -> AffinityEmbedding:
    """Return the eigenvectors for normalized cuts with up to `n_vectors` regions.

    The embedding is the result of all steps of `normalized_cuts` except the last one, which
    computes labels. One embedding can be used for several numbers of regions.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        Same as in `normalized_cuts`.
    n_vectors : int, optional
        Maximum number of regions for `AffinityEmbedding.segment`. The default and the range are the
        same as for `n_segments` in `normalized_cuts`.
    alpha, weights
        Same as in `superfacets.segment`, but the default of `weights` is ``"superfacets"``, with
        a default `alpha` of 100. If the weights of an arc and its reverse arc differ, both arcs get
        the mean of the two weights.
    sigma : float, default 0.1
        Width s of the affinity, as a fraction of the mean path length, > 0. The mean is over the
        paths from 256 faces, evenly spaced among the faces that have a neighbor, to all faces.
    reach : float, optional
        By default, the affinity of all pairs of faces is computed. With `reach`, the affinity of
        two faces is 0 if their Euclidean distance e exceeds R = `reach` * r, where r is the
        expected radius of `n_vectors` regions. Paths must then stay within the distance R of one of
        the two faces, and affinities are multiplied by 1 - (e / R)^2. Results with a reach of 3 are
        close to results with all pairs.
    max_memory : float, default 6e9
        Memory limit in bytes for affinities and eigenvectors.
    weld : bool, default True
        Whether to merge vertices at exactly the same position.
    n_threads : int, optional
        Number of threads that compute paths, as for `superfacets.segment`. Matrices are multiplied
        by NumPy's BLAS on its own threads, whose order of summation may change a few labels.

    Returns
    -------
    AffinityEmbedding

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type, or if more memory than `max_memory` is
        needed. The message contains the required memory.
    MissingGroupError
        If SciPy is not installed.

    Notes
    -----
    Time is O(F^2 log F) for paths and O(k F^2) for eigenvectors. Memory is 4 bytes for each pair of
    faces, and 52 bytes times k for each face. With `reach`, there are only about (F reach)^2 / k
    pairs.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> embedding = affinity_embedding(square, 2)
    >>> [embedding.segment(k).labels.tolist() for k in (1, 2)]
    [[0, 0], [0, 1]]
    """
    threads = checked_threads(n_threads)
    if alpha is None and isinstance(weights, str) and weights == "superfacets":
        alpha = ALPHA
    chosen = WeightOptions.checked(weights, alpha)
    sigma = checked_number(sigma, "sigma", zero=False)
    if reach is not None:
        reach = checked_number(reach, "reach", zero=False)
    max_memory = checked_number(max_memory, "max_memory", zero=False)
    import_package("scipy.linalg", "normalized cuts")
    cells = read_face_cells(mesh, n_vectors, chosen, weld, threads)
    components = cells.components()
    _check_memory(cells, max(len(c.faces) for c in components), reach, max_memory)
    with timed(cells.timings, "distances"):
        width = sigma * _mean_path_length(cells.graph)
    affinity = _Affinity(width, None if reach is None else reach * cells.radius, threads)
    cells.params.update(method="ncuts", sigma=sigma, sigma_length=width, reach=reach)
    embedded = [_embed(cells, component, affinity) for component in components]
    return AffinityEmbedding(cells, embedded, threads)


@dataclass(frozen=True)
class _Affinity:
    """Computes affinities of cells from the lengths of paths between them."""

    width: float  # width s of the affinity, in the unit of the arc weights
    reach: float | None  # maximum distance R in the unit of the vertices; None means no limit
    n_threads: int

    def between_all(self, graph: CellGraph) -> Singles:
        cells = np.arange(graph.n_cells, dtype=np.int32)
        lengths = _path_lengths(graph, cells)
        lengths *= np.float32(-1 / self.width)
        return np.exp(lengths, out=lengths)

    def between_near(self, graph: CellGraph, reach: float) -> Any:
        """Return the affinities of all pairs of cells with a distance of at most `reach`.

        The result is a symmetric sparse array. If the affinities from cell i to j and from j to i
        differ, both are set to the larger one.
        """
        from scipy.sparse import csr_array

        offsets, columns, values = near_path_lengths(graph, reach)
        values *= np.float32(-1 / self.width)
        np.exp(values, out=values)
        for first in range(0, graph.n_cells, _N_ROWS):
            ends = offsets[first : first + _N_ROWS + 1]
            entries = slice(ends[0], ends[-1])
            sources = np.repeat(np.arange(first, first + len(ends) - 1), np.diff(ends))
            gaps = graph.positions[columns[entries]] - graph.positions[sources]
            shares = np.einsum("ij,ij->i", gaps, gaps) / reach**2
            values[entries] *= np.maximum(0, 1 - shares).astype(np.float32)
        rows = csr_array((values, columns, offsets), shape=(graph.n_cells, graph.n_cells))
        return rows.maximum(rows.T)


def _check_memory(cells: FaceCells, n_faces: int, reach: float | None, max_memory: float) -> None:
    """Raise a ValueError if a component of `n_faces` faces needs more than `max_memory` bytes."""
    n_columns = _krylov_size(cells.n_segments)
    n_bytes = 24.0 * n_faces**2 if n_columns >= n_faces else 12.0 * n_faces * n_columns
    if reach is None:
        n_bytes += 4.0 * n_faces**2
        what, advice = "", "use reach=3, which leaves out pairs that are far apart"
    else:
        n_near = min(n_faces, cells.graph.n_cells * reach**2 / cells.n_segments)
        n_bytes += _BYTES_PER_NEAR_PAIR * n_faces * n_near
        what, advice = f" with reach={reach:g}", "use a smaller reach"
    if n_bytes > max_memory:
        raise ValueError(
            f"normalized cuts of {n_faces} faces{what} need {n_bytes / 1e9:.3g} GB but max_memory"
            f" is {max_memory / 1e9:.3g} GB: {advice}"
        )


def near_path_lengths(graph: CellGraph, reach: float) -> tuple[Longs, Ints, Singles]:
    """Return path lengths between cells at a distance of at most `reach`, in CSR form.

    Paths pass only through cells within `reach` of their source. So the paths from cell i to j and
    from j to i may differ in length, or only one of them may exist.
    """
    from scipy.spatial import KDTree

    tree = KDTree(graph.positions)
    rows = [
        _rows_of_near(graph, tree, np.arange(first, min(first + _N_ROWS, graph.n_cells)), reach)
        for first in range(0, graph.n_cells, _N_ROWS)
    ]
    counts, columns, lengths = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    return np.concatenate([[0], np.cumsum(counts)]), columns, lengths


def _rows_of_near(
    graph: CellGraph, tree: Any, sources: Longs, reach: float
) -> tuple[Longs, Ints, Singles]:
    """Return rows of `near_path_lengths`: the size of each, and columns and lengths of all.

    Each row has its own copies of the cells in reach, so that one search finds the paths of all.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    near = tree.query_ball_point(graph.positions[sources], reach, return_sorted=True)
    counts = np.array([len(cells) for cells in near])
    cells = np.concatenate(near).astype(np.int64)
    keys = np.repeat(np.arange(len(sources)), counts) * graph.n_cells + cells
    n_arcs = np.diff(graph.offsets)[cells]
    ends = np.cumsum(n_arcs)
    arcs = np.arange(ends[-1]) + np.repeat(graph.offsets[cells] - ends + n_arcs, n_arcs)
    targets = np.repeat(keys - cells, n_arcs) + graph.neighbors[arcs]
    places = np.minimum(np.searchsorted(keys, targets), len(keys) - 1)
    is_near = keys[places] == targets
    offsets = np.concatenate([[0], np.cumsum(is_near)])[np.concatenate([[0], ends])]
    steps = graph.lengths[arcs[is_near]].astype(float), places[is_near], offsets
    starts = np.searchsorted(keys, np.arange(len(sources)) * graph.n_cells + sources)
    copies = csr_array(steps, shape=(len(keys), len(keys)))
    lengths = dijkstra(copies, indices=starts, min_only=True)
    is_reached = np.isfinite(lengths)
    counts = np.add.reduceat(is_reached, np.cumsum(counts) - counts, dtype=np.int64)
    return (
        counts, cells[is_reached].astype(np.int32),
        (lengths[is_reached] * graph.unit).astype(np.float32),
    )  # fmt: skip


def _path_lengths(graph: CellGraph, sources: Ints) -> Singles:
    """Return the lengths of shortest paths from `sources` to all cells, (len(sources), N)."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    steps = csr_array(
        (np.maximum(graph.weights, graph.unit), graph.neighbors.astype(np.int64), graph.offsets),
        shape=(graph.n_cells, graph.n_cells),
    )
    return np.asarray(dijkstra(steps, indices=sources), np.float32)


def _mean_path_length(graph: CellGraph) -> float:
    """Return the mean path length from sampled cells to all cells, or 1 if there are no arcs."""
    candidates = np.flatnonzero(np.diff(graph.offsets))
    if not len(candidates):
        return 1.0
    n_samples = min(_N_SAMPLES, len(candidates))
    sample = candidates[np.arange(n_samples) * len(candidates) // n_samples]
    lengths = _path_lengths(graph, sample.astype(np.int32))
    return float(lengths.mean(where=np.isfinite(lengths), dtype=np.float64))


def _embed(cells: FaceCells, component: Component, affinity: _Affinity) -> _EmbeddedComponent:
    """Return up to `cells.n_segments` leading eigenpairs of one connected component."""
    n_faces = len(component.faces)
    if n_faces == 1:
        return _EmbeddedComponent(component.faces, np.ones(1, np.float32), np.ones((1, 1), "f4"))
    with timed(cells.timings, "distances"):
        graph = component_graph(cells, component)
        if affinity.reach is None:
            matrix = _normalize(affinity.between_all(graph))
        else:
            matrix = _normalize_sparse(affinity.between_near(graph, affinity.reach))
    with timed(cells.timings, "eigenvectors"):
        values, vectors = _leading_eigenvectors(matrix, min(cells.n_segments, n_faces))
    return _EmbeddedComponent(component.faces, values, vectors)


def _normalize(affinities: Singles) -> Singles:
    """Replace the affinities W by D^-1/2 W D^-1/2 in place, and return them."""
    scale = (1 / np.sqrt(affinities.sum(axis=1, dtype=np.float64))).astype(np.float32)
    affinities *= scale[:, None]
    affinities *= scale
    return affinities


def _normalize_sparse(affinities: Any) -> Any:
    scale = 1 / np.sqrt(affinities.sum(axis=1, dtype=np.float64))
    affinities.data *= np.repeat(scale, np.diff(affinities.indptr)).astype(np.float32)
    affinities.data *= scale.astype(np.float32)[affinities.indices]
    return affinities


def _krylov_size(n_vectors: int) -> int:
    return _N_POWERS * (round(_BLOCK_SHARE * n_vectors) + _BLOCK_SLACK)


def _leading_eigenvectors(matrix: Any, n_vectors: int) -> tuple[Singles, Singles]:
    """Return the largest eigenvalues of a symmetric matrix, descending, and their eigenvectors."""
    # The block Krylov space is spanned by powers of the matrix times a random block of vectors.
    # Symmetric meshes have multiple eigenvalues. A block Krylov space contains all of their
    # eigenvectors, but the Krylov space of a single vector does not.
    n = matrix.shape[0]
    n_columns = _krylov_size(n_vectors)
    if n_columns >= n:
        full = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
        return _highest(*np.linalg.eigh(full.astype(np.float64)), n_vectors)
    width = n_columns // _N_POWERS
    basis = np.empty((n, n_columns), np.float32)
    images = np.empty((n, n_columns), np.float32)
    block = np.random.default_rng(0).standard_normal((n, width), dtype=np.float32)
    for n_before in range(0, n_columns, width):
        before = basis[:, :n_before]
        for _ in range(2):  # the second pass removes rounding errors of the first pass
            block -= before @ (before.T @ block)
            block = np.linalg.qr(block)[0]
        basis[:, n_before : n_before + width] = block
        block = matrix @ block
        images[:, n_before : n_before + width] = block
    values, coefficients = np.linalg.eigh((basis.T @ images).astype(np.float64))
    values, coefficients = _highest(values, coefficients, n_vectors)
    return values, basis @ coefficients


def _highest(values: Floats, vectors: Floats, n: int) -> tuple[Singles, Singles]:
    """Return the last n of ascending eigenvalues, in descending order, and their eigenvectors."""
    return values[: -n - 1 : -1].astype(np.float32), vectors[:, : -n - 1 : -1].astype(np.float32)


def _discretize(vectors: Singles) -> Longs:
    """Rotate the rows of `vectors` so that they are near axes; return the nearest axis per row."""
    from scipy.sparse import csr_array

    n, m = vectors.shape
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    rows = vectors.astype(np.float64) / np.maximum(norms, np.finfo(np.float32).tiny)
    rotation = _pivoted_rotation(vectors.astype(np.float64))
    labels = np.zeros(n, np.int64)
    fit = 0.0  # sum over rows of the coordinate on the nearest axis; the iterations maximize it
    for _ in range(_MAX_ROTATIONS):
        labels = (rows @ rotation).argmax(axis=1)
        members = csr_array((np.ones(n), labels, np.arange(n + 1)), shape=(n, m))
        left, values, right = np.linalg.svd(members.T @ rows)
        if values.sum() <= fit * (1 + _ROTATION_TOL):
            break
        fit = values.sum()
        rotation = (left @ right).T
    return labels


def _pivoted_rotation(vectors: Floats) -> Floats:
    """Return a rotation, (m, m), that moves m linearly independent rows of `vectors` near axes."""
    from scipy.linalg import qr

    _, pivots = qr(vectors.T, mode="r", pivoting=True)
    left, _, right = np.linalg.svd(vectors[pivots[: vectors.shape[1]]].T)
    rotation: Floats = left @ right
    return rotation
