"""Stage 5: extract borders of regions as lines along edges, and find the cells at borders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_regions, checked_threads, counted, freeze
from ..base.types import Bools, Floats, Ints, Longs
from ..graph.cell_graph import CellGraph
from ..graph.face_graph import FaceGraph, build_face_graph
from ..graph.kinds import as_known, kind_of
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, corners_of
from ..mesh.weld import lowest_vertices

NO_REGION = -1
"""Second region of a line at the boundary of the mesh or at faces without a region."""


@dataclass(frozen=True, eq=False)
class BorderLines:
    """Result of `border_lines`: L lines along edges, each between two regions.

    ``len(lines)`` is L.

    Attributes
    ----------
    vertices : ndarray of int32, shape (P,)
        Vertices of all lines, one line after the other. If vertices are welded, the vertex with the
        lowest index at each position is listed.
    offsets : ndarray of int64, shape (L + 1,)
        The vertices of line i are ``vertices[offsets[i]:offsets[i + 1]]``; see `line`.
    regions : ndarray of int32, shape (L, 2)
        The two regions that each line separates, the lower region first. At the boundary of an open
        mesh and at faces in no region, the existing region is first, and the second region is -1.
        If faces are consistently oriented, the first region is to the left of the line, seen from
        outside.
    is_closed : ndarray of bool, shape (L,)
        Whether each line is a loop. The first vertex of a loop is not repeated at its end.
    lengths : ndarray of float64, shape (L,)
        Length of each line, in the unit of the vertices.
    junctions : ndarray of int32, shape (J,)
        Vertices where lines end, in ascending order. A line ends at a vertex if the number of
        border edges at the vertex is not two, or if the two edges separate different regions.
    """

    vertices: Ints
    offsets: Longs
    regions: Ints
    is_closed: Bools
    lengths: Floats
    junctions: Ints

    def __len__(self) -> int:
        """Number of lines, L."""
        return len(self.regions)

    def line(self, i: int) -> Ints:
        """Return the vertices of line i, from 0 to L - 1, in the order along the line."""
        if not 0 <= i < len(self):
            raise IndexError(f"there is no line {i}: the number of lines is {len(self)}")
        return self.vertices[self.offsets[i] : self.offsets[i + 1]]

    @property
    def paths(self) -> list[Ints]:
        """Vertices of each line, in the order along the line; a loop ends at its first vertex."""
        pairs = zip(map(self.line, range(len(self))), self.is_closed, strict=True)
        return [np.append(line, line[: int(is_closed)]) for line, is_closed in pairs]

    def __repr__(self) -> str:
        return (
            f"BorderLines({counted(len(self), 'line')}, {counted(len(self.junctions), 'junction')})"
        )


def border_lines(
    mesh: MeshLike, labels: npt.ArrayLike, *, weld: float = True, n_threads: int | None = None
) -> BorderLines:
    """Return the borders between regions, and the boundary of an open mesh, as ordered lines.

    Lines run along edges of the mesh, from junction to junction or as closed loops.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`, but the mesh must have faces.
    labels : array_like of int, shape (F,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks faces in no region.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    BorderLines
        All lines, open lines before closed lines.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, if labels are not one integer >= -1 per face, or
        if a label from 0 to K - 1 is missing.

    Notes
    -----
    If faces of three regions share an edge, there is a line along the edge for each of the three
    pairs of regions. Time is O(F + B log B) for B border edges.

    Examples
    --------
    The diagonal of a square separates two triangles, and each triangle has two boundary edges:

    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> lines = border_lines(square, [0, 1])
    >>> [(line, lines.line(i).tolist()) for i, line in enumerate(lines.regions.tolist())]
    [([0, -1], [0, 1, 2]), ([0, 1], [2, 0]), ([1, -1], [2, 3, 0])]
    """
    checked = as_mesh(mesh)
    threads = checked_threads(n_threads)
    array, _ = checked_regions(labels, checked.n_faces)
    graph = build_face_graph(checked, weld=weld, n_threads=threads)
    return _lines_of(_Segments.of(checked, graph, array, weld, threads), checked)


@dataclass(frozen=True, eq=False)
class _Segments:
    """Segments of borders: one per edge and pair of regions at the edge, sorted in this order."""

    edges: Longs  # (S,) index of the edge among the B border edges
    ends: Ints  # (S, 2) vertices of the edge, oriented as in a face of the first region
    regions: Ints  # (S, 2) lower and higher region; the second is -1 if there is only one

    @classmethod
    def of(
        cls, mesh: FaceMesh, graph: FaceGraph, labels: Ints, weld: float, n_threads: int
    ) -> _Segments:
        faces, sides, others = _border_sides(mesh, graph, labels)
        lowest = lowest_vertices(mesh.vertices, weld, n_threads)
        ends = lowest[corners_of(mesh).ends_of_sides(faces, sides)]
        is_edge = ends[:, 0] != ends[:, 1]
        ends, regions = ends[is_edge], np.stack([labels[faces], others], axis=1)[is_edge]
        low, high = ends.min(axis=1), ends.max(axis=1)
        columns = np.stack([low, high, *regions.T])
        order = np.lexsort(columns[::-1])
        columns = columns[:, order]
        is_new = np.ones(len(order), dtype=bool)
        is_new[1:] = np.any(columns[:, 1:] != columns[:, :-1], axis=0)
        order, columns = order[is_new], columns[:, is_new]
        starts = np.any(columns[:2, 1:] != columns[:2, :-1], axis=0)
        edges = np.concatenate([np.zeros(min(len(order), 1), bool), starts]).cumsum()
        return cls(edges, ends[order], regions[order])

    @property
    def kinds(self) -> Longs:
        """Key of each border edge, (B,). Edges with equal keys separate the same regions."""
        firsts = np.flatnonzero(np.diff(self.edges, prepend=-1))
        keys = self.regions[:, 0].astype(np.int64) << 32 | (self.regions[:, 1] + 1)
        kinds = keys[firsts]
        # Edges where three or more regions meet have several pairs of regions, and get new keys
        # below 0. All other keys are >= 0.
        several: dict[tuple[int, ...], int] = {}
        stops = np.append(firsts[1:], len(keys))
        for edge in np.flatnonzero(stops - firsts > 1).tolist():
            pairs = tuple(keys[firsts[edge] : stops[edge]].tolist())
            kinds[edge] = several.setdefault(pairs, -1 - len(several))
        return kinds


def _border_sides(
    mesh: FaceMesh, graph: FaceGraph, labels: Ints
) -> tuple[Ints, npt.NDArray[np.integer], Ints]:
    """Return the face, the number in it, and the opposite region of each side at a border.

    It is a side of the lower region. At the boundary and at faces without a region, the opposite
    region is `NO_REGION`.
    """
    sources = graph.sources
    own, others = labels[sources], labels[graph.neighbors]
    arcs = np.flatnonzero((own != NO_REGION) & ((own < others) | (others == NO_REGION)))
    starts = corners_of(mesh).starts
    is_open = np.ones(starts[-1], dtype=bool)
    is_open[starts[sources] + graph.sides] = False
    corners = np.flatnonzero(is_open)
    faces = (np.searchsorted(starts, corners, side="right") - 1).astype(np.int32)
    has_region = labels[faces] != NO_REGION
    corners, faces = corners[has_region], faces[has_region]
    return (
        np.concatenate([sources[arcs], faces]),
        np.concatenate([graph.sides[arcs].astype(np.int64), corners - starts[faces]]),
        np.concatenate([others[arcs], np.full(len(faces), NO_REGION, np.int32)]),
    )


def _lines_of(segments: _Segments, mesh: FaceMesh) -> BorderLines:
    vertices, indices = np.unique(segments.ends, return_inverse=True)
    ends = indices.reshape(-1, 2)  # ends of each segment as indices into `vertices`
    continues = _continues(segments, ends, len(vertices))
    partners = _partners_of(ends.ravel(), segments.regions, continues)
    offsets, entries, is_closed = _core.trace_lines(partners)
    is_open = is_closed == 0
    steps = mesh.vertices[segments.ends[:, 1]] - mesh.vertices[segments.ends[:, 0]]
    lengths = np.sqrt(np.einsum("ij,ij->i", steps, steps))[entries >> 1]
    # An open line of n segments has n + 1 vertices, and a closed line has n.
    ends_before = np.concatenate([[0], np.cumsum(is_open)])
    numbers = np.repeat(np.arange(len(is_open)), np.diff(offsets))
    along = np.empty(len(entries) + ends_before[-1], dtype=np.int32)
    along[np.arange(len(entries)) + ends_before[numbers]] = segments.ends.ravel()[entries]
    last = entries[offsets[1:][is_open] - 1] ^ 1
    along[(offsets + ends_before)[1:][is_open] - 1] = segments.ends.ravel()[last]
    arrays = {
        "vertices": along, "offsets": offsets + ends_before,
        "regions": segments.regions[entries[offsets[:-1]] >> 1], "is_closed": ~is_open,
        "lengths": np.bincount(numbers, weights=lengths, minlength=len(is_open)),
        "junctions": vertices[~continues],
    }  # fmt: skip
    lines = BorderLines(**arrays)
    freeze(lines, **arrays)
    return lines


def _continues(segments: _Segments, ends: Longs, n_vertices: int) -> Bools:
    """Return whether each vertex has exactly two border edges that separate the same regions."""
    firsts = np.flatnonzero(np.diff(segments.edges, prepend=-1))
    at, kinds = ends[firsts].ravel(), np.repeat(segments.kinds, 2)
    lowest = np.full(n_vertices, np.iinfo(np.int64).max)
    highest = np.full(n_vertices, np.iinfo(np.int64).min)
    np.minimum.at(lowest, at, kinds)
    np.maximum.at(highest, at, kinds)
    return np.asarray((np.bincount(at, minlength=n_vertices) == 2) & (lowest == highest))


def _partners_of(at: Longs, regions: Ints, continues: Bools) -> Longs:
    """Return, for each end of a segment, the end that continues its line, (2 S,); -1 if none does.

    Ends 2 i and 2 i + 1 belong to segment i. `at` is the vertex of each end.
    """
    partners = np.full(len(at), -1, dtype=np.int64)
    ends = np.flatnonzero(continues[at])
    pairs = regions[ends >> 1]
    ends = ends[np.lexsort((pairs[:, 1], pairs[:, 0], at[ends]))]
    partners[ends[::2]], partners[ends[1::2]] = ends[1::2], ends[::2]
    return partners


def find_boundaries(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, weld: float = True,
    n_threads: int | None = None,
) -> Bools:  # fmt: skip
    """Return whether each cell has a neighbor with another label.

    Cells on both sides of a border are marked, as ``find_boundaries`` of scikit-image marks pixels
    in the mode ``"thick"``. The boundary of an open mesh is not a border. To get the edges of
    borders, use `border_lines`.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like, or CellGraph
        Same as in `segment`, or a graph of any cells.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks cells in no region, which
        are treated like cells of one more region.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    ndarray of bool, shape (N,)

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell, or if a label from 0
        to K - 1 is missing.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> vertices = [[x // 2, x % 2, 0] for x in range(7)]
    >>> strip = Mesh(vertices, [[f, f + 1, f + 2] for f in range(5)])
    >>> find_boundaries(strip, [0, 0, 1, 1, 1]).tolist()
    [False, True, True, False, False]
    """
    known = as_known(mesh)
    graph, _ = kind_of(known).build_graph(known, weld, checked_threads(n_threads))
    array, _ = checked_regions(labels, graph.n_cells)
    sources, neighbors = graph.sources, graph.neighbors
    differ = array[sources] != array[neighbors]
    is_boundary = np.zeros(graph.n_cells, dtype=bool)
    is_boundary[sources[differ]] = True
    is_boundary[neighbors[differ]] = True  # because an arc may have no reverse arc
    return is_boundary
