"""Define `Segmentation`, the class of the results of `segment`."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import _core
from ..base.checks import counted
from ..base.lazy import load
from ..base.types import Array, Ints
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_surface
from ..graph.surface import Surface
from ..mesh.base import Cells

if TYPE_CHECKING:
    from .. import Page, Plot
    from ..regions.region_graph import RegionGraph

StopReason = Literal["converged", "settled", "enough", "max_num_iter", "cancelled"]


@dataclass(frozen=True)
class LoopLevel:
    """Record of the clustering loop on one of its levels: on all cells, or on groups of cells.

    Attributes
    ----------
    n_cells : int
        Number of cells of the level.
    n_iter : int
        Number of iterations on this level, or 1 if the cells were only labeled once.
    stop_reason : {"converged", "settled", "enough", "max_num_iter", "cancelled"}
        Reason why the loop stopped on this level; see `Segmentation`. If the cells were only
        labeled once, it is the reason of the level before.
    seconds : float
        Wall time of the loop on this level, in seconds.
    """

    n_cells: int
    n_iter: int
    stop_reason: StopReason
    seconds: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`: one label per face, and information about the segmentation.

    ``np.asarray(segmentation)`` is ``labels``. Notebooks show a picture of the regions if the extra
    ``viz`` is installed and there are at most 200,000 faces or 50,000 points.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, from 0 to K - 1, in input order; -1 for faces outside the mask.
    centers : ndarray of int32, shape (K,)
        Representative face of each region: the center with the shortest path to its faces, unless a
        later step (smoothing, joining, merging, balancing) changed labels. For large regions,
        shortest paths are computed on groups of faces.
    n_segments : int
        Number of regions, K.
    n_iter : int
        Total number of iterations on all levels of the loop; see ``levels``.
    stop_reason : {"converged", "settled", "enough", "max_num_iter", "cancelled"}
        Reason why the loop stopped on the finest level on which it ran:

        - ``"converged"``: The root mean square of the moves of centers was at most ``tol`` * r.
        - ``"settled"``: The same set of centers occurred twice.
        - ``"enough"``: Further iterations would change little, because centers were relocated, or
          because coarse cells were used before.
        - ``"max_num_iter"``: The maximum number of iterations was reached.
        - ``"cancelled"``: The callable ``callback`` returned False.
    n_unreached : int
        Number of components that no center reached because they have no seed and, with
        ``radius_factor``, of connected groups of faces too far from all centers. Each of them
        becomes a region or, with ``islands="nearest"``, joins the nearest region, unless barriers
        separate it from all regions.
    n_extra_pieces : int
        Total number of connected pieces of all regions, minus K. It is 0 unless
        ``Sizes(cells=...)`` is given and no connected regions of this size were found.
    sliver_share : float or None
        Fraction of the area, 0 to 1, inside the mask, in faces longer than 2 r and thinner than r /
        2, where r is the expected radius. Above 0.1, regions become stripes, and `segment` warns.
        None for a `CellGraph`.
    levels : tuple of LoopLevel
        One record of the loop per level, from the coarsest groups of faces to all faces.
    timings : dict of str to float
        Wall time of each stage, in seconds.
    params : dict
        Parameters of the segmentation. The entry ``"radius"`` is always r, in the unit of the
        vertices; if it was given, the entry ``"n_segments"`` is None.
    cells : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or None
        The segmented mesh, cloud or graph (not a copy), which ``regions``, ``plot`` and ``view``
        need. None if it was not stored.
    vertex_groups : ndarray of int32, shape (V,), or None
        Barriers of vertices, -1 outside the mask, if any were given; see `vertex_labels`.
    """

    labels: Ints
    centers: Ints
    n_iter: int
    stop_reason: StopReason
    timings: dict[str, float] = field(repr=False)
    params: dict[str, Any] = field(repr=False)
    n_unreached: int = 0
    n_extra_pieces: int = 0
    sliver_share: float | None = None
    levels: tuple[LoopLevel, ...] = field(default=(), repr=False)
    cells: Cells | CellGraph | None = field(default=None, repr=False)
    vertex_groups: Ints | None = field(default=None, repr=False)

    @property
    def n_segments(self) -> int:
        """Number of regions, K."""
        return len(self.centers)

    @cached_property
    def patches(self) -> Ints:
        """Cells of each region, shape (K, number of cells of the largest region).

        Rows are padded with -1. Use ``sizes=Sizes(cells=64)`` for neural networks that process
        patches of 64 cells: then each row contains 64 cells, except for at most one row per
        component. The cells of a region are in the order of a depth-first search that starts at the
        cell with the fewest neighbors in the region. Each cell is a neighbor of the previous cell,
        unless the search backtracks.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.

        Examples
        --------
        >>> import superfacets
        >>> sizes = superfacets.Sizes(cells=64)
        >>> result = superfacets.segment(superfacets.sample_mesh(5_000), sizes=sizes)
        >>> result.patches.shape[1], (result.patches < 0).sum(axis=1).nonzero()[0].size <= 1
        (64, True)
        """
        surface = self._surface
        walk = _core.walk_regions(*surface.arcs, self.labels, self.n_segments, surface.n_threads)
        counts = np.bincount(self.labels[self.labels >= 0], minlength=self.n_segments)
        padded = np.full((self.n_segments, int(counts.max(initial=0))), -1, np.int32)
        padded[np.arange(padded.shape[1]) < counts[:, None]] = walk
        return padded

    @cached_property
    def regions(self) -> RegionGraph:
        """Graph of the regions, with areas, centroids, neighbors and borders; see `region_graph`.

        The graph is computed when this property is read for the first time.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.
        """
        region_graph_of = load("superfacets.regions.region_graph:region_graph_of")
        graph: RegionGraph = region_graph_of(
            self._surface, self.labels, self.n_segments, self.centers
        )
        return graph

    def plot(self, output: str | os.PathLike[str] | None = None, **options: Any) -> Plot:
        """Return ``superfacets.plot(cells, self, output, **options)``: a picture of the regions.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        shown: Plot = load("superfacets_show.plotting:plot")(
            self._known_cells("plot"), self, output, **options
        )
        return shown

    def view(self, **options: Any) -> Page:
        """Return ``superfacets.view(cells, labels, **options)``, an interactive page of regions.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        page: Page = load("superfacets_show.page.document:view")(
            self._known_cells("view"), self, **options
        )
        return page

    @property
    def _surface(self) -> Surface:
        cells = self._known_cells("region_graph")
        weld = self.params.get("weld", True)
        return as_surface(cells, weld=weld, n_threads=None, is_kept=self.labels >= 0)

    def _known_cells(self, instead: str) -> Any:
        """Return ``cells``, or raise a ValueError that suggests to call the function `instead`."""
        if self.cells is None:
            raise ValueError(
                f"this segmentation does not store its mesh: call {instead}(mesh, labels) instead"
            )
        return self.cells

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        if copy is None:  # NumPy 1 has no `np.array(..., copy=None)`
            return np.asarray(self.labels, dtype=dtype)
        return np.array(self.labels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return (
            f"Segmentation({counted(len(self.labels), 'cell')},"
            f" {counted(self.n_segments, 'region')}, {counted(self.n_iter, 'iteration')},"
            f" {self.stop_reason})"
        )

    def _repr_html_(self) -> str:
        """Return HTML for notebooks: a picture of the regions if possible, and their sizes."""
        html: str = load("superfacets_show.notebook:html_of")(self)
        return html

    def _repr_png_(self) -> bytes | None:
        """Return a picture of the regions as PNG, for notebooks that do not show HTML."""
        picture: bytes | None = load("superfacets_show.notebook:png_of")(self)
        return picture
