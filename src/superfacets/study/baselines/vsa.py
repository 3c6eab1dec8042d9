"""Variational Shape Approximation: k regions that are as flat as possible."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ..._timing import timed
from ..._types import Ints
from ..._validate import (
    checked_callable,
    checked_choice,
    checked_count,
    checked_generator,
    checked_threads,
)
from ...adapters.convert import MeshLike, as_triangles
from ...cells.face_graph import FaceGraph, build_face_graph
from ...cells.size import checked_n_segments
from ...clustering.segmentation import Segmentation, StopReason
from ...mesh.triangle_mesh import Mesh

METRICS = {"l21": _core.ProxyMetric.L21, "l2": _core.ProxyMetric.L2}
"""Names of the error metrics."""

INITS = ("random", "incremental")
"""Names of the methods to find the first proxies."""

Progress = Callable[[int, int], object]


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

    Each region is approximated by a plane, its proxy: a center and a unit normal. Two steps
    alternate: proxies are fitted to the regions, and then the regions are flooded anew. A flood
    begins at the seed of each region: its face of least error (the lowest among equals; a face
    without a normal only if there is no other). The flood then takes, one by one, the face of least
    error against the proxy of a region that it touches (among equals, the face that was offered
    first). Faces that were taken are not given back.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any triangle mesh, as for `superfacets.segment`. For ``"l21"`` it should be consistently
        oriented: the normal of a flipped face counts as opposite.
    n_segments : int, optional
        Number of regions k, 1 to the number of faces. By default 150, or the number of faces if
        that is less.
    metric : {"l21", "l2"}, default "l21"
        Error that a face adds to its region, integrated over the area of the face. ``"l21"``: the
        squared difference of the unit normals of face and proxy, 0 to 4. The proxy's normal is the
        direction of the mean normal; a face without a normal adds nothing. ``"l2"``: the squared
        distance to the plane of the proxy, which goes through the barycenter of the region,
        perpendicular to the direction in which the region extends least.
    init : {"random", "incremental"}, default "random"
        ``"random"``: the seeds are k faces drawn at random, without replacement, and the proxies
        are their planes. ``"incremental"``: begin with one region for each component of the mesh.
        While there are fewer than k, fit proxies to all regions, choose the region of largest total
        error (of two or more faces; the lowest label among equals) and in it the face of largest
        error (not the seed; the highest among equals), add this face as a seed with its plane as
        the proxy, and flood all regions anew.
    rng : int or numpy.random.Generator, default 0
        Draws the faces of ``"random"``; an int >= 0 seeds a generator.
    max_num_iter : int, default 50
        Maximum number of floods with k regions, each of which labels all faces.
    weld : bool, default True
        Count vertices at exactly the same position as one.
    n_threads : int, optional
        As for `superfacets.segment`; floods and fits use one thread.
    progress : callable, optional
        Called after each iteration with its number (from 1) and the number of faces that changed
        their region (all faces in the first iteration). Returning False ends the loop with
        ``stop_reason="cancelled"``. It is not called before there are k regions.

    Returns
    -------
    Segmentation
        ``labels`` are from the last flood, ``centers`` are its seeds. ``stop_reason`` is
        ``"converged"`` if no face changed regions, and ``"settled"`` if earlier labels came back.
        Each component without a seed becomes one more region: the lowest of the faces that no flood
        reaches becomes a seed. With ``"incremental"`` these regions count toward k, which is then
        exceeded only if there are more components.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    Each flood takes O(F log F), so ``"incremental"`` takes O(k F log F). Fitting never raises the
    error, but a flood may, because its queue is greedy.

    References
    ----------
    Cohen-Steiner, Alliez and Desbrun, "Variational Shape Approximation", 2004, section 3. The paper
    does not define ties, faces without a normal, and meshes of several components.

    Examples
    --------
    >>> ridge = ([[0, 0, 0], [0, 2, 0], [-1, 1, -1], [1, 1, -1], [1, 3, -1]],
    ...          [[0, 1, 2], [0, 3, 1], [1, 3, 4]])
    >>> variational_shape_approximation(ridge, 2, init="incremental").labels
    array([1, 0, 0], dtype=int32)
    """
    checked_choice(metric, "metric", tuple(METRICS))
    checked_choice(init, "init", INITS)
    generator = checked_generator(rng, "rng")
    max_num_iter = checked_count(max_num_iter, "max_num_iter")
    n_threads = checked_threads(n_threads)
    progress = checked_callable(progress, "progress")
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
            regions = _flood_incrementally(surface, graph, metric, n_segments)
    with timed(timings, "relax"):
        n_iter, stop_reason = _relax(regions, surface.n_faces, max_num_iter, progress)
    params: dict[str, Any] = {
        "method": "vsa", "n_segments": n_segments, "metric": metric, "init": init,
        "rng": "given" if rng is generator else rng, "max_num_iter": max_num_iter, "weld": weld,
    }  # fmt: skip
    return Segmentation(regions.labels(), regions.seeds(), n_iter, stop_reason, timings, params)


def _flood(mesh: Mesh, graph: FaceGraph, metric: str, seeds: npt.ArrayLike) -> _core.ProxyRegions:
    return _core.ProxyRegions(
        mesh.vertices,
        mesh.faces,
        graph.measures,
        graph.offsets,
        graph.neighbors,
        METRICS[metric],
        np.asarray(seeds, dtype=np.int32),
    )


def _flood_incrementally(
    mesh: Mesh, graph: FaceGraph, metric: str, n_segments: int
) -> _core.ProxyRegions:
    # The first face does not matter: it floods its component, and new seeds flood the others.
    regions = _flood(mesh, graph, metric, [0])
    while regions.n_regions < n_segments:
        regions.insert()
    return regions


def _relax(
    regions: _core.ProxyRegions, n_faces: int, max_num_iter: int, progress: Progress | None
) -> tuple[int, StopReason]:
    """Fit and flood until a stop rule applies; return the number of floods and the rule."""
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
        fingerprint = _fingerprint(regions.labels())
        if fingerprint in seen:
            return iteration, "settled"
        seen.add(fingerprint)
    return max_num_iter, "max_num_iter"


def _fingerprint(labels: Ints) -> bytes:
    """128-bit hash of the labels. Equal labels have equal successors."""
    return hashlib.blake2b(labels.tobytes(), digest_size=16).digest()
