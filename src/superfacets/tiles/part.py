"""Define `Part`, a subset of the cells of a tiled mesh or cloud in memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from .. import _core
from .._types import Array, Ints, Longs
from .._validate import freeze
from ..cells.cell_graph import box_diagonal
from ..cells.face_graph import FoundArcs, surface_of_faces
from ..cells.surface import Surface
from ..cells.weights import NO_NORMALS
from ..mesh.faces import FaceMesh
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from ..workers.scratch import Scratch
from .arrays import compacted, index_near, merged, rows
from .store import TileStore

Columns: TypeAlias = dict[str, Array]
"""Dict that maps names to arrays of equal length."""


def taken(columns: Columns, chosen: Array) -> Columns:
    """Return the rows `chosen` of all columns, in this order."""
    return {name: column.take(chosen, axis=0) for name, column in columns.items()}


@dataclass(frozen=True, eq=False)
class Lists:
    """One list per cell: cell i has the rows offsets[i] to offsets[i + 1] - 1 of `entries`."""

    offsets: Longs
    entries: Columns

    def take(self, chosen: Array) -> Lists:
        """Return the lists of the cells `chosen`, in this order."""
        offsets, at = rows(self.offsets, chosen)
        return Lists(offsets, taken(self.entries, at))


@dataclass(frozen=True, eq=False)
class Part:
    """A subset of the cells of a tiled mesh or cloud.

    Attributes
    ----------
    columns : Columns
        Arrays with one row per cell, for example ``places`` (curve indices, see `TileStore`),
        ``cells`` (cell numbers) and ``positions``. Triangles have ``corners``, (n, 3), which are
        row indices of `vertices`.
    lists : dict of str to Lists
        CSR lists by name: ``arcs`` of all cells, ``neighbors`` of points, and ``corners`` of
        polygons, whose entries ``vertices`` are row indices of the attribute `vertices`.
    vertices : Columns
        Vertices of faces: their ascending numbers ``ids``, and their positions ``points``.
    """

    columns: Columns
    lists: dict[str, Lists] = field(default_factory=dict)
    vertices: Columns = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def take(self, chosen: Array) -> Part:
        """Return the cells `chosen`, in this order, with only the vertices that they use."""
        lists = {name: found.take(chosen) for name, found in self.lists.items()}
        part = Part(taken(self.columns, chosen), lists, self.vertices)
        if not self.vertices:
            return part
        used, corners = compacted(part.corners()[1])
        return part.with_corners(corners, taken(self.vertices, used))

    def at(self, places: Array) -> Part:
        """Return the cells with the curve indices `places`; this part must be in curve order."""
        return self.take(np.searchsorted(self.columns["places"], places))

    def corners(self) -> tuple[Longs, Ints]:
        """Return CSR offsets of the corners of faces, and the row in `vertices` of each corner."""
        if "corners" in self.lists:
            return self.lists["corners"].offsets, self.lists["corners"].entries["vertices"]
        corners = self.columns["corners"]
        return np.arange(0, corners.size + 1, 3), corners.reshape(-1)

    def with_corners(self, corners: Ints, vertices: Columns) -> Part:
        """Return the same cells with other `vertices`; `corners` contains rows of `vertices`."""
        if "corners" in self.lists:
            lists = Lists(self.lists["corners"].offsets, {"vertices": corners})
            return replace(self, lists=self.lists | {"corners": lists}, vertices=vertices)
        columns = self.columns | {"corners": corners.reshape(-1, 3)}
        return replace(self, columns=columns, vertices=vertices)

    def mesh(self, store: TileStore) -> FaceMesh:
        """Return the faces as a mesh with the bounds of the whole mesh, without any checks."""
        offsets, corners = self.corners()
        vertices, bounds = np.ascontiguousarray(self.vertices["points"]), store.bounds.copy()
        if "corners" in self.lists:
            polygons = object.__new__(PolygonMesh)
            freeze(polygons, vertices=vertices, offsets=offsets, indices=corners, bounds=bounds)
            return polygons
        mesh = object.__new__(Mesh)
        freeze(mesh, vertices=vertices, faces=corners.reshape(-1, 3), bounds=bounds)
        return mesh

    def save(self, scratch: Scratch, folder: str) -> None:
        """Write all arrays to a folder, from which `load` reads them."""
        for name, array in self._arrays.items():
            scratch.save(f"{folder}/{name}", array)

    def keep(self, scratch: Scratch, folder: str) -> bool:
        """Store all arrays in the cache of `scratch`; return whether they fit.

        If the result is False, some of the arrays may be in the cache.
        """
        return all(scratch.keep(f"{folder}/{name}", some) for name, some in self._arrays.items())

    @property
    def _arrays(self) -> Columns:
        found = self.columns | {f"vertices/{name}": some for name, some in self.vertices.items()}
        for name, lists in self.lists.items():
            entries = lists.entries | {"offsets": lists.offsets}
            found |= {f"{name}/{entry}": column for entry, column in entries.items()}
        return found

    @classmethod
    def load(
        cls, scratch: Scratch, folder: str, names: Sequence[str], begin: int = 0,
        end: int | None = None,
    ) -> Part:  # fmt: skip
        """Read the named arrays for cells `begin` to `end` - 1, and all vertices.

        Names without an array on disk are ignored. Arrays of CSR lists have names of the form
        list/array, for example ``corners/vertices``.
        """
        part = cls({})
        groups = {"": (part.columns, begin, end), "vertices": (part.vertices, 0, None)}
        for name in (*names, "vertices/ids", "vertices/points"):
            if not scratch.has(f"{folder}/{name}"):
                continue
            group, _, column = name.rpartition("/")
            if group not in groups:
                last_row = None if end is None else end + 1
                offsets = scratch.load(f"{folder}/{group}/offsets", begin, last_row)
                part.lists[group] = Lists(offsets - offsets[0], {})
                groups[group] = part.lists[group].entries, int(offsets[0]), int(offsets[-1])
            columns, first, last = groups[group]
            columns[column] = scratch.load(f"{folder}/{name}", first, last)
        return part

    @classmethod
    def of_tile(
        cls, store: TileStore, tile: int, names: Sequence[str], begin: int = 0,
        end: int | None = None,
    ) -> Part:  # fmt: skip
        """Read cells of a tile like `load`, and add their curve indices as column ``places``."""
        part = cls.load(store.scratch, f"tile{tile}", names, begin, end)
        first = store.starts[tile] + begin
        part.columns["places"] = np.arange(first, first + len(part), dtype=np.int32)
        return part

    @classmethod
    def joined(cls, parts: Sequence[Part], key: str | None = None) -> Part:
        """Return the cells of all parts as one part, sorted by the column `key` if it is given."""
        return cls.joined_from(parts.__getitem__, len(parts), key)

    @classmethod
    def joined_from(cls, load: Callable[[int], Part], n_parts: int, key: str | None) -> Part:
        """Return the same as `joined` for parts that are loaded with ``load(i)``.

        To save memory, only one part is loaded at a time. Each part is loaded twice.
        """
        keys, ids, counts = [], [], dict[str, list[Longs]]()
        for place in range(n_parts):
            part = load(place)
            keys.append(part.columns[key] if key else np.zeros(len(part), np.int8))
            ids.append(part.vertices.get("ids", np.empty(0, np.int64)))
            for name, found in part.lists.items():
                counts.setdefault(name, []).append(np.diff(found.offsets))
        order = np.argsort(np.concatenate(keys), kind="stable")
        ranks = np.empty(len(order), np.int64)
        ranks[order] = np.arange(len(order))
        at, vertex_ids = np.split(ranks, np.cumsum(list(map(len, keys)))[:-1]), merged(ids)
        lists = {}
        for name, found in part.lists.items():
            offsets = np.append(0, np.cumsum(np.concatenate(counts[name])[order]))
            lists[name] = Lists(offsets, _empty(found.entries, int(offsets[-1])))
        vertices = _empty(part.vertices, len(vertex_ids))
        whole = cls(_empty(part.columns, len(order)), lists, vertices)
        for place in range(n_parts):
            whole._fill(load(place), at[place], vertex_ids)
        return whole

    def _fill(self, part: Part, at: Longs, vertex_ids: Longs) -> None:
        """Copy the cells of `part` to the rows `at`; `vertex_ids` are the vertex ids of `self`."""
        if part.vertices:
            numbers = np.searchsorted(vertex_ids, part.vertices["ids"]).astype(np.int32)
            part = part.with_corners(numbers[part.corners()[1]], part.vertices)
            for name, column in part.vertices.items():
                self.vertices[name][numbers] = column
        for name, column in part.columns.items():
            self.columns[name][at] = column
        for name, found in part.lists.items():
            _, entries = rows(self.lists[name].offsets, at)
            for entry, column in found.entries.items():
                self.lists[name].entries[entry][entries] = column


def _empty(columns: Columns, n_rows: int) -> Columns:
    return {name: np.empty((n_rows, *some.shape[1:]), some.dtype) for name, some in columns.items()}


def in_order_of_cells(part: Part) -> Part:
    """Return points sorted by cell number, with arcs whose ``neighbors`` are row indices."""
    order = np.argsort(part.columns["cells"])
    ranks = np.empty(len(order), np.int32)
    ranks[order] = np.arange(len(order))
    lists = {"arcs": part.lists["neighbors"]}
    points = Part(part.columns, lists)
    return with_neighbors(points, points.columns["places"], ranks, sorts=True)[0].take(order)


def with_neighbors(part: Part, places: Ints, ranks: Ints, *, sorts: bool) -> tuple[Part, Longs]:
    """Replace ``targets`` of arcs, which are curve indices, by ``neighbors``, which are ranks.

    `places` contains the curve indices of cells, in ascending order, and `ranks` their ranks. Arcs
    to cells that are not in `places` are dropped. If `sorts` is true, the arcs of each cell are
    sorted by rank, as in a graph of points. Returns the new part, and the indices of dropped arcs.
    """
    arcs = part.lists["arcs"]
    at = index_near(arcs.entries["targets"], places, part.columns["places"])
    kept = np.flatnonzero(at >= 0)
    sources = np.repeat(np.arange(len(part), dtype=np.int32), np.diff(arcs.offsets))[kept]
    neighbors = ranks[at[kept]]
    if sorts and np.any(ranks[1:] < ranks[:-1]):  # ranks descend only if the cloud has copies
        order = np.lexsort((neighbors, sources))
        kept, neighbors = kept[order], neighbors[order]
    offsets = np.searchsorted(sources, np.arange(len(part) + 1)).astype(np.int64)
    entries = {name: column[kept] for name, column in arcs.entries.items() if name != "targets"}
    lists = part.lists | {"arcs": Lists(offsets, entries | {"neighbors": neighbors})}
    return replace(part, lists=lists), np.flatnonzero(at < 0)


def surface_of(store: TileStore, part: Part, n_threads: int) -> Surface:
    """Return the surface (graph and geometry) of a part. Its angles between faces are not valid."""
    arcs = part.lists["arcs"]
    graph = arcs.offsets, arcs.entries["neighbors"]
    handle: _core.Surface
    if store.kind == "points":
        columns, order = part.columns, np.arange(len(part), dtype=np.int32)
        normals = columns.get("normals", NO_NORMALS)
        points = columns["positions"], columns["measures"], normals
        handle = _core.PointSurface(*points, order, *graph)
    else:
        turns = np.zeros(len(graph[1]), np.uint8)
        found = FoundArcs(*graph, arcs.entries["sides"], turns, (0, 0, 0, 0))
        handle = surface_of_faces(part.mesh(store), found, False, n_threads)
    return Surface(handle, *graph, store.bounds, box_diagonal(store.bounds), n_threads)
