"""Partition meshes with METIS into parts of similar area, whose borders are short or in creases."""

from __future__ import annotations

import heapq
from typing import Any

import numpy as np

from superfacets.base.checks import checked_number, checked_threads
from superfacets.base.timing import timed
from superfacets.base.types import Floats, Longs
from superfacets.clustering.result import Segmentation
from superfacets.mesh.convert import MeshLike
from superfacets.mesh.faces import corners_of
from superfacets.weights.formulas import WeightName, WeightOptions, Weights

from ..checks import import_package
from .face_cells import Component, FaceCells, read_face_cells

CREASE_SCALE = 2.0
"""Scale s of the border cost exp(-w / s) per unit of edge length, as a multiple of the mean of w.
Here w is the arc weight per unit of edge length. Between scales of 1 and 3, the undersegmentation
error on 95 benchmark models changes by 0.001."""

IMBALANCE = 0.5
"""Maximum amount by which the area of a part exceeds the mean area, as a fraction of the mean. With
0.03, the default of METIS, many borders do not follow creases, and the undersegmentation error is
0.002 higher."""

LARGEST_CELL = 0.25
"""Before METIS is called, areas of faces are limited to this fraction of the mean area of a part.
Without this limit, METIS leaves parts empty and prints warnings if a face is larger than a part."""

SEED = 0

_MEAN_INTEGER = 1000  # mean of the areas, and of the costs, after conversion to integers
_LARGEST_SUM = 2**30  # limit of the sum of these integers, because METIS may use 32 bits


def metis_partition(
    mesh: MeshLike,
    n_segments: int | None = None,
    *,
    alpha: float | None = None,
    weights: WeightName | Weights = "superfacets",
    imbalance: float = IMBALANCE,
    weld: bool = True,
    n_threads: int | None = None,
) -> Segmentation:
    """Label every face of a mesh with one of k parts, computed by METIS.

    METIS computes a multilevel partition of the face graph. It minimizes the total cost of borders,
    while the area of a part is at most 1.5 times the mean (see `imbalance`). An edge e on a border
    costs ``|e| exp(-w / (s |e|))``. Here w is the weight of the arc across the edge, and s is twice
    the sum of all weights divided by the sum of all edge lengths. Therefore, borders are short or
    in creases. The result does not depend on the unit of the weights.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any surface mesh, as for `superfacets.segment`. Connected components are divided separately.
        Each component gets one part, and each further part is added to the component with the
        largest area per part. A component gets at most as many parts as it has faces.
    n_segments : int, optional
        Number of parts k, from 1 to the number of faces. The default is 150, or the number of faces
        if that is less. METIS may leave some parts empty: a few in a thousand at 20 faces per part,
        and more if parts are smaller. If there are more than k components, each component is one
        part.
    alpha, weights
        Same as in `superfacets.segment`, but the default of `weights` is ``"superfacets"``. If the
        weights of an arc and its reverse arc differ, both arcs get the mean of the two weights.
    imbalance : float, default 0.5
        Maximum amount by which the area of a part exceeds the mean area, as a fraction of the mean,
        > 0. The value is rounded to a multiple of 0.001, at least 0.001.
    weld : bool, default True
        Whether to merge vertices at exactly the same position.
    n_threads : int, optional
        Same as in `superfacets.segment`. METIS itself uses one thread.

    Returns
    -------
    Segmentation
        ``centers`` are computed by `update_centers`. Parts may be disconnected.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.
    MissingGroupError
        If pymetis is not installed.

    References
    ----------
    Karypis and Kumar, "A Fast and High Quality Multilevel Scheme for Partitioning Irregular
    Graphs", 1998.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> metis_partition(square, 2)
    Segmentation(2 cells, 2 regions, 1 iteration, converged)
    """
    threads = checked_threads(n_threads)
    chosen = WeightOptions.checked(weights, alpha)
    excess = max(1, round(1000 * checked_number(imbalance, "imbalance", zero=False)))
    metis = import_package("pymetis", "a partition by METIS")
    cells = read_face_cells(mesh, n_segments, chosen, weld, threads)
    with timed(cells.timings, "partition"):
        labels = _partition(metis, cells, excess)
    cells.params.update(method="metis", seed=SEED)
    return cells.segmentation(labels, threads)


def _partition(metis: Any, cells: FaceCells, excess: int) -> Longs:
    """Partition each component, and return the label of each face. Some labels may be unused."""
    costs = _cutting_costs(cells)
    areas = cells.graph.measures
    components = cells.components()
    n_parts = _parts_of_components(
        [float(areas[component.faces].sum()) for component in components],
        [len(component.faces) for component in components],
        cells.n_segments,
    )
    labels = np.empty(cells.graph.n_cells, np.int64)
    n_labels = 0
    for component, n in zip(components, n_parts, strict=True):
        weights = (areas[component.faces], costs[component.arcs])
        parts = _divide(metis, component, *weights, n, excess)
        labels[component.faces] = n_labels + parts
        n_labels += n
    return labels


def _cutting_costs(cells: FaceCells) -> Floats:
    """Return, for each arc, the cost of a border along its edge, in the unit of edge lengths."""
    sides = corners_of(cells.mesh).ends_of_sides(cells.graph.sources, cells.faces.sides)
    ends = cells.mesh.vertices[sides]
    lengths: Floats = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    weights = cells.graph.weights
    if not weights.any() or not lengths.any():  # squares of tiny edge lengths underflow to 0
        return lengths
    scale = CREASE_SCALE * weights.sum() / lengths.sum()
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        costs = lengths * np.exp(-weights / (scale * lengths))
    return np.where(lengths > 0, costs, 0.0)


def _parts_of_components(areas: list[float], sizes: list[int], n_parts: int) -> list[int]:
    """Return the number of parts of each component. `sizes` are the numbers of faces.

    Each component gets one part. Each further part is added to the component with the largest area
    per part, or to the first of several such components. A component gets at most as many parts as
    it has faces.
    """
    counts = [1] * len(areas)
    queue = [(-area, index) for index, area in enumerate(areas) if sizes[index] > 1]
    heapq.heapify(queue)
    for _ in range(n_parts - len(areas)):
        index = queue[0][1]
        counts[index] += 1
        if counts[index] < sizes[index]:
            heapq.heapreplace(queue, (-areas[index] / counts[index], index))
        else:
            heapq.heappop(queue)
    return counts


def _divide(
    metis: Any, component: Component, areas: Floats, costs: Floats, n_parts: int, excess: int
) -> Longs:
    """Return the part of each face, 0 to n_parts - 1. `excess` is 1,000 times the imbalance."""
    n_faces = len(areas)
    if n_parts == 1:
        return np.zeros(n_faces, np.int64)
    if n_parts == n_faces:
        return np.arange(n_faces)
    pairs = _merge_pairs(component, _whole_numbers(costs))
    dtype = metis.zero_copy_dtype()
    parts = metis.part_graph(
        n_parts,
        metis.CSRAdjacency(pairs.indptr.astype(dtype), pairs.indices.astype(dtype)),
        vweights=_whole_numbers(_cap(areas, n_parts)).astype(dtype),
        eweights=pairs.data.astype(dtype),
        recursive=False,  # recursive bisection does not support `contig`
        options=metis.Options(contig=1, ufactor=excess, seed=SEED),
    ).vertex_part
    return np.asarray(parts, dtype=np.int64)


def _cap(areas: Floats, n_parts: int) -> Floats:
    """Limit areas to `LARGEST_CELL` times the mean area of a part, computed from limited areas.

    If no such limit exists, all areas are replaced by 1.
    """
    falling = np.sort(areas)[::-1]
    n_capped = np.arange(len(areas))
    kept = falling[::-1].cumsum()[::-1]  # [n]: sum of all areas except the n largest
    with np.errstate(divide="ignore", invalid="ignore"):
        caps = LARGEST_CELL * kept / np.maximum(n_parts - LARGEST_CELL * n_capped, 0)
    fits = (caps >= falling) & (caps < np.inf)
    return np.minimum(areas, caps[fits.argmax()]) if fits.any() else np.ones(len(areas))


def _merge_pairs(component: Component, costs: Longs) -> Any:
    """Return a sparse matrix with the sum of the costs of all arcs between each pair of faces."""
    from scipy.sparse import csr_array

    n = len(component.faces)
    arcs = (costs, component.neighbors.copy(), component.offsets.copy())
    pairs = csr_array(arcs, shape=(n, n))
    pairs.sum_duplicates()  # exact for integers, so the matrix stays symmetric
    return pairs


def _whole_numbers(values: Floats) -> Longs:
    """Scale values, and round them to integers >= 1; return ones if all values are 0."""
    total = values.sum()
    if total == 0:
        return np.ones(len(values), np.int64)
    scale = min(_MEAN_INTEGER * len(values), _LARGEST_SUM) / total
    whole: Longs = np.maximum(1, np.rint(values * scale)).astype(np.int64)
    return whole
