"""Divide a mesh into k regions that are as flat as possible (Variational Shape Approximation)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from superfacets.base.checks import checked_choice, checked_count, checked_threads
from superfacets.base.timing import timed
from superfacets.clustering.result import Segmentation, StopReason
from superfacets.graph.face_graph import FaceGraph, build_face_graph
from superfacets.graph.size import checked_n_segments
from superfacets.mesh.convert import MeshLike
from superfacets.mesh.meshes import Mesh

from ..checks import as_triangles, checked_generator, import_package

METRICS = ("l21", "l2")  # names of error metrics

INITS = ("random", "incremental")  # values of `init`: methods that choose the first seeds

Progress = Callable[[int, int], object]

if TYPE_CHECKING:
    from superfacets_vsa import ProxyRegions


def variational_shape_approximation(
    mesh: MeshLike,
    n_segments: int | None = None,
    *,
    metric: str = "l21",
    init: str = "random",
    rng: int | np.random.Generator = 0,
    max_num_iter: int = 50,
    weld: bool = True,
    n_threads: int | None = None,
    progress: Progress | None = None,
) -> Segmentation:
    """Label every face of a mesh with one of k connected regions that are as flat as possible.

    Each region is approximated by a plane, its proxy, which has a center and a unit normal. Two
    steps alternate: proxies are fitted to the regions, and a flood fill grows new regions from
    seeds. The seed of a region is its face with the lowest error. If several faces have the lowest
    error, the lowest index is used. A face without a normal is a seed only if all faces of the
    region have no normal. The flood fill adds faces one by one. The next face is the face with the
    lowest error with respect to an adjacent region. If several faces have the lowest error, the
    face that was queued first is used. Each face is labeled only once.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any triangle mesh, as for `superfacets.segment`. For ``"l21"``, faces should be consistently
        oriented, because the error depends on the direction of normals.
    n_segments : int, optional
        Number of regions k, from 1 to the number of faces. The default is 150, but at most the
        number of faces.
    metric : {"l21", "l2"}, default "l21"
        Error of a face, integrated over its area. ``"l21"`` is the squared difference of the unit
        normals of face and proxy, 0 to 4. The normal of the proxy is the area-weighted mean of the
        normals of the faces, scaled to unit length. The error of a face without a normal is 0.
        ``"l2"`` is the squared distance to the plane of the proxy. This plane contains the
        barycenter of the region, and is perpendicular to the direction in which the region extends
        least.
    init : {"random", "incremental"}, default "random"
        With ``"random"``, the seeds are k random faces, drawn without replacement, and the proxies
        are their planes. ``"incremental"`` starts with one region per connected component of the
        mesh, and adds one seed at a time until there are k regions. The region for the new seed has
        the largest total error of all regions with two or more faces. The new seed is the face with
        the largest error in this region, except the old seed. Ties are resolved by the lowest index
        of regions, and by the highest index of faces. With the new seed, all regions are flooded
        again. Before the next seed is chosen, proxies are fitted.
    rng : int or numpy.random.Generator, default 0
        Random number generator for ``"random"``, or an int >= 0 to seed a generator.
    max_num_iter : int, default 50
        Maximum number of flood fills with k regions.
    weld : bool, default True
        Whether to merge vertices at exactly the same position.
    n_threads : int, optional
        Same as in `superfacets.segment`. Flood fills and fits use one thread.
    progress : callable, optional
        Function called after each iteration with the iteration number, from 1, and the number of
        faces that changed their region. In the first iteration, this is the number of all faces. If
        the function returns False, the loop stops with ``stop_reason="cancelled"``. Flood fills
        with fewer than k regions are not reported.

    Returns
    -------
    Segmentation
        ``labels`` are from the last flood fill, and ``centers`` are its seeds. ``stop_reason`` is
        ``"converged"`` if no face changed its region, and ``"settled"`` if earlier labels occur
        again. Each connected component without a seed becomes an additional region, and its seed is
        the face with the lowest index. With ``"incremental"``, these regions are included in k.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    A flood fill takes O(F log F), so ``"incremental"`` takes O(k F log F). Fitting never increases
    the error, but a flood fill may, because it is greedy.

    References
    ----------
    Cohen-Steiner, Alliez and Desbrun, "Variational Shape Approximation", 2004, section 3. Rules for
    ties, faces without a normal, and meshes of several components are our own.

    Examples
    --------
    >>> ridge = ([[0, 0, 0], [0, 2, 0], [-1, 1, -1], [1, 1, -1], [1, 3, -1]],
    ...          [[0, 1, 2], [0, 3, 1], [1, 3, 4]])
    >>> variational_shape_approximation(ridge, 2, init="incremental").labels
    array([1, 0, 0], dtype=int32)
    """
    checked_choice(metric, "metric", METRICS)
    checked_choice(init, "init", INITS)
    generator = checked_generator(rng, "rng")
    max_num_iter = checked_count(max_num_iter, "max_num_iter")
    n_threads = checked_threads(n_threads)
    timings: dict[str, float] = {}
    with timed(timings, "mesh"):
        surface = as_triangles(mesh)
    n_segments = checked_n_segments(n_segments, surface.n_faces)
    with timed(timings, "face_graph"):
        graph = build_face_graph(surface, weld=weld, n_threads=n_threads)
    with timed(timings, "seeding"):
        if init == "random":
            seeds = generator.choice(surface.n_faces, n_segments, replace=False)
            regions = _flood(surface, graph, metric, seeds)
        else:
            regions = _flood(surface, graph, metric, [0])  # adds a seed in each further component
            while regions.n_regions < n_segments:
                regions.insert()
    with timed(timings, "relax"):
        n_iter, stop_reason = _relax(regions, surface.n_faces, max_num_iter, progress)
    params: dict[str, Any] = {
        "method": "vsa", "n_segments": n_segments, "metric": metric, "init": init,
        "rng": "given" if rng is generator else rng, "max_num_iter": max_num_iter, "weld": weld,
    }  # fmt: skip
    return Segmentation(regions.labels(), regions.seeds(), n_iter, stop_reason, timings, params)


def _flood(mesh: Mesh, graph: FaceGraph, metric: str, seeds: npt.ArrayLike) -> ProxyRegions:
    vsa = import_package("superfacets_vsa", "variational shape approximation")
    return vsa.ProxyRegions(
        mesh.vertices, mesh.faces, graph.measures, graph.offsets, graph.neighbors,
        getattr(vsa.ProxyMetric, metric.upper()), np.asarray(seeds, dtype=np.int32),
    )  # fmt: skip


def _relax(
    regions: ProxyRegions,
    n_faces: int,
    max_num_iter: int,
    progress: Progress | None,
) -> tuple[int, StopReason]:
    """Alternate fits and flood fills; return the number of iterations and the stop reason."""
    seen: set[bytes] = set()
    n_changed = n_faces
    for iteration in range(1, max_num_iter + 1):
        if iteration > 1:
            n_changed = regions.relax()
        answer = None if progress is None else progress(iteration, n_changed)
        if n_changed == 0:
            return iteration, "converged"
        if isinstance(answer, (bool, np.bool_)) and not answer:
            return iteration, "cancelled"
        # Labels depend only on the previous labels. If labels occur again, they repeat forever.
        fingerprint = hashlib.blake2b(regions.labels().tobytes(), digest_size=16).digest()
        if fingerprint in seen:
            return iteration, "settled"
        seen.add(fingerprint)
    return max_num_iter, "max_num_iter"
