"""Kinds of cells, such as triangles or points, and all operations that depend on the kind.

A new kind needs a class of cells that derives from `Cells`, a subclass of `Kind`, and a call of
`register`. File formats (`export.cells`) and counts (`cells.info`) of a kind are optional. They are
in tables that are keyed by the name of the kind.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from .. import _core
from .._types import ArcLists, Bools, Floats, Ints, Longs
from .._validate import checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..errors import MeshError
from ..mesh.base import Cells
from ..mesh.faces import (
    AnyMesh,
    Corners,
    FaceMesh,
    corners_of,
    cut_into_triangles,
    measure_faces,
    mesh_like,
)
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh, signed_volumes
from ..mesh.triangle_mesh import Mesh
from .cell_graph import CellGraph
from .face_graph import FaceGraph, FaceShapes, arcs_at_borders, graph_and_shapes
from .point_graph import (
    PointGraph,
    bare_point_surface,
    find_point_graph,
    find_sorted_graph,
    point_surface,
)
from .size import sliver_share
from .sorting import is_scattered, sorted_corners
from .surface import Surface
from .tet_graph import TetGraph, build_tet_graph, tet_surface
from .weights import Weighed, WeightOptions, arc_weights, step_weights

Nearest: TypeAlias = tuple[Ints, Floats, Floats]
"""Nearest cell to each query point, its distance, and the nearest point of the cell."""


class Outside(NamedTuple):
    """Faces that are drawn to show cells in pictures."""

    mesh: FaceMesh
    sources: Ints | None  # (F,) cell of each face; None if the faces are the cells


class OrderedCells(NamedTuple):
    """Cells and their graph, in input order or in a sorted order for speed."""

    cells: Any  # cells of the same class as the input
    graph: Any
    shapes: Any  # measures that only weights need, or None
    order: Ints | None  # (N,) input index of each cell; None if cells are in input order


class Kind:
    """Operations that depend on the kind of cells.

    The methods of this base class work for `CellGraph`, and for each kind whose `build_graph`
    returns a `CellGraph` with `ArcMeasures`. A kind with this property overrides only
    `build_graph`. The argument `cells` is an object of the class that the kind is registered for.
    """

    name: ClassVar[str] = "cells"
    """Key of the kind in tables of other modules."""
    noun: ClassVar[str] = "cell"
    """Singular noun for a cell in messages. The plural in counts appends an "s"."""
    plural: ClassVar[str] = "cells"
    """Plural noun for cells in messages without counts."""
    dimension: ClassVar[int] = 2
    """2 if measures are areas, 3 if they are volumes."""
    has_faces: ClassVar[bool] = False
    """Whether cells are faces of a surface mesh."""
    are_points: ClassVar[bool] = False
    """Whether cells are points of a cloud."""

    def build_graph(self, cells: Any, weld: bool, n_threads: int) -> tuple[Any, Any]:
        """Return the graph of the cells, and measures that only weights need, or None.

        The graph has all members of `cell_graph.Arcs`.
        """
        return cells, None

    def sorted_graph(self, cells: Any, weld: bool, n_threads: int) -> OrderedCells | None:
        """Sort the cells for speed and build their graph, or return None if sorting is useless."""
        corners = self.corners(cells)
        if corners is None or not is_scattered(cells.vertices, corners):
            return None
        found = sorted_corners(cells.vertices, corners, weld, n_threads)
        ordered = self.with_corners(
            cells, found.vertices, found.corners, found.offsets, cells.bounds
        )
        # No vertices are welded here, because `sorted_corners` has welded them.
        return OrderedCells(ordered, *self.build_graph(ordered, False, n_threads), found.order)

    def surface(self, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the `Surface` of the cells, which stages 2 and 5 to 7 use."""
        return Surface.of_graph(graph, n_threads)

    def bare_surface(self, surface: Surface, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the surface, but leave out arrays that only weights need, to save memory."""
        return surface

    def weight_options(self, graph: Any, options: WeightOptions) -> WeightOptions:
        """Return the options with defaults that suit these cells."""
        return options

    def weights(
        self, surface: Surface, graph: Any, shapes: Any, radius: float, options: WeightOptions
    ) -> Weighed:
        """Return one weight per arc, which is the same for both directions."""
        return step_weights(surface, options, self.plural)

    def sliver_share(
        self, cells: Any, graph: Any, shapes: Any, radius: float, n_threads: int
    ) -> float:
        """Return the fraction of the area in faces that are long and thin compared with regions."""
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
        """Return the nearest cell to each query point, its distance, and its nearest point.

        The index of the cell is -1 if all cells are farther than `max_distance`.
        """
        return _core.nearest_points(self.positions(cells), queries, max_distance, n_threads)

    def corners(self, cells: Any) -> Corners | None:
        """Return the corners as indices of vertices, or None for kinds without corners."""
        return None

    def part(self, cells: Any, chosen: Ints) -> Any:
        """Return the chosen cells, given in ascending order; only for kinds without corners.

        Kinds with corners use `with_corners` instead.
        """
        raise MeshError(f"{self.plural} cannot be split into files: write only their labels")

    def with_corners(
        self, cells: Any, vertices: Floats, corners: Ints, offsets: Longs,
        bounds: Floats | None = None,
    ) -> Any:  # fmt: skip
        """Make cells of the same class from corners. Nothing is checked if `bounds` are given."""
        return mesh_like(cells, vertices, corners, offsets, bounds)

    def outside(self, cells: Any, keep: Bools | None = None) -> Outside | None:
        """Return the faces to draw for the cells in `keep`; None if cells are drawn as points."""
        return None

    def cloud(self, cells: Any) -> PointCloud:
        """Return the points to draw for kinds whose `outside` is None."""
        return PointCloud(self.positions(cells))

    def border_arcs(self, cells: Any, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        """Return arcs and labels of a subset of the cells that includes all cells at borders."""
        graph, _ = self.build_graph(cells, True, n_threads)
        return (graph.offsets, graph.neighbors), labels


class _Faces(Kind):
    noun = "face"
    plural = "faces"
    has_faces = True

    def build_graph(self, cells: FaceMesh, weld: bool, n_threads: int) -> tuple[Any, FaceShapes]:
        return graph_and_shapes(cells, weld=weld, n_threads=n_threads)

    def surface(self, cells: FaceMesh, graph: FaceGraph, n_threads: int) -> Surface:
        return Surface.of_faces(cells, graph, n_threads)

    def weights(
        self, surface: Surface, graph: Any, shapes: FaceShapes, radius: float,
        options: WeightOptions,
    ) -> Weighed:  # fmt: skip
        return arc_weights(surface, graph, radius, options, shapes.normals)

    def sliver_share(
        self, cells: FaceMesh, graph: FaceGraph, shapes: FaceShapes, radius: float, n_threads: int
    ) -> float:
        return sliver_share(cells, graph, shapes.longest, radius, n_threads)

    def measures(self, cells: FaceMesh, n_threads: int) -> Floats:
        return measure_faces(cells, n_threads)[1]

    def positions(self, cells: FaceMesh) -> Floats:
        return measure_faces(cells, checked_threads(None))[0]

    def nearest(
        self, cells: FaceMesh, queries: Floats, max_distance: float, n_threads: int
    ) -> Nearest:
        triangles, sources = cut_into_triangles(cells)
        nearest, distances, points = _core.nearest_triangles(
            cells.vertices, triangles, queries, max_distance, n_threads
        )
        if sources is not None:
            nearest = np.append(sources, np.int32(-1))[nearest]  # index -1 selects the appended -1
        return nearest, distances, points

    def corners(self, cells: AnyMesh) -> Corners:
        return corners_of(cells)

    def outside(self, cells: FaceMesh, keep: Bools | None = None) -> Outside:
        return Outside(cells, None)


class _Triangles(_Faces):
    name = "triangles"

    def border_arcs(self, cells: Mesh, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        offsets, neighbors, of_cells = arcs_at_borders(cells, labels, n_threads)
        return (offsets, neighbors), of_cells


class _Polygons(_Faces):
    name = "polygons"


class _Tets(Kind):
    name = "tetrahedra"
    noun = "tet"
    plural = "tetrahedra"
    dimension = 3

    def build_graph(self, cells: TetMesh, weld: bool, n_threads: int) -> tuple[TetGraph, None]:
        return build_tet_graph(cells, weld=weld, n_threads=n_threads), None

    def surface(self, cells: TetMesh, graph: TetGraph, n_threads: int) -> Surface:
        return tet_surface(cells, graph, n_threads)

    def measures(self, cells: TetMesh, n_threads: int) -> Floats:
        return np.abs(signed_volumes(cells))

    def positions(self, cells: TetMesh) -> Floats:
        return np.asarray(cells.vertices[cells.tets].mean(axis=1))

    def nearest(
        self, cells: TetMesh, queries: Floats, max_distance: float, n_threads: int
    ) -> Nearest:
        return _core.nearest_tets(cells.vertices, cells.tets, queries, max_distance, n_threads)

    def corners(self, cells: TetMesh) -> Corners:
        return corners_of(cells)

    def outside(self, cells: TetMesh, keep: Bools | None = None) -> Outside:
        return Outside(*cells.boundary(keep))


class _Points(Kind):
    name = "points"
    noun = "point"
    plural = "points"
    are_points = True

    def build_graph(self, cells: PointCloud, weld: bool, n_threads: int) -> tuple[PointGraph, None]:
        return find_point_graph(cells, n_threads), None

    def sorted_graph(self, cells: PointCloud, weld: bool, n_threads: int) -> OrderedCells:
        graph = find_sorted_graph(cells, n_threads)
        return OrderedCells(cells, graph, None, graph.points)

    def surface(self, cells: PointCloud, graph: PointGraph, n_threads: int) -> Surface:
        return point_surface(cells, graph, n_threads)

    def bare_surface(
        self, surface: Surface, cells: PointCloud, graph: PointGraph, n_threads: int
    ) -> Surface:
        return bare_point_surface(cells, graph, n_threads)

    def weight_options(self, graph: PointGraph, options: WeightOptions) -> WeightOptions:
        return options if graph.knows_turns else options.counting_both_turns()

    def weights(
        self, surface: Surface, graph: Any, shapes: Any, radius: float, options: WeightOptions
    ) -> Weighed:
        return arc_weights(surface, graph, radius, options)

    def positions(self, cells: PointCloud) -> Floats:
        return cells.points

    def part(self, cells: PointCloud, chosen: Ints) -> PointCloud:
        return cells.taken(chosen)

    def cloud(self, cells: PointCloud) -> PointCloud:
        return cells


_KINDS: dict[type, Kind] = {}


def register(cells: type, kind: Kind) -> None:
    """Register a kind for a class of cells, so that all stages accept cells of this class."""
    _KINDS[cells] = kind


register(CellGraph, Kind())
register(Mesh, _Triangles())
register(PolygonMesh, _Polygons())
register(TetMesh, _Tets())
register(PointCloud, _Points())


def kind_of(cells: object) -> Kind:
    """Return the kind of cells, which must be a result of `as_known`."""
    try:
        return _KINDS[type(cells)]
    except KeyError:
        raise TypeError(
            f"{type(cells).__name__} is not a registered class of cells: call"
            " cells.kinds.register first"
        ) from None


def as_known(source: MeshLike | CloudLike | CellGraph) -> Any:
    """Convert any mesh or cloud with `as_cells`, and return a `CellGraph` unchanged."""
    return source if isinstance(source, CellGraph) else as_cells(source)


def as_surface(
    source: MeshLike | CloudLike | CellGraph, *, weld: bool, n_threads: int | None
) -> Surface:
    """Return the `Surface` of a mesh, a cloud, or a graph with `ArcMeasures`."""
    return graph_and_surface(as_known(source), weld, checked_threads(n_threads))[1]


def graph_and_surface(cells: Cells | CellGraph, weld: bool, n_threads: int) -> tuple[Any, Surface]:
    """Return the graph and the `Surface` of cells, which must be a result of `as_known`."""
    kind = kind_of(cells)
    graph, _ = kind.build_graph(cells, weld, n_threads)
    return graph, kind.surface(cells, graph, n_threads)


def measures_of(cells: Cells | CellGraph, n_threads: int) -> Floats:
    """Return the measure of each cell: the area or volume of the cell, or the area around a point.

    The result has shape (N,).
    """
    return kind_of(cells).measures(cells, n_threads)
