"""Read texture coordinates and materials of a glTF file."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Floats, GltfScene, Ints, counted, most_bytes_of

from .images import ENDING_OF_IMAGE, UNKNOWN, TextureImage, image_beside, kind_of_image, problems_of
from .textures import Material, MaterialSource, Texture, with_textures

WRAP_OF_CODE = {10497: "repeat", 33071: "clamp", 33648: "mirror"}

_TRANSFORM = "KHR_texture_transform"
_WEBP, _BASIS = "EXT_texture_webp", "KHR_texture_basisu"


def read_texture(scene: GltfScene, folder: Path | None) -> tuple[Texture | None, list[str]]:
    """Return the texture of a scene, and the left-out items; raise a MeshError if it is damaged."""
    reader = _Reader(scene, folder)
    return reader.texture(), reader.left_out


@dataclass(frozen=True)
class _Use:
    """Set of texture coordinates that a material uses, and an affine map of the coordinates."""

    coordinates: int = 0  # index of the set: TEXCOORD_0, TEXCOORD_1, ...
    offset: tuple[float, ...] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, ...] = (1.0, 1.0)

    def moved(self, pairs: Floats) -> Floats:
        """Apply the affine map to texture coordinates, (n, 2), with v pointing down."""
        if (self.offset, self.rotation, self.scale) == ((0.0, 0.0), 0.0, (1.0, 1.0)):
            return pairs
        cosine, sine = np.cos(self.rotation), np.sin(self.rotation)
        u, v = (pairs * self.scale).T  # v points down, so the rotation is counterclockwise
        turned = np.stack([cosine * u + sine * v, cosine * v - sine * u], axis=1)
        return np.asarray(turned + self.offset)


@dataclass
class _Reader:
    """Reader that reads each material, image and array of texture coordinates only once."""

    gltf: GltfScene
    folder: Path | None
    left_out: list[str] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    uses: list[_Use] = field(default_factory=list)  # coordinates for each material's color image
    coordinates: list[Floats] = field(default_factory=list)
    n_coordinates: int = 0
    n_image_bytes: int = 0
    _material_of: dict[int, int] = field(default_factory=dict)  # keyed by index in the document
    _image_of: dict[str, TextureImage] = field(default_factory=dict)  # keyed by address or view
    _first_of: dict[tuple[int, _Use], int] = field(default_factory=dict)

    def texture(self) -> Texture | None:
        """Return the texture of a scene, or None if it has neither coordinates nor materials."""
        parts = {index: self._parts(index) for index in {visit.mesh for visit in self.gltf.visits}}
        corners, face_materials = list[Array](), list[Ints]()
        for visit in self.gltf.visits:
            for indices, material in parts[visit.mesh]:
                corners.append(indices[:, [0, 2, 1]] if visit.is_mirrored else indices)
                face_materials.append(np.full(len(indices), material, np.int32))
        if not self.coordinates and not self.materials:
            return None
        pairs = np.concatenate([np.empty((0, 2)), *self.coordinates])
        pairs[:, 1] = 1.0 - pairs[:, 1]
        self.left_out += problems_of([*self._image_of.values()])
        return Texture(
            pairs, np.concatenate(corners).ravel(), self.materials, np.concatenate(face_materials)
        )

    def _parts(self, index: int) -> list[tuple[Array, int]]:
        """Return texture coordinate indices, (n, 3), and material of each primitive, or -1."""
        parts = []
        for primitive in self.gltf.primitives(index):
            positions = self.gltf.rows(self.gltf.positions_of(primitive, index), "VEC3")
            corners = self.gltf.corners(primitive, len(positions)).reshape(-1, 3)
            material = self._material(primitive["material"]) if "material" in primitive else -1
            use = self.uses[material] if material >= 0 else _Use()
            accessor = primitive["attributes"].get(f"TEXCOORD_{use.coordinates}")
            if accessor is None:
                parts.append((np.full(corners.shape, -1), material))
                continue
            first = self._first_coordinate(accessor, use, len(positions))
            parts.append((corners.astype(np.int64) + first, material))
        return parts

    def _first_coordinate(self, accessor: Any, use: _Use, n_vertices: int) -> int:
        """Return the index of an accessor's first coordinate; add the coordinates if new."""
        key = (self.gltf.whole({"accessor": accessor}, "accessor"), use)
        if key not in self._first_of:
            pairs = self.gltf.doubles(accessor, "VEC2")
            if len(pairs) != n_vertices:
                expected = counted(n_vertices, "texture coordinate")
                raise MeshError(f"expected {expected}, got {len(pairs)}")
            self._first_of[key] = self.n_coordinates
            self.n_coordinates += len(pairs)
            if pairs.itemsize * 2 * self.n_coordinates > most_bytes_of(self.gltf.n_bytes):
                raise MeshError("the file uses its texture coordinates too many times")
            self.coordinates.append(use.moved(pairs))
        return self._first_of[key]

    def _material(self, index: Any) -> int:
        document = self.gltf.item("materials", index)
        if index not in self._material_of:
            self._material_of[index] = len(self.materials)
            material, use = self._read_material(document, index)
            self.materials.append(material)
            self.uses.append(use)
        return self._material_of[index]

    def _read_material(self, document: dict[str, Any], index: int) -> tuple[Material, _Use]:
        name = document.get("name")
        name = name if isinstance(name, str) else f"material_{index}"
        shading = document.get("pbrMetallicRoughness", {})
        if not isinstance(shading, dict):
            raise MeshError(f"materials[{index}].pbrMetallicRoughness must be a JSON object")
        red, green, blue, _ = self.gltf.numbers(shading, "baseColorFactor", [1.0] * 4).tolist()
        info = shading.get("baseColorTexture")
        use = _use_of(info) if isinstance(info, dict) else _Use()
        source = _SourceReader(self, use)
        try:
            text = json.dumps(with_textures(document, source.reference))
        except RecursionError:
            raise MeshError(f"broken glTF: materials[{index}] is nested too deeply") from None
        self.left_out += [f"{what} of material {name!r}" for what in source.left_out]
        kept = MaterialSource("gltf", text, tuple(source.images), tuple(source.samplers))
        if not isinstance(info, dict):
            return Material(name, (red, green, blue), source=kept), use
        image, sampler = self.image_and_sampler(info.get("index"))
        codes = [self.gltf.whole(sampler, key, 10497) for key in ("wrapS", "wrapT")]
        wrap_u, wrap_v = (WRAP_OF_CODE.get(code, "repeat") for code in codes)
        return Material(name, (red, green, blue), image, (wrap_u, wrap_v), kept), use

    def image_and_sampler(self, index: Any) -> tuple[TextureImage, dict[str, Any]]:
        """Return the image and the sampler of a texture of the document."""
        texture = self.gltf.item("textures", index)
        sampler = self.gltf.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        extensions = texture.get("extensions")
        listed = extensions if isinstance(extensions, dict) else {}
        others = [listed[name] for name in (_WEBP, _BASIS) if isinstance(listed.get(name), dict)]
        sources = [each["source"] for each in (texture, *others) if "source" in each]
        if not sources:
            raise MeshError(f"broken glTF: textures[{index}] has no image")
        return self._image(sources[0]), sampler

    def _image(self, index: Any) -> TextureImage:
        document = self.gltf.item("images", index)
        key = str(document.get("uri", f"view {document.get('bufferView')}"))
        if key not in self._image_of:
            self._image_of[key] = self._read_image(document, index)
        return self._image_of[key]

    def _read_image(self, document: dict[str, Any], index: int) -> TextureImage:
        address = document.get("uri")
        if isinstance(address, str) and not address.startswith("data:"):
            return image_beside(unquote(address), self.folder)
        if isinstance(address, str):
            content = self.gltf.decoded(address)
        else:
            self.gltf.item("bufferViews", document.get("bufferView"))
            content = bytes(self.gltf.view(document["bufferView"]))
            self.n_image_bytes += len(content)
            if self.n_image_bytes > self.gltf.n_bytes:  # otherwise, a small file could fill memory
                raise MeshError("broken glTF: the images in the file overlap")
        name = str(document.get("name") or f"image_{index}")
        kind = kind_of_image(content)
        ending = ENDING_OF_IMAGE.get(kind or "", "")
        name = name if name.lower().endswith(ending) else name + ending
        return TextureImage(name, None, content, None if kind else UNKNOWN)


@dataclass
class _SourceReader:
    """Replaces the textures of a material by indices into `images` and `samplers`."""

    reader: _Reader
    use: _Use  # texture coordinates of the color image, which other images must use, too
    images: list[TextureImage] = field(default_factory=list)
    samplers: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def reference(self, key: str, info: dict[str, Any]) -> dict[str, Any] | None:
        """Convert a texture reference; return None if its coordinates differ from the color's."""
        if _use_of(info) != self.use:
            self.left_out.append(f"{key}, whose texture coordinates differ from the color's,")
            return None
        image, sampler = self.reader.image_and_sampler(info["index"])
        self.images.append(image)
        self.samplers.append(json.dumps(sampler))
        new = {**info, "index": len(self.images) - 1}
        new.pop("texCoord", None)
        extensions = dict(new.pop("extensions", {}))
        extensions.pop(_TRANSFORM, None)
        return {**new, "extensions": extensions} if extensions else new


def _use_of(info: dict[str, Any]) -> _Use:
    extensions = info.get("extensions", {})
    transform = extensions.get(_TRANSFORM, {}) if isinstance(extensions, dict) else None
    if not isinstance(transform, dict):
        raise MeshError("broken glTF: extensions of a texture reference must be objects")
    offset = tuple(GltfScene.numbers(transform, "offset", [0.0, 0.0]).tolist())
    scale = tuple(GltfScene.numbers(transform, "scale", [1.0, 1.0]).tolist())
    rotation = transform.get("rotation", 0.0)
    if type(rotation) not in (int, float) or not np.isfinite(rotation):
        raise MeshError("broken glTF: the rotation of a texture must be a finite number")
    place = GltfScene.whole(transform, "texCoord", GltfScene.whole(info, "texCoord", 0))
    return _Use(place, offset, float(rotation), scale)
