"""Compute all metrics of labels of cells or of vertices."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_classes, checked_number, checked_threads, counted
from ..base.errors import MeshError
from ..base.types import ArcLists, Bools, Floats, Ints
from ..graph.kinds import as_surface, kind_of
from ..graph.sums import positive_total
from ..graph.surface import Surface
from ..mesh.convert import MeshLike, as_cells
from ..mesh.faces import AnyMesh, FaceMesh, is_same_mesh, vertex_graph
from ..mesh.weld import lowest_vertices
from ..regions.crease_labels import corners_in
from ..regions.submeshes import part_of
from .borders import DEFAULT_TOLERANCE, Cuts, MeshEdges, boundary_agreement, cut_discrepancy
from .overlap import (
    Overlap,
    achievable_accuracy,
    achievable_iou,
    compact_labels,
    consistency_error,
    hamming_distance,
    overlap_of,
    rand_index,
    undersegmentation_error,
    weights_of_cells,
)
from .shape import compactness_of, explained_variation

_WRONG_MESH = "the ground truths were prepared for another mesh: prepare GroundTruths of this mesh"


@dataclass(frozen=True)
class _Truth:
    """One ground truth of a mesh: the true segments of the faces and their borders."""

    segments: Ints  # (F,) true segment of each face, 0 to n_segments - 1; -1 if unannotated
    n_segments: int
    cuts: Cuts


class GroundTruths:
    """Ground truths of one mesh, prepared for evaluating many segmentations of the mesh.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        Same as in `segment`.
    truths : array of integers, shape (F,), or sequence of array_like of integers
        One ground truth, or a sequence of ground truths. A ground truth contains the true segment
        (>= 0) of each face, or -1 for an unannotated face.
    weld, n_threads
        Same as in `prepare`.

    Raises
    ------
    MeshError
        If the mesh is not a valid mesh of faces.
    ValueError, TypeError
        If a ground truth is not one integer >= -1 per face, if all of its values are -1, or if all
        faces have area 0.
    """

    def __init__(
        self, mesh: MeshLike, truths: npt.NDArray[np.integer] | Sequence[npt.ArrayLike], *,
        weld: float = True, n_threads: int | None = None,
    ) -> None:  # fmt: skip
        self.edges = MeshEdges.of(mesh, weld=weld, n_threads=n_threads)
        positive_total(self.edges.areas)
        sizes = (self.edges.mesh.n_faces, self.edges.mesh.n_vertices)
        compact = [compact_labels(truth, *sizes, "truth") for truth in _listed(truths)]
        self.truths = [_Truth(*labels, Cuts.of(self.edges, labels[0])) for labels in compact]

    def __len__(self) -> int:
        return len(self.truths)

    def __repr__(self) -> str:
        return f"GroundTruths({len(self)} of {counted(self.edges.mesh.n_faces, 'face')})"


def evaluate(
    mesh: MeshLike, labels: npt.ArrayLike,
    ground_truths: GroundTruths | npt.NDArray[np.integer] | Sequence[npt.ArrayLike] = (), *,
    tolerance: float = DEFAULT_TOLERANCE, weld: float = True, n_threads: int | None = None,
) -> dict[str, float]:  # fmt: skip
    """Compute all metrics of labels, and return them in a dict keyed by name.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, mesh-like or cloud-like
        Same as in `segment`.
    labels : array_like of integers, shape (F,)
        Region of each face, tetrahedron or point, >= 0; -1 for no region, which no metric counts.
    ground_truths : array of integers, sequence of array_like of integers, or GroundTruths
        One or several ground truths: the true segment (>= 0) of each cell, or -1 for unannotated
        cells, which are ignored. `GroundTruths` save time if many labels of one mesh are evaluated;
        `weld` and `n_threads` then have no effect.
    tolerance : float, default 0.01
        Maximum distance between matching borders for ``boundary_recall`` and
        ``boundary_precision``, >= 0, as a fraction of the diagonal of the bounding box.
    weld, n_threads
        Same as in `prepare`.

    Returns
    -------
    dict of str to float
        ``n_regions``, ``n_left_out`` (number of cells with label -1, plus the mean number of other
        cells that are -1 in a ground truth), ``n_extra_pieces`` (connected pieces of all regions,
        minus ``n_regions``), ``compactness`` and ``explained_variation``. Ground truths add
        ``undersegmentation_error``, ``achievable_accuracy``, ``achievable_iou``,
        ``boundary_recall``, ``boundary_precision``, ``cut_discrepancy``, ``hamming_distance``,
        ``missing_rate``, ``false_alarm_rate``, ``rand_index``, ``global_consistency_error`` and
        ``local_consistency_error``, each the mean over the ground truths. All but the first four
        are weighted by area or length, by volume for a `TetMesh`, and by the number of points for
        a `PointCloud`; for the latter two, metrics that need normals or border edges are left out.
        Metrics do not change if labels are renumbered or if the mesh is scaled.

    Raises
    ------
    MeshError
        If the mesh or cloud is not valid.
    ValueError, TypeError
        If labels are not one integer >= -1 per cell, or all -1, if a ground truth is not valid (see
        `GroundTruths`), if all cells have area 0, if `tolerance` is negative, or if `GroundTruths`
        were made for another mesh.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> found = evaluate(square, [0, 1], [[3, 3]])
    >>> found["n_regions"], found["undersegmentation_error"], found["missing_rate"]
    (2, 0.0, 0.5)
    """
    tolerance = checked_number(tolerance, "tolerance", zero=True)
    cells: Any = as_cells(mesh)
    regions, n_regions = compact_labels(labels, cells.n_cells, getattr(cells, "n_vertices", None))
    if regions.min() < 0:
        return _of_part(cells, regions, ground_truths, tolerance=tolerance, weld=weld)
    if not kind_of(cells).has_faces:
        if isinstance(ground_truths, GroundTruths):
            raise ValueError(_WRONG_MESH)
        surface = as_surface(cells, weld=weld, n_threads=n_threads)
        values = _of_regions(surface, regions, n_regions)
        truths = [
            compact_labels(truth, surface.n_cells, name="truth") for truth in _listed(ground_truths)
        ]
        return values | _of_overlaps(regions, n_regions, truths, weights_of_cells(cells))
    prepared = _prepared(cells, ground_truths, weld, n_threads)
    edges, surface = prepared.edges, prepared.edges.surface
    values = _of_regions(surface, regions, n_regions)
    values["explained_variation"] = explained_variation(surface, regions, n_regions)
    if not prepared.truths:
        return values
    cuts = Cuts.of(edges, regions)
    rows = []
    for truth in prepared.truths:
        overlap = overlap_of(regions, n_regions, truth.segments, truth.n_segments, edges.areas)
        rated = cuts
        if truth.segments.min() < 0:
            rated = Cuts.of(edges, np.where(truth.segments < 0, truth.segments, regions))
        recall, precision = boundary_agreement(edges, rated, truth.cuts, tolerance)
        of_borders = {"boundary_recall": recall, "boundary_precision": precision}
        of_borders["cut_discrepancy"] = cut_discrepancy(edges, rated, truth.cuts)
        rows.append(_of_overlap(overlap) | of_borders)
    return values | _left_out([truth.segments for truth in prepared.truths]) | _means(rows)


def evaluate_vertices(
    mesh: MeshLike, vertex_labels: npt.ArrayLike,
    ground_truths: npt.NDArray[np.integer] | Sequence[npt.ArrayLike] = (),
) -> dict[str, float]:  # fmt: skip
    """Compute metrics of labels of vertices, without conversion to labels of faces.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        Same as in `segment`. Vertices that belong to no face are ignored.
    vertex_labels : array_like of integers, shape (V,)
        Region of each vertex, >= 0; -1 for vertices in no region, which are left out.
    ground_truths : array of integers or sequence of array_like of integers
        Same as in `evaluate`, with one value per vertex.

    Returns
    -------
    dict of str to float
        The metrics of `evaluate` that need neither borders nor normals. Vertices are connected if
        they share an edge or have the same position. Vertices are counted: where a metric of
        `evaluate` is a fraction of the area, it is a fraction of the vertices.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if it is a point cloud, if labels or a ground truth are not one
        integer >= -1 per vertex, or if they are -1 at all vertices of faces.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> found = evaluate_vertices(square, [0, 1, 0, 1], [[3, 3, 3, 3]])
    >>> found["n_regions"], found["n_extra_pieces"], round(found["missing_rate"], 3)
    (2, 1, 0.5)
    """
    cells: Any = as_cells(mesh)
    if kind_of(cells).are_points:
        raise MeshError("a point cloud has no faces, which evaluate_vertices needs: use evaluate")
    corners, n = corners_in(cells), cells.n_vertices
    is_used = np.bincount(corners.vertices, minlength=n) > 0
    given = checked_classes(vertex_labels, n, "vertex_labels", "vertex")
    regions, n_regions = compact_labels(np.where(is_used, given, -1), n)
    is_rated = regions >= 0
    listed = [checked_classes(truth, n, "truth", "vertex") for truth in _listed(ground_truths)]
    truths = [compact_labels(np.where(is_rated, truth, -1), n, name="truth") for truth in listed]
    pieces = _core.find_components(*_arcs_of_vertices(cells, is_used), regions)[0]
    n_extra = len(np.unique(pieces[is_rated])) - n_regions
    values = {"n_regions": n_regions, "n_extra_pieces": n_extra} | _left_out([regions[is_used]])
    used = [(segments[is_used], n_segments) for segments, n_segments in truths]
    of_used = np.maximum(regions[is_used], 0)
    return values | _of_overlaps(of_used, n_regions, used, np.ones(len(of_used)))


def _arcs_of_vertices(cells: AnyMesh, is_used: Bools) -> ArcLists:
    """Return arcs between used vertices that share an edge or a position, in CSR form."""
    n, threads = cells.n_vertices, checked_threads(None)
    lowest = lowest_vertices(cells.vertices, True, threads)
    graph = vertex_graph(cells, np.arange(n, dtype=np.int32), threads)
    copies = np.flatnonzero((lowest != np.arange(n)) & is_used & is_used[lowest])
    starts = np.repeat(np.arange(n), np.diff(graph.offsets))
    starts = np.concatenate([starts, copies, lowest[copies]])
    ends = np.concatenate([graph.neighbors, lowest[copies], copies])
    offsets = np.append(0, np.cumsum(np.bincount(starts, minlength=n)))
    return offsets, ends[np.argsort(starts, kind="stable")].astype(np.int32)


def _of_overlaps(
    regions: Ints, n_regions: int, truths: list[tuple[Ints, int]], weights: Floats
) -> dict[str, float]:
    """Return the metrics of overlaps, and the number of unannotated cells: means over `truths`."""
    overlaps = [overlap_of(regions, n_regions, *truth, weights) for truth in truths]
    left_out = _left_out([segments for segments, _ in truths]) if truths else {}
    return left_out | _means([_of_overlap(overlap) for overlap in overlaps])


def _of_part(cells: Any, labels: Ints, truths: Any, **options: Any) -> dict[str, float]:
    """Return the metrics of the cells whose label is not -1."""
    kept = np.flatnonzero(labels >= 0).astype(np.int32)
    if isinstance(truths, GroundTruths):
        truths = [truth.segments for truth in _prepared(cells, truths, True, None).truths]
    cut = [compact_labels(truth, len(labels), name="truth")[0][kept] for truth in _listed(truths)]
    found = evaluate(part_of(cells, kept, 0).mesh, labels[kept], cut, **options)
    return found | {"n_left_out": found["n_left_out"] + len(labels) - len(kept)}


def _left_out(arrays: list[Ints]) -> dict[str, float]:
    """Return the number of values -1: the mean over `arrays`, or 0 if there are none."""
    total, n = sum(int(np.count_nonzero(a < 0)) for a in arrays), max(len(arrays), 1)
    return {"n_left_out": total / n if total % n else total // n}


def _of_regions(surface: Surface, regions: Ints, n_regions: int) -> dict[str, float]:
    return {
        "n_regions": n_regions,
        "n_left_out": 0,
        "n_extra_pieces": int(surface.components(regions).max()) + 1 - n_regions,
        "compactness": compactness_of(surface, regions, n_regions),
    }


def _means(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return the mean of each metric over `rows`, where each row is for one ground truth."""
    return {name: float(np.mean([row[name] for row in rows])) for name in (rows or [{}])[0]}


def _listed(truths: npt.NDArray[np.integer] | Sequence[npt.ArrayLike]) -> list[npt.ArrayLike]:
    if hasattr(truths, "__array__"):  # also a Segmentation
        truths = np.asarray(truths)
    if isinstance(truths, np.ndarray) and truths.ndim == 1 and truths.dtype.kind in "iu":
        return [truths]
    listed = list(truths) if hasattr(truths, "__iter__") else None
    if listed is None or any(np.ndim(truth) == 0 for truth in listed):
        raise TypeError(
            "ground_truths must be an array of one label per face, or a sequence of such arrays,"
            f" got {reprlib.repr(truths)}"
        )
    return listed


def _prepared(
    mesh: FaceMesh, ground_truths: GroundTruths | npt.NDArray[np.integer] | Sequence[npt.ArrayLike],
    weld: float, n_threads: int | None,
) -> GroundTruths:  # fmt: skip
    if isinstance(ground_truths, GroundTruths):
        if not is_same_mesh(ground_truths.edges.mesh, mesh):
            raise ValueError(_WRONG_MESH)
        return ground_truths
    return GroundTruths(mesh, ground_truths, weld=weld, n_threads=n_threads)


def _of_overlap(overlap: Overlap) -> dict[str, float]:
    distance, missing, false_alarm = hamming_distance(overlap)
    of_whole, of_points = consistency_error(overlap)
    return {
        "undersegmentation_error": undersegmentation_error(overlap),
        "achievable_accuracy": achievable_accuracy(overlap),
        "achievable_iou": achievable_iou(overlap), "hamming_distance": distance,
        "missing_rate": missing, "false_alarm_rate": false_alarm, "rand_index": rand_index(overlap),
        "global_consistency_error": of_whole, "local_consistency_error": of_points,
    }  # fmt: skip
