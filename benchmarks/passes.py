"""Times of a single classification of all faces."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import superfacets as sf
from superfacets.paper import superfacet_weights

from .checks import require
from .clock import interleaved, median
from .meshes import Arrays

Key = tuple[int, int]  # number of regions, threads


def measure(mesh: str, arrays: Arrays, keys: list[Key], repeats: int) -> list[dict[str, Any]]:
    """Return a row for each of `keys`, with the time of one pass.

    A pass is one classification of all faces from the seeds, without the result of an earlier
    classification. Its time is ``timings["classify"]`` of `segment_graph` with one iteration. The
    time includes the allocation of the result. It does not include the placement of seeds, the
    update of centers, and the making of the sorted graph.
    """
    surface = sf.Mesh(*arrays)
    faces = sf.build_face_graph(surface)
    graph = faces.with_weights(superfacet_weights(surface, faces))
    seeds = {k: sf.place_seeds(graph, k, init="farthest") for k in {k for k, _ in keys}}
    labels = {k: sf.classify(graph, seeds[k]).labels for k in seeds}

    def accept(key: Key, result: sf.Segmentation) -> float:
        is_same = np.array_equal(result.labels, labels[key[0]])
        require(is_same, f"{mesh}: one iteration is not one classification of the seeds")
        return result.timings["classify"]

    one_pass = partial(sf.segment_graph, graph, max_num_iter=1, tol=0.0)
    jobs = {
        (k, threads): partial(one_pass, init=seeds[k], n_threads=threads) for k, threads in keys
    }
    samples = interleaved(jobs, repeats, accept)
    return [_row(mesh, graph, key, [sample.fact for sample in samples[key]]) for key in keys]


def _row(mesh: str, graph: sf.CellGraph, key: Key, seconds: list[float]) -> dict[str, Any]:
    middle = median(seconds)
    return {
        "mesh": mesh,
        "faces": graph.n_cells,
        "k": key[0],
        "threads": key[1],
        "pass_seconds": middle,
        "fastest": min(seconds),
        "slowest": max(seconds),
        "ns_per_face": 1e9 * middle / graph.n_cells,
    }
