"""Write materials and images to a glTF document."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from .images import TextureImage, import_pillow, kind_of_image
from .textures import Material, with_textures


class GltfMaterials:
    """Materials and images to write to a glTF document. Each image is embedded once."""

    def __init__(self, add_view: Any) -> None:
        self.add_view = add_view  # function that stores an array and returns its buffer view index
        self.lists: dict[str, list[dict[str, Any]]] = {
            name: [] for name in ("images", "samplers", "textures", "materials")
        }
        self.extensions: set[str] = set()
        self._image_of: dict[TextureImage, int] = {}
        self._texture_of: dict[tuple[TextureImage, str], int] = {}

    def add(self, material: Material) -> int:
        """Add a material, and return its index."""
        source = material.source
        if source is not None and source.format == "gltf":
            pairs = list(zip(source.images, source.samplers, strict=True))

            def reference(_: str, info: dict[str, Any]) -> dict[str, Any] | None:
                image, sampler = pairs[info["index"]]
                if image.problem is not None:
                    return None
                return {**info, "index": self._texture(image, sampler)}

            document = with_textures(json.loads(source.text), reference)
            self._find_extensions(document)
        else:
            document = self._plain(material)
        self.lists["materials"].append(document)
        return len(self.lists["materials"]) - 1

    def _plain(self, material: Material) -> dict[str, Any]:
        """Return a non-metallic glTF material with the color and the image of `material`."""
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

    def _find_extensions(self, value: Any) -> None:
        nested = value if isinstance(value, list) else []
        if isinstance(value, dict):
            nested = list(value.values())
            if isinstance(value.get("extensions"), dict):
                self.extensions |= {*value["extensions"]}
        for each in nested:
            self._find_extensions(each)

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
        """Return a glTF texture that refers to an image; WebP and KTX2 need an extension."""
        kind = self.lists["images"][image]["mimeType"]
        name = {"image/webp": "EXT_texture_webp", "image/ktx2": "KHR_texture_basisu"}.get(kind)
        if name is None:
            return {"source": image}
        self.extensions.add(name)
        return {"extensions": {name: {"source": image}}}

    def _image(self, image: TextureImage) -> int:
        """Embed an image, converted to PNG if glTF does not support its format."""
        if image not in self._image_of:
            content = image.encoded()
            kind = kind_of_image(content)
            if kind in ("bmp", "tga", "tiff"):
                file = io.BytesIO()
                import_pillow("Image").fromarray(image.pixels()).save(file, "png")
                content, kind = file.getvalue(), "png"
            view = self.add_view(np.frombuffer(content, np.uint8))
            document = {"bufferView": view, "mimeType": f"image/{kind}", "name": image.name}
            self.lists["images"].append(document)
            self._image_of[image] = len(self.lists["images"]) - 1
        return self._image_of[image]
