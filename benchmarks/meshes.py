"""Meshes of the benchmark: files, the sample bear, and finer meshes made from them.

A name consists of a base and, optionally, of the factor by which subdivision multiplies the number
of faces: ``bunny``, ``hand-x64``, ``bear60k-x4``, ``sphere-x65536``. A base is the name, without
its ending, of a file in the folder ``meshes`` of the data folder; or ``bear5k`` or ``bear60k``
(`superfacets.sample_mesh`); or ``sphere``, an icosahedron whose subdivisions are projected onto a
sphere. The endings ``-noisy`` and ``-holes``, as in ``hand-x64-noisy``, stand for a mesh as from a
scanner: with noise, or with holes.
"""

from __future__ import annotations

import functools
import math
import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from research.checks import as_triangles

import superfacets as sf
from superfacets.tools.sample import split_in_four

NOISE = 0.001
"""Maximum shift of a vertex along an axis, in mean edge lengths. Neighboring triangles are then not
coplanar, and no triangle folds over."""

SCAN_NOISE = 0.05
"""Standard deviation of the noise of scans, along each axis, in mean edge lengths."""

HOLES, HOLE_RADIUS = 60, 0.04
"""Number of holes of a scan, and their radius as a fraction of the diagonal of the bounding box."""

SEED = 0

BEARS = {"bear5k": 5_000, "bear60k": 60_000}
"""Sample meshes of the package, by name, with their numbers of faces."""


class Arrays(NamedTuple):
    """A triangle mesh as two arrays."""

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]


def find_data(given: Path | None = None) -> Path | None:
    """Return the data folder: `given` or, if it is None, SUPERFACETS_DATA or ../shared/data.

    Returns None if the data folder does not contain a folder ``meshes``.
    """
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = given or Path(os.environ.get("SUPERFACETS_DATA", beside))
    return folder if (folder / "meshes").is_dir() else None


def split_name(name: str) -> tuple[str, int]:
    """Return the base in the name of a mesh, and the number of subdivisions.

    Examples
    --------
    >>> split_name("hand-x64"), split_name("bunny-noisy")
    (('hand', 3), ('bunny', 0))
    """
    match = re.fullmatch(r"(\w+?)(?:-x(\d+))?(?:-noisy|-holes)?", name)
    factor = int(match[2] or 1) if match else 0
    levels = factor.bit_length() // 2
    if match is None or factor != 4**levels:
        raise ValueError(f"{name!r} is not the name of a mesh: expected BASE, BASE-x4, -x16, ...")
    return match[1], levels


@functools.lru_cache(maxsize=1)
def build(name: str, data: Path | None) -> Arrays:
    """Return the mesh with this name; the last mesh is cached.

    Raises
    ------
    ValueError
        If there is no mesh with this name.
    """
    base, levels = split_name(name)
    arrays = _base(base, data)
    for _ in range(levels):
        arrays = subdivide(arrays)
        if base == "sphere":
            arrays = arrays._replace(vertices=_on_unit_sphere(arrays.vertices))
    arrays = perturb(arrays) if levels else arrays
    if name.endswith("-noisy"):
        return with_noise(arrays)
    return with_holes(arrays) if name.endswith("-holes") else arrays


def count_faces(name: str, data: Path | None) -> int:
    """Return the number of faces, without holes, of the mesh with this name; does not build it."""
    base, levels = split_name(name)
    return len(_base(base, data).faces) * int(4**levels)


@functools.cache
def _base(base: str, data: Path | None) -> Arrays:
    if base == "sphere":
        return icosahedron()
    mesh = sf.sample_mesh(BEARS[base]) if base in BEARS else sf.read_mesh(file_of(base, data))
    return Arrays(mesh.vertices, as_triangles(mesh).faces)


def file_of(base: str, data: Path | None) -> Path:
    """Return the path of a mesh in the data folder; raise a ValueError if there is none."""
    files = sorted((data / "meshes").glob(f"{base}.*")) if data else []
    if not files:
        raise ValueError(f"there is no mesh {base!r} in the data folder; see --data")
    return files[0]


def subdivide(arrays: Arrays) -> Arrays:
    """Split each face into four."""
    return Arrays(*split_in_four(*arrays))


def perturb(arrays: Arrays) -> Arrays:
    """Shift each vertex by random, reproducible offsets of at most `NOISE` mean edge lengths.

    The mean edge length is rounded to a power of two, because its last bits depend on the order in
    which numpy adds numbers.
    """
    vertices, faces = arrays
    reach = NOISE * 2.0 ** round(math.log2(_mean_edge(arrays)))
    shifts = np.random.default_rng(SEED).random(vertices.shape)
    return Arrays(vertices + reach * (2.0 * shifts - 1.0), faces)


def with_noise(arrays: Arrays) -> Arrays:
    """Add normally distributed noise of `SCAN_NOISE` mean edge lengths to each coordinate."""
    scale = SCAN_NOISE * _mean_edge(arrays)
    shifts = np.random.default_rng(SEED).normal(0.0, scale, arrays.vertices.shape)
    return Arrays(arrays.vertices + shifts, arrays.faces)


def with_holes(arrays: Arrays) -> Arrays:
    """Remove the faces with a corner within `HOLE_RADIUS` of one of `HOLES` random vertices."""
    vertices, faces = arrays
    centers = np.random.default_rng(SEED).choice(vertices, HOLES)
    reach = HOLE_RADIUS * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    is_removed = np.zeros(len(vertices), bool)
    for center in centers:
        is_removed |= ((vertices - center) ** 2).sum(axis=1) < reach * reach
    return Arrays(vertices, faces[~is_removed[faces].any(axis=1)])


def _mean_edge(arrays: Arrays) -> float:
    vertices, faces = arrays
    starts, ends = vertices[faces], vertices[np.roll(faces, -1, axis=1)]
    return float(np.sqrt(((starts - ends) ** 2).sum(axis=2)).mean())


def shuffle(arrays: Arrays, *, vertices: bool) -> Arrays:
    """Put faces and, if `vertices` is True, vertices in a random, reproducible order."""
    rng = np.random.default_rng(SEED)
    faces = arrays.faces[rng.permutation(len(arrays.faces))]
    if not vertices:
        return Arrays(arrays.vertices, faces)
    order = rng.permutation(len(arrays.vertices))
    new_index = np.argsort(order).astype(np.int32)
    return Arrays(arrays.vertices[order], new_index[faces])


def icosahedron() -> Arrays:
    """Return the regular icosahedron of radius 1: 12 vertices, 20 faces, outward normals."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    around_x = [[0.0, s, t * g] for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    vertices = np.array([np.roll(v, turn) for turn in range(3) for v in around_x])
    squared = ((vertices[:, None] - vertices) ** 2).sum(axis=2)
    near = np.abs(squared - 4.0) < 1e-9  # edges have length 2
    triples = [
        (i, j, k)
        for i, j in np.argwhere(near).tolist()
        for k in np.flatnonzero(near[i] & near[j]).tolist()
        if i < j and i < k
    ]
    is_outward = [np.linalg.det(vertices[list(triple)]) > 0 for triple in triples]
    faces = np.array(triples, dtype=np.int32)[is_outward]
    return Arrays(_on_unit_sphere(vertices), faces)


def _on_unit_sphere(vertices: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    x, y, z = vertices.T
    radii: npt.NDArray[np.float64] = np.sqrt(x * x + y * y + z * z)
    return vertices / radii[:, None]
