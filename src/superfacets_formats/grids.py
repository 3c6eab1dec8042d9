"""Choose the tetrahedra, faces or points among the cells of a file; read VTK, MSH and MESH."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Floats, Input, Longs, Read, counted, guarded, shown

from .tet_mesh import TetMesh

Columns = Iterable[tuple[str, "Array | str"]]
"""Names and values of data, or the reasons why they cannot be read."""

TETS = {10: 4, 24: 4}
"""Number of nodes used for each VTK type of tetrahedra. The first four nodes are the corners."""

_FLAT = (*range(10), 21, 22, 23, 28, 30, 34, 35, 36)
"""VTK types of cells without volume."""

_PIXEL, _STRIP = 8, 6

_FACES = {5: 3, _STRIP: None, 7: None, _PIXEL: 4, 9: 4, 22: 3, 23: 4, 28: 4, 34: 3, 36: None}
"""Number of corners used for each VTK type of faces; None if it is the number of nodes."""

_SIZES = {1: 1, 3: 2, 5: 3, _PIXEL: 4, 9: 4, 10: 4, 21: 3, 22: 6, 23: 8, 24: 10, 28: 9, 34: 7}
"""Number of nodes by VTK type; a different number indicates a damaged file."""

NAMES = {
    1: "vertex", 2: "polyvertex", 3: "line", 4: "polyline", 5: "triangle", 7: "polygon", 9: "quad",
    10: "tetra", 11: "voxel", 12: "hexahedron", 24: "tetra10",
    13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 32: "wedge18",
    42: "polyhedron",
}  # fmt: skip
"""Names of VTK types, as in meshio."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Vertices and cells of all kinds, in the order of the file, with their data."""

    vertices: Floats  # (V, 3) positions of the vertices
    kinds: Array  # (C,) VTK type of each cell
    sizes: Array  # (C,) number of corners of each cell
    corners: Array  # (S,) vertex of each corner, one cell after the other
    point: Columns = ()
    cell: Columns = ()
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of_foreign(cls, reader: str, source: Input) -> Grid:
        """Return the grid that a function of the module `foreign` reads."""
        kit.FORMATS.check_readers([".vtk" if reader == "read_with_vtk" else ".msh"])
        found = guarded(f"superfacets_formats.foreign:{reader}", source.data, source.ending)
        fields = ("vertices", "kinds", "sizes", "corners")
        arrays: dict[str, Any] = {name: found.pop(name) for name in fields}
        data: dict[str, list[tuple[str, Any]]] = {"point": [], "cell": [], "names": [], "field": []}
        for key, values in found.items():
            owner, _, name = key.partition(" ")
            data[owner].append((name, values))
        for name, why in data["field"]:
            source.declare(f"field {name}", why)
        names = {name: tuple(json.loads(values)) for name, values in data["names"]}
        return cls(**arrays, point=data["point"], cell=data["cell"], names=names)

    def read(self, source: Input) -> Read:
        """Return tetrahedra, faces or points; raise a MeshError for other kinds of volume cells."""
        self._check()
        kinds = np.unique(self.kinds).tolist()
        if others := [kind for kind in kinds if kind not in (*TETS, *_FLAT)]:
            raise MeshError(f"all volume cells must be tetrahedra, but there are {_named(others)}")
        wanted: Mapping[int, int | None] = TETS if {*TETS} & {*kinds} else _FACES
        chosen = np.flatnonzero(np.isin(self.kinds, [*wanted]))
        for kind in kinds:
            n_used = wanted.get(kind, 0)  # None means all nodes
            if n_used is not None and n_used < _SIZES.get(kind, 1):
                n = counted(int(np.count_nonzero(self.kinds == kind)), "cell")
                source.declare(f"{'nodes on edges of ' * (n_used > 0)}{n} of type {_named([kind])}")
        if wanted is TETS:
            corners = self._corners_of(chosen, np.full(len(chosen), 4)).reshape(-1, 4)
            cells = TetMesh(self.vertices, corners)
            face = self._data_of(chosen)
            return source.of_cells(cells, vertex=self.point, face=face, names=self.names)
        rows, sizes, corners = self._polygons(chosen)
        return source.polygons(
            self.vertices, sizes, corners, vertex=self.point, face=self._data_of(rows),
            names=self.names,
        )  # fmt: skip

    def _data_of(self, rows: Longs) -> Columns:
        for name, values in self.cell:
            if isinstance(values, str):
                yield name, values
            elif len(values) != len(self.kinds):
                raise MeshError(
                    f"{name} has {counted(len(values), 'value')} for"
                    f" {counted(len(self.kinds), 'cell')}: the file may be damaged"
                )
            else:
                yield name, values[rows]

    def _check(self) -> None:
        n_cells = len(self.kinds)
        if len(self.sizes) != n_cells or int(self.sizes.sum()) != len(self.corners):
            raise MeshError(
                f"types of {counted(n_cells, 'cell')}, sizes of {counted(len(self.sizes), 'cell')}"
                f" (sum {self.sizes.sum()}) and {counted(len(self.corners), 'corner')} do not"
                " match: the file may be damaged"
            )
        for kind, n_corners in _SIZES.items():
            wrong = np.flatnonzero((self.kinds == kind) & (self.sizes != n_corners))
            if len(wrong):
                n_found = counted(int(self.sizes[wrong[0]]), "corner")
                raise MeshError(f"cells[{wrong[0]}] has the type {_named([kind])} but {n_found}")

    def _corners_of(self, rows: Longs, sizes: Array) -> Array:
        """Return the first `sizes` corners of some cells, flat."""
        starts = np.cumsum(self.sizes, dtype=np.int64) - self.sizes
        firsts = np.cumsum(sizes) - sizes
        places = np.repeat(starts[rows] - firsts, sizes) + np.arange(int(sizes.sum()))
        return np.asarray(self.corners[places])

    def _polygons(self, chosen: Longs) -> tuple[Longs, Array, Array]:
        """Return the cell, the size and the corners of each face; strips become triangles."""
        kinds = self.kinds[chosen]
        sizes = self.sizes[chosen].astype(np.int64)
        for kind, n_corners in _FACES.items():
            if n_corners is not None:
                sizes[kinds == kind] = n_corners
        corners = self._corners_of(chosen, sizes)
        if (kinds == _PIXEL).any():  # its corners are in rows
            at = (np.cumsum(sizes) - sizes)[kinds == _PIXEL]
            corners[at + 2], corners[at + 3] = corners[at + 3], corners[at + 2].copy()
        if not (kinds == _STRIP).any():
            return chosen, sizes, corners
        rows, lists = [], list[Array]()
        of_rows = np.split(corners, np.cumsum(sizes)[:-1])
        for row, kind, of_row in zip(chosen, kinds, of_rows, strict=True):
            faces = [of_row]
            if kind == _STRIP:
                faces = [of_row[[i + i % 2, i + 1 - i % 2, i + 2]] for i in range(len(of_row) - 2)]
            rows += [row] * len(faces)
            lists += faces
        return np.array(rows), np.array([len(each) for each in lists]), np.concatenate(lists)


def read_vtk(source: Input) -> Read:
    """Read a legacy VTK file with VTK."""
    if source.data[:22] != b"# vtk DataFile Version":
        raise MeshError("not a VTK file: it does not begin with # vtk DataFile Version")
    return Grid.of_foreign("read_with_vtk", source).read(source)


def read_with_meshio(source: Input) -> Read:
    """Read an MSH file of Gmsh or a MESH file of Medit with meshio."""
    return Grid.of_foreign("read_with_meshio", source).read(source)


def _named(kinds: list[int]) -> str:
    return ", ".join(sorted(NAMES.get(kind, f"VTK type {kind}") for kind in kinds[:10]))


def as_count(token: bytes | str, what: str) -> int:
    """Parse an integer >= 0 of at most 18 digits; other tokens raise a MeshError."""
    if not token.isdigit() or len(token) > 18 or not token.isascii():
        raise MeshError(f"{what} must be integers >= 0, got {shown(token)}")
    return int(token)


def sizes_between(offsets: Array, what: str) -> Longs:
    """Return the sizes of lists, given the offset of the end of each list."""
    offsets = offsets.astype(np.int64, copy=False)
    sizes = np.diff(offsets, prepend=0)
    if (offsets < 0).any() or (sizes < 0).any():
        raise MeshError(f"the offsets of {what} must be non-negative and ascending")
    return sizes
