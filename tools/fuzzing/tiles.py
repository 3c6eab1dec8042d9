"""Labels that are computed in tiles, compared with labels of the same cells in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapes

import superfacets as sf

from .promises import THREADS, refusals


def check_tiles(rng: np.random.Generator, folder: Path) -> None:
    """Segment a mesh or a cloud of a few tiles with random options, and compare with `segment`."""
    mesh = shapes.bumpy_sheet(int(rng.integers(30, 80)), int(rng.integers(1000)))
    cells = sf.PointCloud(mesh.vertices) if rng.random() < 0.3 else _with_holes(mesh, rng)
    options = {
        "weights": str(rng.choice(["creases", "superfacets"])),
        "max_num_iter": int(rng.integers(0, 10)),
        "islands": "nearest",
        "smooth": False,
        "tol": 0.0,
    }
    chosen = {name: value for name, value in options.items() if rng.random() < 0.4}
    chosen.setdefault("weights", "creases")
    n_segments = int(rng.integers(1, 60))
    with refusals():
        wanted = sf.segment(cells, n_segments, **chosen)
        found = sf.segment_tiled(
            cells, n_segments, **chosen, tile_size=4096, scratch=folder, cache=0,
            n_threads=int(rng.choice(THREADS)),
        )  # fmt: skip
        assert np.array_equal(found.labels, wanted.labels)
        assert np.array_equal(found.centers, wanted.centers)


def _with_holes(mesh: sf.Mesh, rng: np.random.Generator) -> sf.Mesh:
    """Return the mesh with its faces in random order, and with some faces removed."""
    kept = rng.permutation(mesh.n_faces)[: int(mesh.n_faces * rng.uniform(0.5, 1))]
    return sf.Mesh(mesh.vertices, mesh.faces[kept])
