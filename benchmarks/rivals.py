"""Run alternatives to superfacets with their best settings.

Each function returns labels, and the seconds of each part of its run. Only the benchmark needs the
packages of the rivals. Each package is imported where it is used.
"""

from __future__ import annotations

import functools
import importlib.util
import math
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import superfacets as sf

from .meshes import SEED, Arrays


class Outcome(NamedTuple):
    """Labels of faces, vertices or pixels, and the seconds of each part of the run."""

    labels: npt.NDArray[Any]
    seconds: dict[str, float]


class Rival(NamedTuple):
    """A rival with one choice of settings."""

    name: str
    module: str
    elements: str  # name of the labeled elements: "faces", "vertices" or "pixels"
    settings: str
    prepare: Callable[[Arrays], Any]  # makes the input from the mesh; not timed
    run: Callable[[Any, int], Outcome]


def is_installed(module: str) -> bool:
    """Return whether a module is installed."""
    return importlib.util.find_spec(module) is not None


@contextmanager
def _part(seconds: dict[str, float], name: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[name] = time.perf_counter() - start


def run_metis(arrays: Arrays, n_segments: int) -> Outcome:
    """Divide the graph of faces into connected parts with METIS; all arcs have the same weight.

    METIS ignores the option for connected parts if the graph is disconnected.
    """
    import pymetis

    seconds: dict[str, float] = {}
    with _part(seconds, "graph"):
        adjacency = pymetis.CSRAdjacency(*face_adjacency(arrays))
    with _part(seconds, "partition"):
        # `contiguous=True` has the same effect, but causes a warning.
        options = pymetis.Options(contig=True)
        parts = pymetis.part_graph(n_segments, adjacency, options=options).vertex_part
        labels = np.asarray(parts, dtype=np.int32)
    return Outcome(labels, seconds)


def face_adjacency(arrays: Arrays) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the offsets and neighbors of the face graph in CSR form, computed with a single sort.

    An edge must have at most two faces. The arrays are int64, because pymetis does not copy int64
    arrays.
    """
    corners = arrays.faces.astype(np.int64)
    following = np.roll(corners, -1, axis=1)
    low, high = np.minimum(corners, following), np.maximum(corners, following)
    keys = (low * len(arrays.vertices) + high).ravel()
    order = np.argsort(keys)
    is_pair = np.diff(keys[order]) == 0
    first, second = order[:-1][is_pair], order[1:][is_pair]
    neighbor_of_side = np.full(len(keys), -1, dtype=np.int64)
    neighbor_of_side[first] = second // 3
    neighbor_of_side[second] = first // 3
    has_neighbor = neighbor_of_side >= 0
    offsets = np.zeros(len(corners) + 1, dtype=np.int64)
    np.cumsum(has_neighbor.reshape(-1, 3).sum(axis=1), out=offsets[1:])
    return offsets, neighbor_of_side[has_neighbor]


def run_pyacvd(arrays: Arrays, n_segments: int) -> Outcome:
    """Cluster the vertices with pyacvd, without subdividing the mesh."""
    return _cluster_vertices(arrays, lambda clustering: clustering.cluster(n_segments))


def run_pyacvd_fast(arrays: Arrays, n_segments: int) -> Outcome:
    """Cluster the vertices with the faster method of pyacvd, whose regions differ more in size."""
    return _cluster_vertices(arrays, lambda clustering: clustering.fast_cluster(n_segments))


def _cluster_vertices(arrays: Arrays, cluster: Callable[[Any], npt.NDArray[Any]]) -> Outcome:
    import pyacvd
    import pyvista

    seconds: dict[str, float] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pyacvd calls deprecated functions of PyVista
        with _part(seconds, "mesh"):
            faces: Any = arrays.faces  # PyVista's annotations exclude int32
            surface = pyvista.PolyData.from_regular_faces(arrays.vertices, faces)
        with _part(seconds, "neighbors"):
            clustering = pyacvd.Clustering(surface)
        with _part(seconds, "cluster"):
            labels = np.asarray(cluster(clustering))
    return Outcome(labels, seconds)


def gray_image(n_pixels: int) -> npt.NDArray[np.float32]:
    """Return a smooth image with reproducible noise, of at most, and about, `n_pixels` pixels."""
    height = math.isqrt(n_pixels)
    width = n_pixels // height
    y, x = np.meshgrid(np.linspace(0, 9, height), np.linspace(0, 9, width), indexing="ij")
    noise = np.random.default_rng(SEED).random((height, width))
    return (0.4 + 0.2 * np.sin(x + y) + 0.2 * np.sin(2 * x - y) + 0.2 * noise).astype(np.float32)


def _image_of_mesh_size(arrays: Arrays) -> npt.NDArray[np.float32]:
    return gray_image(len(arrays.faces))


def run_slic(image: npt.NDArray[np.float32], n_segments: int, *, connect: bool) -> Outcome:
    """Segment an image with 10 iterations of SLIC, which is fastest for gray float32 images."""
    from skimage.segmentation import slic

    seconds: dict[str, float] = {}
    with _part(seconds, "slic"):
        labels = slic(
            image, n_segments, max_num_iter=10, channel_axis=None, enforce_connectivity=connect,
            start_label=0,
        )  # fmt: skip
    return Outcome(labels.ravel(), seconds)


run_slic_connected = functools.partial(run_slic, connect=True)
run_slic_loose = functools.partial(run_slic, connect=False)
"""SLIC whose regions may be disconnected."""


class ScipyOutcome(NamedTuple):
    """Distance of each cell to its nearest center, this center, and the seconds of each part."""

    distances: npt.NDArray[np.float64]
    centers: npt.NDArray[np.int32]
    seconds: dict[str, float]


def run_scipy(graph: sf.CellGraph, centers: npt.NDArray[np.int32]) -> ScipyOutcome:
    """Run SciPy's Dijkstra once, from all centers simultaneously.

    The graph must have each arc in both directions.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    seconds: dict[str, float] = {}
    with _part(seconds, "matrix"):
        shape = (graph.n_cells, graph.n_cells)
        indices = graph.neighbors, graph.offsets.astype(np.int32)
        matrix = csr_array((graph.weights, *indices), shape=shape)
    with _part(seconds, "dijkstra"):
        distances, _, sources = dijkstra(
            matrix, directed=True, indices=centers, min_only=True, return_predecessors=True
        )
    return ScipyOutcome(distances, sources, seconds)


def _as_is(arrays: Arrays) -> Arrays:
    return arrays


RIVALS = (
    Rival("METIS", "pymetis", "faces", "contiguous=True", _as_is, run_metis),
    Rival("pyacvd", "pyacvd", "vertices", "cluster", _as_is, run_pyacvd),
    Rival("pyacvd", "pyacvd", "vertices", "fast_cluster", _as_is, run_pyacvd_fast),
    Rival("SLIC", "skimage", "pixels", "10 iterations", _image_of_mesh_size, run_slic_connected),
    Rival(
        "SLIC",
        "skimage",
        "pixels",
        "10 iterations, enforce_connectivity=False",
        _image_of_mesh_size,
        run_slic_loose,
    ),
)
