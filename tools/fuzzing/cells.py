"""Random cells of every kind: segmentation with random options, and functions of regions."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import loops
import numpy as np
import shapes

import superfacets as sf

from .promises import THREADS, check_labels, refusals

Options = dict[str, Any]

OF_PAPER = {"max_num_iter", "islands", "mask", "barriers"}
"""The `random_options` that `superfacets.paper.segment` has, too."""


def check_cells(rng: np.random.Generator, _folder: Path) -> None:
    """Check segmentation, levels and pooling for random cells of a random kind."""
    with refusals():
        cells = random_cells(rng)
        options = random_options(rng, cells.n_cells)
        given = cells if rng.random() < 0.7 else sf.prepare(cells, weld=bool(rng.integers(2)))
        result = loops.segment(given, **options, n_threads=1)
        check_segmentation(given, result, options)
        _check_regions(cells, result, rng)


def random_cells(rng: np.random.Generator) -> Any:
    """Return triangles, polygons, tetrahedra or points, in one or several components.

    Some distances may be equal, and some cells may be at the same position.
    """
    kind = rng.integers(4)
    mesh = shapes.bumpy_sheet(int(rng.integers(2, 12)), int(rng.integers(1000)))
    if kind == 0:
        return _cloud(mesh, rng)
    if kind == 1:
        return _tets(rng)
    if kind == 2:
        corners = np.array(mesh.faces).reshape(-1, 2, 3)  # pairs of adjacent triangles
        quads = [
            np.unique(pair) if len(np.unique(pair)) == 3 else _around(pair) for pair in corners
        ]
        offsets = np.cumsum([0, *map(len, quads)])
        return sf.PolygonMesh(mesh.vertices, offsets, np.concatenate(quads))
    kept = rng.permutation(mesh.n_faces)[: int(rng.integers(1, mesh.n_faces + 1))]
    return sf.Mesh(mesh.vertices, mesh.faces[kept])


def _around(pair: np.ndarray) -> np.ndarray:
    """Return the quad of two triangles, or the first triangle if they do not share an edge."""
    first, second = pair.tolist()
    new = [corner for corner in second if corner not in first]
    old = [corner for corner in first if corner not in second]
    if len(new) != 1:
        return np.array(first)
    while first[0] != old[0]:
        first = first[1:] + first[:1]
    return np.array([first[0], first[1], new[0], first[2]])


def _cloud(mesh: sf.Mesh, rng: np.random.Generator) -> sf.PointCloud:
    points = np.array(mesh.vertices)
    if rng.random() < 0.3:
        points = np.round(points * 4) / 4
    if rng.random() < 0.3:
        points = np.concatenate([points, rng.choice(points, 5), points + 100])
    colors = rng.random(points.shape) if rng.random() < 0.5 else None
    return sf.PointCloud(rng.permutation(points), colors=colors)


def _tets(rng: np.random.Generator) -> sf.TetMesh:
    """Return a block of cubes of six tetrahedra each, with some tetrahedra removed."""
    size = int(rng.integers(1, 5))
    grid = np.stack(np.meshgrid(*[np.arange(size + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    step = np.array([(size + 1) ** 2, size + 1, 1])
    origins = grid[(grid < size).all(axis=1)] @ step
    x, y, z = step
    paths = [(x, y, z), (x, z, y), (y, x, z), (y, z, x), (z, x, y), (z, y, x)]
    corners = np.array([[0, a, a + b, a + b + c] for a, b, c in paths])
    tets = (origins[:, None, None] + corners).reshape(-1, 4)
    kept = rng.permutation(len(tets))[: int(rng.integers(1, len(tets) + 1))]
    points = grid + rng.normal(scale=0.1, size=grid.shape) * (rng.random() < 0.7)
    return sf.TetMesh(points, tets[kept])


def random_options(rng: np.random.Generator, n_cells: int) -> Options:
    """Return random options of `segment`; most options keep their defaults."""
    options: Options = {
        "weights": str(rng.choice(["creases", "superfacets"])),
        "init": str(rng.choice(["geodesic", "curve", "farthest", "flood", "grid"])),
        "radius_factor": float(rng.uniform(0.1, 3)),
        "max_num_iter": int(rng.integers(0, 20)),
        "tol": float(rng.choice([0.0, 0.1])),
        "relocates": False,
        "islands": "nearest",
        "smooth": False,
        "mask": rng.random(n_cells) < rng.uniform(0.2, 1),
        "barriers": rng.integers(0, 3, n_cells),
        "features": rng.normal(size=(n_cells, int(rng.integers(1, 4)))),
    }
    chosen = {name: value for name, value in options.items() if rng.random() < 0.2}
    preset = rng.random()
    if preset < 0.1:
        chosen["weights"] = "parts"
    elif preset < 0.2:
        chosen = {name: chosen[name] for name in OF_PAPER & chosen.keys()} | {"paper": True}
    most = n_cells if rng.random() < 0.2 else min(n_cells, 40)
    return chosen | {"n_segments": int(rng.integers(1, most + 1))}


def check_segmentation(cells: Any, result: sf.Segmentation, options: Options) -> None:
    """Check labels outside of the mask, at barriers, and with several numbers of threads."""
    labels = np.asarray(result.labels)
    kept = np.asarray(options.get("mask", np.ones(len(labels), bool)))
    assert np.array_equal(labels >= 0, kept)
    check_labels(labels[kept], int(kept.sum()), result.n_segments)
    assert np.array_equal(labels[result.centers], np.arange(result.n_segments))
    if "barriers" in options:
        pairs = np.unique(np.column_stack([labels, options["barriers"]])[kept], axis=0)
        assert len(pairs) == result.n_segments, "a region crosses a barrier"
    for n_threads in THREADS[1:]:
        other = loops.segment(cells, **options, n_threads=n_threads)
        assert np.array_equal(other.labels, labels), f"{n_threads} threads"


def _check_regions(cells: Any, result: sf.Segmentation, rng: np.random.Generator) -> None:
    """Check that the region graph counts all cells, levels nest, and `pool` reverts `unpool`."""
    labels = result.labels
    graph = sf.region_graph(cells, labels)
    assert graph.n_regions == result.n_segments
    tails, heads = graph.edge_index
    assert (tails < heads).all()
    assert graph.cell_counts.sum() == np.count_nonzero(np.asarray(labels) >= 0)
    for edit in (
        sf.enforce_connectivity(cells, labels),
        sf.merge_small_regions(cells, labels, float(rng.uniform(0, 1))),
    ):
        check_labels(edit.labels[labels >= 0], np.count_nonzero(labels >= 0), len(edit.sources))
    field = rng.normal(size=result.n_segments)
    assert np.array_equal(sf.pool(labels, sf.unpool(labels, field, fill=0.0), mesh=cells), field)
    counts = sorted({result.n_segments, *rng.integers(1, result.n_segments + 1, 3).tolist()})
    levels = sf.hierarchy(cells, counts, labels=labels, islands="nearest").levels
    for fine, coarse in itertools.pairwise(sorted(levels, key=np.max, reverse=True)):
        pairs = np.unique(np.column_stack([fine, coarse]), axis=0)
        assert len(pairs) == len(np.unique(fine)), "levels are not nested"
