"""Textures of written meshes: MTL files, images beside them, and images of region ids."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from .._types import Array, Bools, Bytes, Ints
from ..cells.kinds import kind_of
from ..cells.texels import ids_in_layout
from ..errors import MeshError
from ..io.atomic import atomic_outputs
from ..io.guards import counted
from ..io.light import srgb_of_linear
from ..io.textures import (
    ENDING_OF_IMAGE,
    Material,
    Texture,
    TextureImage,
    import_pillow,
    kind_of_image,
)
from .content import Content

PLAIN_SIZE = (2048, 2048)
"""Width and height of an image of ids where there is no image of colors."""


def notes_on_texture(
    texture: Texture, endings: Collection[str], *, has_polygons: bool = False
) -> list[str]:
    """Notes on parts of a texture that files with these endings do not hold."""
    notes = []
    lacking = sorted({ending for ending in endings if ending in (".off", ".vtp")})
    if ".ply" in endings and has_polygons and not texture.is_of_ply:
        lacking.append(".ply of polygons")
    if lacking:
        notes.append(f"no texture in {' and '.join(lacking)}, which cannot hold it")
    for ending, format in ((".obj", "mtl"), (".glb", "gltf"), (".ply", "none")):
        others = [
            material.name for material in texture.materials
            if material.source is not None and material.source.format != format
            and {*material.source.images} - {material.image}
        ]  # fmt: skip
        if ending in endings and others:
            notes.append(f"of {counted(len(others), 'material')}, {ending} holds the color alone")
    if ".obj" in endings and any("mirror" in material.wrap for material in texture.materials):
        notes.append("OBJ cannot mirror images: they repeat")
    return notes


@dataclass
class Placer:
    """Finds the names by which an output refers to images, and copies those of other folders."""

    path: Path | None  # the output; None: standard output, beside which nothing is written
    names: dict[TextureImage, str | None] = field(default_factory=dict)

    def name_of(self, image: TextureImage) -> str | None:
        """The name of an image in the output; None if it has none there.

        An image in the folder of the output, or below it, is referred to. Another is copied beside
        the output. One that there is not keeps its name.
        """
        if image not in self.names:
            self.names[image] = self._placed(image)
        return self.names[image]

    def relative(self, path: Path) -> str | None:
        """The path of a file in the folder of the output or below it, else None."""
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
        name = f"{self.path.stem}_{_plain(Path(image.name).name)}"
        ending = ENDING_OF_IMAGE.get(kind_of_image(content) or "", "")
        stem = Path(name).stem if Path(name).suffix else name
        name, number = f"{stem}{Path(name).suffix or ending}", 1
        while name in self.names.values():
            name, number = f"{stem}_{number}{Path(name).suffix}", number + 1
        write_beside(self.path, name, content)
        return name


def write_beside(path: Path, name: str, content: bytes) -> None:
    """Write a file beside an output."""
    with atomic_outputs([path.with_name(name)]) as (temporary,):
        temporary.write_bytes(content)


def _plain(name: str) -> str:
    """A name of letters, digits, points and dashes."""
    return re.sub(r"[^\w.-]+", "_", name).lstrip(".") or "image"


def material_names(texture: Texture) -> list[str]:
    """Names of materials for an OBJ file: those of its input as they are, others made unique."""
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
    """The lines ``mtllib`` of an OBJ file; MTL file and images are written beside it if needed."""
    placer = Placer(path)
    known = [placer.relative(library) for library in texture.libraries]
    # Readers disagree about the folder of images in an MTL file of another folder than the OBJ.
    if known and all(name is not None and "/" not in name for name in known):
        names = [name for name in known if name is not None]
    elif path is not None and texture.materials:
        names = [f"{path.stem}.mtl"]
        text = "\n".join(_mtl_lines(texture, placer)) + "\n"
        write_beside(path, names[0], text.encode("utf-8", "surrogateescape"))
    else:
        names = []
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
    """Lines of a material with the names of images in place of their numbers."""
    pieces = text.split("\0")
    for place in range(1, len(pieces), 2):
        image = images[int(pieces[place])]
        pieces[place] = placer.name_of(image) or image.name
    return "".join(pieces)


def ply_texture(
    texture: Texture, placer: Placer, *, has_triangles: bool
) -> tuple[list[str], dict[str, Array]]:
    """Comments that name images for a PLY file, and properties of faces that it lacks.

    The texture of a PLY file is in its properties already. Others need triangles.
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
    fields = {"texcoord": np.nan_to_num(pairs).astype(np.float32)}
    if len(comments) > 1 or -1 in of_materials:
        fields["texnumber"] = np.array(of_materials, np.int32)[texture.face_materials]
    return comments, fields


def write_ids(file: IO[bytes], content: Content) -> None:
    """Write an image of region ids in the layout of the texture, and a table of them beside it.

    The id of a region is its label plus 1, as red + 256 green + 65,536 blue; 0 is no region. If the
    texture has several images, the ids of each are in an image of its own beside the first.
    """
    texture, labels = content.texture, content.labels
    if texture is None or labels is None:
        raise MeshError("an image of ids needs faces with labels and texture coordinates")
    if labels.max(initial=0) >= 2**24 - 1:
        raise MeshError("an image of ids holds up to 16,777,215 regions")
    n_texels = np.zeros(int(labels.max(initial=-1)) + 1, np.int64)
    for number, (material, is_here, size) in enumerate(_layouts(texture)):
        ids = ids_in_layout(content.cells, texture, labels, is_here, material.wrap, size)
        n_texels += np.bincount(ids[ids >= 0], minlength=len(n_texels))
        image = import_pillow("Image").fromarray(_as_colors(ids))
        if number == 0:
            image.save(file, "png")
        elif content.path is not None:
            stem = content.path.name[: -len(content.ending)]
            with atomic_outputs([content.path.with_name(f"{stem}.{number}.ids.png")]) as (beside,):
                image.save(beside, "png")
    if content.path is not None:
        stem = content.path.name[: -len(content.ending)]
        write_beside(content.path, f"{stem}.ids.csv", _table_of_ids(content, labels, n_texels))


def _layouts(texture: Texture) -> Iterator[tuple[Material, Bools, tuple[int, int]]]:
    """A material with each image, the faces that show it, and the size of the image.

    Without images, all faces are in one layout.
    """
    if not texture.images:
        yield Material(), np.ones(len(texture.face_materials), np.bool_), PLAIN_SIZE
    for image in texture.images:
        numbers = [n for n, each in enumerate(texture.materials) if each.image is image]
        is_here = np.isin(texture.face_materials, numbers)
        size = PLAIN_SIZE if image.problem is not None else image.size()
        yield texture.materials[numbers[0]], is_here, size


def _as_colors(ids: Ints) -> Bytes:
    numbers = ids.astype(np.int64) + 1
    return np.stack([numbers & 255, numbers >> 8 & 255, numbers >> 16], axis=2).astype(np.uint8)


def _table_of_ids(content: Content, labels: Ints, n_texels: Array) -> bytes:
    """Id, label, number of texels and area of each region, as CSV."""
    measures = kind_of(content.cells).measures(content.cells, 1)
    kept = labels >= 0
    areas = np.bincount(labels[kept], measures[kept], len(n_texels))
    rows = [
        f"{label + 1},{label},{n_texels[label]},{areas[label]:.9g}"
        for label in np.unique(labels[kept]).tolist()
    ]
    return ("\n".join(["id,label,texels,area", *rows]) + "\n").encode("ascii")


class GltfMaterials:
    """Adds the materials of a texture to a glTF document, each image once."""

    def __init__(self, add_view: Any) -> None:
        self.add_view = add_view  # appends bytes to the buffer, and returns the number of the view
        self.lists: dict[str, list[dict[str, Any]]] = {
            name: [] for name in ("images", "samplers", "textures", "materials")
        }
        self.extensions: set[str] = set()
        self._image_of: dict[TextureImage, int] = {}
        self._texture_of: dict[tuple[TextureImage, str], int] = {}

    def add(self, material: Material) -> int:
        """Add a material, and return its number."""
        source = material.source
        if source is not None and source.format == "gltf":
            document = self._with_textures(
                json.loads(source.text), list(zip(source.images, source.samplers, strict=True))
            )
        else:
            document = self._plain(material)
        self.lists["materials"].append(document)
        return len(self.lists["materials"]) - 1

    def _plain(self, material: Material) -> dict[str, Any]:
        """A rough material with the color and the image."""
        shading: dict[str, Any] = {"metallicFactor": 0.0}
        if material.color != (1.0, 1.0, 1.0):
            shading["baseColorFactor"] = [*material.color, 1.0]
        if material.image is not None and material.image.problem is None:
            codes = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
            sampler = {"wrapS": codes[material.wrap[0]], "wrapT": codes[material.wrap[1]]}
            shading["baseColorTexture"] = {
                "index": self._texture(material.image, json.dumps(sampler))
            }
        return {"name": material.name, "pbrMetallicRoughness": shading}

    def _with_textures(self, value: Any, sources: list[tuple[TextureImage, str]]) -> Any:
        """The JSON of a material with textures of this document."""
        if isinstance(value, list):
            return [self._with_textures(each, sources) for each in value]
        if not isinstance(value, dict):
            return value
        kept: dict[str, Any] = {}
        for key, each in value.items():
            if key == "extensions" and isinstance(each, dict):
                self.extensions |= {*each}
            if key.endswith("Texture") and isinstance(each, dict) and "index" in each:
                image, sampler = sources[each["index"]]
                if image.problem is None:
                    kept[key] = {**each, "index": self._texture(image, sampler)}
            else:
                kept[key] = self._with_textures(each, sources)
        return kept

    def _texture(self, image: TextureImage, sampler: str) -> int:
        key = image, sampler
        if key not in self._texture_of:
            texture = self._reference(self._image(image))
            options = json.loads(sampler)
            if options:
                samplers = self.lists["samplers"]
                if options not in samplers:
                    samplers.append(options)
                texture["sampler"] = samplers.index(options)
            self.lists["textures"].append(texture)
            self._texture_of[key] = len(self.lists["textures"]) - 1
        return self._texture_of[key]

    def _reference(self, image: int) -> dict[str, Any]:
        """A texture of an image; kinds other than PNG and JPEG need an extension."""
        kind = self.lists["images"][image]["mimeType"]
        name = {"image/webp": "EXT_texture_webp", "image/ktx2": "KHR_texture_basisu"}.get(kind)
        if name is None:
            return {"source": image}
        self.extensions.add(name)
        return {"extensions": {name: {"source": image}}}

    def _image(self, image: TextureImage) -> int:
        """Embed an image as it is; as PNG if glTF does not know its kind."""
        if image not in self._image_of:
            content = image.encoded()
            kind = kind_of_image(content)
            if kind in ("bmp", "tga", "tiff"):
                content, kind = png_of(image), "png"
            view = self.add_view(np.frombuffer(content, np.uint8))
            document = {"bufferView": view, "mimeType": f"image/{kind}", "name": image.name}
            self.lists["images"].append(document)
            self._image_of[image] = len(self.lists["images"]) - 1
        return self._image_of[image]


def png_of(image: TextureImage) -> bytes:
    """The pixels of an image as PNG."""
    import io

    file = io.BytesIO()
    import_pillow("Image").fromarray(image.pixels()).save(file, "png")
    return file.getvalue()
