"""Read MTL files, which contain the materials of OBJ files."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from superfacets import MeshError
from superfacets.kit import file_beside, read_content

from .images import TextureImage, image_beside
from .light import linear_of_srgb
from .textures import Material, MaterialSource

_WIDTHS = {"-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1,
           "-imfchan": 1, "-mm": 2, "-texres": 1, "-type": 1}  # fmt: skip
"""Number of values of each texture map option."""

_VECTORS = ("-o", "-s", "-t")
"""Texture map options that have one to three numbers."""


@dataclass
class _Block:
    """Lines of a material, in which indices replace the names of images."""

    name: str
    lines: list[str] = field(default_factory=list)
    images: list[TextureImage] = field(default_factory=list)
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)  # in linear light, from ``Kd``
    map: TextureImage | None = None  # color image, from ``map_Kd``
    is_clamped: bool = False  # whether the color image has the option ``-clamp on``

    def material(self) -> Material:
        """Return the material. If it has a color image, ``Kd`` is replaced by white."""
        color = self.color if self.map is None else (1.0, 1.0, 1.0)
        wrap = "clamp" if self.is_clamped else "repeat"
        source = MaterialSource("mtl", "\n".join(self.lines), tuple(self.images))
        return Material(self.name, color, self.map, (wrap, wrap), source)


def read_mtl(path: Path, folder: Path) -> dict[str, Material]:
    """Return the materials of an MTL file by name; images must be in `folder` or its subfolders.

    All lines of a material are stored, so that `write_mesh` can write them again.
    """
    content = bytes(read_content(path)[:]).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    text = content.replace(b"\\\n", b" ").decode("utf-8-sig", "surrogateescape")
    beside = path.parent.relative_to(folder) if path.parent.is_relative_to(folder) else Path()
    known: dict[str, TextureImage] = {}
    blocks: list[_Block] = []
    for line in text.split("\n"):
        keyword, rest = split_word(line)
        if keyword == "newmtl":
            blocks.append(_Block(rest))
        elif blocks and keyword and not keyword.startswith("#") and "\0" not in line:
            _add_line(blocks[-1], keyword, rest, partial(_image, beside, folder, known))
    return {block.name: block.material() for block in reversed(blocks)}  # the first of equal names


def _image(beside: Path, folder: Path, known: dict[str, TextureImage], name: str) -> TextureImage:
    """Return the image at a path relative to `beside`; equal paths give the same object."""
    path = str(Path(beside, name.replace("\\", "/")))
    if path not in known:
        known[path] = image_beside(path, folder)
    return known[path]


def _add_line(
    block: _Block, keyword: str, rest: str, image_of: Callable[[str], TextureImage]
) -> None:
    if keyword == "Kd":
        block.color = _linear_color(rest) or block.color
    if not keyword.lower().startswith(("map_", "bump", "disp", "decal", "refl", "norm")):
        block.lines.append(f"{keyword} {rest}")
        return
    options, name = _split_options(rest)
    image = image_of(name)
    if image not in block.images:
        block.images.append(image)
    block.lines.append(" ".join([keyword, *options, f"\0{block.images.index(image)}\0"]))
    if keyword.lower() == "map_kd":
        block.map = image
        block.is_clamped = "-clamp on" in " ".join(options)


def _split_options(text: str) -> tuple[list[str], str]:
    """Split the text of a texture map into options and the image name, which may have spaces."""
    options: list[str] = []
    rest = text
    while rest.startswith("-"):
        word, after = split_word(rest)
        if word not in _WIDTHS and word not in _VECTORS:
            break
        options.append(word)
        rest = after
        for place in range(3 if word in _VECTORS else _WIDTHS[word]):
            value, after = split_word(rest)
            if word in _VECTORS and place and not _is_number(value):
                break
            options.append(value)
            rest = after
    return options, rest


def split_word(text: str) -> tuple[str, str]:
    """Return the first word of a text, and the rest; any white space separates them."""
    word, *rest = text.split(maxsplit=1) or [""]
    return word, rest[0].rstrip() if rest else ""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _linear_color(text: str) -> tuple[float, float, float] | None:
    """Convert an sRGB color to linear light; None if `text` does not begin with 3 numbers."""
    words = text.split()
    if len(words) < 3 or not all(map(_is_number, words[:3])):
        return None
    shares = np.clip(np.nan_to_num([float(word) for word in words[:3]]), 0.0, 1.0)
    red, green, blue = linear_of_srgb(shares).tolist()
    return red, green, blue


def read_libraries(
    names: list[str], folder: Path | None
) -> tuple[dict[str, Material], list[Path], list[str]]:
    """Return materials by name, the MTL files that were read, and notes about unreadable files."""
    materials: dict[str, Material] = {}
    found, left_out = list[Path](), list[str]()
    for name in dict.fromkeys(names):
        path = file_beside(name.replace("\\", "/"), folder)
        try:
            if path is None or folder is None:
                raise FileNotFoundError(name)
            read = read_mtl(path, Path(os.path.realpath(folder)))
        except (OSError, MeshError):
            left_out.append(f"materials: {name!r} cannot be read in the mesh's folder")
            continue
        found.append(path)
        materials = {**read, **materials}
    return materials, found, left_out
