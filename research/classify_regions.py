"""Learn which regions belong to the trunk of a shape, and which regions belong to limbs.

    python -m research.classify_regions FOLDER [CATEGORY ...]

FOLDER contains the Princeton Segmentation Benchmark, or some of its models. CATEGORY is a category
of the benchmark; the shapes of the default categories have a trunk and limbs. In the ground truth,
several people divided each model into parts without names. For each person, the part that touches
the most other parts is the trunk, and all other parts are limbs. The class of a face is the
majority class over all people. The class of a region is the majority class by area.

The test is a leave-one-out test: for each model, a random forest is trained on the regions of the
other models of the category, and predicts the classes of the regions of this model. The baseline
predicts the most frequent class in the other models. The program requires scikit-learn.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

import superfacets as sf

from .princeton import Benchmark, Model, category_of

CATEGORIES = ("Human", "Ant", "Octopus", "Teddy", "Hand", "Armadillo", "Fourleg")
N_REGIONS = 150


def main() -> None:
    """Print a line for each category."""
    benchmark = Benchmark(sys.argv[1])
    print("category   models  regions  majority  forest")
    for category in sys.argv[2:] or CATEGORIES:
        models = [
            benchmark.load(number)
            for number in benchmark.numbers
            if category_of(number) == category
        ]
        majority, forest, n_regions = evaluate(models)
        print(f"{category:10} {len(models):6} {n_regions:8}  {majority:8.1%}  {forest:6.1%}")


def evaluate(models: list[Model]) -> tuple[float, float, int]:
    """Return the accuracy of the majority class and of a forest, and the number of regions."""
    features, names, groups = [], [], []
    for model in models:
        result = sf.segment(model.mesh, N_REGIONS)
        features.append(features_of(result.regions))
        names.append(names_of(model, result.labels))
        groups.append(np.full(result.n_segments, model.number))
    x, y, group = (np.concatenate(parts) for parts in (features, names, groups))
    forest = RandomForestClassifier(200, min_samples_leaf=3, random_state=0)
    found = cross_val_predict(forest, x, y, groups=group, cv=LeaveOneGroupOut())
    is_limb = np.array([y[group != g].mean() >= 0.5 for g in group])
    return float((is_limb == y).mean()), float((found == y).mean()), len(y)


def names_of(model: Model, labels: np.ndarray) -> np.ndarray:
    """Return the class of each region: 1 for limb, 0 for trunk."""
    graph = sf.build_face_graph(model.mesh)
    votes = np.mean([is_limb(graph, truth) for truth in model.ground_truths], axis=0)
    areas = np.bincount(labels, weights=graph.measures)
    return (np.bincount(labels, weights=graph.measures * (votes > 0.5)) > areas / 2).astype(int)


def is_limb(graph: sf.FaceGraph, parts: np.ndarray) -> np.ndarray:
    """Return whether each face is outside the trunk, the part that touches the most other parts.

    If several parts touch the same number of parts, the trunk is the largest of them.
    """
    _, parts = np.unique(parts, return_inverse=True)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    pairs = np.stack([parts[sources], parts[graph.neighbors]], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    n_parts = parts.max() + 1
    n_touched = np.bincount(pairs[:, 0], minlength=n_parts)
    areas = np.bincount(parts, weights=graph.measures)
    return np.asarray(parts != np.lexsort((areas, n_touched))[-1])


def features_of(regions: sf.RegionGraph) -> np.ndarray:
    """Return features of each region, (K, 20), independent of the position and size of the model.

    The last ten columns are means of the first ten over the neighbors of the region.
    """
    size = np.sqrt(regions.areas.sum())
    away = np.linalg.norm(regions.centroids - regions.centroids.mean(axis=0), axis=1) / size
    own = np.column_stack(
        [
            regions.deviations / size,
            regions.compactness,
            border_means(regions, regions.concavities),
            border_means(regions, regions.mean_angles),
            away,
            remoteness(regions),
        ]
    )
    around = regions.to_scipy("border_length")
    lengths = np.maximum(around.sum(axis=1), np.finfo(float).tiny)[:, np.newaxis]
    return np.column_stack([own, around @ own / lengths])


def border_means(regions: sf.RegionGraph, values: np.ndarray) -> np.ndarray:
    """Return the mean of arc values along the border of each region, or 0 without a border."""
    ends, weights = regions.edge_index.ravel(), np.tile(regions.border_lengths, 2)
    sums = np.bincount(ends, weights=weights * np.tile(values, 2), minlength=regions.n_regions)
    lengths = np.bincount(ends, weights=weights, minlength=regions.n_regions)
    return sums / np.maximum(lengths, np.finfo(float).tiny)


def remoteness(regions: sf.RegionGraph) -> np.ndarray:
    """Return mean and maximum distance to other regions, and area of nearby regions, (K, 3)."""
    first, second = regions.edge_index
    steps = np.linalg.norm(regions.centroids[first] - regions.centroids[second], axis=1)
    matrix = coo_array((steps, (first, second)), (regions.n_regions, regions.n_regions))
    distances = dijkstra(matrix.tocsr(), directed=False)
    distances[np.isinf(distances)] = distances[np.isfinite(distances)].max()
    fractions = regions.areas / regions.areas.sum()
    mean = distances @ fractions
    near = (distances < np.median(distances)) @ fractions
    return np.column_stack([mean / mean.mean(), distances.max(axis=1) / mean.mean(), near])


if __name__ == "__main__":
    main()
