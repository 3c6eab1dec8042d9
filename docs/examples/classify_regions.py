"""Learn from people which regions belong to the trunk of a shape, and which to its limbs.

    python docs/examples/classify_regions.py FOLDER [CATEGORY ...]

FOLDER is a copy of the Princeton Segmentation Benchmark, or a part of it; without categories those
with a trunk and limbs are taken. People cut each model into parts that have no names. The name here
follows from how the parts hang together: the one that touches the most others is the trunk, the
rest are limbs. A face gets the name that most people give it, a region that of most of its area.

Each model in turn is left out: a random forest learns the regions of the other models of the
category and names those of this one. To beat is guessing the name that is most frequent among the
regions it has learned from. Needs scikit-learn.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

import superfacets as sf

CATEGORIES = ("Human", "Ant", "Octopus", "Teddy", "Hand", "Armadillo", "Fourleg")
N_REGIONS = 150


def main() -> None:
    """Print a line for each category."""
    benchmark = sf.princeton.Benchmark(sys.argv[1])
    print("category   models  regions  majority  forest")
    for category in sys.argv[2:] or CATEGORIES:
        models = [
            benchmark.load(number)
            for number in benchmark.numbers
            if sf.princeton.category_of(number) == category
        ]
        majority, forest, n_regions = evaluate(models)
        print(f"{category:10} {len(models):6} {n_regions:8}  {majority:8.1%}  {forest:6.1%}")


def evaluate(models: list[sf.princeton.Model]) -> tuple[float, float, int]:
    """Share of regions that guessing and a forest name right, on models not learned from."""
    features, names, groups = [], [], []
    for model in models:
        result = sf.segment(model.mesh, N_REGIONS)
        features.append(features_of(model.mesh, result.labels))
        names.append(names_of(model, result.labels))
        groups.append(np.full(result.n_segments, model.number))
    x, y, group = (np.concatenate(parts) for parts in (features, names, groups))
    forest = RandomForestClassifier(200, min_samples_leaf=3, random_state=0)
    found = cross_val_predict(forest, x, y, groups=group, cv=LeaveOneGroupOut())
    is_limb = np.array([y[group != g].mean() >= 0.5 for g in group])
    return float((is_limb == y).mean()), float((found == y).mean()), len(y)


def names_of(model: sf.princeton.Model, labels: np.ndarray) -> np.ndarray:
    """Whether each region is of a limb (1) or of the trunk (0), as most people say."""
    graph = sf.build_face_graph(model.mesh)
    votes = np.mean([is_limb(graph, truth) for truth in model.ground_truths], axis=0)
    areas = np.bincount(labels, weights=graph.measures)
    return (np.bincount(labels, weights=graph.measures * (votes > 0.5)) > areas / 2).astype(int)


def is_limb(graph: sf.FaceGraph, parts: np.ndarray) -> np.ndarray:
    """Whether each face is outside the part that touches the most others (the largest of such)."""
    _, parts = np.unique(parts, return_inverse=True)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    pairs = np.stack([parts[sources], parts[graph.neighbors]], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    n_parts = parts.max() + 1
    n_touched = np.bincount(pairs[:, 0], minlength=n_parts)
    areas = np.bincount(parts, weights=graph.measures)
    return parts != np.lexsort((areas, n_touched))[-1]


def features_of(mesh: sf.Mesh, labels: np.ndarray) -> np.ndarray:
    """Numbers of each region, (K, 10), that do not depend on where the model is, or how large."""
    graph = sf.build_face_graph(mesh)
    arcs, area = sf.arc_measures(mesh, graph), np.bincount(labels, weights=graph.measures)
    size, n_regions = np.sqrt(graph.measures.sum()), len(area)
    sources = labels[np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))]
    targets = labels[graph.neighbors]
    out = sources != targets
    border = np.bincount(sources[out], weights=arcs.border_lengths[out], minlength=n_regions)

    def border_mean(values: np.ndarray) -> np.ndarray:
        weighted = values[out] * arcs.border_lengths[out]
        sums = np.bincount(sources[out], weights=weighted, minlength=n_regions)
        return sums / np.maximum(border, np.finfo(float).tiny)  # of an island: 0

    center = means(labels, graph.positions, graph.measures)
    spread = np.sqrt(spreads(labels, graph.positions - center[labels], graph.measures)) / size
    away = np.linalg.norm(graph.positions.mean(axis=0) - center, axis=1) / size
    step = np.linalg.norm(center[sources[out]] - center[targets[out]], axis=1) / size
    far = remoteness(sources[out], targets[out], step, area)
    shape = [spread[:, 0], spread[:, 1], spread[:, 2], border / np.sqrt(area)]
    creases = [border_mean(arcs.angles), border_mean(np.abs(arcs.angles))]
    return np.stack([*shape, *creases, away, *far], axis=1)


def means(labels: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted mean of values, (N, 3), of each region, (K, 3)."""
    sums = [np.bincount(labels, weights=weights * column) for column in values.T]
    return np.stack(sums, axis=1) / np.bincount(labels, weights=weights)[:, np.newaxis]


def spreads(labels: np.ndarray, offsets: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Variances of each region along its principal axes, (K, 3), the largest first."""
    products = (offsets[:, :, np.newaxis] * offsets[:, np.newaxis]).reshape(-1, 9)
    sums = np.stack([np.bincount(labels, weights=weights * column) for column in products.T], 1)
    matrices = (sums / np.bincount(labels, weights=weights)[:, np.newaxis]).reshape(-1, 3, 3)
    return np.maximum(np.linalg.eigvalsh(matrices)[:, ::-1], 0)


def remoteness(
    sources: np.ndarray, targets: np.ndarray, steps: np.ndarray, areas: np.ndarray
) -> list[np.ndarray]:
    """How far the others are from each region, over the surface: mean, farthest, and how many."""
    n_regions = len(areas)
    order = np.unique(sources * n_regions + targets, return_index=True)[1]
    matrix = coo_array((steps[order], (sources[order], targets[order])), (n_regions, n_regions))
    distances = dijkstra(matrix.tocsr(), directed=False)
    distances[np.isinf(distances)] = distances[np.isfinite(distances)].max()
    mean = distances @ areas / areas.sum()
    near = (distances < np.median(distances)) @ areas / areas.sum()
    return [mean / mean.mean(), distances.max(axis=1) / mean.mean(), near]


if __name__ == "__main__":
    main()
