"""Define the operations that depend on the kind of cells, for example triangles or points.

To add a kind, derive a class from `Cells` and another class from `Kind`, and name both by an entry
point of the group ``superfacets.kinds``. The name of the entry point is the class of the cells, for
example ``package.module.Class``, and its value is a `Kind`. File formats of the kind are entry
points, too (see `files.formats`).
"""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple, TypeAlias, cast

import numpy as np

from .. import _core
from ..base.checks import checked_threads, counted, refuse_mask
from ..base.errors import MeshError
from ..base.lazy import Table, load
from ..base.types import ArcLists, Array, Bools, Floats, Ints, Longs, Singles
from ..mesh.base import Cells, CellsOfVertices
from ..mesh.convert import MeshLike, as_cells
from ..mesh.faces import Corners, FaceMesh, corners_of, cut_into_triangles, measure_faces, mesh_like
from ..mesh.meshes import Mesh, PolygonMesh
from ..mesh.point_cloud import PointCloud
from .cell_graph import BaseGraph, CellGraph
from .face_graph import FaceArcs, FaceGraph, arcs_at_borders
from .point_graph import PointGraph, find_point_graph, point_surface
from .size import sliver_share
from .sorting import sorted_corners
from .sums import weighted_majority
from .surface import NO_NORMALS, Surface

Nearest: TypeAlias = tuple[Ints, Floats]
"""Index of the cell nearest to each query point, and its distance."""

DrawnFaces: TypeAlias = tuple[FaceMesh, Ints | None]
"""Faces to draw in pictures of cells, such as the boundary of tetrahedra, and the cell that each
face belongs to, (F,); None if the faces are the cells."""


class OrderedCells(NamedTuple):
    """Cells and their graph (for clouds only the graph), in input order or sorted along a curve."""

    cells: Cells  # mesh or cloud of the same class as the input
    graph: BaseGraph
    longest: Floats | None  # longest sides of faces, for `sliver_share`
    input_index: Ints | None  # (N,) index of each cell in the input; None if cells are not sorted


class Kind:
    """Base class of the operations on one kind of cells, for packages that add a kind.

    The argument `cells` of the methods is an object of the class for which the kind is registered.
    If `build_graph` returns a `CellGraph` with `ArcMeasures`, all other methods can be inherited.
    The arcs then have the weights of this graph, unless the caller of `segment` gives weights.
    """

    name: ClassVar[str] = "cells"
    """Name of the kind, and its key in tables of other modules."""
    noun: ClassVar[str] = "cell"
    """Noun for one cell in messages that count cells. For the plural, an "s" is appended."""
    plural: ClassVar[str] = "cells"
    """Plural noun in messages that do not count cells. It may differ from `noun` plus "s"."""
    dimension: ClassVar[int] = 2
    """2 if measures are areas, 3 if they are volumes."""
    has_faces: ClassVar[bool] = False
    """Whether cells are faces of a surface mesh."""
    are_points: ClassVar[bool] = False
    """Whether cells are points of a cloud."""
    has_angles: ClassVar[bool] = False
    """Whether arcs have angles, so that formulas can compute their weights."""

    def build_graph(
        self, cells: Any, weld: float, n_threads: int
    ) -> tuple[BaseGraph, Floats | None]:
        """Return the graph of the cells, and the longest sides of cells that are faces."""
        return cells, None

    def ordered(
        self, cells: Any, weld: float, n_threads: int, *, may_sort: bool,
        is_kept: Bools | None = None,
    ) -> OrderedCells:  # fmt: skip
        """Build the graph of the cells, which are sorted first if `may_sort`.

        If `is_kept` is given, (N,), points of a cloud that are not kept have no neighbors.
        """
        cells, weld, order = self.sorted(cells, weld, n_threads, may_sort=may_sort)
        return OrderedCells(cells, *self.build_graph(cells, weld, n_threads), order)

    def sorted(
        self, cells: Any, weld: float, n_threads: int, *, may_sort: bool
    ) -> tuple[Any, float, Ints | None]:
        """Sort the cells of a mesh as in `ordered`, and weld vertices of sorted cells.

        Returns the cells, how to weld them later, and `OrderedCells.input_index`.
        """
        corners = self.corners(cells) if may_sort else None
        if corners is None:
            return cells, weld, None
        found = sorted_corners(cells.vertices, corners, weld, n_threads, are_faces=self.has_faces)
        ordered = self.with_corners(
            cells, found.vertices, found.corners, found.offsets, cells.bounds
        )
        return ordered, False, found.order

    def surface(self, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the `Surface` of the cells, which computes lengths and angles of arcs."""
        return Surface.of_graph(graph, n_threads)

    def bare_surface(self, surface: Surface, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the surface without arrays that are only needed for weights, to save memory."""
        return surface

    def normals(self, surface: Surface, graph: Any) -> Singles:
        """Return the outward unit normal of each cell, (N, 3); 0 if it is not known."""
        return np.zeros((surface.n_cells, 3), np.float32)

    def tells_concave(self, graph: Any) -> bool:
        """Return whether concave and convex creases can be distinguished."""
        return True

    def sliver_share(
        self, cells: Any, areas: Floats, longest: Floats | None, radius: float, n_threads: int
    ) -> float:
        """Return the fraction of the area in long and thin faces; 0 if cells are not faces."""
        return 0.0

    def measures(self, cells: Any, n_threads: int) -> Floats:
        """Return the area or volume of each cell, (N,)."""
        graph, _ = self.build_graph(cells, True, n_threads)
        return np.asarray(graph.measures)

    def positions(self, cells: Any) -> Floats:
        """Return a representative point of each cell, (N, 3)."""
        graph, _ = self.build_graph(cells, True, checked_threads(None))
        return np.asarray(graph.positions)

    def nearest(self, cells: Any, queries: Floats, max_distance: float, n_threads: int) -> Nearest:
        """Return the cell nearest to each query point, and its distance.

        If all cells are farther than `max_distance`, the cell is -1, and the distance infinite.
        """
        return _core.nearest_points(self.positions(cells), queries, max_distance, n_threads)

    def corners(self, cells: Any) -> Corners | None:
        """Return the vertices at the corners of the cells, or None if cells have no corners."""
        return corners_of(cells) if isinstance(cells, CellsOfVertices) else None

    def part(self, cells: Any, chosen: Ints) -> Any:
        """Return a cloud of the points with the indices `chosen`.

        Raises a MeshError if cells are not points. For cells with corners, use `with_corners`.
        """
        raise MeshError(f"{self.plural} cannot be split into files: write only their labels")

    def with_corners(
        self, cells: Any, vertices: Floats, corners: Ints, offsets: Longs,
        bounds: Floats | None = None,
    ) -> Any:  # fmt: skip
        """Make a mesh of the class of `cells` from new vertices and corners; see `mesh_like`."""
        return mesh_like(cells, vertices, corners, offsets, bounds)

    def has_fronts(self, cells: Any) -> bool:
        """Return whether the front sides of the cells are known."""
        return True

    def seen_from(self, cells: Any, viewpoint: Sequence[float] | None) -> Any:
        """Return a cloud with `viewpoint`, or `cells` if it is None.

        Raises a MeshError if the viewpoint has no effect.
        """
        if viewpoint is None:
            return cells
        raise MeshError("omit viewpoint: it is only for point clouds without normals")

    def drawn_faces(self, cells: Any, keep: Bools | None = None) -> DrawnFaces | None:
        """Return the faces to draw in a picture of the cells, or None to draw `cloud` instead.

        For tetrahedra, `keep` marks the cells to draw. For other cells, `keep` is ignored.
        """
        return None

    @staticmethod
    def seen_cells(
        drawn: DrawnFaces, views: Floats, sizes: Ints, n_threads: int
    ) -> tuple[Ints, Floats, Ints]:
        """Return the visible cell (or -1) and its area per pixel of n images, and all seen cells.

        `drawn` is the result of `drawn_faces`. A row of `views`, (n, 13), is a matrix (3, 4) that
        maps (x, y, z, 1) to depth * (u, v, 1), with pixel (u, v), and the product of the focal
        lengths in pixels. `sizes`, (n, 2) int32, has the width and height of each image, and pixels
        are returned row by row. An area is 0 if no cell is visible, or if the angle between the
        surface and the line of sight is below 6 degrees.
        """
        if views.shape != (len(sizes), 13) or sizes.shape != (len(views), 2) or sizes.min() < 1:
            raise ValueError("views and sizes must have a row of 13 and of 2 numbers per image")
        mesh, sources = drawn
        triangles, faces = cut_into_triangles(mesh)
        found, areas, is_seen = _core.see_surface(
            mesh.vertices, triangles, views, sizes.ravel(), n_threads
        )
        seen = np.flatnonzero(is_seen).astype(np.int32)
        for owners in (faces, sources):
            if owners is not None:
                seen, found = owners[seen], np.append(owners, np.int32(-1))[found]
        return found, areas, seen

    def cloud(self, cells: Any) -> PointCloud:
        """Return the points to draw if `drawn_faces` returns None."""
        return PointCloud(self.positions(cells))

    def point_graph(self, cells: Any, n_threads: int) -> PointGraph:
        """Return the neighbors, areas and normals of the points of `cloud`."""
        return find_point_graph(self.cloud(cells), n_threads)

    def border_arcs(self, cells: Any, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        """Return the arcs between some of the cells, and the labels of these cells.

        All cells at region borders are among them. Arcs are offsets and neighbors in CSR form.
        """
        graph, _ = self.build_graph(cells, True, n_threads)
        return (graph.offsets, graph.neighbors), labels


class _Polygons(Kind):
    name = "polygons"
    noun = "face"
    plural = "faces"
    has_faces = True
    has_angles = True

    def build_graph(
        self, cells: FaceMesh, weld: float, n_threads: int
    ) -> tuple[FaceGraph, Floats | None]:
        return FaceArcs.of(cells, weld, n_threads).measured(cells, n_threads)

    def surface(self, cells: FaceMesh, graph: FaceGraph, n_threads: int) -> Surface:
        return Surface.of_faces(cells, graph, n_threads)

    def normals(self, surface: Surface, graph: FaceGraph) -> Singles:
        handle = cast(_core.TriangleSurface | _core.PolygonSurface, surface.handle)
        normals = surface.single_normals()
        if handle.is_inside_out:
            np.negative(normals, out=normals)
        if graph.has_turns:  # it is unknown which of two inconsistent neighbors is right
            normals[graph.sources[graph.same_turn != 0]] = 0.0
        return normals

    def sliver_share(
        self, cells: FaceMesh, areas: Floats, longest: Floats | None, radius: float, n_threads: int
    ) -> float:
        return sliver_share(cells, areas, longest, radius, n_threads)

    def measures(self, cells: FaceMesh, n_threads: int) -> Floats:
        return measure_faces(cells, n_threads)[1]

    def positions(self, cells: FaceMesh) -> Floats:
        return measure_faces(cells, checked_threads(None))[0]

    def nearest(
        self, cells: FaceMesh, queries: Floats, max_distance: float, n_threads: int
    ) -> Nearest:
        triangles, sources = cut_into_triangles(cells)
        nearest, distances = _core.nearest_triangles(
            cells.vertices, triangles, queries, max_distance, n_threads
        )
        if sources is not None:
            nearest = np.append(sources, np.int32(-1))[nearest]  # index -1 selects the appended -1
        return nearest, distances

    def drawn_faces(self, cells: FaceMesh, keep: Bools | None = None) -> DrawnFaces:
        return cells, None


class _Triangles(_Polygons):
    name = "triangles"

    def border_arcs(self, cells: Mesh, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        return arcs_at_borders(cells, labels, n_threads)


class _Points(Kind):
    name = "points"
    noun = "point"
    plural = "points"
    are_points = True
    has_angles = True

    def has_fronts(self, cells: PointCloud) -> bool:
        return cells.normals is not None or cells.viewpoints is not None

    def seen_from(self, cells: PointCloud, viewpoint: Sequence[float] | None) -> Any:
        if viewpoint is None or cells.normals is not None:
            return super().seen_from(cells, viewpoint)
        return PointCloud(cells.points, None, cells.colors, cells.axes, np.array(viewpoint))

    def build_graph(
        self, cells: PointCloud, weld: float, n_threads: int
    ) -> tuple[PointGraph, None]:
        return find_point_graph(cells, n_threads), None

    def ordered(
        self, cells: PointCloud, weld: float, n_threads: int, *, may_sort: bool,
        is_kept: Bools | None = None,
    ) -> OrderedCells:  # fmt: skip
        graph = find_point_graph(cells, n_threads, is_kept=is_kept, is_sorted=may_sort)
        return OrderedCells(cells, graph, None, graph.points)

    def surface(self, cells: PointCloud, graph: PointGraph, n_threads: int) -> Surface:
        return point_surface(graph, n_threads)

    def bare_surface(
        self, surface: Surface, cells: PointCloud, graph: PointGraph, n_threads: int
    ) -> Surface:
        return point_surface(replace(graph, normals=NO_NORMALS), n_threads)

    def tells_concave(self, graph: PointGraph) -> bool:
        return graph.tells_concave

    def normals(self, surface: Surface, graph: PointGraph) -> Singles:
        if not graph.tells_concave:
            return super().normals(surface, graph)
        return _core.narrowed(graph.normals.reshape(-1), surface.n_threads).reshape(-1, 3)

    def positions(self, cells: PointCloud) -> Floats:
        return cells.points

    def part(self, cells: PointCloud, chosen: Ints) -> PointCloud:
        return cells.taken(chosen)

    def cloud(self, cells: PointCloud) -> PointCloud:
        return cells


_KINDS: dict[type, Kind] = {}

_NAMED = {"superfacets_formats.tet_mesh.TetMesh": "superfacets_formats.tet_graph:TETS"}
"""Kinds that are registered when they are needed, keyed by the name of the class of cells."""


def register(cells: type, kind: Kind) -> None:
    """Register a kind for a class of cells, so that `segment` accepts objects of this class."""
    _KINDS[cells] = kind


register(CellGraph, Kind())
register(Mesh, _Triangles())
register(PolygonMesh, _Polygons())
register(PointCloud, _Points())


def kind_of(cells: object) -> Kind:
    """Return the `Kind` of cells, whose methods and names apps use instead of testing classes."""
    found = type(cells)
    if found not in _KINDS:
        name = f"{found.__module__}.{found.__qualname__}"
        target = _NAMED.get(name) or Table.added("superfacets.kinds").get(name)
        if target is None:
            raise TypeError(
                f"{found.__name__} is not a registered class of cells: add an entry point of the"
                " group superfacets.kinds"
            )
        register(found, load(target))
    return _KINDS[found]


def as_known(source: MeshLike | CellGraph) -> Any:
    """Convert a mesh or cloud of any type with `as_cells`; return a `CellGraph` unchanged."""
    return source if isinstance(source, CellGraph) else as_cells(source)


def as_surface(
    source: MeshLike | CellGraph, *, weld: float, n_threads: int | None,
    is_kept: Bools | None = None,
) -> Surface:  # fmt: skip
    """Return the `Surface` of a mesh, a cloud, or a graph with `ArcMeasures`."""
    return graph_and_surface(as_known(source), weld, checked_threads(n_threads), is_kept)[1]


def graph_and_surface(
    cells: Cells | CellGraph, weld: float, n_threads: int, is_kept: Bools | None = None
) -> tuple[BaseGraph, Surface]:
    """Return graph and `Surface` of cells; points not in `is_kept`, (N,), have no neighbors."""
    kind = kind_of(cells)
    graph = kind.ordered(cells, weld, n_threads, may_sort=False, is_kept=is_kept).graph
    return graph, kind.surface(cells, graph, n_threads)


def labels_of_corners(cells: Any, of_vertices: Array) -> Array:
    """Return, for each cell, the most frequent label of its corners, of the same type.

    If several labels are equally frequent, the lowest is used. `of_vertices` has one label per
    vertex, or per point of a cloud.
    """
    corners = kind_of(cells).corners(cells)
    if corners is None:
        return of_vertices
    names, ranks = np.unique(of_vertices, return_inverse=True)
    groups = np.repeat(np.arange(cells.n_cells), corners.sizes)
    voters = ranks[corners.vertices].astype(np.int32)
    winners = weighted_majority(groups, voters, np.ones(len(voters)), cells.n_cells).winners
    return np.asarray(names[winners])


def of_cells(values: Any, cells: Any) -> Any:
    """Convert labels of vertices, (V,), to labels of cells; return anything else unchanged.

    Apps use it for labels given by users. If a mesh has as many vertices as cells, the labels
    count as labels of cells.
    """
    if not fit_vertices(values, cells):
        return values
    refuse_mask(values, "labels")
    return labels_of_corners(cells, np.asarray(values))


def fit_vertices(values: Any, cells: Any) -> bool:
    """Return whether there is one value per vertex and not one per cell, as in `of_cells`."""
    n_vertices = getattr(cells, "n_vertices", None)  # point clouds have no vertices
    if isinstance(values, Sized) and len(values) != n_vertices:
        return False  # no array is made
    try:
        return bool(np.shape(values) == (n_vertices,) != (cells.n_cells,))
    except ValueError:  # items of different shapes
        return False


def are_of_vertices(labels: Sized, cells: Any, name: str = "labels") -> bool:
    """Return whether labels are per vertex, not per cell; raise a MeshError for other numbers."""
    n_vertices = getattr(cells, "n_vertices", None)  # point clouds have no vertices
    if len(labels) in (cells.n_cells, n_vertices):
        return len(labels) != int(cells.n_cells)
    vertices = "" if n_vertices is None else f" or per vertex ({n_vertices})"
    raise MeshError(
        f"{name} must have one value per {kind_of(cells).noun} ({cells.n_cells}){vertices},"
        f" got {counted(len(labels), 'value')}"
    )
