"""Compute colors of faces from a texture, and draw region ids in the layout of a texture."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Bools, Bytes, FaceMesh, Floats, Ints, MeshLike, Texels

from .images import TextureImage
from .light import linear_of_srgb, oklab_of_linear, srgb_of_linear
from .textures import Texture

LINEAR = np.rint(65535 * linear_of_srgb(np.arange(256) / 255)).astype(np.int32)
"""Lookup table from 8-bit sRGB values to linear light, from 0 to 65,535."""

BLEED = 2
"""Number of texels by which region ids extend beyond the borders of texture charts. When viewers
interpolate at these borders, they also read texels outside of the charts."""


@dataclass(frozen=True, eq=False, repr=False)  # a generated repr would print the arrays
class FaceTexels:
    """Result of `texture_colors`: the color of each face.

    Attributes
    ----------
    linear : ndarray of float64, shape (F, 3)
        Mean red, green and blue of each face in linear light, from 0 to 1. The mean of the texels
        is multiplied by the color of the material.
    spread : ndarray of float64, shape (F,)
        Standard deviation of the texel colors in each face in linear light, from 0 to 1; 0 if the
        color does not come from an image. The color of the material has no effect.
    is_textured : ndarray of bool, shape (F,)
        Whether the color of each face comes from an image.
    """

    linear: Floats
    spread: Floats
    is_textured: Bools

    @property
    def oklab(self) -> Floats:
        """Mean color of each face in OKLab, (F, 3), where distances match perceived differences."""
        return oklab_of_linear(self.linear)

    @property
    def srgb(self) -> Bytes:
        """Mean color of each face in sRGB, (F, 3), from 0 to 255."""
        return srgb_of_linear(self.linear)


def texture_colors(
    mesh: MeshLike, texture: Texture | None = None, *, n_threads: int | None = None
) -> FaceTexels:
    """Return the color of each face: the mean of the texels that the face covers.

    Small faces that contain no texel center are sampled between texels. In triangles with more than
    16,384 texels, only every n-th row and column of texels is sampled. Texture coordinates outside
    [0, 1] repeat, clamp or mirror the image, as specified by the material. The mean is multiplied
    by the color of the material. Faces without an image have the color of their material, and faces
    without a material are white. Faces whose texture coordinates are missing, not finite or larger
    than 2**20 in magnitude are treated like faces without an image.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    texture : Texture, optional
        Texture from `read_attributes`. If `mesh` is a path, the default is the texture of the file.
    n_threads : int, optional
        Same as in `segment`. The colors do not depend on the number of threads.

    Returns
    -------
    FaceTexels

    Raises
    ------
    MeshError
        If the mesh is not valid, if there is no texture, if the texture and the mesh have different
        numbers of faces or corners, or if an image is missing, damaged or too large.
    MissingExtraError
        If the texture has images and Pillow is not installed. The extra ``texture`` installs
        Pillow.

    Notes
    -----
    Images are loaded one after the other. A million faces that cover an image of 8192 x 8192 texels
    take about half a second on two cores, plus the time to decode the image.

    Examples
    --------
    >>> from superfacets import Material, Mesh, Texture
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> red, blue = Material(color=(1, 0, 0)), Material(color=(0, 0, 1))
    >>> texture = Texture(np.empty((0, 2)), [-1] * 6, [red, blue], [0, 1])
    >>> texture_colors(square, texture).srgb.tolist()
    [[255, 0, 0], [0, 0, 255]]
    """
    source: Any = mesh
    if texture is None and isinstance(mesh, (str, os.PathLike)):
        source, attributes = kit.CellFile.read(mesh).cells_and_attributes()
        texture = None if attributes is None else attributes.texture
    cells = kit.as_mesh(source)
    if texture is None:
        raise MeshError("the mesh has no texture: pass a texture, or the path of a file with one")
    check_texture(texture, cells)
    return face_texels(cells, texture, kit.checked_threads(n_threads))


def check_texture(texture: Texture, mesh: FaceMesh) -> None:
    """Raise a MeshError unless the texture has as many faces and corners as the mesh."""
    n_corners = len(kit.corners_of(mesh).vertices)
    if len(texture.corners) != n_corners or len(texture.face_materials) != mesh.n_faces:
        raise MeshError(
            f"the texture must have {kit.counted(n_corners, 'corner')} of"
            f" {kit.counted(mesh.n_faces, 'face')}, like the mesh, got"
            f" {kit.counted(len(texture.corners), 'corner')} of"
            f" {kit.counted(len(texture.face_materials), 'face')}"
        )


def face_texels(mesh: FaceMesh, texture: Texture, n_threads: int) -> FaceTexels:
    """Return the color of each face of a mesh; the texture must be checked by `check_texture`."""
    triangles, sources = kit.corner_triangles(mesh)
    faces = np.arange(mesh.n_faces, dtype=np.int32) if sources is None else sources
    factors = np.array([material.color for material in texture.materials] + [(1.0, 1.0, 1.0)])
    linear = factors[texture.face_materials]
    means = np.full((len(triangles), 3), np.nan)
    spreads = np.zeros(len(triangles))
    for (image, wrap), numbers in _materials_by_image(texture).items():
        is_here = np.isin(texture.face_materials, numbers)[faces]
        if not is_here.any():
            continue
        pixels = image.pixels()
        texels = Texels(pixels.shape[1], pixels.shape[0], wrap)
        where = texture.coordinates, texture.corners[triangles[is_here]]
        means[is_here], spreads[is_here] = texels.colors(pixels, LINEAR, *where, n_threads)
    is_found = np.isfinite(means[:, 0])
    of_faces, spread, is_textured = _means_by_face(
        means[is_found], spreads[is_found], _uv_areas(texture, triangles[is_found]),
        faces[is_found], mesh.n_faces,
    )  # fmt: skip
    linear[is_textured] *= of_faces[is_textured]
    return FaceTexels(linear, spread, is_textured)


def _materials_by_image(texture: Texture) -> dict[tuple[TextureImage, tuple[str, str]], list[int]]:
    """Return the indices of materials by image and wrap modes, so that images are decoded once."""
    numbers: dict[tuple[TextureImage, tuple[str, str]], list[int]] = {}
    for number, material in enumerate(texture.materials):
        if material.image is not None:
            numbers.setdefault((material.image, material.wrap), []).append(number)
    return numbers


def _uv_areas(texture: Texture, triangles: Array) -> Floats:
    """Return twice the areas of triangles in texture coordinates, plus 1e-12 so that none is 0."""
    a, b, c = texture.coordinates[texture.corners[triangles]].swapaxes(0, 1)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(np.abs(ux * vy - uy * vx) + 1e-12)


def _means_by_face(
    means: Floats, spreads: Floats, areas: Floats, faces: Ints, n_faces: int
) -> tuple[Floats, Floats, Bools]:
    """Average means and deviations of triangles per face; return also whether a face has any."""
    if len(faces) == n_faces and np.array_equal(faces, np.arange(n_faces)):
        return means, spreads, np.ones(n_faces, np.bool_)
    totals = np.bincount(faces, areas, n_faces)
    is_found = totals > 0
    totals[~is_found] = 1.0
    mixed = [np.bincount(faces, areas * column, n_faces) / totals for column in means.T]
    of_faces = np.stack(mixed, axis=1)
    inner = areas * (spreads**2 + ((means - of_faces[faces]) ** 2).sum(axis=1))
    spread = np.sqrt(np.bincount(faces, inner, n_faces) / totals)
    return of_faces, spread, is_found


def ids_in_layout(
    mesh: FaceMesh, texture: Texture, labels: Ints, is_here: Bools, wrap: tuple[str, str],
    size: tuple[int, int],
) -> Ints:  # fmt: skip
    """Return an image (height, width) with the labels >= 0 of the faces in `is_here`, (F,).

    Labels extend beyond the faces by `BLEED` texels. All other texels are -1.
    """
    triangles, sources = kit.corner_triangles(mesh)
    faces = np.arange(mesh.n_faces) if sources is None else sources
    is_drawn = is_here[faces] & (labels[faces] >= 0)
    return Texels(*size, wrap).painted(
        labels[faces[is_drawn]], texture.coordinates, texture.corners[triangles[is_drawn]],
        BLEED, kit.checked_threads(None),
    )  # fmt: skip


def subdivided_texture(
    texture: Texture, mesh: FaceMesh, parts: FaceMesh, sources: Ints
) -> Texture | None:
    """Return a texture for `parts`, whose triangles are parts of the triangles `sources` of `mesh`.

    Texture coordinates are interpolated. Returns None if `mesh` is not a `Mesh`.
    """
    corners = kit.corners_of(mesh)
    if corners.size != 3:
        return None
    a, b, c = mesh.vertices[corners.vertices.reshape(-1, 3)[sources]].swapaxes(0, 1)
    along, aside = b - a, c - a
    normal = np.cross(along, aside)
    scale = np.maximum((normal**2).sum(axis=1), np.finfo(float).tiny)[:, np.newaxis]
    given = texture.corners.reshape(-1, 3)[sources]
    pairs = texture.coordinates[given] if len(texture.coordinates) else np.zeros((*given.shape, 2))
    found = []
    for vertices in kit.corners_of(parts).vertices.reshape(-1, 3).T:
        offset = parts.vertices[vertices] - a
        s = (np.cross(offset, aside) * normal).sum(axis=1, keepdims=True) / scale
        t = (np.cross(along, offset) * normal).sum(axis=1, keepdims=True) / scale
        s, t = np.rint([s * 2.0**24, t * 2.0**24]) / 2.0**24  # equal for both triangles of an edge
        found.append((1 - s - t) * pairs[:, 0] + s * pairs[:, 1] + t * pairs[:, 2])
    coordinates = np.stack(found, axis=1).reshape(-1, 2)
    new = np.where(np.repeat((given >= 0).all(axis=1), 3), np.arange(len(coordinates)), -1)
    of_faces = texture.face_materials[sources]
    return Texture(coordinates, new, texture.materials, of_faces, texture.libraries)
