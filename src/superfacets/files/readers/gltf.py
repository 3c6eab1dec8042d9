"""Read the triangles of a glTF scene, with one copy of a mesh for each node that refers to it."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ...base.arrays import rotation_of
from ...base.checks import MAX_CELLS, counted
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Floats
from ...mesh.attributes import COLORS
from ..input import Input, Read
from .gltf_file import GEOMETRY, SUPPORTED, Gltf

DRACO = "KHR_draco_mesh_compression"

INSTANCES = "EXT_mesh_gpu_instancing"

POINTS, TRIANGLES, TRIANGLE_FAN = 0, 4, 6
_MODES = ("points", "lines", "line loops", "line strips", "triangles", "triangle strips",
          "triangle fans")  # fmt: skip
_FACES = range(TRIANGLES, TRIANGLE_FAN + 1)
_SKINNED = {f"JOINTS_{i}": f"WEIGHTS_{i}" for i in range(8)}  # 4 joints of a vertex in each

_DERIVED = ("label", "area", "normal")
"""Columns of property tables that `write_glb` writes, and that are read or computed again."""

BYTES_PER_VERTEX, BYTES_PER_FACE = 24, 12


def read_gltf(source: Input) -> Read:
    """Read the triangles of the default scene of a glTF file, or its points if there are none."""
    scene = GltfScene.open(source.data, source.folder)
    vertices, faces, vertex, face = scene.read()
    texture = source.texture("gltf_texture", scene) if source.keep and len(faces) else None
    use = "cells" if any("skin" in visit.node for visit in scene.visits) else "which no skin uses"
    scene.declare_others(source, {
        "POSITION": "cells", **dict.fromkeys((*_SKINNED, *_SKINNED.values()), use),
        "COLOR_0": "attributes" if vertex else "which are colors of regions",
        "_FEATURE_ID_0": "attributes" if face else "which not all vertices have",
    }, shown=_FACES if len(faces) else (POINTS,))  # fmt: skip
    return source.mesh(vertices, faces, vertex=vertex, face=face, texture=texture)


class Visit(NamedTuple):
    """A node with a mesh, or one of its instances."""

    mesh: int  # index of the mesh
    matrix: Floats  # global matrix; the identity for a skinned mesh, whose joints place it
    node: dict[str, Any]

    @property
    def is_mirrored(self) -> bool:
        """Whether the matrix turns a surface inside out: its determinant is negative."""
        axes = self.matrix[:3, :3]
        with np.errstate(over="ignore", invalid="ignore"):
            return float((np.cross(axes[0], axes[1]) * axes[2]).sum()) < 0


class GltfScene(Gltf):
    """A glTF document, and the meshes of its default scene.

    The reader of textures uses it to read materials, images and the corners of primitives. Without
    `folder`, `open` refuses files that refer to other files.
    """

    @cached_property
    def visits(self) -> list[Visit]:
        """Return nodes with a mesh, and instances, sorted by mesh.

        Nodes of one mesh are in depth-first order. If the default scene has no mesh, all scenes are
        used; if there are no scenes, all nodes; and if there are no nodes, all meshes.
        """
        scenes = self.items(self.document, "scenes")
        if not scenes:
            nodes = self.items(self.document, "nodes")
            below = {child for node in nodes for child in self.items(node, "children", int)}
            visits = self._visits_of([i for i in range(len(nodes)) if i not in below])
            n_meshes = 0 if visits else len(self.items(self.document, "meshes"))
            return visits or [Visit(index, np.eye(4), {}) for index in range(n_meshes)]
        default = self.item("scenes", self.document.get("scene", 0))
        roots = [root for scene in scenes for root in self.items(scene, "nodes", int)]
        visits = self._visits_of(self.items(default, "nodes", int))
        return visits or self._visits_of([*dict.fromkeys(roots)])

    def _visits_of(self, roots: list[int]) -> list[Visit]:
        stack = [(root, np.eye(4)) for root in reversed(roots)]
        visits = []
        self._matrices: dict[int, Floats] = {}  # global matrix of each node, by index
        while stack:
            index, above = stack.pop()
            node = self.item("nodes", index)
            if index in self._matrices:
                raise MeshError(f"broken glTF: nodes[{index}] has two parents or is in a loop")
            matrix = self._matrices[index] = _product(above, _local_matrix(node))
            if "mesh" in node:
                self.item("meshes", node["mesh"])
                copies = [np.eye(4)] if "skin" in node else self._copies(node, matrix)
                visits += [Visit(node["mesh"], one, node) for one in copies]
            children = self.items(node, "children", int)
            stack.extend((child, matrix) for child in reversed(children))
        return sorted(visits, key=lambda visit: visit.mesh)

    def _copies(self, node: dict[str, Any], matrix: Floats) -> list[Floats]:
        """Return the matrix of each instance of a node, or the matrix of the node."""
        attributes = (self.extension(node, INSTANCES) or {}).get("attributes")
        if not isinstance(attributes, dict):
            return [matrix]
        kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
        rows = {
            name.lower(): self.doubles(attributes[name], kind)
            for name, kind in kinds.items() if name in attributes
        }  # fmt: skip
        n_copies = min((len(values) for values in rows.values()), default=0)
        self.take(128 * n_copies, "instances")
        return [
            _product(matrix, _local_matrix({name: row[i].tolist() for name, row in rows.items()}))
            for i in range(n_copies)
        ]

    def declare_others(self, source: Input, fates: Mapping[str, str], shown: Sequence[int]) -> None:
        """Declare what the document has besides materials.

        `fates` says how attributes of vertices were used, and `shown` are the modes of primitives
        that were read.
        """
        for name in ("animations", "cameras", "lights"):
            if n := len(self.items(self.document, name)):
                source.declare(counted(n, name[:-1]))
        used = self.document.get("extensionsUsed", [])
        for name in used if isinstance(used, list) else []:
            if name not in SUPPORTED and GEOMETRY.search(str(name)):
                source.declare(f"extension {name}")
        for name in self._table.get("properties", {}):
            if name not in _DERIVED:
                source.declare(f"column {name} of the table of regions")
        meshes = {visit.mesh for visit in self.visits}
        if n_hidden := len(self.items(self.document, "meshes")) - len(meshes):
            source.declare(counted(n_hidden, "mesh"), "which no node of the scene shows")
        listed = (self.items(self.item("meshes", index), "primitives") for index in meshes)
        for primitive in chain.from_iterable(listed):
            mode = self.whole(primitive, "mode", TRIANGLES)
            name = _MODES[mode] if mode < len(_MODES) else f"primitives of mode {mode}"
            source.declared.setdefault(name, "cells" if mode in shown else "")
            attributes = primitive.get("attributes")
            for name in attributes if isinstance(attributes, dict) else ():
                if name != "TEXCOORD_0":  # of the texture
                    source.declared.setdefault(f"vertex attribute {name}", fates.get(name, ""))

    def read(self) -> tuple[Floats, Array, list[tuple[str, Array]], list[tuple[str, Array]]]:
        """Return vertices and faces, and properties of vertices and of faces.

        Meshes are in the order of the file, with a copy per node. Primitives of one mesh that use
        the same positions share vertices. Without triangles, all points of the scene are vertices.
        """
        if not self.visits:
            raise MeshError("no scene of the glTF file has a mesh")
        meshes = {visit.mesh for visit in self.visits}
        has_faces = any(self.primitives(index) for index in meshes)
        vertices, colors, ids, faces = [], [], [], []
        n_vertices = n_bytes = 0
        copies = Counter(visit.mesh for visit in self.visits)
        for visit in self.visits:
            copies[visit.mesh] -= 1
            n_before = n_bytes
            firsts: dict[int, int] = {}  # index of the first vertex, by the accessor of positions
            for primitive in self.primitives(visit.mesh, _FACES if has_faces else (POINTS,)):
                accessor = self.positions_of(primitive, visit.mesh)
                n_own = len(self.rows(accessor, "VEC3"))
                if accessor not in firsts:
                    firsts[accessor], n_vertices = n_vertices, n_vertices + n_own
                    n_bytes += BYTES_PER_VERTEX * n_own
                    vertices.append(self._positions(primitive, accessor, visit))
                    colors.append(self._colors(primitive, n_own))
                    ids.append(self._ids(primitive, n_own))
                if has_faces:
                    corners = self.corners(primitive, n_own).reshape(-1, 3)
                    corners = corners[:, [0, 2, 1]] if visit.is_mirrored else corners
                    first = firsts[accessor]
                    faces.append(corners + np.int64(first) if first else corners)
                    n_bytes += BYTES_PER_FACE * len(corners)
                n_left = copies[visit.mesh] * (n_bytes - n_before)
                self.check_growth(n_bytes + n_left, f"copies of meshes[{visit.mesh}]")
        joined = _joined(faces)
        face = self._labels(ids, joined)
        is_own = self.document["asset"].get("generator") == "superfacets"  # as in `write_glb`
        vertex = [] if is_own and face else _shades(colors, vertices)
        return _joined(vertices), joined, vertex, face

    def _labels(self, ids: list[Floats | None], faces: Array) -> list[tuple[str, Array]]:
        """Return the region of each face: the id of its vertices, or its label in a table."""
        whole = [each for each in ids if each is not None]
        if not len(faces) or len(whole) < len(ids):
            return []
        of_faces = np.rint(_joined(whole)[faces[:, 0]]).astype(np.int64)
        table = self._table
        with contextlib.suppress(MeshError, KeyError, TypeError):
            view = self.view(table["properties"]["label"]["values"])
            names = np.append(np.frombuffer(view, "<i4", self.whole(table, "count")), np.int32(-1))
            return [("label", names[np.clip(of_faces, 0, len(names) - 1)])]
        return [("feature_id", of_faces)]

    @cached_property
    def _table(self) -> dict[str, Any]:
        """The first property table, or an empty dict."""
        extensions = self.document.get("extensions", {})
        with contextlib.suppress(KeyError, IndexError, TypeError):
            table = extensions["EXT_structural_metadata"]["propertyTables"][0]
            if isinstance(table.get("properties", {}), dict):
                return dict(table)
        return {}

    def primitives(self, index: int, modes: Sequence[int] = _FACES) -> list[dict[str, Any]]:
        """Return the primitives of a mesh that have these modes: triangles, strips or fans."""
        primitives = self.items(self.item("meshes", index), "primitives")
        found = [each for each in primitives if self.whole(each, "mode", TRIANGLES) in modes]
        for primitive in found:
            packed = self.extension(primitive, DRACO)
            if packed is not None and modes is _FACES:
                load("superfacets_formats.compression:unpack_draco")(self, primitive, packed, index)
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
        if len(corners) and corners.max() >= n_vertices:
            raise MeshError(
                f"a face refers to vertex {corners.max()}, but its primitive has"
                f" {counted(n_vertices, 'vertex')}"
            )
        mode = self.whole(primitive, "mode", TRIANGLES)
        if mode != TRIANGLES:
            return _triangles_of(corners, is_fan=mode == TRIANGLE_FAN)
        if len(corners) % 3:
            raise MeshError(f"broken glTF: a multiple of 3 corners is expected, got {len(corners)}")
        return corners

    @staticmethod
    def positions_of(primitive: dict[str, Any], index: int) -> int:
        """Return the accessor index of the positions of a primitive of mesh `index`."""
        attributes = primitive.get("attributes")
        accessor = attributes.get("POSITION") if isinstance(attributes, dict) else None
        if type(accessor) is not int:
            raise MeshError(f"broken glTF: meshes[{index}] has a primitive without positions")
        return accessor

    def _colors(self, primitive: dict[str, Any], n_rows: int) -> Floats | None:
        index = primitive["attributes"].get("COLOR_0")
        if index is None:
            return None
        kind = self.item("accessors", index).get("type")
        shades = self.doubles(index, "VEC4" if kind == "VEC4" else "VEC3")
        if len(shades) != n_rows:
            raise MeshError(f"broken glTF: accessors[{index}] must have {n_rows} colors")
        return shades[:, :3]

    def _ids(self, primitive: dict[str, Any], n_rows: int) -> Floats | None:
        index = primitive["attributes"].get("_FEATURE_ID_0")
        ids = None if index is None else self.doubles(index, "SCALAR")
        return ids if ids is not None and len(ids) == n_rows and np.isfinite(ids).all() else None

    def _positions(self, primitive: dict[str, Any], accessor: int, visit: Visit) -> Floats:
        """Return positions, moved by morph weights, and by the node or the joints of its skin."""
        positions, matrices = self.doubles(accessor, "VEC3"), visit.matrix
        weights = visit.node.get("weights", self.item("meshes", visit.mesh).get("weights"))
        given = weights if isinstance(weights, list) else ()
        for target, weight in zip(self.items(primitive, "targets"), given, strict=False):
            if "POSITION" in target and type(weight) in (int, float) and weight:
                moves = self.doubles(target["POSITION"], "VEC3")
                if len(moves) != len(positions):
                    raise MeshError("broken glTF: a morph target has another number of positions")
                positions = positions + weight * moves
        attributes = primitive["attributes"]
        with np.errstate(all="ignore"):  # `Mesh` refuses infinite coordinates
            if "skin" in visit.node and {"JOINTS_0", "WEIGHTS_0"} <= attributes.keys():
                of_joints, total = self._joints(visit.node["skin"]), np.zeros((1, 4, 4))
                for name in filter(attributes.__contains__, _SKINNED):
                    joints = self.rows(attributes[name], "VEC4")
                    shares = self.doubles(attributes.get(_SKINNED[name]), "VEC4")
                    are_short = not len(joints) == len(shares) == len(positions)
                    are_wrong = joints.dtype.kind != "u" or joints.max(initial=0) >= len(of_joints)
                    if are_short or (len(joints) and are_wrong):
                        raise MeshError("broken glTF: the joints of a mesh do not match its skin")
                    total = total + (shares[:, :, None, None] * of_joints[joints]).sum(axis=1)
                share = total[:, 3:, 3:]  # the sum of the weights, which is not 1 in all files
                matrices = total / np.where(share, share, 1.0)
            elif np.array_equal(matrices, np.eye(4)):
                return positions
            moved: Floats = (positions[:, np.newaxis, :] * matrices[..., :3, :3]).sum(axis=2)
            return moved + matrices[..., :3, 3]

    def _joints(self, index: object) -> Floats:
        """Return the matrix of each joint of a skin, (J, 4, 4), for positions in the bind pose."""
        skin = self.item("skins", index)
        nodes = self.items(skin, "joints", int)
        found = [self._matrices.get(node, np.eye(4)) for node in nodes]
        matrices = np.array(found).reshape(-1, 4, 4)
        if "inverseBindMatrices" not in skin:
            return matrices
        binds = self.doubles(skin["inverseBindMatrices"], "MAT4").reshape(-1, 4, 4)
        if len(binds) != len(matrices):
            raise MeshError(f"broken glTF: skins[{index}] needs an inverse matrix for each joint")
        return _product(matrices, binds.swapaxes(1, 2))


def _joined(parts: list[Array]) -> Array:
    """Concatenate arrays of three columns; a single array is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts or [np.empty((0, 3), np.int64)])


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


def _product(above: Floats, matrix: Floats) -> Floats:
    """Multiply matrices; unlike `@`, this function adds in the same order on all machines."""
    with np.errstate(over="ignore", invalid="ignore"):  # `Mesh` refuses infinite coordinates
        product: Floats = (above[..., np.newaxis] * matrix[..., np.newaxis, :, :]).sum(axis=-2)
    return product


def _triangles_of(corners: Array, *, is_fan: bool) -> Array:
    """Return the corners of the triangles of a strip or fan, flat."""
    n = max(len(corners) - 2, 0)
    if is_fan:
        first = np.broadcast_to(corners[:1], n)
        return np.stack([corners[1 : n + 1], corners[2 : n + 2], first], axis=1).ravel()
    places, odd = np.arange(n), np.arange(n) % 2
    return np.stack([corners[:n], corners[places + 1 + odd], corners[places + 2 - odd]], 1).ravel()


def _shades(colors: list[Floats | None], vertices: list[Floats]) -> list[tuple[str, Array]]:
    """Return red, green and blue of all vertices as sRGB bytes; white where a part has no color."""
    if all(each is None for each in colors):
        return []
    pairs = zip(colors, vertices, strict=True)
    whole = _joined([np.ones(rows.shape) if each is None else each for each, rows in pairs])
    linear = np.clip(np.nan_to_num(whole), 0.0, 1.0)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return [*zip(COLORS, np.rint(255 * srgb).astype(np.uint8).T, strict=True)]
