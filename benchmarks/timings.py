"""Print the timing table of the README: ``make timings``.

Medians of five runs from arrays to labels, on sample meshes. Before a time is reported, the labels
are compared with those of one thread, and their number with what was asked for.
"""

import os
import platform
import statistics
import time

import numpy as np

import superfacets as sf

SIZES = (60_000, 250_000, 1_000_000)
N_SEGMENTS = (150, 2_000)
N_RUNS = 5


def main() -> None:
    """Time the default parameters on each size and number of regions."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    print(f"{platform.machine()}, {cores} cores, superfacets {sf.__version__}\n")
    print("| faces | regions | iterations | seconds |")
    print("|---:|---:|---:|---:|")
    for n_faces in SIZES:
        mesh = sf.sample_mesh(n_faces)
        for n_segments in N_SEGMENTS:
            one_thread = sf.segment(mesh, n_segments, n_threads=1)
            results, seconds = zip(*(_run(mesh, n_segments) for _ in range(N_RUNS)), strict=True)
            assert all(result.n_segments == n_segments for result in results)
            assert all(np.array_equal(result.labels, one_thread.labels) for result in results)
            median = statistics.median(seconds)
            print(f"| {mesh.n_faces:,} | {n_segments:,} | {one_thread.n_iter} | {median:.2f} |")


def _run(mesh: sf.Mesh, n_segments: int) -> tuple[sf.Segmentation, float]:
    start = time.perf_counter()
    result = sf.segment(mesh, n_segments)
    return result, time.perf_counter() - start


if __name__ == "__main__":
    main()
