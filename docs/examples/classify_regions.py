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
        features.append(features_of(result.regions))
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


def features_of(regions: sf.RegionGraph) -> np.ndarray:
    """Numbers of each region, (K, 20), that do not depend on where the model is, or how large.

    The second half are means over the regions around it.
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
    """Mean of values of arcs along the border of each region, 0 where it touches no other."""
    ends, weights = regions.edge_index.ravel(), np.tile(regions.border_lengths, 2)
    sums = np.bincount(ends, weights=weights * np.tile(values, 2), minlength=regions.n_regions)
    lengths = np.bincount(ends, weights=weights, minlength=regions.n_regions)
    return sums / np.maximum(lengths, np.finfo(float).tiny)


def remoteness(regions: sf.RegionGraph) -> np.ndarray:
    """How far the others are over the surface, (K, 3): mean, farthest, and how many are near."""
    first, second = regions.edge_index
    steps = np.linalg.norm(regions.centroids[first] - regions.centroids[second], axis=1)
    matrix = coo_array((steps, (first, second)), (regions.n_regions, regions.n_regions))
    distances = dijkstra(matrix.tocsr(), directed=False)
    distances[np.isinf(distances)] = distances[np.isfinite(distances)].max()
    share = regions.areas / regions.areas.sum()
    mean = distances @ share
    near = (distances < np.median(distances)) @ share
    return np.column_stack([mean / mean.mean(), distances.max(axis=1) / mean.mean(), near])


if __name__ == "__main__":
    main()
