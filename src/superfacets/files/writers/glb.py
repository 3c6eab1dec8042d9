"""Write GLB files with textures, the region id of each vertex, and a table of the regions.

The extension `EXT_mesh_features` stores the region id of each vertex, and `EXT_structural_metadata`
stores a table with one row per id. Ids in glTF belong to vertices, so vertices on the borders of
regions are duplicated. Viewers that do not support these extensions show only the colors.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Bools, Bytes, Floats, Ints, Longs
from ...mesh.faces import FaceMesh, corner_triangles, corners_of
from ...regions.region_graph import region_graph
from ..attributes import GENERATOR
from .content import Output
from .text import finite_singles, fits_single

if TYPE_CHECKING:
    from ... import Texture

FLOAT, UNSIGNED_INT = 5126, 5125
VERTICES, INDICES = 34962, 34963
"""Values of `target` in a buffer view: the view stores vertex attributes, or vertex indices."""

MAX_BYTES = 2**32 - 1
"""Maximum file size in bytes, because GLB stores the size in 32 bits."""

MAX_IDS = 2**24
"""Maximum number of ids, including the id for no region. Ids are stored as float32, which
represents all integers up to 2**24 exactly."""

_SRGB = np.arange(256) / 255
_LINEAR = np.where(_SRGB <= 0.04045, _SRGB / 12.92, ((_SRGB + 0.055) / 1.055) ** 2.4).astype("<f4")
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
        materials = load("superfacets_textures.gltf_materials:GltfMaterials")(scene.view)
        primitives = []
        of_triangles = texture.face_materials[split.faces]
        for number in np.unique(of_triangles).tolist():
            part = split.part(of_triangles == number)
            primitive = _add_primitive(scene, part, content, regions)
            if number >= 0:
                primitive["material"] = materials.add(texture.materials[number])
            primitives.append(primitive)
        scene.document |= {name: found for name, found in materials.lists.items() if found}
        scene.used |= materials.extensions
    if regions is not None and regions.count:
        assert labels is not None
        graph = region_graph(mesh, np.where(labels < 0, -1, regions.ids))
        columns = {
            "label": regions.names[-regions.count :].astype("<i4"),
            "area": graph.areas.astype("<f4"),
            "normal": np.nan_to_num(graph.normals).astype("<f4"),  # undefined normals are 0
        }
        scene.add_table(columns, content.classes)
    scene.document["meshes"] = [{"primitives": primitives}]
    scene.write(file)


@dataclass(frozen=True, eq=False)
class _Regions:
    names: Ints  # distinct labels, ascending; may include -1
    ids: Longs  # region id of each face; `count` for faces with label -1
    count: int  # number of regions, not counting label -1

    @classmethod
    def of(cls, labels: Ints) -> _Regions:
        names, ids = np.unique(labels, return_inverse=True)
        n_regions = len(names) - int(names[0] < 0)
        if len(names) > MAX_IDS:
            raise MeshError(
                f"GLB can store at most {MAX_IDS} ids, but there are {len(names)} regions (faces"
                " without a region count as one): write .ply or .npy instead"
            )
        return cls(names, np.where(labels < 0, n_regions, ids - int(names[0] < 0)), n_regions)


def _add_primitive(
    scene: _Scene, split: _Split, content: Output, regions: _Regions | None
) -> dict[str, Any]:
    """Append the arrays of the triangles in `split` to the scene; return their glTF primitive."""
    attributes = {"POSITION": scene.positions(content.cells.vertices, split.vertices)}
    indices = scene.accessor(split.triangles.ravel().astype("<u4"), "SCALAR", INDICES)
    primitive: dict[str, Any] = {"attributes": attributes, "indices": indices}
    if content.texture is not None and np.any(split.pairs >= 0):
        given = content.texture.coordinates[np.maximum(split.pairs, 0)]
        pairs = np.where(split.pairs[:, np.newaxis] >= 0, given, 0.0)
        pairs = finite_singles(np.stack([pairs[:, 0], 1.0 - pairs[:, 1]], axis=1))
        attributes["TEXCOORD_0"] = scene.accessor(pairs, "VEC2", VERTICES)
    if (colors := content.colors) is not None:
        shades = _LINEAR[colors[split.face_of_vertex]]
        attributes["COLOR_0"] = scene.accessor(shades, "VEC3", VERTICES)
    elif (own := content.stored_colors("vertex")) is not None:
        attributes["COLOR_0"] = scene.accessor(_LINEAR[own[split.vertices]], "VEC3", VERTICES)
    if regions is not None:
        assert content.labels is not None
        ids = regions.ids[split.face_of_vertex].astype("<f4")
        attributes["_FEATURE_ID_0"] = scene.accessor(ids, "SCALAR", VERTICES)
        of_ids = {"featureCount": max(regions.count, 1), "attribute": 0, "label": "region"}
        if regions.count:
            of_ids["propertyTable"] = 0
        if content.labels.min() < 0:
            of_ids["nullFeatureId"] = regions.count
        primitive["extensions"] = {"EXT_mesh_features": {"featureIds": [of_ids]}}
        scene.used.add("EXT_mesh_features")
    return primitive


@dataclass(frozen=True, eq=False)
class _Split:
    """Vertices and triangles to write. Each vertex has a single label, color and material."""

    vertices: Longs  # mesh vertex of each written vertex
    face_of_vertex: Longs  # one of the mesh faces at each written vertex
    pairs: Longs  # row of each vertex in `Texture.coordinates`; -1 for no row
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
    places, sources = corner_triangles(mesh)
    keys = np.zeros(mesh.n_faces, np.int64) if labels is None else _numbered(labels)
    if colors is not None:
        red, green, blue = colors.T.astype(np.int64)
        keys = _numbered(keys << 24 | red << 16 | green << 8 | blue)
    if texture is not None:
        keys = _numbered(keys * (len(texture.materials) + 1) + texture.face_materials + 1)
    faces = np.arange(mesh.n_faces) if sources is None else sources
    vertices = corners_of(mesh).vertices[places]
    corners = (keys[faces][:, np.newaxis] * mesh.n_vertices + vertices).ravel()
    pairs = np.full(len(corners), -1)
    if texture is not None:
        pairs = texture.corners[places].ravel().astype(np.int64)
        corners = _numbered(corners) * (len(texture.coordinates) + 1) + pairs + 1
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
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    parts: list[bytes] = field(default_factory=list)  # content of each buffer view, with padding
    n_bytes: int = 0  # size of the buffer, in bytes
    node: dict[str, Any] = field(default_factory=lambda: {"mesh": 0})
    used: set[str] = field(default_factory=set)  # names of the extensions in use
    middle: Floats | None = None  # origin of positions; None means (0, 0, 0)

    def view(self, array: Array, target: int | None = None) -> int:
        """Append an array to the buffer, and return the index of its buffer view."""
        _check_size(self.n_bytes + array.nbytes)
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": self.n_bytes, "byteLength": len(data)}
        self.views.append(view if target is None else {**view, "target": target})
        self.parts.append(data + bytes(-len(data) % ALIGNMENT))
        self.n_bytes += len(self.parts[-1])
        return len(self.views) - 1

    def accessor(self, array: Array, kind: str, target: int) -> int:
        """Append an array, and return the index of its accessor."""
        component = {"f4": FLOAT, "u4": UNSIGNED_INT}[array.dtype.str[1:]]
        view = self.view(array, target)
        accessor = {"bufferView": view, "componentType": component, "count": len(array)}
        self.accessors.append({**accessor, "type": kind})
        return len(self.accessors) - 1

    def place(self, points: Floats) -> None:
        """Move the origin to the center of the points if float32 cannot represent them exactly."""
        if not fits_single(points):
            self.middle = (points.min(axis=0) + points.max(axis=0)) / 2
            self.node["translation"] = self.middle.tolist()

    def positions(self, vertices: Floats, corners: Longs) -> int:
        """Append the positions of vertices, and return the index of their accessor."""
        points = vertices[corners]
        if self.middle is not None:
            points = points - self.middle
        single = points.astype("<f4")
        place = self.accessor(single, "VEC3", VERTICES)
        self.accessors[place]["min"] = single.min(axis=0).tolist()
        self.accessors[place]["max"] = single.max(axis=0).tolist()
        return place

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
        used = sorted({*self.used, *self.document.get("extensions", {})})
        if used:
            self.document["extensionsUsed"] = used
        self.document |= {
            "asset": {"version": "2.0", "generator": GENERATOR},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [self.node],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.n_bytes}],
        }
        text = json.dumps(self.document, separators=(",", ":")).encode("ascii")
        text += b" " * (-(12 + 8 + len(text)) % ALIGNMENT)  # aligns the start of the buffer
        size = 12 + 8 + len(text) + 8 + self.n_bytes
        _check_size(size)
        file.write(struct.pack("<4s2I", b"glTF", 2, size))
        file.write(struct.pack("<2I", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<2I", self.n_bytes, 0x004E4942))
        file.writelines(self.parts)
