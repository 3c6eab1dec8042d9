"""Define textures, which consist of texture coordinates of corners and materials of faces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets.kit import Array, Floats, Ints, Texels, counted, freeze, refuse_mask

from .images import TextureImage

WRAPS = Texels.WRAPS
"""Wrap modes: how an image continues outside [0, 1]."""


@dataclass(frozen=True, eq=False)
class MaterialSource:
    """Complete description of a material, copied from its file for output in the same format.

    In MTL text, each image name is replaced by its index in `images`, between two zero bytes. In
    glTF JSON, ``index`` is the index of an image in `images`, and of its sampler in `samplers`.
    """

    format: str  # "mtl" or "gltf"
    text: str
    images: tuple[TextureImage, ...] = ()
    samplers: tuple[str, ...] = ()  # glTF only: JSON text of the sampler of each image


def with_textures(value: Any, convert: Callable[[str, dict[str, Any]], Any]) -> Any:
    """Copy a glTF material; ``convert(key, texture)`` replaces textures, or removes (None) them."""
    if isinstance(value, list):
        return [with_textures(each, convert) for each in value]
    if not isinstance(value, dict):
        return value
    kept: dict[str, Any] = {}
    for key, each in value.items():
        if not (key.endswith("Texture") and isinstance(each, dict) and "index" in each):
            kept[key] = with_textures(each, convert)
        elif (converted := convert(key, each)) is not None:
            kept[key] = converted
    return kept


@dataclass(frozen=True, eq=False)
class Material:
    """Color of faces, which is multiplied by the colors of an image if the material has an image.

    Parameters
    ----------
    name : str
        Name of the material.
    color : tuple of three floats
        Red, green and blue in linear light, 0 to 1.
    image : TextureImage, optional
        Image whose colors are multiplied by ``color``.
    wrap : tuple of two str
        How the image continues for u and for v outside [0, 1]: ``"repeat"``, ``"clamp"`` or
        ``"mirror"``.
    source : MaterialSource, optional
        Complete description of the material in its file.
    """

    name: str = ""
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    image: TextureImage | None = None
    wrap: tuple[str, str] = ("repeat", "repeat")
    source: MaterialSource | None = None

    def __post_init__(self) -> None:
        if not {*self.wrap} <= {*WRAPS} or len(self.wrap) != 2:
            raise ValueError(f"wrap must be two values from {', '.join(WRAPS)}, got {self.wrap!r}")


@dataclass(frozen=True, eq=False)
class Texture:
    """Texture coordinates of the corners of faces, and the materials of faces.

    `read_attributes` reads textures from a file, and `write_mesh` writes them.

    Parameters
    ----------
    coordinates : array_like, shape (T, 2)
        Texture coordinates u and v. From 0 to 1, u goes from the left to the right side of the
        image, and v from its lower to its upper side.
    corners : array_like of integers, shape (C,)
        Row of `coordinates` for each corner, one face after the other; -1 for no coordinates.
    materials : sequence of Material
        Materials of the mesh.
    face_materials : array_like of integers, shape (F,)
        Index of the material of each face, or -1 for no material.
    libraries : sequence of path-like, optional
        MTL files that describe the materials.
    format : str, optional
        ``"ply"`` if the texture was read from a PLY file. The coordinates are then also attributes
        of the vertices or faces.

    Raises
    ------
    ValueError
        If an array has the wrong shape or type, or if an index is out of range.

    Examples
    --------
    >>> wall = TextureImage("wall.png", Path("wall.png"))
    >>> Texture([[0, 0], [1, 0], [0, 1]], [0, 1, 2], [Material("wall", image=wall)], [0])
    Texture(3 coordinates; 1 material, 1 image)
    """

    coordinates: Floats
    corners: Ints
    materials: Sequence[Material]
    face_materials: Ints
    libraries: Sequence[Path] = ()
    format: str = ""

    def __post_init__(self) -> None:
        coordinates = np.array(_numbers(self.coordinates, "coordinates", "iuf"), float, order="C")
        if coordinates.ndim != 2 or coordinates.shape[1] != 2:
            raise ValueError(f"coordinates must have shape (T, 2), got {coordinates.shape}")
        corners = _indices(self.corners, "corners", len(coordinates))
        face_materials = _indices(self.face_materials, "face_materials", len(self.materials))
        freeze(self, coordinates=coordinates, corners=corners, face_materials=face_materials)
        object.__setattr__(self, "materials", tuple(self.materials))
        object.__setattr__(self, "libraries", tuple(map(Path, self.libraries)))

    def __reduce__(self) -> tuple[type[Texture], tuple[Any, ...]]:
        arrays = self.coordinates, self.corners, self.materials, self.face_materials
        return Texture, (*arrays, self.libraries, self.format)

    @property
    def is_of_ply(self) -> bool:
        """Whether the texture is from a PLY file, so that its coordinates are also attributes."""
        return self.format == "ply"

    @cached_property
    def shared(self) -> Texture:
        """The same texture, with equal coordinates stored once, in the order of their first row."""
        pairs = self.coordinates.view(np.complex128)[:, 0]
        _, firsts, numbers = np.unique(pairs, return_index=True, return_inverse=True)
        kept = np.sort(firsts)
        rows = np.append(np.searchsorted(kept, firsts)[numbers], -1)  # -1 means no coordinates
        return replace(self, coordinates=self.coordinates[kept], corners=rows[self.corners])

    @property
    def images(self) -> list[TextureImage]:
        """Color images of the materials, without duplicates."""
        return [*dict.fromkeys(each.image for each in self.materials if each.image is not None)]

    def __repr__(self) -> str:
        coordinates = counted(len(self.coordinates), "coordinate")
        materials = counted(len(self.materials), "material")
        images = counted(len(self.images), "image")
        return f"Texture({coordinates}; {materials}, {images})"


def _numbers(values: npt.ArrayLike, name: str, kinds: str) -> Array:
    refuse_mask(values, name)
    array = np.asarray(values)
    if array.dtype.kind not in kinds and array.size:
        what = "integers" if "f" not in kinds else "numbers"
        raise ValueError(f"{name} must be {what}, got {array.dtype}")
    return array


def _indices(values: npt.ArrayLike, name: str, count: int) -> Ints:
    array = _numbers(values, name, "iu")
    if array.ndim != 1:
        raise ValueError(f"{name} must have one dimension, got shape {array.shape}")
    if array.size and (array.min() < -1 or array.max() >= count):
        wrong = int(np.argmax((array < -1) | (array >= count)))
        raise ValueError(f"{name}[{wrong}] must be from -1 to {count - 1}, got {array[wrong]}")
    return array.astype(np.int32)
