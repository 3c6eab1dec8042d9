"""Write textures: copy images, write MTL files, and add texture coordinates to PLY files."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from superfacets.kit import Array, Floats, atomic_outputs, counted

from .images import ENDING_OF_IMAGE, TextureImage, kind_of_image
from .light import srgb_of_linear
from .textures import Texture


def notes_on_texture(texture: Texture, endings: Collection[str]) -> list[str]:
    """Return notes on parts of the texture that files with these endings cannot store."""
    notes = []
    for ending, format in ((".obj", "mtl"), (".glb", "gltf"), (".ply", "none")):
        others = [
            material.name for material in texture.materials
            if material.source is not None and material.source.format != format
            and {*material.source.images} - {material.image}
        ]  # fmt: skip
        if ending in endings and others:
            materials = counted(len(others), "material")
            notes.append(f"{ending} can store only the color and color image of {materials}")
    if ".obj" in endings and any("mirror" in material.wrap for material in texture.materials):
        notes.append("OBJ cannot store mirrored images: images are repeated instead")
    return notes


@dataclass
class Placer:
    """Copies images to the folder of an output file, and chooses the names of the copies."""

    path: Path | None  # output file; None for standard output, in which case no image is copied
    names: dict[TextureImage, str | None] = field(default_factory=dict)

    def name_of(self, image: TextureImage) -> str | None:
        """Return the name of an image in the output, or None if the output cannot refer to it.

        Images outside of the folder of the output are copied. A missing image keeps its name.
        """
        if image not in self.names:
            self.names[image] = self._placed(image)
        return self.names[image]

    def relative(self, path: Path) -> str | None:
        """Return `path` relative to the folder of the output, or None; for a stream, its name."""
        if self.path is None:
            return path.name
        folder, real = Path(os.path.realpath(self.path.parent)), Path(os.path.realpath(path))
        return real.relative_to(folder).as_posix() if real.is_relative_to(folder) else None

    def _placed(self, image: TextureImage) -> str | None:
        if image.problem is not None:
            return image.name
        found = None if image.path is None else self.relative(image.path)
        if found is not None or self.path is None:
            return found
        content = image.encoded()
        base = Path(f"{self.path.stem}_{_plain(Path(image.name).name)}")
        ending = base.suffix or ENDING_OF_IMAGE.get(kind_of_image(content) or "", "")
        name, number = f"{base.stem}{ending}", 1
        while name in self.names.values():
            name, number = f"{base.stem}_{number}{ending}", number + 1
        write_beside(self.path, name, content)
        return name


def write_beside(path: Path, name: str, content: bytes) -> None:
    """Write a file to the folder of an output file."""
    with atomic_outputs([path.with_name(name)]) as (temporary,):
        temporary.write_bytes(content)


def _plain(name: str) -> str:
    """Replace all characters except letters, digits, dots and dashes by underscores."""
    return re.sub(r"[^\w.-]+", "_", name).lstrip(".") or "image"


def material_names(texture: Texture) -> list[str]:
    """Return unique material names for an OBJ file; names from an MTL file are not changed."""
    names: list[str] = []
    for number, material in enumerate(texture.materials):
        name = material.name
        if material.source is None or material.source.format != "mtl":
            name = _plain(name) if name else f"material_{number}"
            while name in names:
                name = f"{name}_{number}"
        names.append(name)
    return names


def library_lines(texture: Texture, path: Path | None) -> bytes:
    """Return the ``mtllib`` lines of an OBJ file; write an MTL file if none can be reused."""
    placer = Placer(path)
    names, known = list[str](), [placer.relative(library) for library in texture.libraries]
    # MTL files are reused only if they are in the folder of the OBJ file. For other folders,
    # programs disagree on the folder to which image names are relative.
    if known and all(name is not None and "/" not in name for name in known):
        names = [name for name in known if name is not None]
    elif path is not None and texture.materials:
        names = [f"{path.stem}.mtl"]
        text = "\n".join(_mtl_lines(texture, placer)) + "\n"
        write_beside(path, names[0], text.encode("utf-8", "surrogateescape"))
    return "".join(f"mtllib {name}\n" for name in names).encode("utf-8", "surrogateescape")


def _mtl_lines(texture: Texture, placer: Placer) -> Iterator[str]:
    for name, material in zip(material_names(texture), texture.materials, strict=True):
        yield f"newmtl {name}"
        if material.source is not None and material.source.format == "mtl":
            yield _with_names(material.source.text, material.source.images, placer)
            continue
        yield "Kd " + " ".join(f"{value / 255:.6g}" for value in srgb_of_linear(material.color))
        image = None if material.image is None else placer.name_of(material.image)
        if image is not None:
            clamp = "-clamp on " if material.wrap == ("clamp", "clamp") else ""
            yield f"map_Kd {clamp}{image}"


def _with_names(text: str, images: tuple[TextureImage, ...], placer: Placer) -> str:
    """Return the MTL text of a material, with its indices into `images` replaced by image names."""
    pieces = text.split("\0")
    for place in range(1, len(pieces), 2):
        image = images[int(pieces[place])]
        pieces[place] = placer.name_of(image) or image.name
    return "".join(pieces)


def ply_texture(
    texture: Texture, placer: Placer, *, has_triangles: bool
) -> tuple[list[str], dict[str, Array]]:
    """Return comments that name images, and face properties: texture coordinates and image numbers.

    There are none for polygons, and for a texture of a PLY file, which is in the attributes.
    """
    names = [(image, placer.name_of(image)) for image in texture.images]
    comments = [f"comment TextureFile {name}" for _, name in names if name is not None]
    if texture.is_of_ply or not has_triangles or not comments:
        return comments if texture.is_of_ply else [], {}
    numbers = {image: n for n, (image, name) in enumerate(names) if name is not None}
    of_materials = [
        -1 if material.image is None else numbers.get(material.image, -1)
        for material in texture.materials
    ] + [-1]
    corners = texture.corners.reshape(-1, 3)
    pairs = np.concatenate([texture.coordinates, [[0.0, 0.0]]])[corners].reshape(-1, 6)
    fields: dict[str, Array] = {"texcoord": finite_singles(pairs)}
    if len(comments) > 1 or -1 in of_materials:
        fields["texnumber"] = np.array(of_materials, np.int32)[texture.face_materials]
    return comments, fields


def finite_singles(values: Floats) -> Array:
    """Round to float32; NaN becomes 0, and numbers beyond float32 become its largest number."""
    largest = float(np.finfo(np.float32).max)
    return np.clip(np.nan_to_num(values), -largest, largest).astype(np.float32)
