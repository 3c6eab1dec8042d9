"""Regions of the default options and of four peers, compared in quality and time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from research.baselines import (
    felzenszwalb_segments,
    metis_partition,
    variational_shape_approximation,
)
from research.princeton import Benchmark

import superfacets as sf

from .balance import METHODS, Labels, faces_of_vertices, measured

Run = Callable[[], Labels]
"""Function that segments one mesh into k regions."""

_ROUNDS = 12  # of the search for a threshold: the last interval is a factor of 1.01 wide


def _timed(method: Callable[[sf.Mesh, int], Labels]) -> Callable[[sf.Mesh, int], Run]:
    return lambda mesh, k: partial(method, mesh, k)


def _segmentator(mesh: sf.Mesh, k: int) -> Run:
    """Search the threshold with which ScanNet's segmentator makes about `k` segments.

    Segments have at least a quarter of the mean number of vertices, and at most 20, the default.
    """
    least = max(1, min(20, mesh.n_vertices // (4 * k)))

    def segments(power: float) -> Labels:
        return felzenszwalb_segments(mesh, 10.0**power, least, n_threads=1)

    low, high = -10.0, 10.0
    for _ in range(_ROUNDS):
        middle = (low + high) / 2
        low, high = (middle, high) if segments(middle).max() + 1 > k else (low, middle)
    return lambda: faces_of_vertices(mesh, segments(high))


PEERS: dict[str, Callable[[sf.Mesh, int], Run]] = {
    "superfacets": _timed(METHODS["superfacets"]),
    "METIS": _timed(lambda mesh, k: metis_partition(mesh, k, n_threads=1).labels),
    "VSA": _timed(
        lambda mesh, k: (
            variational_shape_approximation(mesh, k, metric="l2", init="random", n_threads=1).labels
        )
    ),
    "pyacvd": _timed(METHODS["pyacvd"]),
    "ScanNet's segmentator": _segmentator,
}
"""Function that prepares a run for a mesh and a number of regions; only the run is timed."""


def smoothed(mesh: sf.Mesh, labels: Labels) -> Labels:
    """Connect regions and straighten their borders as `superfacets.segment` does.

    Without this, the borders of vertex labels, converted to faces, and of METIS are saw teeth.
    """
    connected = sf.enforce_connectivity(mesh, labels).labels
    return sf.smooth_borders(mesh, connected, stiffness=1.5)


def measure_peers(
    folder: Path, k: int, every: int, say: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Measure all peers on every n-th model of the Princeton benchmark in `folder`.

    Returns a row for each peer: means over models of the undersegmentation error and the
    compactness of its labels after `smoothed`, and its time on one thread divided by our time.
    """
    benchmark = Benchmark(folder)
    models = [benchmark.load(number) for number in sorted(benchmark.numbers)[::every]]
    rows: list[dict[str, Any]] = []
    for name, prepare in PEERS.items():
        say(name)
        finish = {"finish": smoothed} if rows else {}  # the first row is ours, already smooth
        found = np.array([measured(model, prepare(model.mesh, k), **finish) for model in models])
        error, compactness, *_, seconds = found.mean(axis=0)
        ours = rows[0]["seconds"] if rows else seconds
        rows.append({"method": name, "error": error, "compactness": compactness,
                     "seconds": seconds, "times_ours": seconds / ours})  # fmt: skip
    return rows
