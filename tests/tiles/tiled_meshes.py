"""Meshes that tests of tiles share."""

import numpy as np

from superfacets import PolygonMesh, write_mesh


def as_ply(folder, mesh):
    """Return the path of a binary PLY file with a mesh."""
    write_mesh(folder / "mesh.ply", mesh)
    return folder / "mesh.ply"


def random_polygons(n_faces, seed=0):
    """Return a row of flat polygons of 3 to 6 corners that share sides, but not vertex indices."""
    generator = np.random.default_rng(seed)
    sizes = generator.integers(3, 7, n_faces)
    offsets = np.append(0, np.cumsum(sizes))
    angles = 2 * np.pi * (np.arange(offsets[-1]) - np.repeat(offsets[:-1], sizes))
    angles /= np.repeat(sizes, sizes)
    row = np.repeat(np.arange(n_faces), sizes)
    vertices = np.stack([np.cos(angles) + 1.5 * (row % 97), np.sin(angles), row // 97], axis=1)
    return PolygonMesh(np.round(vertices, 1), offsets, np.arange(offsets[-1]))
