"""Define `Input`, the argument of the functions that read a file, and its account of the file."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..base.arrays import as_rows
from ..base.checks import counted
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Array, Bools, Floats
from ..graph.kinds import kind_of
from ..mesh.attributes import COLORS, MeshAttributes, is_name
from ..mesh.base import Cells
from ..mesh.meshes import Mesh, PolygonMesh
from ..mesh.point_cloud import PointCloud
from .guards import Content, Polygons, faces_of

if TYPE_CHECKING:
    from .. import Texture

NORMALS = ("nx", "ny", "nz")
"""Names of the properties that are normals."""

Columns: TypeAlias = Iterable[tuple[str, Array | str]]
"""Names and values of properties, (N,) or (N, n). The values of a property that cannot be read are
replaced by the reason."""

Read: TypeAlias = tuple[Cells, MeshAttributes | None]
"""Cells and attributes of a file; the attributes are None if they are not wanted."""


@dataclass(frozen=True)
class Input:
    """Content of a file to read, and a record of everything that the file declares.

    Functions that read a format get an `Input`; see `files.formats`. They declare everything in the
    file except properties of vertices and faces, and return the result of `mesh` or `cloud`, which
    gets all properties and declares them.
    """

    data: Content
    ending: str
    folder: Path | None = None  # folder of other files that the file names; None if there is none
    keep: bool = True  # whether attributes are wanted
    declared: dict[str, str] = field(default_factory=dict)
    """How each declared item was used; see `MeshAttributes.declared`."""
    _counts: defaultdict[str, int] = field(default_factory=lambda: defaultdict(lambda: 1))
    """Highest suffix that was tried for each item that was declared more than once."""

    def declare(self, item: str, became: str = "") -> None:
        """Declare an item of the file, and how it was used: one of `TAKEN`, or why it was not."""
        self.declared[self._new(item)] = became

    def _new(self, item: str) -> str:
        """Return the item, with a number if the file already has such an item."""
        name = item
        while name in self.declared:
            self._counts[item] += 1
            name = f"{item} ({self._counts[item]})"
        return name

    def texture(self, module: str, data: object) -> Texture | None:
        """Return the texture that a module of textures reads, and declare what it leaves out."""
        try:
            read = load(f"superfacets_textures.{module}:read_texture")
            texture, left_out = read(data, self.folder)
        except MeshError as error:
            texture, left_out = None, [f"texture: {error}"]
        for item in left_out:
            self.declare(item)
        if texture is not None:
            self.declare("texture" if len(texture.coordinates) else "materials", "texture")
        found: Texture | None = texture
        return found

    def mesh(
        self, vertices: Floats, faces: Array | Polygons | None, *, vertex: Columns = (),
        face: Columns = (), **others: Any,
    ) -> Read:  # fmt: skip
        """Return the mesh, and its attributes; without faces, the vertices are a point cloud.

        `vertex` and `face` are all properties other than positions and corners. They are not used
        if attributes are not wanted, so that iterators need not compute them. `others` are fields
        of `MeshAttributes`.
        """
        if faces is None or not len(faces[0] if isinstance(faces, Polygons) else faces):
            if not len(vertices):
                raise MeshError("the mesh has no faces")
            return self.cloud((*zip("xyz", vertices.T, strict=True), *vertex), **others)
        vertices = self._without_gaps(vertices, faces)
        cells: Cells
        if isinstance(faces, Polygons):
            cells = PolygonMesh._of_new(vertices, *faces)
        else:
            cells = Mesh._of_new(vertices, faces)
        return self.of_cells(cells, vertex=vertex, face=face, **others)

    def _without_gaps(self, vertices: Floats, faces: Array | Polygons) -> Floats:
        """Move unused vertices without a position to a corner of a face."""
        with np.errstate(over="ignore", invalid="ignore"):
            if np.isfinite(vertices.sum()):  # the sum of finite numbers is rarely infinite
                return vertices
        corners = faces.indices if isinstance(faces, Polygons) else faces.ravel()
        is_lost: Bools = np.asarray(~np.isfinite(vertices).all(axis=1))
        used = corners[(corners >= 0) & (corners < len(vertices))]
        if not is_lost.any() or is_lost[used].any():
            return vertices
        n_lost = counted(int(np.count_nonzero(is_lost)), "vertex")
        self.declare(f"{n_lost} without a position", "which no face uses")
        return np.where(is_lost[:, np.newaxis], vertices[used[0]], vertices)

    def polygons(self, vertices: Floats, sizes: Array, corners: Array, **others: Any) -> Read:
        """Return the same as `mesh`; `sizes` are the corner counts of the faces in `corners`."""
        return self.mesh(vertices, faces_of(sizes, corners), **others)

    def of_cells(
        self, cells: Cells, *, vertex: Columns = (), face: Columns = (), **others: Any
    ) -> Read:
        """Return cells of any kind, and their attributes, as `mesh` does."""
        if not self.keep:
            return cells, None
        n_vertices = len(cells.vertices)  # type: ignore[attr-defined]  # points use `cloud`
        self.declare(counted(n_vertices, "vertex"), "cells")
        self.declare(counted(cells.n_cells, kind_of(cells).noun), "cells")
        of_vertices = self._kept("vertex", vertex, n_vertices)
        of_faces = self._kept("face", face, cells.n_cells)
        return cells, MeshAttributes(of_vertices, of_faces, declared=self.declared, **others)

    def cloud(
        self, columns: Columns, *, viewpoints: Floats | None = None, records: Bools | None = None,
        **others: Any,
    ) -> Read:  # fmt: skip
        """Return the point cloud of columns, with names as in PLY, and its attributes.

        Positions are x, y and z, normals nx, ny and nz, and colors red, green and blue. `records`
        is False where a record has no position; the columns have one row per other record.
        `viewpoints` are the same as in `PointCloud`, and `others` are fields of `MeshAttributes`.
        """
        pairs = [*columns]
        found = {name: values for name, values in reversed(pairs) if not isinstance(values, str)}
        for axis in "xyz":
            if axis not in found or found[axis].ndim != 1:
                raise MeshError(f"the points have no property {axis}")
        normals = self._normals_of(found)
        cloud = _cloud_of(found, normals, viewpoints)
        if not self.keep:
            is_whole = records is None or bool(records.all())
            return cloud, None if is_whole else MeshAttributes(records=records)
        self.declare(counted(cloud.n_points, "point"), "cells")
        properties = (pair for pair in pairs if pair[0] not in [*"xyz"])
        kept = self._kept("point", properties, cloud.n_points)
        if records is not None and not records.all():
            n_lost = len(records) - cloud.n_points
            self.declare(f"{n_lost:,} of {len(records):,} points", "which have no position")
        return cloud, MeshAttributes(vertex=kept, declared=self.declared, records=records, **others)

    def _normals_of(self, columns: Mapping[str, Array]) -> Floats | None:
        """Return the normals; zero replaces normals that are not finite, and means no normal."""
        if not _has(columns, NORMALS):
            return None
        normals = as_rows([columns[name] for name in NORMALS], np.float64)
        is_lost: Bools = np.asarray(~np.isfinite(normals).all(axis=1))
        if is_lost.any():
            n_lost = counted(int(np.count_nonzero(is_lost)), "point")
            self.declare(f"normals of {n_lost}", "which are not finite")
            normals[is_lost] = 0.0
        return normals if normals.any() else None  # normals of Gaussian splats are often zero

    def _kept(self, owner: str, columns: Columns, n_rows: int) -> dict[str, Array]:
        """Return the properties that attributes can store, and declare all properties."""
        kept: dict[str, Array] = {}
        for name, values in columns:
            item = self._new(f"{owner} property {name}")
            self.declared[item] = "attributes"
            if isinstance(values, str):
                self.declared[item] = values
            elif values.dtype.kind not in "biuf" or values.ndim > 2:
                self.declared[item] = "whose rows are neither numbers nor lists of numbers"
            elif len(values) != n_rows:
                rows = counted(n_rows, owner)
                raise MeshError(f"{item} has {counted(len(values), 'value')} for {rows}")
            elif name in kept or not is_name(name):
                self.declared[item] = "whose name is repeated or not one line"
            else:
                kept[name] = values
        return kept


def _has(columns: Mapping[str, Array], names: Sequence[str]) -> bool:
    return all(name in columns and columns[name].ndim == 1 for name in names)


def _cloud_of(
    columns: Mapping[str, Array], normals: Floats | None, viewpoints: Floats | None
) -> PointCloud:
    """Return the cloud of `columns`, (N,) each, whose names are as in `Input.cloud`."""
    colors = None
    if _has(columns, COLORS):
        kinds = {columns[name].dtype.kind + str(columns[name].dtype.itemsize) for name in COLORS}
        if len(kinds) == 1 and kinds <= {"u1", "u2", "f4", "f8"}:
            colors = as_rows([columns[name] for name in COLORS], columns["red"].dtype)
    elif "f_dc_0" in columns:  # Gaussian splats
        colors = load("superfacets_formats.splats:splat_colors")(columns)
    axes = None
    if normals is None and "rot_0" in columns:
        axes = load("superfacets_formats.splats:splat_axes")(columns)
    points = as_rows([columns[axis] for axis in "xyz"], np.float64)
    return PointCloud(points, normals, colors, axes, viewpoints)
