"""Random meshes, segmented with random options."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import loops
import numpy as np
import shapes
from test_twins import check_mesh_stages

import superfacets as sf
from superfacets.metrics import evaluate

from .promises import THREADS, check_labels, check_number, check_pieces, check_result, refusals

Options = dict[str, Any]

# Maximum number of faces of meshes that are compared with the reference implementation.
MAX_FACES_OF_TWINS = 60


def check_mesh(rng: np.random.Generator, _folder: Path) -> None:
    """Check the labels, the clean-up and the transfer of labels for a random mesh."""
    with refusals():
        mesh = _random_mesh(rng)
        _check_segmentation(mesh, rng)
        _check_clean_up(mesh, rng)
        _check_carried(mesh, rng)
        if mesh.n_faces <= MAX_FACES_OF_TWINS:
            check_mesh_stages(mesh, weld=bool(rng.integers(2)))


def _random_mesh(rng: np.random.Generator) -> sf.Mesh:
    """Return a mesh with random defects."""
    vertices, faces = _regular(rng) if rng.random() < 0.7 else scattered_faces(rng)
    if rng.random() < 0.3:  # holes and islands
        faces = faces[rng.random(len(faces)) < rng.uniform(0.3, 1)]
    if rng.random() < 0.2:  # neighbors of opposite orientation
        turned = rng.random(len(faces)) < 0.2
        faces[turned] = faces[turned, ::-1]
    if rng.random() < 0.2 and len(faces):  # duplicate faces, and edges with more than two faces
        faces = np.concatenate([faces, rng.choice(faces, len(faces) // 3)])
    if rng.random() < 0.2:  # edges of length 0, faces of area 0, and ties
        vertices = np.round(vertices * 4) / 4
    if rng.random() < 0.2:  # separate vertices at one position
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    if rng.random() < 0.2:
        vertices = vertices * 10.0 ** rng.integers(-13, 13) + rng.choice([0.0, 1e3])
    return sf.Mesh(vertices, rng.permutation(faces))


def _regular(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    kind = rng.integers(4)
    if kind == 0:
        mesh = shapes.bumpy_sheet(int(rng.choice([1, 2, 3, 5, 10, 90])), int(rng.integers(1000)))
    elif kind == 1:
        mesh = shapes.dumbbell(int(rng.integers(2, 20)), int(rng.integers(3, 12)))
    elif kind == 2:
        mesh = shapes.fins(int(rng.integers(1, 30)))
    else:
        mesh = shapes.strip(int(rng.integers(1, 80)))
    return np.array(mesh.vertices), np.array(mesh.faces)


def scattered_faces(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return random faces between vertices at random grid points."""
    n_vertices = int(rng.integers(1, 40))
    vertices = rng.integers(-3, 4, (n_vertices, 3)).astype(float)
    return vertices, rng.integers(0, n_vertices, (int(rng.integers(1, 60)), 3))


def _random_options(rng: np.random.Generator, mesh: sf.Mesh) -> Options:
    """Return random options of `segment`; most options keep their defaults."""
    options: Options = {
        "weights": rng.choice(["creases", "superfacets"]),
        "init": rng.choice(["geodesic", "curve", "farthest", "flood", "grid"]),
        "radius_factor": float(rng.uniform(0.1, 3)),
        "max_num_iter": int(rng.integers(1, 20)),
        "tol": float(rng.choice([0.0, 0.1])),
        "islands": "nearest",
        "smooth": False,
    }
    chosen = {name: value for name, value in options.items() if rng.random() < 0.3}
    chosen["n_segments"] = int(rng.integers(1, min(mesh.n_faces, 40) + 1))
    return chosen


def _check_segmentation(mesh: sf.Mesh, rng: np.random.Generator) -> None:
    options, weld = _random_options(rng, mesh), bool(rng.random() < 0.7)
    prepared = mesh if weld else sf.prepare(mesh, weld=False)
    result = loops.segment(prepared, **options, n_threads=1)
    graph = sf.build_face_graph(mesh, weld=weld)
    check_result(result, graph)
    is_exact = "radius_factor" not in options
    is_joined = "islands" in options
    if options.get("init") not in ("flood", "grid"):
        if is_joined:
            assert result.n_segments == options["n_segments"]
        elif is_exact:
            check_number(result, graph, options["n_segments"])
    if not is_joined and is_exact:
        # Which of more than 64 faces at an edge are neighbors depends on the order of faces.
        ordered = sf.prepare(mesh, weld=weld)
        check_pieces(result.labels[ordered.input_index], ordered.graph)
    for n_threads in THREADS[1:]:
        other = loops.segment(prepared, **options, n_threads=n_threads)
        assert np.array_equal(other.labels, result.labels), f"{n_threads} threads"
    twin = loops.segment(pickle.loads(pickle.dumps(prepared)), **options)
    assert np.array_equal(twin.labels, result.labels)


def _check_clean_up(mesh: sf.Mesh, rng: np.random.Generator) -> None:
    """Check clean-up and metrics with random labels."""
    graph = sf.build_face_graph(mesh)
    n_labels = int(rng.integers(1, min(mesh.n_faces, 20) + 1))
    scattered = rng.integers(0, n_labels, mesh.n_faces)
    labels = np.unique(scattered, return_inverse=True)[1]
    connected = sf.enforce_connectivity(mesh, labels)
    check_labels(connected.labels, mesh.n_faces, len(connected.sources))
    check_pieces(connected.labels, graph)
    merged = sf.merge_small_regions(mesh, labels, float(rng.uniform(0, 3)))
    check_labels(merged.labels, mesh.n_faces, len(merged.sources))
    smooth = sf.smooth_borders(mesh, connected.labels)
    check_labels(smooth, mesh.n_faces, len(connected.sources))
    check_pieces(smooth, graph)
    values = evaluate(mesh, labels, [connected.labels])
    assert all(np.isfinite(value) and value >= 0 for value in values.values()), values


def _check_carried(mesh: sf.Mesh, rng: np.random.Generator) -> None:
    """Check the transfer of values and labels of regions to faces, vertices and points."""
    labels = np.unique(rng.integers(0, 9, mesh.n_faces), return_inverse=True)[1]
    field = rng.normal(size=labels.max() + 1)
    assert np.array_equal(sf.pool(labels, sf.unpool(labels, field), mesh=mesh), field)
    assert np.array_equal(sf.unpool(labels, sf.pool(labels, labels, how="majority")), labels)
    of_vertices = sf.vertex_labels(mesh, labels)
    is_used = np.isin(np.arange(mesh.n_vertices), mesh.faces)
    assert np.array_equal(of_vertices >= 0, is_used)
    along_creases = [
        sf.vertex_labels(mesh, labels, method="creases", min_vertices=4, n_threads=n_threads)
        for n_threads in THREADS
    ]
    assert np.array_equal(along_creases[0] >= 0, is_used)
    assert all(np.array_equal(found, along_creases[0]) for found in along_creases)
    low, high = mesh.bounds
    points = rng.uniform(1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low, (200, 3))
    faces = sf.transfer(mesh, np.arange(mesh.n_faces), points, n_threads=1)
    for n_threads in THREADS[1:]:
        carried = sf.transfer(mesh, labels, points, n_threads=n_threads)
        assert np.array_equal(carried, labels[faces]), f"{n_threads} threads"
    own = sf.transfer(mesh, labels, mesh)  # faces at the same position may swap labels
    assert np.isin(own, labels).all()
