"""Checks of labels before times are kept: hashes, reference implementation, and invariants."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import reference

import superfacets as sf

from .meshes import Arrays

PLAIN: dict[str, Any] = {"weights": "superfacets", "init": "farthest", "smooth": False}
"""Keywords for the paper's weights and seeds, without smoothing."""

EXPECTED = Path(__file__).with_name("expected.json")
"""File with hashes of meshes and labels; ``python -m benchmarks expect`` writes it."""

Expected = dict[str, Any]


class WrongLabelsError(AssertionError):
    """The labels are wrong, so the times of this run have no meaning."""


def require(holds: bool, message: str) -> None:
    """Raise a WrongLabelsError if a condition is False."""
    if not holds:
        raise WrongLabelsError(message)


def load_expected(path: Path = EXPECTED) -> Expected:
    """Return the stored hashes, or an empty set of hashes if the file does not exist."""
    if not path.exists():
        return {"meshes": {}}
    stored: Expected = json.loads(path.read_text())
    return stored


def save_expected(expected: Expected, path: Path = EXPECTED) -> None:
    """Write the hashes in sorted order, so that a changed hash changes one line."""
    path.write_text(json.dumps(expected, indent=1, sort_keys=True) + "\n")


def check_labels(
    expected: Expected, run: tuple[str, str], arrays: Arrays, result: sf.Segmentation,
    alone: Callable[[], sf.Segmentation],
) -> str:  # fmt: skip
    """Check labels, and return how they were checked.

    If the mesh has the stored hash, its labels must have the stored hash. If the mesh has another
    hash, or if no hash is stored, the labels are checked by invariants, and compared with the
    labels of one thread. Meshes may have other hashes on other machines, because subdivided meshes
    depend on numpy's random numbers, and sample meshes depend on its linear algebra.

    Parameters
    ----------
    expected : dict
        From `load_expected`.
    run : (str, str)
        Name of the mesh, and name of the run from `runs.run_name`.
    arrays : Arrays
        The mesh.
    result : Segmentation
        Result of the run, which has the labels.
    alone : callable
        Function that repeats the run on one thread.

    Raises
    ------
    WrongLabelsError
        If the labels are wrong.
    """
    mesh, name = run
    entry = expected["meshes"].get(mesh, {"labels": {}})
    stored = entry["labels"].get(name)
    if stored == hash_labels(result.labels):
        return "stored hash"
    if stored is not None and entry["mesh"] == hash_mesh(arrays):
        raise WrongLabelsError(f"{mesh}, {name}: the labels do not have the stored hash")
    reason = "no hash" if stored is None else "another mesh than hashed"
    check_invariants(arrays, result)
    is_same = np.array_equal(alone().labels, result.labels)
    require(is_same, "one thread gives other labels")
    return f"invariants, 1 thread ({reason})"


def check_invariants(arrays: Arrays, result: sf.Segmentation) -> None:
    """Raise an error unless labels are int32, and each of K connected regions contains its center.

    K must be the requested number of regions, plus at most one for each component of the mesh after
    the first. If paths have a limit, regions may be disconnected, and there may be more regions.
    """
    labels, n_segments = result.labels, result.n_segments
    require(labels.shape == (len(arrays.faces),), "there is not one label per face")
    require(labels.dtype == np.int32, f"labels are {labels.dtype}, not int32")
    counts = np.bincount(labels, minlength=n_segments)
    require(len(counts) == n_segments and bool(counts.all()), "labels have gaps")
    own = labels[result.centers]
    require(np.array_equal(own, np.arange(n_segments)), "a center is in another region")
    asked = result.params["n_segments"]
    if result.params["radius_factor"] is not None:
        require(n_segments >= asked, f"{n_segments} regions, {asked} requested")
        return
    graph = sf.build_face_graph(arrays)
    pieces = n_pieces(graph.offsets, graph.neighbors, labels)
    require(pieces == n_segments, f"{n_segments} regions are in {pieces} pieces")
    n_components = n_pieces(graph.offsets, graph.neighbors, np.zeros_like(labels))
    is_right = asked <= n_segments < asked + n_components
    require(is_right, f"{n_segments} regions, {asked} requested")


def n_pieces(
    offsets: npt.NDArray[Any], neighbors: npt.NDArray[Any], labels: npt.NDArray[Any]
) -> int:
    """Return the total number of connected pieces of all regions. Needs SciPy."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n_cells = len(labels)
    sources = np.repeat(np.arange(n_cells, dtype=np.int32), np.diff(offsets))
    is_inside = labels[sources] == labels[neighbors]
    n_inside = np.concatenate([[0], np.cumsum(is_inside)])[offsets].astype(np.int32)
    ones = np.ones(int(n_inside[-1]), dtype=np.int8)
    inside = csr_array((ones, neighbors[is_inside], n_inside), shape=(n_cells, n_cells))
    return int(connected_components(inside, directed=False)[0])


@cache
def check_against_reference(n_segments: int = 20) -> None:
    """Raise an error unless `reference` gives the same labels for a small mesh."""
    mesh = cast(sf.Mesh, sf.prepare(sf.sample_mesh(3_000), denoise=0).cells)  # sorted
    arcs = reference.build_face_graph(mesh)
    weights = reference.superfacet_weights(mesh, arcs, alpha=200.0, eta_convex=0.2)
    positions, areas = reference.measure_faces(mesh)
    counts = np.bincount([arc.face for arc in arcs], minlength=mesh.n_faces)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    neighbors = np.array([arc.neighbor for arc in arcs], dtype=np.int32)
    graph = sf.CellGraph(positions, areas, offsets, neighbors, weights)
    radius = math.sqrt(float(areas.sum()) / (math.pi * n_segments))
    seeds = reference.farthest_seeds(graph, n_segments)
    for tol in (0.02, 0.0):
        history, stop_reason = reference.iterate(graph, seeds, radius, tol=tol)
        result = sf.segment(mesh, n_segments, tol=tol, **PLAIN | {"init": seeds})
        require(result.labels.tolist() == history[-1][0], f"tol={tol}: not the reference's labels")
        require(result.stop_reason == stop_reason, f"tol={tol}: not the reference's stop reason")
    result = sf.segment(mesh, n_segments, **PLAIN)
    labels, _ = reference.classify_exact(graph, result.centers.tolist())
    is_right = len(result.levels) > 1 and result.labels.tolist() == labels
    require(is_right, "coarse to fine: not the reference's classification by these centers")


def hash_labels(labels: npt.NDArray[np.int32]) -> str:
    """Return a hash of labels, the same on any machine."""
    return _hash(labels.astype("<i4", copy=False))


def hash_mesh(arrays: Arrays) -> str:
    """Return a hash of vertices and faces, the same on any machine."""
    return _hash(arrays.vertices.astype("<f8", copy=False), arrays.faces.astype("<i4", copy=False))


def _hash(*arrays: npt.NDArray[Any]) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()
