"""What each kind of cells offers to the stages: found by the type of the input, in one place.

A new kind is a class for its input, and an entry in `_KINDS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from .._options import WeightOptions
from .._validate import checked_threads
from ..adapters.clouds import CloudLike
from ..adapters.convert import MeshLike, as_cells
from ..mesh.faces import AnyCells
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh
from ..mesh.triangle_mesh import Mesh
from .cell_graph import CellGraph
from .face_graph import graph_and_shapes
from .point_graph import bare_point_surface, find_point_graph, find_sorted_graph, point_surface
from .slivers import sliver_share
from .surface import Surface
from .tet_graph import build_tet_graph, tet_surface, tet_weights
from .weights import arc_weights

__all__ = ["Kind", "as_surface", "graph_and_surface", "kind_of"]


@dataclass(frozen=True)
class Kind:
    """The stages 1 and 2 of one kind of cells. The source is of the class that the kind is for.

    Parameters
    ----------
    build_graph : callable
        (source, weld, n_threads): who is a neighbor of whom, as an object with ``positions``,
        ``measures``, ``offsets``, ``neighbors``, ``diagonal`` and ``quantized`` as `FaceGraph` has;
        and whatever else was found on the way that sliver_share and weights can use, or None.
    surface : callable
        (source, graph, n_threads): what stages 5 to 7 take.
    weights : callable
        (surface, graph, found, radius, options): one weight per arc, as `segment` is asked for; the
        same both ways.
    sliver_share : callable
        (source, graph, found, radius, n_threads): share of the measure in cells that are long and
        thin beside regions of this radius.
    dimension : int
        2 if measures are areas, 3 if they are volumes.
    bare_surface : callable, optional
        As `surface`, without what the weights alone need, to make room.
    sorted_graph : callable, optional
        (source, n_threads): the graph of cells in another order, in which later stages are faster,
        and whose ``points`` are the cells' numbers in the source.
    """

    build_graph: Callable[[Any, bool, int], tuple[Any, Any]]
    surface: Callable[[Any, Any, int], Surface]
    weights: Callable[[Surface, Any, Any, float, WeightOptions], npt.ArrayLike]
    sliver_share: Callable[[Any, Any, Any, float, int], float]
    dimension: int = 2
    bare_surface: Callable[[Any, Any, int], Surface] | None = None
    sorted_graph: Callable[[Any, int], Any] | None = None


_FACES = Kind(
    build_graph=lambda mesh, weld, n_threads: graph_and_shapes(
        mesh, weld=weld, n_threads=n_threads
    ),
    surface=Surface.of_faces,
    weights=lambda surface, graph, shapes, radius, options: arc_weights(
        surface, graph, radius, options, None if shapes is None else shapes.normals
    ),
    sliver_share=lambda mesh, graph, shapes, radius, n_threads: sliver_share(
        mesh, graph, None if shapes is None else shapes.longest, radius, n_threads
    ),
)

_TETS = Kind(
    build_graph=lambda mesh, weld, n_threads: (
        build_tet_graph(mesh, weld=weld, n_threads=n_threads),
        None,
    ),
    surface=tet_surface,
    weights=lambda surface, graph, found, radius, options: tet_weights(surface, options),
    sliver_share=lambda *_: 0.0,
    dimension=3,
)

_POINTS = Kind(
    build_graph=lambda cloud, weld, n_threads: (find_point_graph(cloud, n_threads), None),
    surface=point_surface,
    weights=lambda surface, graph, found, radius, options: arc_weights(
        surface, graph, radius, options
    ),
    sliver_share=lambda *_: 0.0,
    bare_surface=bare_point_surface,
    sorted_graph=find_sorted_graph,
)

_KINDS: dict[type, Kind] = {Mesh: _FACES, PolygonMesh: _FACES, TetMesh: _TETS, PointCloud: _POINTS}


def kind_of(source: object) -> Kind:
    """Return what is made of a source that `as_cells` has returned."""
    return _KINDS[type(source)]


def as_surface(
    source: MeshLike | CloudLike | CellGraph, *, weld: bool, n_threads: int | None
) -> Surface:
    """Return the cells of a mesh, or of a graph with `ArcMeasures`; arguments as for `segment`."""
    cells = source if isinstance(source, CellGraph) else as_cells(source)
    return graph_and_surface(cells, weld, checked_threads(n_threads))[1]


def graph_and_surface(
    cells: AnyCells | CellGraph, weld: bool, n_threads: int
) -> tuple[Any, Surface]:
    """Return the graph of what `as_cells` has returned, or of a graph itself, and its surface."""
    if isinstance(cells, CellGraph):
        return cells, Surface.of_graph(cells, n_threads)
    kind = kind_of(cells)
    graph, _ = kind.build_graph(cells, weld, n_threads)
    return graph, kind.surface(cells, graph, n_threads)
