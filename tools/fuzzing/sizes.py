"""Random cells of every kind, divided into regions of balanced, limited or exact sizes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loops
import numpy as np

import superfacets as sf

from .cells import Options, check_segmentation, random_cells
from .meshes import scattered_faces
from .promises import refusals

REASONS = ("needs a radius above 0", "Sizes(bounds=")
"""What messages contain if a random segmentation may be refused."""

ROUNDING = 1e-9  # accepted difference of a size from its limit, as a fraction of the total size


def check_sizes(rng: np.random.Generator, _folder: Path) -> None:
    """Check the sizes of regions, and that each region keeps a cell and its center.

    Only limits of sizes may be refused, because they may need another number of regions, and
    methods of seeding that need areas above 0.
    """
    cells = None
    with refusals():
        cells = sf.Mesh(*scattered_faces(rng)) if rng.random() < 0.3 else random_cells(rng)
    if cells is None:
        return
    options = _random_options(rng, cells.n_cells)
    try:
        result = loops.segment(cells, **options, n_threads=1)
    except ValueError as error:
        if any(reason in str(error) for reason in REASONS):
            return
        raise
    check_segmentation(cells, result, options)
    _check_limits(result, options)


def _random_options(rng: np.random.Generator, n_cells: int) -> Options:
    """Return random options of `segment`, with sizes of cells of which about a third are 0."""
    options: Options = {
        "islands": "nearest",
        "mask": rng.random(n_cells) < rng.uniform(0.2, 1),
        "barriers": rng.integers(0, 3, n_cells),
        "smooth": False,
        "denoise": None,
        "weights": "creases",
        "init": str(rng.choice(["geodesic", "curve", "farthest", "flood", "grid"])),
        "max_num_iter": int(rng.integers(0, 20)),
    }
    chosen = {name: value for name, value in options.items() if rng.random() < 0.3}
    is_kept = chosen.get("mask", np.ones(n_cells, bool))
    is_kept[0] = True
    k = int(rng.integers(1, np.count_nonzero(is_kept) + 1))
    if rng.random() < 0.2:
        chosen.pop("islands", None)
        return chosen | {"sizes": sf.Sizes(cells=k)}
    sizes = rng.integers(0, 3, n_cells).astype(float)
    sizes[0] = 1.0
    mean = sizes[is_kept].sum() / k
    given = {
        "balance": float(rng.choice([0.5, 1.0])),
        "high": max(float(rng.uniform(1, 3)) * mean, 2.0),
        "low": float(rng.uniform(0, 1)) * mean,
    }
    given = {name: given[name] for name in rng.permutation(list(given))[: rng.integers(1, 4)]}
    bounds = (given.get("low"), given.get("high"))
    chosen["sizes"] = sf.Sizes(balance=given.get("balance", 0), bounds=bounds, weights=sizes)
    if rng.random() < 0.1:
        return chosen | {"init": rng.permutation(np.flatnonzero(is_kept))[:k]}
    return chosen | {"n_segments": k}


def _check_limits(result: Any, options: Options) -> None:
    """Check that no region is empty, and that the size of each region is within the limits."""
    is_kept = result.labels >= 0
    asked = options["sizes"]
    sizes = np.ones(len(is_kept)) if asked.weights is None else asked.weights
    counts = np.bincount(result.labels[is_kept], minlength=result.n_segments)
    assert counts.min() > 0, "a region is empty"
    found = np.bincount(result.labels[is_kept], sizes[is_kept], result.n_segments)
    slack = ROUNDING * float(found.sum())
    low, high = asked.limits
    assert found.max() <= high + slack
    assert found.min() >= low - slack
    assert found.max() <= (asked.cells or np.inf)
