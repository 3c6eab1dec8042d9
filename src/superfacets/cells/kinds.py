"""The kinds of cells, and all operations that depend on the kind.

A new kind needs a class of cells that derives from `Cells`, a subclass of `Kind`, and a call of
`register`. File formats (`export.cells`) and counts (`cells.info`) of a kind are optional; they are
in tables by the name of the kind.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from .. import _core
from .._types import ArcLists, Bools, Floats, Ints, Longs
from .._validate import checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..errors import MeshError
from ..mesh.cells import Cells
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


class Outside(NamedTuple):
    """The faces that represent cells in pictures."""

    mesh: FaceMesh
    sources: Ints | None  # the cell of each face; None: faces are the cells


class OrderedCells(NamedTuple):
    """Cells in the order of stages 1 to 5: the given order, or a sorted order for speed."""

    cells: Any  # of the same class as the source
    graph: Any
    shapes: Any
    """Measures that only the weights of this kind need."""
    order: Ints | None
    """Index of each cell in the source; None: 0 to N - 1."""


class Kind:
    """Operations that depend on the kind of cells.

    The methods of this base class work for `CellGraph`, and for each kind whose `build_graph`
    returns a `CellGraph` with `ArcMeasures`. Such a kind overrides `build_graph` only. `cells` is
    an object of the class that the kind is registered for.
    """

    name: ClassVar[str] = "cells"
    """Key of the kind in tables of other modules."""
    noun: ClassVar[str] = "cell"
    """Noun for a cell in messages; counts append an "s"."""
    plural: ClassVar[str] = "cells"
    """Noun for cells in messages."""
    dimension: ClassVar[int] = 2
    """2 if measures are areas, 3 if they are volumes."""
    has_faces: ClassVar[bool] = False
    """Whether cells are faces of a surface, with normals, and with edges between faces."""
    are_points: ClassVar[bool] = False
    """Whether each cell is a vertex."""

    def build_graph(self, cells: Any, weld: bool, n_threads: int) -> tuple[Any, Any]:
        """Return the graph of the cells, and measures that only weights need (None for most kinds).

        The graph has all members of `cell_graph.Arcs`.
        """
        return cells, None

    def sorted_graph(self, cells: Any, weld: bool, n_threads: int) -> OrderedCells | None:
        """Return cells and graph sorted for speed, or None to keep the order.

        Cells with corners are sorted along a space-filling curve if their order is bad.
        """
        corners = self.corners(cells)
        if corners is None or not is_scattered(cells.vertices, corners):
            return None
        found = sorted_corners(cells.vertices, corners, weld, n_threads)
        ordered = self.with_corners(
            cells, found.vertices, found.corners, found.offsets, cells.bounds
        )
        # If `weld`, the vertices are already welded.
        return OrderedCells(ordered, *self.build_graph(ordered, False, n_threads), found.order)

    def surface(self, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the cells with their arcs: the input of stages 2 and 5 to 7."""
        return Surface.of_graph(graph, n_threads)

    def bare_surface(self, surface: Surface, cells: Any, graph: Any, n_threads: int) -> Surface:
        """Return the surface without arrays that only weights need, to free memory."""
        return surface

    def weight_options(self, graph: Any, options: WeightOptions) -> WeightOptions:
        """Return the options adapted to these cells."""
        return options

    def weights(
        self, surface: Surface, graph: Any, shapes: Any, radius: float, options: WeightOptions
    ) -> Weighed:
        """Return one weight per arc, the same in both directions."""
        return step_weights(surface, options, self.plural)

    def sliver_share(
        self, cells: Any, graph: Any, shapes: Any, radius: float, n_threads: int
    ) -> float:
        """Return the share of the measure in slivers: cells long and thin compared with regions."""
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
        """Return the nearest cell to each query, its distance, and its nearest point.

        The cell is -1 if all cells are farther than `max_distance`.
        """
        return _core.nearest_points(self.positions(cells), queries, max_distance, n_threads)

    def corners(self, cells: Any) -> Corners | None:
        """Return the corners as indices of ``vertices``; None for kinds without corners."""
        return None

    def part(self, cells: Any, chosen: Ints) -> Any:
        """Return chosen cells (ascending) as cells of the same kind, for kinds without corners.

        Kinds with corners use `with_corners` instead.
        """
        raise MeshError(f"{self.plural} cannot be split: only their labels can be written")

    def with_corners(
        self, cells: Any, vertices: Floats, corners: Ints, offsets: Longs,
        bounds: Floats | None = None,
    ) -> Any:  # fmt: skip
        """Return cells of the same class with these corners; not checked if `bounds` are given."""
        return mesh_like(cells, vertices, corners, offsets, bounds)

    def outside(self, cells: Any, keep: Bools | None = None) -> Outside | None:
        """Return the faces to draw for all cells, or for the cells to keep; None for points."""
        return None

    def cloud(self, cells: Any) -> PointCloud:
        """Return the points to draw for kinds without an outside."""
        return PointCloud(self.positions(cells))

    def border_arcs(self, cells: Any, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        """Return arcs and labels of some cells, which include all cells at borders."""
        graph, _ = self.build_graph(cells, True, n_threads)
        return (graph.offsets, graph.neighbors), labels


class _Faces(Kind):
    """Faces of a surface."""

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
            nearest = np.append(sources, np.int32(-1))[nearest]  # -1 stays -1
        return nearest, distances, points

    def corners(self, cells: AnyMesh) -> Corners:
        return corners_of(cells)

    def outside(self, cells: FaceMesh, keep: Bools | None = None) -> Outside:
        return Outside(cells, None)


class _Triangles(_Faces):
    """Triangles, with faster kernels than polygons."""

    name = "triangles"

    def border_arcs(self, cells: Mesh, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
        offsets, neighbors, of_cells = arcs_at_borders(cells, labels, n_threads)
        return (offsets, neighbors), of_cells


class _Polygons(_Faces):
    name = "polygons"


class _Tets(Kind):
    """Tetrahedra of a volume."""

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
    """Points of a cloud."""

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
    """Register the kind of a class of cells, so that every stage accepts them."""
    _KINDS[cells] = kind


register(CellGraph, Kind())
register(Mesh, _Triangles())
register(PolygonMesh, _Polygons())
register(TetMesh, _Tets())
register(PointCloud, _Points())


def kind_of(cells: object) -> Kind:
    """Return the kind of cells that `as_known` has returned."""
    try:
        return _KINDS[type(cells)]
    except KeyError:
        raise TypeError(
            f"{type(cells).__name__} is not a registered class of cells: see cells.kinds.register"
        ) from None


def as_known(source: MeshLike | CloudLike | CellGraph) -> Any:
    """Return a `CellGraph` unchanged, or the result of `as_cells` for any other source."""
    return source if isinstance(source, CellGraph) else as_cells(source)


def as_surface(
    source: MeshLike | CloudLike | CellGraph, *, weld: bool, n_threads: int | None
) -> Surface:
    """Return the surface of a mesh or graph with `ArcMeasures`; arguments as for `segment`."""
    return graph_and_surface(as_known(source), weld, checked_threads(n_threads))[1]


def graph_and_surface(cells: Cells | CellGraph, weld: bool, n_threads: int) -> tuple[Any, Surface]:
    """Return the graph of cells that `as_known` has returned, and their surface."""
    kind = kind_of(cells)
    graph, _ = kind.build_graph(cells, weld, n_threads)
    return graph, kind.surface(cells, graph, n_threads)


def measures_of(cells: Cells | CellGraph, n_threads: int) -> Floats:
    """Return the area of each face, volume of each tetrahedron, or area around each point, (N,)."""
    return kind_of(cells).measures(cells, n_threads)
