"""Sample mesh: a plush bear whose parts meet in sharp concave creases.

The bear is a union of solid ellipsoids, made by ``tools/sample_bear``. Files hold the vertices, and
the differences between consecutive corners of the faces.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from .._validate import checked_count
from ..io.readers.npy import npz_array
from ..mesh.triangle_mesh import Mesh, split_in_four

__all__ = ["sample_mesh"]

_FOLDER = Path(__file__).parent

_COARSE = ("bear-5k.npz", 4_892)
_FINE = ("bear-60k.npz", 60_220)

MIN_FACES = 3_000


def sample_mesh(n_faces: int = 60_000) -> Mesh:
    """Return a plush bear of about `n_faces` faces: smooth parts that meet in concave creases.

    The surface bounds the union of 17 ellipsoids. It is closed, manifold, connected, of genus 0,
    and oriented outward. The bear is 2.3 units high and faces +z; y is up. The mesh is read from a
    file, so it is the same on every machine.

    Parameters
    ----------
    n_faces : int, default 60_000
        Wanted number of faces, at least 3,000. Two meshes are stored, with 4,892 and 60,220 faces.
        Splitting each face into four gives meshes with 19,568, 240,880, 963,520 faces and so on.
        The mesh nearest to `n_faces` by ratio is returned; the ratio is at most 2.

    Raises
    ------
    ValueError
        If `n_faces` is less than 3,000.
    TypeError
        If `n_faces` is not an integer.

    Examples
    --------
    >>> bear = sample_mesh(5_000)
    >>> bear.n_faces
    4892
    >>> bear.n_vertices - bear.n_faces // 2  # V - E + F of a closed surface of genus 0
    2
    """
    count = checked_count(n_faces, "n_faces")
    if count < MIN_FACES:
        raise ValueError(f"n_faces must be at least {MIN_FACES}, got {count}")
    name, n_splits = _nearest(count)
    content = (_FOLDER / name).read_bytes()
    vertices = npz_array(content, "vertices").astype(np.float64)
    faces = np.cumsum(npz_array(content, "steps"), dtype=np.int32).reshape(-1, 3)
    for _ in range(n_splits):
        vertices, faces = split_in_four(vertices, faces)
    return Mesh(vertices, faces)


def _nearest(count: int) -> tuple[str, int]:
    """File name and number of splits of the mesh nearest to a number of faces."""
    finest = round(max(0.0, math.log(count / _FINE[1], 4)))
    made = [(_COARSE, 0), (_COARSE, 1), (_FINE, finest)]
    (name, _), n_splits = min(
        made, key=lambda choice: abs(math.log(choice[0][1] * 4 ** choice[1] / count))
    )
    return name, n_splits
