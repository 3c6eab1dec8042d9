"""Fit the coefficients of the rate of borders to the borders that people drew.

    python -m research.border_rates psb

`psb` is a folder with off/N.off and seg/Benchmark/N/N_j.seg. Prints the coefficients
and the cross-validated log loss per arc. `superfacets.weights.parts.BORDER_COEFFICIENTS` are the
means of these coefficients and of those that `research.tune` finds.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from superfacets import _core
from superfacets.base.types import Floats, Ints, Singles
from superfacets.graph.kinds import kind_of
from superfacets.graph.size import radius_of
from superfacets.weights.formulas import WeightOptions, weights_of_kind
from superfacets.weights.parts import conducting_graph, embedding

from .princeton import Benchmark, Model

N_ARCS = 1500
"""Number of arcs of a model that are used of those on borders, and of those not on borders."""

N_FOLDS = 3
STEP = 0.007  # kFittedStep in border_rates.cpp


class Sample(NamedTuple):
    """Arcs of a model: features, share of people with a border there, weight, relative length."""

    features: Floats
    share: Floats
    weight: Floats
    step: Floats


def features_of(model: Model) -> tuple[Ints, Floats, Floats, Floats]:
    """Return ends, features, relative lengths and border lengths of all arcs."""
    kind = kind_of(model.mesh)
    graph, _ = kind.build_graph(model.mesh, True, 1)
    surface = kind.surface(model.mesh, graph, 1)
    radius = radius_of(graph.measures, 150, 1)
    options = WeightOptions.checked("parts", None)
    weights = weights_of_kind(kind, surface, graph, radius, options).weights
    lengths, unit = graph.quantized(weights, 1)
    placed = _core.PlacedCells(graph.positions, graph.measures, 1)
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, 1, True, unit * graph.diagonal)
    base = conducting_graph(ordered, options.crease_cost(radius), 1)
    normals = kind.normals(surface, graph)
    vectors: Singles = embedding(base, ordered, 1)
    widths = surface.arc_measures().border_lengths
    ends = np.stack([graph.sources, graph.neighbors])
    sizes = np.linalg.norm(graph.positions[ends[0]] - graph.positions[ends[1]], axis=1)
    steps = np.maximum(sizes, 0.2 * np.sqrt(graph.measures[ends].sum(axis=0)))
    steps[steps == 0] = ordered.straight_unit
    steps /= STEP * np.sqrt(graph.measures.sum())
    columns = []
    for coefficients in np.eye(10)[:3]:  # the rate is then a function of one feature alone
        found = _core.border_rates(
            ordered, *surface.arcs, widths, normals, vectors, coefficients, 1
        )
        found = found / steps
        columns.append(np.log(found / (1 - found)))
    return ends, np.stack(columns, axis=1), steps, widths


def sample_of(model: Model) -> Sample:
    """Choose arcs at random, as many on borders as elsewhere; weights restore the balance."""
    (sources, targets), features, steps, widths = features_of(model)
    share = np.mean([truth[sources] != truth[targets] for truth in model.ground_truths], axis=0)
    rng = np.random.default_rng(model.number)
    chosen, weights = [], []
    for found in (np.flatnonzero(share > 0), np.flatnonzero(share == 0)):
        some = rng.choice(found, min(N_ARCS, len(found)), replace=False)
        chosen.append(some)
        weights.append(widths[some] * (len(found) / max(len(some), 1)))
    arcs, weight = np.concatenate(chosen), np.concatenate(weights)
    return Sample(features[arcs], share[arcs], weight / weight.sum(), steps[arcs])


def terms_of(features: Floats) -> Floats:
    """Return features, products of two features, and 1."""
    x, y, z = features.T
    return np.stack([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z, np.ones_like(x)], axis=1)


def probabilities(data: Sample, coefficients: Floats) -> Floats:
    """Return the probability of a border on each arc."""
    exponents = terms_of(data.features) @ coefficients + np.log(data.step)
    return np.asarray(1 / (1 + np.exp(-np.clip(exponents, -30, 30))))


def fitted(data: Sample, ridge: float = 1e-4, n_steps: int = 50) -> Floats:
    """Return the coefficients of a logistic regression, by Newton's method with short steps."""
    terms = terms_of(data.features)
    coefficients = np.array([0.0] * 9 + [-5.0])
    damping = ridge * np.diag([1.0] * 9 + [0.0])
    for _ in range(n_steps):
        found = probabilities(data, coefficients)
        slope = terms.T @ (data.weight * (found - data.share)) + damping @ coefficients
        curve = (terms * (data.weight * found * (1 - found))[:, np.newaxis]).T @ terms + damping
        step = np.linalg.solve(curve, slope)
        coefficients = coefficients - step * min(1.0, 2.0 / np.abs(step).max())
    return coefficients


def log_loss(data: Sample, found: Floats | float) -> float:
    """Return the mean log loss of probabilities."""
    losses = data.share * np.log(found) + (1 - data.share) * np.log(1 - found)
    return float(-(data.weight * losses).sum() / data.weight.sum())


def main(folder: str) -> None:
    """Fit and print the coefficients."""
    benchmark = Benchmark(folder)
    samples = [sample_of(benchmark.load(number)) for number in benchmark.numbers]
    data = Sample(*(np.concatenate(parts) for parts in zip(*samples, strict=True)))
    fold = np.repeat(np.arange(len(samples)) % N_FOLDS, [len(s.share) for s in samples])
    found = np.empty(len(fold))
    for i in range(N_FOLDS):
        others = fitted(Sample(*(column[fold != i] for column in data)))
        found[fold == i] = probabilities(Sample(*(c[fold == i] for c in data)), others)
    mean = float(np.average(data.share, weights=data.weight))
    print(f"log loss {log_loss(data, found):.5f}; constant {log_loss(data, mean):.5f}")
    print(np.array2string(fitted(data), precision=3, separator=", "))


if __name__ == "__main__":
    main(sys.argv[1])
