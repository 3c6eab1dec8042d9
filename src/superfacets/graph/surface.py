"""Define `Surface`: a class that computes lengths and angles of arcs between cells of any kind."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_classes, checked_threads, counted
from ..base.types import Floats, Ints, Longs, Singles
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, signed_volume, single_normals
from .cell_graph import ArcMeasures, BaseGraph, CellGraph, CsrArcs
from .face_graph import FaceGraph, core_surface
from .tet_cells import TetCells

NO_NORMALS = np.empty((0, 3))
"""Empty array in place of normals. If `_core` gets it, it computes the normals of triangles."""

VOLUME_NOISE = 1e-12
"""The enclosed volume of a mesh is treated as 0 if it is at most this fraction of the cube of the
diagonal of the bounding box."""


@dataclass(frozen=True, eq=False)
class Surface(CsrArcs):
    """Cells of any kind, and arcs between cells. Lengths and angles of arcs are computed on demand.

    The weights of arcs, the clean-up of regions, metrics and exports use this class, and apps use
    `Kind.surface` to get one.
    """

    handle: _core.Surface  # object of `_core` that computes lengths and angles of arcs
    offsets: Longs  # (N + 1,) index of the first arc of each cell
    neighbors: Ints  # (M,) target cell of each arc
    bounds: Floats  # (2, 3) minimum and maximum corner of the bounding box
    weight_unit: float  # length that a weight of 1 corresponds to, in the unit of the positions
    n_threads: int
    mesh: FaceMesh | None = None  # mesh whose faces are the cells, or None for other cells
    # (M,) weight of each arc; None for faces and points, because formulas compute their weights
    weights: Floats | None = None
    # Volume that a mesh of faces encloses; 0 if the mesh is open or inconsistently oriented, or if
    # the volume is not known
    volume: float = 0.0
    dimension: int = 2  # 2 if measures are areas, 3 if measures are volumes

    @classmethod
    def of_faces(cls, mesh: FaceMesh, graph: FaceGraph, n_threads: int) -> Surface:
        """Make the surface of a mesh; raise a ValueError if `graph` does not fit the mesh."""
        if graph.n_cells != mesh.n_faces:
            raise ValueError(
                f"the graph has {counted(graph.n_cells, 'cell')} but the mesh has"
                f" {counted(mesh.n_faces, 'face')}: build the graph from this mesh"
            )
        volume, noise = _signed_volume(mesh, graph, n_threads), VOLUME_NOISE * graph.diagonal**3
        handle = core_surface(mesh, graph, volume < -noise, n_threads)
        volume = 0.0 if graph.has_turns or abs(volume) <= noise else abs(volume)
        return cls(
            handle, graph.offsets, graph.neighbors, graph.bounds, graph.diagonal, n_threads,
            mesh, volume=volume,
        )  # fmt: skip

    @classmethod
    def of_tets(
        cls, mesh: TetCells, graph: BaseGraph, arcs: ArcMeasures, n_threads: int
    ) -> Surface:
        """Make the surface of a tetrahedral mesh from its graph and all measures of the arcs."""
        assert arcs.step_lengths is not None
        assert arcs.sides is not None
        assert arcs.open_lengths is not None
        handle = _core.TetSurface(
            mesh.vertices, mesh.tets, graph.positions, graph.measures, graph.offsets,
            graph.neighbors, arcs.border_lengths, arcs.step_lengths, arcs.sides, arcs.open_lengths,
        )  # fmt: skip
        return cls(
            handle, graph.offsets, graph.neighbors, graph.bounds, graph.diagonal, n_threads,
            weights=arcs.step_lengths / graph.diagonal, dimension=3,
        )  # fmt: skip

    @classmethod
    def of_graph(cls, graph: CellGraph, n_threads: int) -> Surface:
        """Make the surface of a graph; raise a ValueError if the graph has no `ArcMeasures`."""
        given = graph.arc_measures
        if given is None:
            raise ValueError(
                "the CellGraph must have border lengths: make it with arc_measures=ArcMeasures(...)"
            )
        handle = _core.GraphSurface(
            graph.positions, graph.measures, graph.offsets, graph.neighbors, given.border_lengths,
            np.empty(0) if given.step_lengths is None else given.step_lengths,
            np.empty(0) if given.angles is None else given.angles,
            np.empty(0, np.int32) if given.sides is None else given.sides,
            np.empty(0) if given.open_lengths is None else given.open_lengths,
        )  # fmt: skip
        return cls(
            handle, graph.offsets, graph.neighbors, graph.bounds, graph.weight_unit, n_threads,
            weights=graph.weights, dimension=graph.dimension,
        )  # fmt: skip

    @property
    def positions(self) -> Floats:
        """Position of each cell, shape (N, 3)."""
        return self._cells[0]

    @property
    def measures(self) -> Floats:
        """Area or volume of each cell, shape (N,)."""
        return self._cells[1]

    @cached_property
    def _cells(self) -> tuple[Floats, Floats]:
        return self.handle.cells(self.n_threads)

    def single_normals(self) -> Singles:
        """Return the unit normal of each face of `mesh`, (N, 3), in single precision."""
        assert self.mesh is not None
        return single_normals(self.mesh, self.n_threads)

    def arc_measures(self) -> ArcMeasures:
        """Return the lengths and angles of all arcs, as the function `arc_measures` does."""
        return ArcMeasures(*self.handle.arc_measures(self.n_threads))

    def components(self, labels: npt.ArrayLike) -> Ints:
        """Return the connected component of cells with equal labels, from 0, of each cell, (N,)."""
        checked = checked_classes(labels, self.n_cells, "labels")
        return _core.find_components(*self.arcs, checked, self.n_threads)[0]

    def part(self, cells: Ints, arcs: Longs, offsets: Longs, neighbors: Ints) -> Surface:
        """Return the surface of the cells and arcs with these indices, renumbered from 0.

        `offsets` and `neighbors` are the chosen arcs in CSR form, with the new numbers of cells.
        """
        if len(offsets) != len(cells) + 1 or not offsets[-1] == len(arcs) == len(neighbors):
            raise ValueError("offsets and neighbors must be the arcs of the cells in CSR form")
        handle = _core.SubSurface(self.handle, offsets, neighbors, cells, arcs)
        return Surface(
            handle, offsets, neighbors, self.bounds, self.weight_unit, self.n_threads,
            dimension=self.dimension,
        )  # fmt: skip


def arc_measures(mesh: MeshLike, graph: FaceGraph, *, n_threads: int | None = None) -> ArcMeasures:
    """Return the lengths and angles of the arcs of a face graph, for a `superfacets.CellGraph`.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    graph : FaceGraph
        The graph of the same mesh, from `build_face_graph`.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    ArcMeasures
        ``border_lengths`` are the lengths of edges. ``step_lengths`` are the distances from
        centroid to centroid through the midpoint of the edge (equation 1 of the paper). ``angles``
        are in radians, positive for concave edges. ``sides`` are the same as in the graph.
        ``open_lengths`` is, for each face, the total length of its boundary edges.

    Raises
    ------
    ValueError
        If the graph does not fit the mesh, because it was built from another mesh.

    Examples
    --------
    Two faces form a valley with a right angle:

    >>> from superfacets import Mesh, build_face_graph
    >>> valley = Mesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> measures = arc_measures(valley, build_face_graph(valley))
    >>> measures.angles.round(3).tolist(), measures.border_lengths.tolist()
    ([1.571, 1.571], [1.0, 1.0])
    """
    threads = checked_threads(n_threads)
    found = Surface.of_faces(as_mesh(mesh), graph, threads).arc_measures()
    return found.checked(graph.offsets, graph.n_arcs, threads)


def _signed_volume(mesh: FaceMesh, graph: FaceGraph, n_threads: int) -> float:
    """Return the volume of a mesh, negative if its normals point inward, or 0 for an open mesh."""
    if graph.edge_counts.boundary:
        return 0.0
    # If faces are inconsistently oriented, the volume depends on the origin. The centroid is used
    # as origin, so that the volume does not change under rigid motion.
    origin = _core.weighted_mean(graph.positions, graph.measures, n_threads)
    return signed_volume(mesh, origin, n_threads)
