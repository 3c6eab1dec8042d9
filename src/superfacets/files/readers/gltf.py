"""Read the triangles of a glTF scene, with one copy of a mesh for each node that refers to it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ...base.checks import MAX_CELLS, counted
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Floats
from ..guards import MAX_GROWTH, most_bytes_of, named_errors, rotation_of
from ..input import Input, Read
from .gltf_file import COMPONENTS, WIDTHS, Gltf

DRACO = "KHR_draco_mesh_compression"

TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 4, 5, 6

BYTES_PER_VERTEX, BYTES_PER_FACE = 24, 12


def read_gltf(source: Input) -> Read:
    """Read the default scene of a glTF file; other files must be in its folder or in subfolders."""
    scene = GltfScene.open(source.data, source.folder)
    vertices, faces = scene.read()
    texture = source.texture("gltf_texture", scene) if source.keep else None
    return source.mesh(vertices, faces, texture=texture)


class GltfScene(Gltf):
    """A glTF document, and the meshes of its default scene.

    The reader of textures gets it, to read materials, images and the corners of primitives.
    Without `folder`, `open` refuses files that refer to other files.
    """

    @cached_property
    def visits(self) -> list[tuple[int, Floats]]:
        """Return mesh index and global matrix of each node with a mesh, sorted by mesh.

        Nodes of one mesh are in depth-first order.
        """
        scene = self.item("scenes", self.document.get("scene", 0))
        stack = [(root, np.eye(4)) for root in reversed(_indices(scene, "nodes"))]
        seen: set[int] = set()
        visits = []
        while stack:
            index, above = stack.pop()
            node = self.item("nodes", index)
            if index in seen:
                raise MeshError(
                    f"broken glTF: nodes[{index}] has two parents or is its own ancestor"
                )
            seen.add(index)
            # Unlike `@`, this product adds in the same order on all machines. `Mesh` refuses
            # infinite coordinates.
            with np.errstate(over="ignore", invalid="ignore"):
                matrix = (above[:, :, np.newaxis] * _local_matrix(node)).sum(axis=1)
            if "mesh" in node:
                self.item("meshes", node["mesh"])
                visits.append((node["mesh"], matrix))
            stack.extend((child, matrix) for child in reversed(_indices(node, "children")))
        return sorted(visits, key=lambda visit: visit[0])

    def read(self) -> tuple[Floats, Array]:
        """Return vertices and faces: meshes in the order of the file, each for every node.

        Primitives of one mesh that use the same positions share vertices. Lines and points are
        skipped.
        """
        visits = self.visits
        shown = sorted({index for index, _ in visits})
        sizes = {index: self._mesh_size(index) for index in shown}
        self._check_size([sizes[index] for index, _ in visits])
        meshes = {index: self._read_mesh(index) for index in shown}
        parts = [_place(*meshes[index], matrix) for index, matrix in visits]
        ends = np.cumsum([len(positions) for positions, _ in parts]).tolist()
        faces = [_shifted(part, first) for (_, part), first in zip(parts, [0, *ends], strict=False)]
        return _concatenated([positions for positions, _ in parts]), _concatenated(faces)

    def primitives(self, index: int) -> list[dict[str, Any]]:
        """Return the triangle primitives of a mesh; raise a MeshError for strips and fans."""
        primitives = self.items(self.item("meshes", index), "primitives")
        found = [primitive for primitive in primitives if _has_triangles(primitive)]
        for primitive in found:
            self._unpack_draco(primitive, index)
        return found

    def corners(self, primitive: dict[str, Any], n_vertices: int) -> Array:
        """Return the vertex of each corner, (3F,); 0, 1, 2, ... if the primitive has no indices."""
        if "indices" in primitive:
            stored = self.rows(primitive["indices"], "SCALAR")
            if stored.dtype.kind != "u":
                raise MeshError("broken glTF: vertex indices must be unsigned integers")
            fits = stored.max(initial=0) <= MAX_CELLS
            corners = stored.astype(np.int32 if fits else np.int64, copy=False)
        else:
            corners = np.arange(n_vertices)
        if len(corners) % 3:
            raise MeshError(f"broken glTF: a multiple of 3 corners is expected, got {len(corners)}")
        if len(corners) and corners.max() >= n_vertices:
            raise MeshError(
                f"a face refers to vertex {corners.max()}, but its primitive has"
                f" {counted(n_vertices, 'vertex')}"
            )
        return corners

    @staticmethod
    def positions_of(primitive: dict[str, Any], index: int) -> int:
        """Return the accessor index of the positions of a primitive of mesh `index`."""
        attributes = primitive.get("attributes")
        accessor = attributes.get("POSITION") if isinstance(attributes, dict) else None
        if type(accessor) is not int:
            raise MeshError(f"broken glTF: meshes[{index}] has a primitive without positions")
        return accessor

    @staticmethod
    def is_mirrored(matrix: Floats) -> bool:
        """Return whether a matrix turns a surface inside out: its determinant is negative."""
        axes = matrix[:3, :3]
        with np.errstate(over="ignore", invalid="ignore"):
            return float((np.cross(axes[0], axes[1]) * axes[2]).sum()) < 0

    def _mesh_size(self, index: int) -> tuple[int, int]:
        """Return the numbers of vertices and faces of a mesh, without copying arrays."""
        n_vertices = {}  # keyed by the accessor of the positions
        n_corners = 0
        for primitive in self.primitives(index):
            accessor = self.positions_of(primitive, index)
            n_vertices[accessor] = n_own = len(self.rows(accessor, "VEC3"))
            indices = primitive.get("indices")
            has_indices = "indices" in primitive
            n_corners += len(self.rows(indices, "SCALAR")) if has_indices else n_own
        return sum(n_vertices.values()), -(-n_corners // 3)

    def _check_size(self, sizes: list[tuple[int, int]]) -> None:
        """Raise a MeshError if there are no triangles, too many, or too many for the file size."""
        n_vertices, n_faces = (sum(size[i] for size in sizes) for i in range(2))
        if n_faces == 0:
            raise MeshError("the default scene of the glTF file has no triangles")
        if max(n_faces, n_vertices) > MAX_CELLS:
            raise MeshError(
                f"the scene has {n_faces} faces and {n_vertices} vertices;"
                f" at most {MAX_CELLS} are supported"
            )
        n_bytes = BYTES_PER_VERTEX * n_vertices + BYTES_PER_FACE * n_faces
        if n_bytes > most_bytes_of(self.n_bytes):
            raise MeshError(
                f"with all copies of meshes, the scene has {n_faces} faces, which need"
                f" {n_bytes // self.n_bytes} times the size of the files; at most {MAX_GROWTH}"
                " times is allowed: save the scene without copies"
            )

    def _read_mesh(self, index: int) -> tuple[Floats, Array]:
        positions: dict[int, Floats] = {}  # keyed by accessor, in order of first use
        first_vertices: dict[int, int] = {}
        faces: list[Array] = []
        n_vertices = 0
        for primitive in self.primitives(index):
            accessor = self.positions_of(primitive, index)
            if accessor not in positions:
                first_vertices[accessor] = n_vertices
                positions[accessor] = self.doubles(accessor, "VEC3")
                n_vertices += len(positions[accessor])
            corners = self.corners(primitive, len(positions[accessor]))
            faces.append(_shifted(corners.reshape(-1, 3), first_vertices[accessor]))
        if not faces:
            return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        return _concatenated(list(positions.values())), _concatenated(faces)

    def _unpack_draco(self, primitive: dict[str, Any], mesh: int) -> None:
        """Decode a primitive that is stored only as Draco data, so that `rows` can read it."""
        extensions = primitive.get("extensions")
        packed = extensions.get(DRACO) if isinstance(extensions, dict) else None
        if not isinstance(packed, dict):
            return
        positions = self.positions_of(primitive, mesh)
        if "bufferView" in self.item("accessors", positions):
            return
        view, ids = self.whole(packed, "bufferView"), packed.get("attributes")
        if self.unpacked.get(positions, (-1,))[0] == view:
            return
        if not isinstance(ids, dict) or "indices" not in primitive:
            raise MeshError(f"broken glTF: meshes[{mesh}] has damaged Draco data")
        n_vertices = self.whole(self.item("accessors", positions), "count")
        n_corners = self.whole(self.item("accessors", primitive["indices"]), "count")
        self.take(
            BYTES_PER_VERTEX * n_vertices + BYTES_PER_FACE * (n_corners // 3), f"meshes[{mesh}]"
        )
        with named_errors(f"meshes[{mesh}]"):
            content = bytes(self.view(view))
            decode_draco = load("superfacets_formats.compression:decode_draco")
            corners, attributes = decode_draco(content, n_corners // 3, n_vertices)
            self._keep_rows(primitive["indices"], view, corners, of_any_type=True)
            for name in ids:
                if name in primitive["attributes"] and name.startswith(("POSITION", "TEXCOORD")):
                    rows = attributes.get(self.whole(ids, name))
                    self._keep_rows(primitive["attributes"][name], view, rows)

    def _keep_rows(
        self, index: int, view: int, rows: Array | None, *, of_any_type: bool = False
    ) -> None:
        """Store decoded rows for an accessor, and check that they have the type of the accessor."""
        accessor = self.item("accessors", index)
        dtype = COMPONENTS.get(self.whole(accessor, "componentType"))
        width = WIDTHS.get(str(accessor.get("type")))
        is_fitting = rows is not None and (1 if rows.ndim == 1 else rows.shape[1]) == width
        if rows is None or not is_fitting or not (of_any_type or rows.dtype == dtype):
            raise MeshError(
                f"the Draco data has no rows of the type that accessors[{index}] declares"
            )
        if self.unpacked.get(index, (view,))[0] != view:
            raise MeshError(
                f"accessors[{index}] is used by two Draco meshes, which is not supported"
            )
        self.unpacked[index] = view, rows


def _shifted(faces: Array, first_vertex: int) -> Array:
    return faces + np.int64(first_vertex) if first_vertex else faces


def _concatenated(parts: list[Array]) -> Array:
    """Concatenate arrays; a single array is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _indices(item: dict[str, Any], key: str) -> list[Any]:
    values = item.get(key, [])
    if not isinstance(values, list):
        raise MeshError(f"broken glTF: {key} is not a list")
    return values


def _local_matrix(node: dict[str, Any]) -> Floats:
    """Return the matrix of a node, or compute it from translation, rotation and scale."""
    if "matrix" in node:
        return Gltf.numbers(node, "matrix", [0.0] * 16).reshape(4, 4).T
    matrix = np.eye(4)
    scale = Gltf.numbers(node, "scale", [1.0] * 3)
    rotation = rotation_of(np.roll(Gltf.numbers(node, "rotation", [0.0, 0.0, 0.0, 1.0]), 1))
    if rotation is None:
        raise MeshError("broken glTF: the rotation of a node is the zero quaternion")
    matrix[:3, :3] = rotation * scale
    matrix[:3, 3] = Gltf.numbers(node, "translation", [0.0] * 3)
    return matrix


def _has_triangles(primitive: dict[str, Any]) -> bool:
    mode = Gltf.whole(primitive, "mode", TRIANGLES)
    if mode in (TRIANGLE_STRIP, TRIANGLE_FAN):
        raise MeshError("triangle strips and fans are not supported: save the file with triangles")
    return mode == TRIANGLES


def _place(positions: Floats, faces: Array, matrix: Floats) -> tuple[Floats, Array]:
    """Transform a mesh. After a reflection, reverse faces, so that they are not inside out."""
    if np.array_equal(matrix, np.eye(4)):
        return positions, faces
    with np.errstate(over="ignore", invalid="ignore"):  # `Mesh` refuses infinite coordinates
        moved = (positions[:, np.newaxis, :] * matrix[:3, :3]).sum(axis=2) + matrix[:3, 3]
    return moved, faces[:, [0, 2, 1]] if GltfScene.is_mirrored(matrix) else faces
