"""Masks and barriers, which remove cells and arcs from a graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Bools, Ints, Longs
from .._validate import (
    checked_edges,
    checked_mask,
    checked_number,
    checked_seeds,
    checked_threads,
    refuse_first,
    refuse_mask,
)
from ..adapters.convert import MeshLike, as_mesh
from ..mesh.faces import ends_of_sides, face_sizes
from ..mesh.weld import lowest_vertices
from .face_graph import FaceGraph, build_face_graph
from .surface import Surface, arc_measures

ANY_GROUP = -1
"""Number of the group whose cells may share a region with cells of any other group."""

NO_GROUPS = np.empty(0, np.int32)
"""Empty array of groups, which is used if there are no barriers."""

ANGLE_NOISE = 1e-6
"""Tolerance of angles in radians, for the rounding errors of float32 positions."""


@dataclass(frozen=True)
class ConstraintOptions:
    """The arguments `mask` and `barriers` of `segment`."""

    mask: Any = None  # None if all cells are kept
    barriers: Any = None  # None if there are no barriers

    @property
    def is_used(self) -> bool:
        """Whether there is a mask or a barrier."""
        return self.mask is not None or self.barriers is not None

    @property
    def params(self) -> dict[str, Any]:
        """Parameters for the result of `segment`, keyed by name."""
        given = {"mask": self.mask, "barriers": self.barriers}
        return {name: "given" for name, value in given.items() if value is not None}

    def cut(
        self, source: object, graph: Any, *, weld: bool, n_threads: int, order: Ints | None = None
    ) -> Cut | None:
        """Return the kept cells and arcs of a graph, or None if there is no mask and no barrier.

        If the cells of the graph are sorted, `order` is the index of each cell in `source`. Raises
        a ValueError or TypeError if the mask or the barriers are not valid.
        """
        if not self.is_used:
            return None
        n_cells, sources = graph.n_cells, graph.sources
        is_kept = in_order(_checked_kept(self.mask, n_cells), order)
        keeps_arc = is_kept[sources] & is_kept[graph.neighbors]
        groups = NO_GROUPS
        if self.barriers is not None:
            refuse_mask(self.barriers, "barriers")
            if np.ndim(self.barriers) == 2:
                crosses = _crossed_by(
                    self.barriers, source, (graph, sources), weld, n_threads, order
                )
                groups = _groups_apart(graph, keeps_arc, keeps_arc & ~crosses, sources)
            else:
                sides = in_order(_checked_sides(self.barriers, n_cells), order)
                crosses = sides[sources] != sides[graph.neighbors]
                groups = sides
            keeps_arc &= ~crosses
        return Cut.of(graph, is_kept, keeps_arc, sources, groups)


@dataclass(frozen=True, eq=False)
class Cut:
    """Part of a graph that a mask and barriers keep. The kept cells are renumbered."""

    n_whole: int  # number of cells of the whole graph, N
    cells: Ints  # (n,) index in the whole graph of each kept cell, ascending
    arcs: Longs  # (m,) index in the whole graph of each kept arc, ascending
    offsets: Longs  # (n + 1,) index in `neighbors` of the first arc of each kept cell
    neighbors: Ints  # (m,) target of each kept arc, as a new cell index
    groups: Ints
    """Group of each kept cell, (n,); empty without barriers. Cells of different groups must not be
    in the same region, even across a gap. Cells of `ANY_GROUP` may be in a region with any
    cells."""

    @classmethod
    def of(cls, graph: Any, is_kept: Bools, keeps_arc: Bools, sources: Ints, groups: Ints) -> Cut:
        """Make a cut from the cells and arcs to keep; these arcs must join these cells."""
        cells = np.flatnonzero(is_kept).astype(np.int32)
        arcs = np.flatnonzero(keeps_arc)
        numbers = np.cumsum(is_kept, dtype=np.int32) - np.int32(1)
        counts = np.bincount(sources[arcs], minlength=len(is_kept))[cells]
        return cls(
            len(is_kept),
            cells,
            arcs,
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            numbers[graph.neighbors[arcs]],
            groups[cells] if len(groups) else NO_GROUPS,
        )

    def surface_of(self, whole: Surface) -> Surface:
        """Return the surface of the kept cells; `whole` is the surface of all cells."""
        handle = _core.SubSurface(whole.handle, self.offsets, self.neighbors, self.cells, self.arcs)
        return Surface(
            handle, self.offsets, self.neighbors, whole.bounds, whole.weight_unit,
            whole.n_threads, dimension=whole.dimension,
        )  # fmt: skip

    def new_cells(self, cells: npt.ArrayLike, name: str, order: Ints | None = None) -> Ints:
        """Convert cells of the whole graph to new indices.

        Raises a ValueError if a cell is not kept. The message has the input index from `order`.
        """
        given = checked_seeds(cells, self.n_whole, name)
        found = np.minimum(np.searchsorted(self.cells, given), len(self.cells) - 1)
        is_out = self.cells[found] != given
        if is_out.any():
            first = int(np.argmax(is_out))
            cell = given[first] if order is None else order[given[first]]
            raise ValueError(f"{name}[{first}] is cell {cell}, but the mask excludes this cell")
        return found.astype(np.int32)

    def whole_labels(self, labels: Ints) -> Ints:
        """Convert labels of kept cells to labels of all cells; removed cells get -1."""
        whole = np.full(self.n_whole, -1, np.int32)
        whole[self.cells] = labels
        return whole


def sharp_edges(
    mesh: MeshLike, angle: float = 30.0, *, weld: bool = True, n_threads: int | None = None
) -> Ints:
    """Return the edges with a large angle between their faces, for `barriers` of `segment`.

    With these barriers, ``segment(mesh, 1, ...)`` makes one region per smooth face of a CAD part.
    If a line of sharp edges ends inside a face, the region extends around the end of the line.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        As for `segment`.
    angle : float, default 30
        Angle in degrees between the normals of the faces, above 0 and at most 180. Convex and
        concave edges with at least this angle are sharp. A flat edge has 0 degrees, and the edges
        of a cube have 90.
    weld, n_threads
        As for `segment`.

    Returns
    -------
    ndarray of int32, shape (E, 2)
        The two vertices of each edge, the lower vertex first. Edges are in ascending order. Of the
        vertices at the same position, the lowest vertex is used. Edges of three or more faces are
        also sharp, and boundary edges are not.

    Raises
    ------
    MeshError
        If `mesh` has no faces.
    ValueError, TypeError
        If `angle` is not a number above 0 and at most 180.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> roof = Mesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> sharp_edges(roof).tolist(), sharp_edges(roof, 91).tolist()
    ([[0, 2]], [])
    """
    keys, _ = _sharp_sides(mesh, angle, weld, n_threads)
    keys = np.unique(keys)
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


def sharp_edges_inside(
    mesh: MeshLike, labels: Ints, angle: float, *, n_threads: int | None = None
) -> Longs:
    """Return the number of sharp edges between faces of the same region, for each region.

    `labels` is the region of each face, or -1. See `sharp_edges` for the other parameters.
    """
    keys, faces = _sharp_sides(mesh, angle, True, n_threads)
    is_inside = (labels[faces[:, 0]] == labels[faces[:, 1]]) & (labels[faces[:, 0]] >= 0)
    _, first = np.unique(keys[is_inside], return_index=True)
    return np.bincount(labels[faces[is_inside, 0][first]], minlength=int(labels.max()) + 1)


def _sharp_sides(
    mesh: MeshLike, angle: float, weld: bool, n_threads: int | None
) -> tuple[Longs, Ints]:
    """Return the edge key and the two faces of each arc that crosses a sharp edge."""
    angle = checked_number(angle, "angle", zero=False)
    if angle > 180:
        raise ValueError(f"angle must be at most 180, got {angle:g}")
    source, threads = as_mesh(mesh), checked_threads(n_threads)
    graph = build_face_graph(source, weld=weld, n_threads=threads)
    angles = arc_measures(source, graph, n_threads=threads).angles
    assert angles is not None
    sources, is_sharp = graph.sources, np.abs(angles) >= np.radians(angle) - ANGLE_NOISE
    # The arcs of a face are sorted by side. Two consecutive arcs cross the same side if its edge
    # has three or more faces.
    is_same = (sources[1:] == sources[:-1]) & (graph.sides[1:] == graph.sides[:-1])
    is_sharp[1:] |= is_same
    lowest = lowest_vertices(source.vertices, weld, threads)
    ends = lowest[ends_of_sides(source, sources[is_sharp], graph.sides[is_sharp])]
    faces = np.stack([sources[is_sharp], graph.neighbors[is_sharp]], axis=1)
    return _keys_of(ends), faces


def in_order(values: Array, order: Ints | None) -> Array:
    """Return ``values[order]``, or `values` if `order` is None."""
    return values if order is None else values[order]


def _checked_kept(mask: Any, n_cells: int) -> Bools:
    refuse_mask(mask, "mask")
    is_kept = checked_mask(mask, n_cells, "mask")
    if not is_kept.any():
        raise ValueError("mask must be True for at least one cell, but it is False everywhere")
    return is_kept


def _checked_sides(barriers: Any, n_cells: int) -> Ints:
    """Check barriers given as one number per cell, and renumber them to 0, 1, 2, ..."""
    given = np.asarray(barriers)
    if given.dtype.kind not in "iub":
        raise TypeError(f"barriers must contain integers, got {given.dtype}")
    if given.shape != (n_cells,):
        raise ValueError(
            f"barriers must have one number per cell, shape ({n_cells},), or be edges of a mesh,"
            f" shape (E, 2), got shape {given.shape}"
        )
    _, sides = np.unique(given, return_inverse=True)
    return sides.astype(np.int32)


def _crossed_by(
    barriers: Any, source: Any, arcs: tuple[Any, Ints], weld: bool, n_threads: int,
    order: Ints | None,
) -> Bools:  # fmt: skip
    """Return whether each arc crosses an edge in `barriers`.

    `arcs` is the graph, and the start cell of each arc.
    """
    graph, sources = arcs
    if not isinstance(graph, FaceGraph):
        raise ValueError(
            "barriers of shape (E, 2) need a mesh with faces: for other cells, give one number per"
            " cell"
        )
    given = checked_edges(barriers, source.n_vertices, "barriers")
    lowest = lowest_vertices(source.vertices, weld, n_threads)
    wanted = lowest[given]
    is_end = np.zeros(source.n_vertices, bool)
    is_end[wanted] = True
    sizes = face_sizes(source)
    starts = np.cumsum(sizes) - sizes
    faces = np.repeat(np.arange(source.n_faces), sizes)
    sides = np.arange(len(faces)) - np.repeat(starts, sizes)
    ends = lowest[ends_of_sides(source, faces, sides)]
    is_crossed: Bools = np.asarray(is_end[ends].all(axis=1))  # also some sides that are not crossed
    keys, wanted_keys = _keys_of(ends[is_crossed]), _keys_of(wanted)
    refuse_first(~np.isin(wanted_keys, keys), "barriers", given, "an edge of the mesh")
    is_crossed[is_crossed] = np.isin(keys, wanted_keys)
    return np.asarray(is_crossed[in_order(starts, order)[sources] + graph.sides])


def _keys_of(edges: Ints) -> Longs:
    """Return one integer per edge, which is the same for both directions of the edge."""
    low, high = edges.min(axis=1).astype(np.int64), edges.max(axis=1)
    return np.asarray((low << 32) | high)


def _groups_apart(graph: Any, before: Bools, after: Bools, sources: Ints) -> Ints:
    """Return the group of each cell: the index of its piece if barriers divide its component.

    Cells of other components get `ANY_GROUP`. `before` and `after` mark the arcs that are kept
    without and with the barriers.
    """
    whole, n_whole = _components_of(graph, before, sources)
    pieces, n_pieces = _components_of(graph, after, sources)
    whole_of_piece = np.empty(n_pieces, np.int32)
    whole_of_piece[pieces] = whole
    is_cut = np.bincount(whole_of_piece, minlength=n_whole) > 1
    return np.where(is_cut[whole], pieces, np.int32(ANY_GROUP))


def _components_of(graph: Any, keeps_arc: Bools, sources: Ints) -> tuple[Ints, int]:
    counts = np.bincount(sources[keeps_arc], minlength=graph.n_cells)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    one_label = np.zeros(graph.n_cells, np.int32)
    return _core.find_components(offsets, graph.neighbors[keeps_arc], one_label)
