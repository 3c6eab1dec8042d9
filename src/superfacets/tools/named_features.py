"""Return features chosen by name: properties in files, colors, normals and heights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Array, Bools, Bytes, Floats
from ..files.formats import FORMATS
from ..files.guards import named_errors
from ..graph.constraints import ConstraintOptions
from ..graph.kinds import are_of_vertices, kind_of
from ..graph.point_graph import find_point_graph
from ..mesh.attributes import COLORS, MeshAttributes, found_name, is_name, stored_colors
from ..mesh.convert import as_mesh
from ..mesh.faces import area_vectors
from ..mesh.meshes import Mesh
from ..regions.border_cut import BorderCut
from ..weights.features import FeatureTable
from .cell_file import CellFile
from .subdivision import Subdivision

JUST_VISIBLE = 0.02
"""Just noticeable difference of colors in OKLab. Texture colors are divided by their standard
deviation or by this value, whichever is larger, so that noise in a plain texture has no effect."""

_FROM_TEXTURE = ("texture", "texture_spread")
"""Names of features that are always computed from the texture."""


@dataclass(frozen=True)
class CellData:
    """Data of a mesh or point cloud, chosen by name; one row per cell.

    Commands use it for features, for properties and colors to draw, and for statistics of regions.
    """

    cells: Any
    attributes: MeshAttributes | None  # properties and texture of the file; None if there are none

    def features(
        self, names: Sequence[str], n_threads: int, is_kept: Bools | None = None
    ) -> FeatureTable | None:
        """Return the features with the given names, or None if there are no names.

        - ``"color"`` is the red, green and blue of each cell, from the cloud or from the file. If
          there is only a texture, ``"color"`` is the same as ``"texture"``.
        - ``"texture"`` is the mean color of the texels of a face in OKLab, and ``"texture_spread"``
          is the standard deviation of the texel colors in a face.
        - ``"normals"`` and ``"height"`` (z) are computed from the mesh or the cloud.
        - Any other name is a property of the faces, points or vertices in the file, or a file of
          `Formats.value_files`, such as ``lh.sulc``, with one number per cell or vertex.

        If a mask `is_kept` is given, missing normals of a cloud are estimated from the kept points
        only; the normals of the other points are 0. Faces get the mean of the kept vertices.

        Raises a MeshError if a feature is not available.
        """
        columns, groups, of_columns = [], [], list[str]()
        is_kept = ConstraintOptions(is_kept).kept_values(self.cells)
        for name in names:
            has_texels = self.attributes is not None and self.attributes.texture is not None
            if name in _FROM_TEXTURE or (name == "color" and has_texels and not self._has_color):
                texels = self._texels(name, n_threads)
                columns.append(texels.spread[:, None] if name == "texture_spread" else texels.oklab)
                groups.append((columns[-1].shape[1], JUST_VISIBLE))
            else:
                columns.append(self._columns(name, n_threads, is_kept))
                groups += [(1, 0.0)] * columns[-1].shape[1]
            of_columns += [name] * columns[-1].shape[1]
        if not names:
            return None
        return FeatureTable(np.concatenate(columns, axis=1), tuple(groups), tuple(of_columns))

    def values(self, name: str, *, at_vertices: bool = False) -> Floats | None:
        """Return the values of a property or file, (N,), or None if there is no such property.

        A property of the vertices of a mesh is averaged over the corners of each cell, or returned
        as it is, (V,), if `at_vertices`. Raises a MeshError if the property has more than one
        number per cell or vertex.
        """
        table = self._properties((name,), at_vertices)
        if table is not None and table.shape[1] != 1:
            raise MeshError(f"{name} has {table.shape[1]} numbers per row, but one is needed")
        return None if table is None else table[:, 0]

    def colors(self) -> Bytes | None:
        """Return `stored_colors`, where colors of vertices are averaged over the corners of cells.

        If a mesh has as many vertices as cells, the colors are treated as colors of vertices.
        """
        colors = stored_colors(self.cells, self.attributes)
        if colors is None or len(colors) != getattr(self.cells, "n_vertices", None):
            return colors
        return np.asarray(np.rint(_per_cell(colors.astype(np.float64), self.cells)), np.uint8)

    def attributes_of(self, parts: Subdivision | BorderCut) -> MeshAttributes | None:
        """Return the attributes for parts of the faces; `left_out` names lost attributes."""
        given = self.attributes
        if given is None:
            return None
        vertex, declared, texture = {}, {**given.declared}, given.texture
        if kind_of(self.cells).name == "triangles":
            vertex = _interpolated(given.vertex, self.cells, parts)
        elif given.vertex:
            lost = [declared.pop(f"vertex property {name}", name) and name for name in given.vertex]
            declared[f"vertex properties {', '.join(lost)}"] = "because triangles replace polygons"
        face = {name: values[parts.sources] for name, values in given.face.items()}
        if texture is not None:
            of_texture = load("superfacets_textures.ply_texture:OF_TEXTURE")
            face = {name: values for name, values in face.items() if name not in of_texture}
            texture = load("superfacets_textures.texels:subdivided_texture")(
                texture, as_mesh(self.cells), parts.mesh, parts.sources
            )
            if texture is None:
                declared["texture"] = "because triangles replace the polygons"
        return MeshAttributes(vertex, face, given.comments, texture, given.names, declared)

    def _texels(self, name: str, n_threads: int) -> Any:
        """Return the color of each face from the texture, or raise a MeshError if it is missing."""
        reasons = () if self.attributes is None else self.attributes.left_out
        whys = [reason for reason in reasons if reason.startswith(("texture: ", "materials: "))]
        texture = None if self.attributes is None else self.attributes.texture
        if texture is None or whys:
            why = f" ({whys[0]})" if whys else ""
            raise MeshError(
                f"features {name}: {self._whole} has no {'complete ' * bool(texture)}texture{why}"
            )
        load("superfacets_textures.texels:check_texture")(texture, self.cells)
        with named_errors(f"features {name}"):
            return load("superfacets_textures.texels:face_texels")(self.cells, texture, n_threads)

    def _columns(self, name: str, n_threads: int, is_kept: Bools | None) -> Floats:
        cells, are_points = self.cells, kind_of(self.cells).are_points
        if name == "normals":
            return _normals_of(cells, n_threads, is_kept)
        if name == "height":
            return _per_cell((cells.points if are_points else cells.vertices)[:, 2:], cells)
        if name == "color" and are_points and cells.colors is not None:
            return np.asarray(cells.colors, np.float64)
        wanted = COLORS if name == "color" else (name,)
        table = self._properties(wanted, is_kept=is_kept)
        if table is None:
            normals = ["normals"] * (are_points or kind_of(cells).has_faces)
            fields = {field for table in self._stored for field in table}
            known = [*["color"] * self._has_color, *normals, "height", *sorted(fields)]
            raise MeshError(
                f"features {name}: {self._whole} has no property {', '.join(wanted)}; it has"
                f" {', '.join(known)}: name one of these, or a file such as {name}.npy"
            )
        return table

    def _properties(
        self, names: Sequence[str], at_vertices: bool = False, is_kept: Bools | None = None
    ) -> Floats | None:
        """Return properties of faces, or else of vertices, with a row per cell; None if missing.

        If `at_vertices`, properties of vertices have one row per vertex. A name may be the path of
        a file with one number per cell or vertex.
        """
        of_faces, of_vertices = self._stored
        for stored in (of_faces, of_vertices):
            names = [found_name(stored, name) for name in names]
            if all(name in stored for name in names):
                columns = [stored[name].reshape(len(stored[name]), -1) for name in names]
                table = np.concatenate(columns, axis=1).astype(np.float64)
                is_ready = stored is of_faces or at_vertices
                return table if is_ready else _per_cell(table, self.cells, is_kept)
        if len(names) == 1 and names[0].lower().endswith(FORMATS.value_files):
            table = CellFile.values_in(names[0]).astype(np.float64)[:, np.newaxis]
            is_ready = not are_of_vertices(table, self.cells, names[0]) or at_vertices
            return table if is_ready else _per_cell(table, self.cells, is_kept)
        return None

    @property
    def _stored(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Properties of faces, and properties of vertices or points, in the file."""
        found = self.attributes or MeshAttributes()
        return found.face, found.vertex

    @property
    def _whole(self) -> str:
        return "the cloud" if kind_of(self.cells).are_points else "the mesh"

    @cached_property
    def _has_color(self) -> bool:
        """Whether a cloud has colors, or the file of the mesh or cloud has colors."""
        if kind_of(self.cells).are_points and self.cells.colors is not None:
            return True
        return any({*COLORS} <= stored.keys() for stored in self._stored)


def attributes_of(mesh: Any, cells: Any) -> MeshAttributes:
    """Return the data arrays and colors of a mesh of PyVista, meshio or trimesh; else none."""
    found: dict[str, dict[str, Array]] = {"vertex": {}, "face": {}}
    n_points = getattr(cells, "n_vertices", cells.n_cells)
    visual = getattr(mesh, "visual", None)
    shades = {
        owner: {"RGBA": getattr(visual, f"{owner}_colors", ())}
        for owner in found if getattr(visual, "kind", None) == owner
    }  # fmt: skip
    for owner, names, n in (
        ("vertex", ("point_data", "vertex_attributes"), n_points),
        ("face", ("cell_data", "face_attributes"), cells.n_cells),
    ):
        for stored in (*(getattr(mesh, name, None) or {} for name in names), shades.get(owner, {})):
            for name in stored.keys():  # noqa: SIM118  # data of PyVista is no mapping
                values = np.asarray(stored[name])
                values = values[0] if values.ndim == 3 and len(values) == 1 else values  # meshio
                is_table = values.dtype.kind in "biuf" and values.ndim in (1, 2)
                if is_table and len(values) == n and is_name(name):
                    found[owner][name] = values
                    if name in ("RGB", "RGBA") and values.shape[1:] in ((3,), (4,)):
                        found[owner] |= zip(COLORS, values.T, strict=False)
    return MeshAttributes(found["vertex"], found["face"])


def _normals_of(cells: Any, n_threads: int, is_kept: Bools | None) -> Floats:
    kind = kind_of(cells)
    if kind.are_points:
        if cells.normals is not None:
            return np.asarray(cells.normals)
        return find_point_graph(cells, n_threads, is_kept=is_kept).normals
    if not kind.has_faces:
        raise MeshError(f"normals cannot be a feature: {kind.plural} have no normals")
    vectors = area_vectors(cells, n_threads)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0))


def _per_cell(table: Floats, cells: Any, is_kept: Bools | None = None) -> Floats:
    """Return the mean row of the kept vertices of each cell, or `table` for points."""
    corners = kind_of(cells).corners(cells)
    return table if corners is None else corners.means(table, is_kept)


def _interpolated(
    properties: Mapping[str, Array], old: Mesh, parts: Subdivision | BorderCut
) -> dict[str, Array]:
    """Return properties of the vertices of a mesh, and of new vertices in its faces.

    Floats and colors are interpolated; other integers, such as classes, are of the nearest corner.
    """
    n_old, of_vertices = old.n_vertices, np.empty(parts.mesh.n_vertices, np.int64)
    of_vertices[parts.mesh.faces] = parts.sources[:, np.newaxis]
    corners = old.faces[of_vertices[n_old:]]
    arms = old.vertices[corners] - parts.mesh.vertices[n_old:, np.newaxis]
    areas = np.linalg.norm(np.cross(arms[:, [1, 2, 0]], arms[:, [2, 0, 1]]), axis=2)
    nearest = corners[np.arange(len(corners)), areas.argmax(axis=1)]
    shares = areas / np.maximum(areas.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    found = {}
    for name, values in properties.items():
        new = values[nearest]
        if values.dtype.kind == "f" or name in (*COLORS, "alpha"):
            with np.errstate(invalid="ignore"):  # values may be infinite
                steps = values[corners] - new[:, np.newaxis] * 1.0
            change = np.einsum("ij,ij...->i...", shares, steps)
            new = new + (change if values.dtype.kind == "f" else np.rint(change))
        found[name] = np.concatenate([values, new.astype(values.dtype)])
    return found
