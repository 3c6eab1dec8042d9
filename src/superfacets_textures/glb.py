"""Write GLB files with textures, the region id of each vertex, and a table of the regions.

Ids are in the extension `EXT_mesh_features`, and the table, with one row per id, is in
`EXT_structural_metadata`. Vertices on the borders of regions are duplicated.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import IO, Any, NamedTuple

import numpy as np

from superfacets import MeshError, kit, region_graph
from superfacets.kit import Array, Bools, Bytes, FaceMesh, Floats, Ints, Longs, Output

from .images import TextureImage, import_pillow, kind_of_image
from .light import linear_of_srgb
from .textures import Material, Texture, with_textures
from .writing import finite_singles

VERTICES, INDICES = 34962, 34963
"""Values of `target` in a buffer view: the view stores vertex attributes, or vertex indices."""

MAX_BYTES = 2**32 - 1
"""Maximum file size in bytes, because GLB stores the size in 32 bits."""

MAX_IDS = 2**24
"""Maximum number of ids, including the id for no region. Ids are stored as float32, which
represents all integers up to 2**24 exactly."""

_LINEAR = linear_of_srgb(np.arange(256) / 255).astype("<f4")
"""Intensity of linear light, 0 to 1, for each byte of sRGB; colors in glTF are linear."""

ALIGNMENT = 8
"""Alignment of buffer views in bytes, which property tables require."""


def write_glb(file: IO[bytes], content: Output) -> None:
    """Write GLB, with triangles instead of polygons, and one primitive per material.

    The origin is moved to the center of the bounding box if float32 cannot represent coordinates.
    """
    mesh, labels, texture = content.cells, content.labels, content.texture
    scene = _Scene()
    split = _split_vertices(mesh, labels, content.colors, texture)
    scene.place(mesh.vertices[split.vertices])
    regions = None if labels is None else _Regions.of(labels)
    if texture is None:
        primitives = [_add_primitive(scene, split, content, regions)]
    else:
        content.taken.add("texture")
        materials = _Materials(scene)
        primitives = []
        of_triangles = texture.face_materials[split.faces]
        for number in np.unique(of_triangles).tolist():
            part = split.part(of_triangles == number)
            primitive = _add_primitive(scene, part, content, regions)
            if number >= 0:
                primitive["material"] = materials.add(texture.materials[number])
            primitives.append(primitive)
    if regions is not None and len(regions.names):
        graph = region_graph(mesh, regions.ids)
        columns = {
            "label": regions.names.astype("<i4"),
            "area": graph.areas.astype("<f4"),
            "normal": np.nan_to_num(graph.normals).astype("<f4"),  # undefined normals are 0
        }
        scene.add_table(columns, content.classes)
    scene.document["meshes"] = [{"primitives": primitives}]
    scene.write(file)


class _Regions(NamedTuple):
    ids: Ints  # region id of each face, or -1
    names: Array  # label of each region, in ascending order

    @classmethod
    def of(cls, labels: Ints) -> _Regions:
        ids, names = kit.ranked_labels(labels)
        n_ids = len(names) + int(ids.min() < 0)
        if n_ids > MAX_IDS:
            raise MeshError(
                f"GLB can store at most {MAX_IDS} ids, but there are {n_ids} regions (faces"
                " without a region count as one): write .ply or .npy instead"
            )
        return cls(ids, names)


def _add_primitive(
    scene: _Scene, split: _Split, content: Output, regions: _Regions | None
) -> dict[str, Any]:
    """Append the arrays of the triangles in `split` to the scene; return their glTF primitive."""
    attributes = {"POSITION": scene.positions(content.cells.vertices, split.vertices)}
    indices = scene.accessor(split.triangles.ravel().astype("<u4"), "SCALAR", INDICES)
    primitive: dict[str, Any] = {"attributes": attributes, "indices": indices}
    if content.texture is not None and np.any(split.pairs >= 0):
        given = content.texture.shared.coordinates[np.maximum(split.pairs, 0)]
        pairs = np.where(split.pairs[:, np.newaxis] >= 0, given, 0.0)
        pairs = finite_singles(np.stack([pairs[:, 0], 1.0 - pairs[:, 1]], axis=1))
        attributes["TEXCOORD_0"] = scene.accessor(pairs, "VEC2", VERTICES)
    if (colors := content.colors) is not None:
        shades = _LINEAR[colors[split.face_of_vertex]]
        attributes["COLOR_0"] = scene.accessor(shades, "VEC3", VERTICES)
        for owner in ("vertex", "face"):
            content.replace(owner, dict.fromkeys(("red", "green", "blue"), -1))
    elif (own := content.stored_colors("vertex")) is not None:
        attributes["COLOR_0"] = scene.accessor(_LINEAR[own[split.vertices]], "VEC3", VERTICES)
    if regions is not None:
        n_regions, ids = len(regions.names), regions.ids[split.face_of_vertex]
        stored = np.where(ids < 0, n_regions, ids).astype("<f4")
        attributes["_FEATURE_ID_0"] = scene.accessor(stored, "SCALAR", VERTICES)
        of_ids = {"featureCount": max(n_regions, 1), "attribute": 0, "label": "region"}
        if n_regions:
            of_ids["propertyTable"] = 0
        if regions.ids.min() < 0:
            of_ids["nullFeatureId"] = n_regions
        primitive["extensions"] = {"EXT_mesh_features": {"featureIds": [of_ids]}}
        scene.used.add("EXT_mesh_features")
    return primitive


@dataclass(frozen=True, eq=False)
class _Split:
    """Vertices and triangles to write. Each vertex has a single label, color and material."""

    vertices: Longs  # mesh vertex of each written vertex
    face_of_vertex: Longs  # one of the mesh faces at each written vertex
    pairs: Longs  # row of each vertex in `Texture.shared.coordinates`; -1: no row
    triangles: Longs  # (T, 3) indices of written vertices
    faces: Array  # mesh face of each triangle

    def part(self, is_here: Bools) -> _Split:
        """Return the triangles where `is_here` is true, with their vertices."""
        used, triangles = np.unique(self.triangles[is_here], return_inverse=True)
        return _Split(
            self.vertices[used], self.face_of_vertex[used], self.pairs[used],
            triangles.reshape(-1, 3), self.faces[is_here],
        )  # fmt: skip


def _split_vertices(
    mesh: FaceMesh, labels: Ints | None, colors: Bytes | None, texture: Texture | None
) -> _Split:
    """Duplicate vertices where faces differ in label, color, material or texture coordinates."""
    places, sources = kit.corner_triangles(mesh)
    keys = np.zeros(mesh.n_faces, np.int64) if labels is None else _numbered(labels)
    if colors is not None:
        red, green, blue = colors.T.astype(np.int64)
        keys = _numbered(keys << 24 | red << 16 | green << 8 | blue)
    if texture is not None:
        keys = _numbered(keys * (len(texture.materials) + 1) + texture.face_materials + 1)
    faces = np.arange(mesh.n_faces) if sources is None else sources
    vertices = kit.corners_of(mesh).vertices[places]
    corners = (keys[faces][:, np.newaxis] * mesh.n_vertices + vertices).ravel()
    pairs = np.full(len(corners), -1)
    if texture is not None:
        pairs = texture.shared.corners[places].ravel().astype(np.int64)
        corners = _numbered(corners) * (len(texture.shared.coordinates) + 1) + pairs + 1
    _, firsts, numbers = np.unique(corners, return_index=True, return_inverse=True)
    used = vertices.ravel()[firsts].astype(np.int64)
    return _Split(used, faces[firsts // 3], pairs[firsts], numbers.reshape(-1, 3), faces)


def _numbered(keys: Array) -> Longs:
    """Replace distinct keys by 0, 1, 2, ... in ascending order."""
    return np.unique(keys, return_inverse=True)[1].astype(np.int64)


_PROPERTIES = {
    "label": {"type": "SCALAR", "componentType": "INT32"},
    "area": {"type": "SCALAR", "componentType": "FLOAT32"},
    "normal": {"type": "VEC3", "componentType": "FLOAT32"},
    "class": {"type": "ENUM", "enumType": "region_class"},
}


def _check_size(n_bytes: int) -> None:
    if n_bytes > MAX_BYTES:
        raise MeshError("the mesh needs more than 4 GiB, the limit of GLB: write .ply or .obj")


@dataclass
class _Scene:
    """A glTF document with one buffer, to which arrays are appended."""

    document: dict[str, Any] = field(default_factory=dict)
    parts: list[bytes] = field(default_factory=list)  # content of each buffer view, with padding
    n_bytes: int = 0  # size of the buffer, in bytes
    node: dict[str, Any] = field(default_factory=lambda: {"mesh": 0})
    used: set[str] = field(default_factory=set)  # names of the extensions in use
    middle: Floats = field(default_factory=lambda: np.zeros(3))  # origin of positions

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Append an item to a list of the document, and return its index."""
        items = self.document.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def view(self, array: Array, target: int | None = None) -> int:
        """Append an array to the buffer, and return the index of its buffer view."""
        _check_size(self.n_bytes + array.nbytes)
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": self.n_bytes, "byteLength": len(data)}
        self.parts.append(data + bytes(-len(data) % ALIGNMENT))
        self.n_bytes += len(self.parts[-1])
        return self.add("bufferViews", view if target is None else {**view, "target": target})

    def accessor(self, array: Array, kind: str, target: int, **more: Any) -> int:
        """Append an array, and return the index of its accessor."""
        component = {"f4": 5126, "u4": 5125}[array.dtype.str[1:]]
        view = self.view(array, target)
        found = {"bufferView": view, "componentType": component, "count": len(array)}
        return self.add("accessors", {**found, "type": kind, **more})

    def place(self, points: Floats) -> None:
        """Move the origin to the center of the points if float32 cannot represent them exactly."""
        with np.errstate(over="ignore"):  # overflow gives infinity, which differs from the value
            is_exact = np.array_equal(points.astype(np.float32), points)
        if not is_exact:
            self.middle = (points.min(axis=0) + points.max(axis=0)) / 2
            self.node["translation"] = self.middle.tolist()

    def positions(self, vertices: Floats, corners: Longs) -> int:
        """Append the positions of vertices, and return the index of their accessor."""
        points = (vertices[corners] - self.middle).astype("<f4")
        box = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        return self.accessor(points, "VEC3", VERTICES, **box)

    def add_table(self, columns: dict[str, Array], classes: Sequence[str] | None) -> None:
        """Add a property table with one row per region, and with a column of classes if given."""
        count = len(columns["label"])
        schema: dict[str, Any] = {"id": "superfacets"}
        if classes is not None:
            names, numbers = np.unique(np.array(classes, dtype=str), return_inverse=True)
            values = [{"name": name, "value": number} for number, name in enumerate(names.tolist())]
            schema["enums"] = {"region_class": {"valueType": "UINT32", "values": values}}
            columns["class"] = numbers.astype("<u4")
        properties = {name: _PROPERTIES[name] for name in columns}
        schema["classes"] = {"region": {"properties": properties}}
        views = {name: {"values": self.view(column)} for name, column in columns.items()}
        table = {"class": "region", "count": count, "properties": views}
        self.document["extensions"] = {
            "EXT_structural_metadata": {"schema": schema, "propertyTables": [table]}
        }

    def write(self, file: IO[bytes]) -> None:
        """Write the GLB header, the JSON chunk and the binary chunk."""
        if used := sorted({*self.used, *self.document.get("extensions", {})}):
            self.document["extensionsUsed"] = used
        self.document |= {
            "asset": {"version": "2.0", "generator": "superfacets"}, "scene": 0,
            "scenes": [{"nodes": [0]}], "nodes": [self.node],
            "buffers": [{"byteLength": self.n_bytes}],
        }  # fmt: skip
        text = json.dumps(self.document, separators=(",", ":")).encode("ascii")
        text += b" " * (-(12 + 8 + len(text)) % ALIGNMENT)  # aligns the start of the buffer
        size = 12 + 8 + len(text) + 8 + self.n_bytes
        _check_size(size)
        file.write(struct.pack("<4s2I", b"glTF", 2, size))
        file.write(struct.pack("<2I", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<2I", self.n_bytes, 0x004E4942))
        file.writelines(self.parts)


@dataclass
class _Materials:
    """Adds materials and images to a glTF document. Each image is embedded once."""

    scene: _Scene
    image_of: dict[TextureImage, int] = field(default_factory=dict)
    texture_of: dict[tuple[TextureImage, str], int] = field(default_factory=dict)

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
        return self.scene.add("materials", document)

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
        if isinstance(value, dict):
            if isinstance(value.get("extensions"), dict):
                self.scene.used |= {*value["extensions"]}
            value = [*value.values()]
        for each in value if isinstance(value, list) else ():
            self._find_extensions(each)

    def _texture(self, image: TextureImage, sampler: str) -> int:
        key = image, sampler
        if key not in self.texture_of:
            texture = self._reference(self._image(image))
            options = json.loads(sampler)
            if options:
                samplers = self.scene.document.setdefault("samplers", [])
                if options not in samplers:
                    samplers.append(options)
                texture["sampler"] = samplers.index(options)
            self.texture_of[key] = self.scene.add("textures", texture)
        return self.texture_of[key]

    def _reference(self, image: int) -> dict[str, Any]:
        """Return a glTF texture that refers to an image; WebP and KTX2 need an extension."""
        kind = self.scene.document["images"][image]["mimeType"]
        name = {"image/webp": "EXT_texture_webp", "image/ktx2": "KHR_texture_basisu"}.get(kind)
        if name is None:
            return {"source": image}
        self.scene.used.add(name)
        return {"extensions": {name: {"source": image}}}

    def _image(self, image: TextureImage) -> int:
        """Embed an image, converted to PNG if glTF does not support its format."""
        if image not in self.image_of:
            content = image.encoded()
            kind = kind_of_image(content)
            if kind in ("bmp", "tga", "tiff"):
                file = io.BytesIO()
                import_pillow("Image").fromarray(image.pixels()).save(file, "png")
                content, kind = file.getvalue(), "png"
            view = self.scene.view(np.frombuffer(content, np.uint8))
            document = {"bufferView": view, "mimeType": f"image/{kind}", "name": image.name}
            self.image_of[image] = self.scene.add("images", document)
        return self.image_of[image]
