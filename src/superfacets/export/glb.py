"""GLB with the region of each vertex, and a table of the regions.

Viewers show the colors. `EXT_mesh_features` gives each vertex the id of its region, and
`EXT_structural_metadata` a table with a row per id. Ids in glTF belong to vertices, so vertices are
duplicated where regions meet.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ..cells.region_adjacency import region_graph
from ..errors import MeshError
from ..mesh.faces import FaceMesh, cut_into_triangles
from .content import Content
from .text import fits_single

FLOAT, UNSIGNED_INT, UNSIGNED_BYTE = 5126, 5125, 5121
VERTICES, INDICES = 34962, 34963
"""Values of `target` in buffer views: vertex attributes, and vertex indices."""

MAX_BYTES = 2**32 - 1
"""Largest size of a file in bytes: a GLB stores its length in 32 bits."""

MAX_IDS = 2**24
"""Upper bound of the number of ids, including the id for no region: they are float32, which holds
every integer below."""

ALIGNMENT = 8
"""Alignment of buffer views, as required by tables of properties."""


def write_glb(file: IO[bytes], content: Content) -> None:
    """Write GLB. Polygons become triangles; unused vertices are left out.

    Coordinates are float32. If that is not exact, they are relative to the middle of the bounding
    box.
    """
    mesh, labels, colors = content.cells, content.labels, content.colors
    scene = _Scene()
    corners, key_of_corner, triangles = _split_vertices(mesh, labels, colors)
    primitive: dict[str, Any] = {
        "attributes": {"POSITION": scene.positions(mesh.vertices, corners)},
        "indices": scene.accessor(triangles.ravel().astype("<u4"), "SCALAR", INDICES),
    }
    if colors is not None:
        shades = np.full((len(corners), 4), 255, np.uint8)
        shades[:, :3] = colors[key_of_corner]
        primitive["attributes"]["COLOR_0"] = scene.accessor(shades, "VEC4", VERTICES)
    if labels is not None:
        names, ids = np.unique(labels, return_inverse=True)
        n_regions = len(names) - int(names[0] < 0)
        if len(names) > MAX_IDS:
            raise MeshError(
                f"GLB holds the ids of up to {MAX_IDS} regions, and there are {n_regions}: write"
                " .ply or .npy"
            )
        ids = np.where(labels < 0, n_regions, ids - int(names[0] < 0))
        ids_of_corners = ids[key_of_corner].astype("<f4")
        primitive["attributes"]["_FEATURE_ID_0"] = scene.accessor(
            ids_of_corners, "SCALAR", VERTICES
        )
        primitive["extensions"] = {
            "EXT_mesh_features": {"featureIds": [_feature_ids(n_regions, labels)]}
        }
        if n_regions:
            scene.add_table(_region_columns(mesh, labels, names[-n_regions:], ids), content.classes)
    scene.document["meshes"] = [{"primitives": [primitive]}]
    scene.write(file)


def _split_vertices(
    mesh: FaceMesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """For each vertex of the file, its vertex in the mesh and one of its faces; and the triangles.

    The faces around a vertex of the file have the same label and color.
    """
    triangles, sources = cut_into_triangles(mesh)
    keys = np.zeros(mesh.n_faces, np.int64)
    if labels is not None:
        keys = np.unique(labels, return_inverse=True)[1].astype(np.int64)
    if colors is not None:
        red, green, blue = colors.T.astype(np.int64)
        packed = keys << 24 | red << 16 | green << 8 | blue
        keys = np.unique(packed, return_inverse=True)[1].astype(np.int64)
    faces = np.arange(mesh.n_faces) if sources is None else sources
    pairs = (keys[faces][:, np.newaxis] * mesh.n_vertices + triangles).ravel()
    found, firsts, places = np.unique(pairs, return_index=True, return_inverse=True)
    return found % mesh.n_vertices, faces[firsts // 3], places.reshape(-1, 3)


def _feature_ids(n_regions: int, labels: npt.NDArray[np.int32]) -> dict[str, Any]:
    ids: dict[str, Any] = {"featureCount": max(n_regions, 1), "attribute": 0, "label": "region"}
    if n_regions:
        ids["propertyTable"] = 0
    if labels.min() < 0:
        ids["nullFeatureId"] = n_regions
    return ids


def _region_columns(
    mesh: FaceMesh,
    labels: npt.NDArray[np.int32],
    names: npt.NDArray[np.int32],
    ids: npt.NDArray[np.int64],
) -> dict[str, npt.NDArray[Any]]:
    """Label, area and mean normal (0 if undefined) of each region."""
    graph = region_graph(mesh, np.where(labels < 0, -1, ids))
    return {
        "label": names.astype("<i4"),
        "area": graph.areas.astype("<f4"),
        "normal": np.nan_to_num(graph.normals).astype("<f4"),
    }


_PROPERTIES = {
    "label": {"type": "SCALAR", "componentType": "INT32"},
    "area": {"type": "SCALAR", "componentType": "FLOAT32"},
    "normal": {"type": "VEC3", "componentType": "FLOAT32"},
    "class": {"type": "ENUM", "enumType": "region_class"},
}


def _enum_of(classes: Sequence[str]) -> tuple[dict[str, Any], npt.NDArray[Any]]:
    """The enumeration of class names, and the value of each region's class in it."""
    names, numbers = np.unique(np.array(classes, dtype=str), return_inverse=True)
    values = [{"name": name, "value": number} for number, name in enumerate(names.tolist())]
    return {"valueType": "UINT32", "values": values}, numbers.astype("<u4")


def _check_size(n_bytes: int) -> None:
    if n_bytes > MAX_BYTES:
        raise MeshError("the mesh is too large for GLB, which holds 4 GiB: write .ply or .obj")


@dataclass
class _Scene:
    """A growing document, and the parts of its single buffer."""

    document: dict[str, Any] = field(default_factory=dict)
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    parts: list[bytes] = field(default_factory=list)
    n_bytes: int = 0
    node: dict[str, Any] = field(default_factory=lambda: {"mesh": 0})

    def view(self, array: npt.NDArray[Any], target: int | None = None) -> int:
        """Append an array to the buffer, and return the index of its view."""
        _check_size(self.n_bytes + array.nbytes)
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": self.n_bytes, "byteLength": len(data)}
        self.views.append(view if target is None else {**view, "target": target})
        self.parts.append(data + bytes(-len(data) % ALIGNMENT))
        self.n_bytes += len(self.parts[-1])
        return len(self.views) - 1

    def accessor(self, array: npt.NDArray[Any], kind: str, target: int) -> int:
        """Append an array, and return the index of its accessor."""
        component = {"f4": FLOAT, "u4": UNSIGNED_INT, "u1": UNSIGNED_BYTE}[array.dtype.str[1:]]
        accessor: dict[str, Any] = {
            "bufferView": self.view(array, target),
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if component == UNSIGNED_BYTE:
            accessor["normalized"] = True
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def positions(self, vertices: npt.NDArray[np.float64], corners: npt.NDArray[np.int64]) -> int:
        """Append the positions of vertices, and return the index of their accessor."""
        points = vertices[corners]
        if not fits_single(points):
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            self.node["translation"] = middle.tolist()
            points = points - middle
        single = points.astype("<f4")
        place = self.accessor(single, "VEC3", VERTICES)
        self.accessors[place]["min"] = single.min(axis=0).tolist()
        self.accessors[place]["max"] = single.max(axis=0).tolist()
        return place

    def add_table(
        self, columns: dict[str, npt.NDArray[Any]], classes: Sequence[str] | None
    ) -> None:
        """Add the table of regions, one row each."""
        count = len(columns["label"])
        schema: dict[str, Any] = {"id": "superfacets"}
        if classes is not None:
            enum, columns["class"] = _enum_of(classes)
            schema["enums"] = {"region_class": enum}
        properties = {name: _PROPERTIES[name] for name in columns}
        schema["classes"] = {"region": {"properties": properties}}
        values = {name: {"values": self.view(column)} for name, column in columns.items()}
        table = {"class": "region", "count": count, "properties": values}
        self.document["extensions"] = {
            "EXT_structural_metadata": {"schema": schema, "propertyTables": [table]}
        }

    def write(self, file: IO[bytes]) -> None:
        """Write the header and the two chunks."""
        used = ["EXT_mesh_features"] if "extensions" in self._primitive else []
        used += sorted(self.document.get("extensions", {}))
        if used:
            self.document["extensionsUsed"] = used
        self.document |= {
            "asset": {"version": "2.0", "generator": "superfacets"},
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
        for part in self.parts:
            file.write(part)

    @property
    def _primitive(self) -> dict[str, Any]:
        primitive: dict[str, Any] = self.document["meshes"][0]["primitives"][0]
        return primitive
