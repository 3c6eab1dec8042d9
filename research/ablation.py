"""Change one step of the default at a time, and measure what it changes.

    python -m research.ablation psb cad [ROTATIONS]

`psb` is a folder with off/N.off and seg/Benchmark/N/N_j.seg. `cad` is a folder with CAD parts:
``cad_*.npz`` files with `vertices`, `faces`, and `truth`, the face of the CAD model of each face.
Prints a table with the undersegmentation error (UE) and the compactness of 150 regions, as means
over the models of the benchmark, and the geometric mean of the UE of the CAD parts. Shapes are
turned at random, by default with two rotations, because the quality of one rotation varies by
chance. One row takes a minute on two cores.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from superfacets import Mesh, metrics, segment
from superfacets.base.types import Floats
from superfacets.cleanup.smooth import OF_PARTS
from superfacets.clustering import loop
from superfacets.stages import borders, cluster, part_costs
from superfacets.weights import formulas
from superfacets.weights.formulas import Weights

from .princeton import Benchmark
from .table_writer import markdown_table

K = 150

ROUNDS = loop.RELOCATED_FRACTIONS


class Change(NamedTuple):
    """A change of the default: values that replace values of the engine, and keywords."""

    values: tuple[tuple[object, str, object], ...] = ()  # object, name of the attribute, new value
    keywords: Mapping[str, Any] = {}


CHANGES: Mapping[str, Change] = {
    "none": Change(),
    "no costs of likely borders": Change(((borders, "BORDER_FACTOR", 0.0),)),
    "no costs between parts": Change(((part_costs, "strength_of_parts", lambda _: 0.0),)),
    "no costs of creases": Change(keywords={"alpha": 0.0}),
    "no rule for made things": Change(
        ((formulas.EdgeSums, "are_of_made_thing", lambda *_: False),)
    ),
    "no ridges, so no rule for made things": Change(keywords={"weights": Weights(ridges=0.0)}),
    "no rule for hollow shapes": Change(((formulas, "MAX_EVENED", 0.0),)),
    "no limit for creases inside coarse cells": Change(((formulas, "CREASE_LIMIT_ANGLE", 4.0),)),
    "no relocation": Change(((loop, "RELOCATED_FRACTIONS", ()),)),
    "four rounds of relocation instead of two": Change(
        ((loop, "RELOCATED_FRACTIONS", (*ROUNDS, 0.75 * ROUNDS[1], 0.5 * ROUNDS[1])),)
    ),
    "seeds along the curve": Change(keywords={"init": "curve"}),
    "no smoothing of borders": Change(keywords={"smooth": False}),
    "smoothing without stiffness": Change(
        ((cluster, "OF_PARTS", OF_PARTS._replace(stiffness=0.0)),)
    ),
}
"""Changes by name."""


class Shape(NamedTuple):
    """A mesh with its segmentations."""

    vertices: Floats
    faces: Any
    truths: Any


def shapes(psb: str, cad: str) -> Iterator[tuple[bool, Shape]]:
    """Return all shapes, and whether they are CAD parts."""
    benchmark = Benchmark(psb)
    for number in benchmark.numbers:
        model = benchmark.load(number)
        yield False, Shape(model.mesh.vertices, model.mesh.faces, model.ground_truths)
    for path in sorted(Path(cad).glob("cad_*.npz")):
        with np.load(path) as arrays:
            yield True, Shape(arrays["vertices"], arrays["faces"], arrays["truth"])


def quality(task: tuple[str, Shape, int]) -> tuple[float, float]:
    """Return the undersegmentation error and the compactness of a shape that is turned."""
    name, shape, seed = task
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    mesh = Mesh(shape.vertices @ rotation.T * np.linalg.det(rotation), shape.faces)
    change = CHANGES[name]
    with ExitStack() as stack:
        for value in change.values:
            stack.enter_context(mock.patch.object(*value))
        result = segment(mesh, K, n_threads=1, **change.keywords)
    found = metrics.evaluate(mesh, result, shape.truths)
    return found["undersegmentation_error"], found["compactness"]


def main(psb: str, cad: str, n_rotations: str = "2") -> None:
    """Print the table."""
    of_cad, found = zip(*shapes(psb, cad), strict=True)
    is_cad, n = np.array(of_cad), int(n_rotations)
    rows, usual = [], np.zeros(3)
    with Pool() as pool:
        for name in CHANGES:
            tasks = [(name, shape, seed) for seed in range(n) for shape in found]
            errors, compactness = np.reshape(pool.map(quality, tasks, 4), (n, len(found), 2)).T
            values = np.array([
                errors[~is_cad].mean(), compactness[~is_cad].mean(),
                np.exp(np.log(errors[is_cad]).mean()),
            ])  # fmt: skip
            if name == "none":
                usual = values
                rows.append([name, *(f"{value:.4f}" for value in values)])
            else:
                ue, change = values[:2] - usual[:2]
                rows.append(
                    [name, f"{ue:+.4f}", f"{change:+.3f}", f"{values[2] / usual[2] - 1:+.1%}"]
                )
            print(rows[-1], file=sys.stderr, flush=True)
    print(markdown_table(["change", "UE", "compactness", "UE of CAD"], rows))


if __name__ == "__main__":
    main(*sys.argv[1:])
