"""Apply the mask and the barriers of `segment`: a mask removes cells, and barriers remove arcs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import (
    checked_mask,
    checked_number,
    checked_seeds,
    checked_threads,
    integer_array,
    owned_indices,
    refuse_first,
    refuse_mask,
)
from ..base.errors import MeshError
from ..base.types import Array, Bools, Floats, Ints, Longs
from ..mesh.base import Cells
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, corners_of
from ..mesh.weld import lowest_vertices
from .cell_graph import CellGraph, CsrArcs
from .face_graph import FaceGraph, build_face_graph
from .kinds import fit_vertices, kind_of, of_cells
from .sorting import sorted_corners
from .surface import Surface, arc_measures

ANY_GROUP = -1
"""Group of cells that may be in a region with cells of any group. See `KeptCells.groups`."""

NO_GROUPS = np.empty(0, np.int32)
"""Empty value of `KeptCells.groups`, used if there are no barriers."""

ANGLE_NOISE = 1e-6
"""Tolerance of the minimum angle in `sharp_edges`, in radians. It is larger than the rounding
errors that positions in float32 cause."""


@dataclass(frozen=True)
class ConstraintOptions:
    """The arguments `mask` and `barriers` of `segment`."""

    mask: Any = None  # (N,) or (V,) whether each cell is segmented; None to segment all cells
    # Edges that separate regions; or one number per cell or vertex, so that no region has cells
    # with different numbers; or None if there are no barriers.
    barriers: Any = None

    @property
    def is_used(self) -> bool:
        """Whether there is a mask or there are barriers."""
        return self.mask is not None or self.barriers is not None

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` that say whether there are a mask and barriers."""
        given = {"mask": self.mask, "barriers": self.barriers}
        return {name: "given" for name, value in given.items() if value is not None}

    def kept_points(self, cells: Cells) -> Bools | None:
        """Return which points of a cloud to keep; None without a mask or for other cells."""
        return self.kept_values(cells) if kind_of(cells).are_points else None

    def kept_values(self, cells: Any) -> Bools | None:
        """Return which points or vertices to keep; None without a mask, or if it is of faces."""
        if self.mask is None or not (kind_of(cells).are_points or fit_vertices(self.mask, cells)):
            return None
        return _checked_kept(self.mask, len(self.mask))

    def per_cell(self, source: Any) -> ConstraintOptions:
        """Return the same constraints, with a value per cell in place of one per vertex."""
        if fit_vertices(self.mask, source) and fit_vertices(self.barriers, source):
            # "Not kept" is one more number in the vote of the corners, so that both agree.
            groups = of_cells(self.groups_of_vertices(source), source)
            return ConstraintOptions(groups >= 0, groups)
        return ConstraintOptions(of_cells(self.mask, source), of_cells(self.barriers, source))

    def groups_of_vertices(self, source: Any) -> Ints | None:
        """Return a number >= 0 per vertex, -1 outside the mask; None if all values are per cell."""
        has_mask, has_barriers = (fit_vertices(x, source) for x in (self.mask, self.barriers))
        if not (has_mask or has_barriers):
            return None
        groups = np.zeros(source.n_vertices, np.int32)
        if has_barriers:
            groups = _checked_groups(self.barriers, len(groups))
        if has_mask:
            refuse_mask(self.mask, "mask")
            groups[~checked_mask(self.mask, len(groups), "mask")] = -1
        return groups

    def kept_cells(
        self, source: Cells | CellGraph, graph: CsrArcs, *, weld: float, n_threads: int,
        order: Ints | None = None,
    ) -> KeptCells | None:  # fmt: skip
        """Return the cells and arcs to keep, or None if there is neither a mask nor barriers.

        If the cells of `graph` were sorted, `order` is the index of each cell in `source`. Raises a
        ValueError or TypeError if the mask or the barriers are not valid.
        """
        if not self.is_used:
            return None
        n_cells, sources = graph.n_cells, graph.sources
        per_cell = self.per_cell(source)
        barriers = per_cell.barriers
        is_kept = in_order(_checked_kept(per_cell.mask, n_cells), order)
        keeps_arc = is_kept[sources] & is_kept[graph.neighbors]
        groups = NO_GROUPS
        if barriers is not None:
            refuse_mask(self.barriers, "barriers")
            if np.ndim(barriers) == 2:
                crosses = _crossed_by(
                    barriers, source, (graph, sources), weld, n_threads, order is not None
                )
                groups = _groups_apart(graph, keeps_arc, keeps_arc & ~crosses, sources)
            else:
                groups = in_order(_checked_groups(barriers, n_cells), order)
                crosses = groups[sources] != groups[graph.neighbors]
            keeps_arc &= ~crosses
        return KeptCells.of(graph, is_kept, keeps_arc, sources, groups)


NO_CONSTRAINTS = ConstraintOptions()


@dataclass(frozen=True, eq=False)
class KeptCells:
    """Part of a graph that a mask and barriers keep. The n kept cells are numbered 0 to n - 1."""

    n_whole: int  # number of cells of the whole graph, N
    cells: Ints  # (n,) indices of the kept cells in the whole graph, in ascending order
    arcs: Longs  # (m,) indices of the kept arcs in the whole graph, in ascending order
    offsets: Longs  # (n + 1,) index in `neighbors` of the first arc of each kept cell
    neighbors: Ints  # (m,) number, 0 to n - 1, of the target cell of each kept arc
    groups: Ints
    """Group of each kept cell, (n,), or an empty array if there are no barriers. Cells of different
    groups must not be in one region, unless one of the groups is `ANY_GROUP`."""

    @classmethod
    def of(
        cls, graph: CsrArcs, is_kept: Bools, keeps_arc: Bools, sources: Ints, groups: Ints
    ) -> KeptCells:
        """Make an instance from the cells and arcs to keep; kept arcs must join kept cells."""
        cells = np.flatnonzero(is_kept).astype(np.int32)
        arcs = np.flatnonzero(keeps_arc)
        numbers = np.cumsum(is_kept, dtype=np.int32) - np.int32(1)
        counts = np.bincount(sources[arcs], minlength=len(is_kept))[cells]
        return cls(
            len(is_kept), cells, arcs, np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            numbers[graph.neighbors[arcs]], groups[cells] if len(groups) else NO_GROUPS,
        )  # fmt: skip

    def surface_of(self, whole: Surface) -> Surface:
        """Return the surface of the kept cells. `whole` is the surface of all cells."""
        return whole.part(self.cells, self.arcs, self.offsets, self.neighbors)

    def new_cells(self, seeds: npt.ArrayLike, order: Ints | None = None) -> Ints:
        """Convert seeds, indices of cells in the whole graph, to numbers of kept cells.

        Raises a ValueError if a cell is not kept; the message has its index before sorting.
        """
        given = checked_seeds(seeds, self.n_whole, "init")
        found = np.minimum(np.searchsorted(self.cells, given), len(self.cells) - 1)
        is_out = self.cells[found] != given
        if is_out.any():
            first = int(np.argmax(is_out))
            cell = given[first] if order is None else order[given[first]]
            raise ValueError(f"init[{first}] is cell {cell}, but the mask excludes this cell")
        return found.astype(np.int32)

    def whole_labels(self, labels: Ints) -> Ints:
        """Convert labels of kept cells to labels of all cells; cells that are not kept get -1."""
        whole = np.full(self.n_whole, -1, np.int32)
        whole[self.cells] = labels
        return whole


def mask_of(labels: Ints, values: Sequence[int] | None, file: object, cells: Cells) -> Bools:
    """Return the mask of the cells with one of `values`; None stands for all values except 0.

    Raises a MeshError if there are no such cells; `labels` is the value of each cell in `file`.
    """
    is_kept = labels != 0 if values is None else np.isin(labels, values)
    if not is_kept.any():
        wanted = "a value other than 0"
        if values is not None:
            wanted = f"the value {' or '.join(map(str, values))}"
        raise MeshError(f"{file}: no {kind_of(cells).noun} has {wanted}")
    return is_kept


def sharp_edges(
    mesh: MeshLike, angle: float = 30.0, *, weld: float = True, n_threads: int | None = None
) -> Ints:
    """Return the sharp edges of a mesh, to use as `barriers` of `segment`.

    An edge is sharp if the normals of its faces differ by `angle` or more. With these barriers,
    ``segment(mesh, 1, ...)`` makes one region per smooth surface of a CAD part. Surfaces that meet
    tangentially, such as a flat side and its fillet, are in one region. If a line of sharp edges
    ends inside a smooth surface, one region covers both sides of the line.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    angle : float, default 30
        Minimum angle of sharp edges, in degrees, above 0 and at most 180. The angle of an edge is
        the angle between the normals of its faces: 0 on a flat surface, and 90 at the edges of a
        cube. Both convex and concave edges can be sharp.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    ndarray of int32, shape (E, 2)
        The two vertices of each sharp edge, with the lower vertex first. Edges are sorted. If
        vertices at the same position are welded, the lowest of these vertices is used. Edges of
        three or more faces are always sharp. Boundary edges are never sharp.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, or if `angle` is not in (0, 180].

    Examples
    --------
    >>> from superfacets import Mesh
    >>> roof = Mesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> sharp_edges(roof).tolist(), sharp_edges(roof, 91).tolist()
    ([[0, 2]], [])
    """
    keys, _ = _sharp_sides(mesh, angle, weld, n_threads)
    return edges_of_keys(np.unique(keys))


def sharp_edges_inside(
    mesh: FaceMesh, labels: Ints, angle: float, *, n_threads: int | None = None
) -> Floats:
    """Return, for each region, the share of all sharp edges, by length, that is inside it, (K,)."""
    keys, faces = _sharp_sides(mesh, angle, True, n_threads)
    n_regions, total = int(labels.max()) + 1, edge_lengths(mesh, np.unique(keys)).sum()
    is_inside = (labels[faces[:, 0]] == labels[faces[:, 1]]) & (labels[faces[:, 0]] >= 0)
    inside, first = np.unique(keys[is_inside], return_index=True)
    regions = labels[faces[is_inside, 0][first]]
    return np.bincount(regions, edge_lengths(mesh, inside), n_regions) / (total or 1.0)


def checked_angle(angle: Any) -> float:
    """Check a minimum angle of sharp edges, in degrees, and return it as a float."""
    number = checked_number(angle, "angle", zero=False)
    if number > 180:
        raise ValueError(f"angle must be at most 180, got {number:g}")
    return number


def _sharp_sides(
    mesh: MeshLike, angle: float, weld: float, n_threads: int | None
) -> tuple[Longs, Ints]:
    """Return the key (see `edge_keys`) and both faces of each arc across a sharp edge."""
    limit = np.radians(checked_angle(angle))
    source, threads = as_mesh(mesh), checked_threads(n_threads)
    graph = build_face_graph(source, weld=weld, n_threads=threads)
    angles = arc_measures(source, graph, n_threads=threads).angles
    assert angles is not None
    sources, is_sharp = graph.sources, np.abs(angles) >= limit - ANGLE_NOISE
    # The arcs of a face are sorted by side. If two consecutive arcs cross the same side, its edge
    # has three or more faces, so it is sharp.
    is_sharp[1:] |= (sources[1:] == sources[:-1]) & (graph.sides[1:] == graph.sides[:-1])
    lowest = lowest_vertices(source.vertices, weld, threads)
    ends = lowest[corners_of(source).ends_of_sides(sources[is_sharp], graph.sides[is_sharp])]
    faces = np.stack([sources[is_sharp], graph.neighbors[is_sharp]], axis=1)
    return edge_keys(ends), faces


def in_order(values: Array, order: Ints | None) -> Array:
    """Return ``values[order]``, or `values` unchanged if `order` is None."""
    return values if order is None else values[order]


def _checked_kept(mask: Any, n_cells: int) -> Bools:
    refuse_mask(mask, "mask")
    is_kept = checked_mask(mask, n_cells, "mask")
    if not is_kept.any():
        raise ValueError("mask must be True for at least one cell, but it is False everywhere")
    return is_kept


def _checked_groups(barriers: Any, n_cells: int) -> Ints:
    """Check barriers in the form of one number per cell, and replace the numbers by 0, 1, 2, ..."""
    given = np.asarray(barriers)
    if given.dtype.kind not in "iub":
        raise TypeError(f"barriers must contain integers, got {given.dtype}")
    if given.shape != (n_cells,):
        raise ValueError(
            f"barriers must have one number per cell, shape ({n_cells},), or be edges of a mesh,"
            f" shape (E, 2), got shape {given.shape}"
        )
    _, groups = np.unique(given, return_inverse=True)
    return groups.astype(np.int32)


def _checked_edges(barriers: Any, n_vertices: int) -> Ints:
    """Check barriers in the form of edges, and return them as an (E, 2) int32 array."""
    given = np.asarray(barriers)
    if given.ndim != 2 or given.shape[1] != 2:
        raise ValueError(f"barriers must have shape (E, 2), got {given.shape}")
    pairs = owned_indices(integer_array(given.ravel(), "barriers")).reshape(-1, 2)
    is_wrong = ((pairs < 0) | (pairs >= n_vertices)).any(axis=1)
    refuse_first(is_wrong, "barriers", given, f"vertices from 0 to {n_vertices - 1}")
    return pairs


def _crossed_by(
    barriers: Any, source: Any, arcs: tuple[CsrArcs, Ints], weld: float, n_threads: int,
    is_sorted: bool,
) -> Bools:  # fmt: skip
    """Return whether each arc crosses an edge in `barriers`.

    `arcs` are the graph of the faces of `source`, which may have been sorted, and its sources.
    """
    graph, sources = arcs
    if not isinstance(graph, FaceGraph):
        raise ValueError(
            "barriers of shape (E, 2) need a mesh with faces: for other cells, pass one number per"
            " cell"
        )
    given = _checked_edges(barriers, source.n_vertices)
    corners = corners_of(source)
    if is_sorted:
        found = sorted_corners(source.vertices, corners, weld, n_threads, are_faces=True)
        offsets, places = None if corners.offsets is None else found.offsets, found.places
        corners = replace(corners, vertices=found.corners, offsets=offsets)
    else:
        places = lowest_vertices(source.vertices, weld, n_threads)
        corners = replace(corners, vertices=places[corners.vertices])
    wanted = places[given]
    is_end = np.zeros(source.n_vertices, bool)
    is_end[wanted] = True
    faces = np.repeat(np.arange(source.n_faces), corners.sizes)
    sides = np.arange(len(faces)) - corners.starts[faces]
    ends = corners.ends_of_sides(faces, sides)
    # Sides whose two ends are ends of barriers. Sides that are not barriers are removed below.
    is_crossed: Bools = np.asarray(is_end[ends].all(axis=1))
    keys, wanted_keys = edge_keys(ends[is_crossed]), edge_keys(wanted)
    refuse_first(~np.isin(wanted_keys, keys), "barriers", given, "an edge of the mesh")
    is_crossed[is_crossed] = np.isin(keys, wanted_keys)
    return np.asarray(is_crossed[corners.starts[sources] + graph.sides])


def edge_keys(edges: Ints) -> Longs:
    """Return an integer key for each edge, which does not depend on the order of its ends."""
    low, high = edges.min(axis=1).astype(np.int64), edges.max(axis=1)
    return np.asarray((low << 32) | high)


def edges_of_keys(keys: Longs) -> Ints:
    """Return the edges with these keys, (E, 2), with the lower vertex first; see `edge_keys`."""
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


def edge_lengths(mesh: FaceMesh, keys: Longs) -> Floats:
    """Return the length of each edge, (E,); see `edge_keys` for the keys of edges."""
    starts, ends = mesh.vertices[edges_of_keys(keys).T]
    lengths: Floats = np.linalg.norm(ends - starts, axis=1)
    return lengths


def _groups_apart(graph: CsrArcs, before: Bools, after: Bools, sources: Ints) -> Ints:
    """Return the group of each cell: the piece with the cell if barriers cut its component.

    Other cells get `ANY_GROUP`. `before` marks arcs that the mask keeps; `after` excludes barriers.
    """
    whole, n_whole = components_of(graph, before, sources)
    pieces, n_pieces = components_of(graph, after, sources)
    whole_of_piece = np.empty(n_pieces, np.int32)
    whole_of_piece[pieces] = whole
    is_cut = np.bincount(whole_of_piece, minlength=n_whole) > 1
    return np.where(is_cut[whole], pieces, np.int32(ANY_GROUP))


def components_of(graph: CsrArcs, keeps_arc: Bools, sources: Ints) -> tuple[Ints, int]:
    """Return the component of each cell, (N,), along arcs in `keeps_arc`, (M,), and their count."""
    counts = np.bincount(sources[keeps_arc], minlength=graph.n_cells)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    one_label = np.zeros(graph.n_cells, np.int32)
    return _core.find_components(offsets, graph.neighbors[keeps_arc], one_label)
