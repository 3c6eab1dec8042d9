"""Stages 0 and 1: read the mesh or cloud, smooth it, build its graph, and plan the regions."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ..base.checks import checked_threads
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.timing import Clock
from ..base.types import Bools, Floats, Ints
from ..clustering.balance import SizeRules
from ..clustering.plan import Plan
from ..graph.cell_graph import BaseGraph
from ..graph.constraints import ConstraintOptions
from ..graph.face_graph import FaceArcs
from ..graph.kinds import Kind, graph_and_surface, kind_of
from ..graph.surface import Surface
from ..mesh.base import Cells
from ..mesh.convert import MeshLike, as_cells
from ..mesh.denoising import (
    SCAN_STEPS,
    STEPS_WITH_SLACK,
    Denoise,
    Roughness,
    checked_denoise,
    slack_of,
    smoothed,
    suits,
)
from ..mesh.faces import FaceMesh, corners_of, measure_shapes, mesh_like
from ..mesh.weld import checked_weld
from ..weights.features import Features
from .options import SegmentOptions

_FILE = "superfacets.tools.cell_file:CellFile"
_ATTRIBUTES = "superfacets.tools.named_features:attributes_of"
_DATA = "superfacets.tools.named_features:CellData"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A mesh or cloud and the graph of its cells, prepared once for several calls of `segment`.

    The result of the function `prepare`. `segment` accepts it in place of the mesh, and returns the
    same labels in less time.

    Attributes
    ----------
    source : Mesh, PolygonMesh, TetMesh or PointCloud
        The given mesh or cloud, not a copy.
    weld : bool
        Argument of `prepare`.
    n_steps : int or None
        Number of smoothing steps; None if the cells are not faces.
    angle_slack : float
        Angle in radians that is subtracted from the angle of each edge, because noise remains.
    kind : Kind
        Kind of the cells: faces, tetrahedra or points.
    cells, graph, longest, input_index
        The smoothed cells in working order (points of a cloud are not smoothed), their graph, the
        longest side of each face, and the index in `source` of each cell; None if not sorted.
    """

    source: Cells
    weld: float
    n_steps: int | None
    angle_slack: float
    kind: Kind
    cells: Cells
    graph: BaseGraph
    longest: Floats | None
    input_index: Ints | None

    def __repr__(self) -> str:
        return f"Prepared({self.source!r}, weld={self.weld!r}, n_steps={self.n_steps!r})"

    @classmethod
    def of(
        cls, source: Cells, *, weld: float, n_threads: int, may_sort: bool = True,
        denoise: Denoise = "auto", is_kept: Bools | None = None,
    ) -> Prepared:  # fmt: skip
        """Smooth a mesh as `denoise` requires, and build the graph of the mesh or cloud.

        Cells are sorted if `may_sort` is true. `denoise` is None if an earlier graph had cells
        other than faces. A number of steps > 0 raises a ValueError for such cells.
        """
        kind = kind_of(source)
        if not kind.has_faces:
            if denoise not in (None, 0, "auto"):
                raise ValueError(
                    f"denoise needs a mesh of faces, got {kind.plural}: leave denoise out"
                )
            made = kind.ordered(source, weld, n_threads, may_sort=may_sort, is_kept=is_kept)
            return cls(source, weld, None, 0.0, kind, *made)  # cells, graph, longest, input_index
        found = kind.sorted(source, weld, n_threads, may_sort=may_sort)
        # `to_weld` is False if vertices were welded while sorting, else `weld`.
        mesh, to_weld, order = cast(FaceMesh, found[0]), *found[1:]
        arcs = FaceArcs.of(mesh, to_weld, n_threads)
        is_word, slack = isinstance(denoise, str), 0.0
        n_steps = 0 if is_word else int(denoise or 0)
        if is_word or n_steps >= STEPS_WITH_SLACK:
            joined: Cells = mesh
            if not isinstance(to_weld, bool):  # a tolerance joins vertices at several positions
                lists = corners_of(mesh).lists
                joined = mesh_like(mesh, mesh.vertices[arcs.lowest], *lists[:2], mesh.bounds)
            roughness = Roughness.of_mesh(cast(FaceMesh, joined), arcs, n_threads)
            n_steps = roughness.n_steps if is_word else n_steps
            n_steps = max(n_steps, SCAN_STEPS) if denoise == "scan" else n_steps
            slack = slack_of(n_steps, is_regular=roughness.is_regular)
        if n_steps:
            mesh = smoothed(mesh, arcs, n_steps, n_threads)
        graph, longest = arcs.measured(mesh, n_threads)
        return cls(source, weld, n_steps, slack, kind, mesh, graph, longest, order)

    def graph_and_surface(self, *, n_threads: int) -> tuple[BaseGraph, Surface]:
        """Return graph and `Surface` of `source`, whose cells are in the order of the caller."""
        if self.input_index is not None or self.n_steps:
            return graph_and_surface(self.source, self.weld, n_threads)
        return self.graph, self.kind.surface(self.source, self.graph, n_threads)

    def given_measures(self, n_threads: int) -> Floats:
        """Return the areas or volumes of the cells before the mesh was smoothed, (N,)."""
        if not self.n_steps:
            return np.asarray(self.graph.measures)
        measures = self.kind.measures(self.source, n_threads)
        return measures if self.input_index is None else measures[self.input_index]


def prepare(
    mesh: MeshLike, *, weld: float = True, denoise: Denoise = "auto", n_threads: int | None = None
) -> Prepared:
    """Return a mesh or cloud with the graph of its cells, for several calls of `segment`.

    ``segment(prepare(mesh), k)`` returns the same labels as ``segment(mesh, k)``.

    Parameters
    ----------
    mesh, denoise, n_threads
        Same as in `segment`.
    weld : bool or float, default True
        Whether vertices at exactly the same position are treated as one vertex. If not, only faces
        that have vertices in common are neighbors. A number is a tolerance, in the unit of the
        mesh: vertices whose coordinates differ by at most this number are treated as one vertex.

    Returns
    -------
    Prepared
        It refers to the mesh, which must not be changed afterwards. If an argument of `segment`
        requires another graph (a mask of points, weights as an array, another number of smoothing
        steps), `segment` builds that graph itself.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or if a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> import superfacets
    >>> prepared = superfacets.prepare(superfacets.sample_mesh(5_000))
    >>> [superfacets.segment(prepared, k).n_segments for k in (10, 20)]
    [10, 20]
    """
    return Prepared.of(
        as_cells(mesh), weld=checked_weld(weld), denoise=checked_denoise(denoise),
        n_threads=checked_threads(n_threads),
    )  # fmt: skip


def prepared_for(
    mesh: MeshLike | Prepared, options: SegmentOptions, clock: Clock
) -> tuple[Prepared, SegmentOptions]:
    """Return a `Prepared` that fits, and options with values of features and numbers of steps."""
    n_threads, constraints = options.loop.n_threads, options.constraints
    given = mesh if isinstance(mesh, Prepared) else None
    with clock.timed("mesh"):
        source, features = read_with_features(
            mesh.source if isinstance(mesh, Prepared) else mesh,
            options.features, constraints, n_threads,
        )  # fmt: skip
        options = replace(options, features=features)
    with clock.timed("face_graph"):
        kind, is_kept = kind_of(source), constraints.kept_points(source)
        keeps_order, denoise = options.keeps_order(kind), options.denoise
        if given is not None and suits(denoise, given.n_steps):
            denoise = given.n_steps
        prepared = given
        if (
            prepared is None
            or is_kept is not None  # the mask changes the neighbors of points
            or (keeps_order and prepared.input_index is not None)
            or denoise != prepared.n_steps
        ):
            prepared = Prepared.of(
                source, weld=True if given is None else given.weld, n_threads=n_threads,
                may_sort=not keeps_order, denoise=denoise, is_kept=is_kept,
            )  # fmt: skip
    return prepared, options.for_prepared(prepared.n_steps, prepared.angle_slack, prepared.weld)


def read_with_features(
    mesh: MeshLike, features: Features, constraints: ConstraintOptions,
    n_threads: int,
) -> tuple[Cells, Features]:  # fmt: skip
    """Read the mesh or cloud, and replace names of features by a table of their values."""
    names = features.names
    if not names:
        return as_cells(mesh), features
    if isinstance(mesh, (str, os.PathLike)):
        source, attributes = load(_FILE).read(mesh).cells_and_attributes()
    else:
        source = as_cells(mesh)
        attributes = load(_ATTRIBUTES)(mesh, source)
        wants_colors = not {"color", "colors"}.isdisjoint(names)
        if wants_colors and kind_of(source).has_faces and attributes.colors is None:
            raise MeshError(
                "a Mesh has no colors, so features='color' is not available: pass the path of the"
                " file instead, or an array of colors as features"
            )
    data = load(_DATA)(source, attributes)
    table = data.features(names, n_threads, constraints.kept_values(source))
    return source, replace(features, table=table)


@dataclass(frozen=True, eq=False)
class Planned:
    """The cells to segment, the regions to make, and whether cells are too long for them."""

    plan: Plan
    sizes: SizeRules | None  # rules for the sizes of regions; None if sizes are not restricted
    sliver_share: float  # fraction of the area in long and thin faces


def plan_regions(prepared: Prepared, options: SegmentOptions, clock: Clock) -> Planned:
    """Determine the cells to segment, the expected size of regions, and the initial centers."""
    n_threads = options.loop.n_threads
    with clock.timed("face_graph", begins=False):
        inside = options.constraints.kept_cells(
            prepared.source, prepared.graph, weld=prepared.weld, n_threads=n_threads,
            order=prepared.input_index,
        )  # fmt: skip
        measures = prepared.graph.measures
        if options.sizes.is_used:
            measures = prepared.given_measures(n_threads)
        sizes = SizeRules.of(options.sizes, prepared.graph, inside, prepared.input_index, measures)
        count = options.count if sizes is None else sizes.with_count(options.count)
        plan = Plan.of(
            prepared.graph, inside, (count, options.init), options.loop,
            dimension=prepared.kind.dimension, plural=prepared.kind.plural,
            order=prepared.input_index,
        )  # fmt: skip
        if sizes is not None:
            sizes.check(plan.size.n_segments)
        cells, areas, longest = prepared.cells, prepared.graph.measures, prepared.longest
        kept = slice(None) if inside is None else inside.cells
        if prepared.n_steps:  # smoothing makes faces beside a step in the surface long
            cells, order = prepared.source, prepared.input_index
            kept = kept if order is None else order[kept]
            areas, longest = measure_shapes(cast(FaceMesh, cells), n_threads)[1:]
        of_kept = np.zeros_like(areas)
        of_kept[kept] = areas[kept]
        share = prepared.kind.sliver_share(cells, of_kept, longest, plan.size.radius, n_threads)
    return Planned(plan, sizes, share)
