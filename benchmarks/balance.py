"""Regions of equal area, compared with METIS and pyacvd in balance, quality and speed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from research.baselines import metis_partition
from research.princeton import Benchmark, Model
from research.table_writer import markdown_table

import superfacets as sf
from superfacets import metrics

from .meshes import Arrays
from .rivals import run_pyacvd

Labels = npt.NDArray[np.int32]


def _metis(imbalance: float) -> Callable[[sf.Mesh, int], Labels]:
    """Return a function that runs METIS with crease weights.

    `imbalance` is the maximum excess of the area of a region over the mean area, as a fraction.
    """
    return lambda mesh, k: metis_partition(mesh, k, imbalance=imbalance, n_threads=1).labels


def _pyacvd(mesh: sf.Mesh, k: int) -> Labels:
    """Cluster vertices with pyacvd, and return the label of each face."""
    return faces_of_vertices(mesh, run_pyacvd(Arrays(mesh.vertices, mesh.faces), k).labels)


def faces_of_vertices(mesh: sf.Mesh, labels: npt.NDArray[Any]) -> Labels:
    """Return the label of each face, without gaps.

    A face gets the most frequent label of its vertices, or the label of its first vertex if all
    three labels differ.
    """
    first, second, third = labels[mesh.faces].T
    of_faces = np.where(second == third, second, first)
    return np.unique(of_faces, return_inverse=True)[1].astype(np.int32)


METHODS: dict[str, Callable[[sf.Mesh, int], Labels]] = {
    "superfacets": lambda mesh, k: sf.segment(mesh, k, n_threads=1).labels,
    "superfacets, balance=1": lambda mesh, k: (
        sf.segment(mesh, k, sizes=sf.Sizes(balance=1), n_threads=1).labels
    ),
    "METIS, 3 %": _metis(0.03),
    "METIS, 10 %": _metis(0.1),
    "METIS, 20 %": _metis(0.2),
    "pyacvd": _pyacvd,
}


class Row(NamedTuple):
    """Results of one method for one number of regions: means over all models."""

    k: int
    method: str
    error: float  # undersegmentation error
    compactness: float
    variation: float  # coefficient of variation of areas
    largest: float  # largest area divided by the mean area
    apart: float  # number of extra connected pieces per region
    seconds: float


def measure_balance(
    folder: Path, ks: Sequence[int], every: int, say: Callable[[str], None]
) -> list[Row]:
    """Measure all methods on the models of the Princeton benchmark in `folder`, on one thread.

    Only every n-th model is used, where n is `every`. Returns a row for each number of regions in
    `ks` and each method.
    """
    benchmark = Benchmark(folder)
    models = [benchmark.load(number) for number in sorted(benchmark.numbers)[::every]]
    rows = []
    for k in ks:
        for name, method in METHODS.items():
            say(f"k = {k}: {name}")
            values = [measured(model, partial(method, model.mesh, k)) for model in models]
            rows.append(Row(k, name, *np.mean(values, axis=0).tolist()))
    return rows


def measured(
    model: Model, run: Callable[[], Labels],
    finish: Callable[[sf.Mesh, Labels], Labels] = lambda mesh, labels: labels,
) -> list[float]:  # fmt: skip
    """Return the values of a `Row` for a model, from `error` to `seconds`.

    `finish` changes the labels before they are rated; the seconds are those of `run` alone.
    """
    mesh = model.mesh
    start = time.process_time()
    labels = run()
    seconds = time.process_time() - start
    labels = finish(mesh, labels)
    areas = sf.build_face_graph(mesh).measures
    overlaps = [metrics.area_overlap(labels, truth, areas) for truth in model.ground_truths]
    error = float(np.mean([metrics.undersegmentation_error(overlap) for overlap in overlaps]))
    found = metrics.evaluate(mesh, labels)
    sizes = np.bincount(labels, areas)
    apart = found["n_extra_pieces"] / found["n_regions"]
    spread = (float(sizes.std() / sizes.mean()), float(sizes.max() / sizes.mean()))
    return [error, found["compactness"], *spread, apart, seconds]


def balance_table(rows: Sequence[Row]) -> str:
    """Return the rows as a table in Markdown."""
    head = ["k", "method", "UE", "compactness", "CV of areas", "max / mean", "extra pieces"]
    return markdown_table(
        [*head, "seconds"],
        (
            [row.k, row.method, f"{row.error:.4f}", f"{row.compactness:.3f}",
             f"{row.variation:.3f}", f"{row.largest:.3f}", f"{row.apart:.2%}", f"{row.seconds:.3f}"]
            for row in rows
        ),
    )  # fmt: skip
