"""Interleaved runs of rivals and superfacets, with the same mesh and number of regions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

import superfacets as sf
from superfacets.clustering.classification import Classification
from superfacets.paper import superfacet_weights

from .checks import Expected, check_labels, require
from .clock import Sample, interleaved, median, summary
from .machine import usable_cores
from .meshes import Arrays
from .plan import RACED
from .rivals import RIVALS, Outcome, ScipyOutcome, is_installed, run_scipy
from .runs import SETTINGS, run_name

OURS = "superfacets"
Key = tuple[str, str]  # name, settings


def race_for_labels(
    mesh: str, arrays: Arrays, n_segments: int, repeats: int, expected: Expected
) -> list[dict[str, Any]]:
    """Return a row for superfacets with each of its settings, and for each installed rival.

    Each run starts with arrays and ends with labels. The images for SLIC are made before the runs.
    ``ratio`` is the time divided by the time of superfacets with defaults. For settings with 10
    iterations, such as those of SLIC, ``ratio`` is the time divided by the time of superfacets with
    10 iterations.
    """
    checked: dict[Key, npt.NDArray[np.int32]] = {}

    def accept(key: Key, result: Any) -> dict[str, Any]:
        if key[0] != OURS:
            return _facts(result)
        if key not in checked:
            run = (mesh, run_name(n_segments, key[1]))
            alone = partial(SETTINGS[key[1]], arrays, n_segments, n_threads=1)
            check_labels(expected, run, arrays, result, alone)
            checked[key] = result.labels
        require(np.array_equal(checked[key], result.labels), f"{key}: labels depend on the run")
        return _facts(Outcome(result.labels, result.timings))

    jobs = _our_jobs(arrays, n_segments) | _rival_jobs(arrays, n_segments)
    samples = interleaved(jobs, repeats, accept)
    rows = [_row(mesh, arrays, n_segments, key, samples[key]) for key in jobs]
    ours = {row["settings"]: row["seconds"] for row in rows if row["who"] == OURS}
    for row in rows:
        same = "10 iterations" if row["settings"].startswith("10 iterations") else "defaults"
        row["ratio"] = row["seconds"] / ours[same]
    return rows


def _our_jobs(arrays: Arrays, n_segments: int) -> dict[Key, Callable[[], Any]]:
    cores = usable_cores()
    return {
        (OURS, name): partial(SETTINGS[name], arrays, n_segments, n_threads=cores) for name in RACED
    }


def _rival_jobs(arrays: Arrays, n_segments: int) -> dict[Key, Callable[[], Any]]:
    return {
        (rival.name, rival.settings): partial(rival.run, rival.prepare(arrays), n_segments)
        for rival in RIVALS
        if is_installed(rival.module)
    }


def _facts(outcome: Outcome) -> dict[str, Any]:
    sizes = np.unique(outcome.labels, return_counts=True)[1]
    return {
        "regions": len(sizes),
        "spread": float(sizes.std() / sizes.mean()),
        "parts": outcome.seconds,
    }


def _row(
    mesh: str, arrays: Arrays, n_segments: int, key: Key, samples: list[Sample]
) -> dict[str, Any]:
    who, settings = key
    elements = next((r.elements for r in RIVALS if r.name == who), "faces")
    facts = [sample.fact for sample in samples]
    parts = {name: median([f["parts"][name] for f in facts]) for name in facts[0]["parts"]}
    return {
        "mesh": mesh,
        "faces": len(arrays.faces),
        "k": n_segments,
        "who": who,
        "settings": settings,
        "elements": elements,
        "regions": facts[0]["regions"],
        "spread": facts[0]["spread"],
        "parts": parts,
    } | summary([sample.seconds for sample in samples])


def race_for_one_pass(
    mesh: str, arrays: Arrays, n_segments: int, repeats: int
) -> list[dict[str, Any]]:
    """Return rows for `superfacets.classify`, on all threads and on one, and for SciPy's Dijkstra.

    All runs have the same graph and the same centers, and must find the same distances.
    """
    surface = sf.Mesh(*arrays)
    faces = sf.build_face_graph(surface)
    graph = faces.with_weights(superfacet_weights(surface, faces))
    first = sf.classify(graph, sf.place_seeds(graph, n_segments, init="farthest"))
    # superfacets rounds weights to multiples of a unit, with errors of up to half a unit. The sum
    # of these errors along a path is far less than this accuracy.
    accuracy = 1e-4 * float(first.distances.max())

    def accept(key: Key, result: Classification | ScipyOutcome) -> None:
        apart = float(np.abs(result.distances - first.distances).max())
        require(apart <= accuracy, f"{mesh}: {key} finds other distances")

    jobs: dict[Key, Callable[[], Any]] = {
        (OURS, f"classify, n_threads={n}"): partial(sf.classify, graph, first.centers, n_threads=n)
        for n in dict.fromkeys([usable_cores(), 1])
    }
    if is_installed("scipy"):
        jobs["SciPy", "dijkstra, min_only=True"] = partial(run_scipy, graph, first.centers)
    samples = interleaved(jobs, repeats, accept)
    place = {"mesh": mesh, "faces": graph.n_cells, "k": n_segments}
    seconds = {key: summary([sample.seconds for sample in samples[key]]) for key in jobs}
    ours = next(iter(seconds.values()))["seconds"]
    return [
        place | {"who": who, "settings": settings} | values | {"ratio": values["seconds"] / ours}
        for (who, settings), values in seconds.items()
    ]
