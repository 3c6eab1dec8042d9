"""The class `Segmentation`: the result of `segment`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import _core
from .._types import Array, Ints
from ..cells.cell_graph import CellGraph
from ..cells.kinds import as_surface
from ..cells.region_adjacency import RegionGraph, region_graph_of
from ..cells.surface import Surface
from ..mesh.base import Cells

if TYPE_CHECKING:
    from ..pictures.page.document import Page
    from ..pictures.plotting import Plot

StopReason = Literal["converged", "settled", "max_num_iter", "cancelled"]


@dataclass(frozen=True)
class Level:
    """Record of the loop on one level, which is either all cells or coarse cells.

    Attributes
    ----------
    n_cells : int
        Number of cells of the level.
    n_iter : int
        Number of iterations. If all faces are only classified once after coarse levels, it is 1.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why the iterations stopped; see `Segmentation`.
    seconds : float
        Wall time in seconds.
    """

    n_cells: int
    n_iter: int
    stop_reason: StopReason
    seconds: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`: one label per face, and information about the segmentation.

    ``np.asarray(segmentation)`` is ``labels``. Notebooks show a picture of the regions if the extra
    `viz` is installed and there are at most 200,000 faces or 50,000 points.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, from 0 to K - 1, in input order; -1 for faces outside the mask.
    centers : ndarray of int32, shape (K,)
        Representative face of each region. Each face has the label of the center with the shortest
        path, unless the clean-up of stage 5 changed the label. For large regions, shortest paths
        are computed on coarse cells.
    n_segments : int
        Number of regions, K.
    n_iter : int
        Total number of iterations on all levels; see ``levels``.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why the loop stopped, on the finest level on which it ran:

        - ``"converged"``: The centers moved by at most `tol`.
        - ``"settled"``: The centers alternate between a few equally good states.
        - ``"max_num_iter"``: The maximum number of iterations was reached.
        - ``"cancelled"``: The callable `progress` returned False.
    n_unreached : int
        Number of components that no center reached because they have no seed. With `radius_factor`,
        faces beyond the maximum distance from all centers are included. With ``islands="keep"``,
        each component becomes a region. With ``"nearest"``, it joins the nearest region, unless it
        is enclosed by barriers.
    n_joined : int
        Number of pieces of regions that joined a neighbor because of ``enforce_connectivity``.
    n_merged : int
        Number of small regions that were merged into others because of ``min_size``. They are not
        included in K.
    n_islands : int
        Number of small regions that were kept because they have no neighbor.
    n_extra_pieces : int
        Number of connected pieces minus K. It can only be above 0 with ``cells_per_region``, if no
        connected regions of these sizes were found.
    sliver_share : float or None
        Fraction of the area, 0 to 1, in faces longer than 2 r and thinner than r / 2, where r is
        the expected radius. If it is above 0.1, regions become stripes, and `segment` warns. None
        for a `CellGraph`, whose cells have no shape.
    levels : tuple of Level
        Record of the loop on each level, from the coarsest cells to all faces.
    timings : dict of str to float
        Wall time of each stage, in seconds.
    params : dict
        Parameters of the segmentation. ``expected_radius`` is r in the unit of the vertices.
        ``radius`` is the argument, as a fraction of the diagonal, or None.
    cells : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or None
        The segmented mesh, cloud or graph, which `regions`, `plot` and `view` need. It is not
        copied. None if the object was made without it.
    """

    labels: Ints
    centers: Ints
    n_iter: int
    stop_reason: StopReason
    timings: dict[str, float] = field(repr=False)
    params: dict[str, Any] = field(repr=False)
    n_unreached: int = 0
    n_joined: int = 0
    n_merged: int = 0
    n_islands: int = 0
    n_extra_pieces: int = 0
    sliver_share: float | None = None
    levels: tuple[Level, ...] = field(default=(), repr=False)
    cells: Cells | CellGraph | None = field(default=None, repr=False)

    @property
    def n_segments(self) -> int:
        """Number of regions, K."""
        return len(self.centers)

    @cached_property
    def patches(self) -> Ints:
        """Cells of each region, shape (K, size of the largest region), padded with -1.

        With ``cells_per_region=64``, the rows are batches for neural networks that process patches:
        each row has 64 cells, except one row per component. The cells of a region are in the order
        of a depth-first search that starts at the narrowest end of the region. Each cell is a
        neighbor of the previous cell, unless the search backtracks.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.

        Examples
        --------
        >>> import superfacets
        >>> result = superfacets.segment(superfacets.sample_mesh(5_000), cells_per_region=64)
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

        The graph is computed on first use.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.
        """
        return region_graph_of(self._surface, self.labels, self.n_segments, self.centers)

    def plot(self, **options: Any) -> Plot:
        """Draw the regions with ``superfacets.plot(cells, labels)``.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        from ..pictures.plotting import plot

        return plot(self._known_cells("plot"), self.labels, **options)

    def view(self, **options: Any) -> Page:
        """Return an interactive page of the regions from ``superfacets.view(cells, labels)``.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        from ..pictures.page.document import view

        return view(self._known_cells("view"), self.labels, **options)

    @property
    def _surface(self) -> Surface:
        cells = self._known_cells("region_graph")
        return as_surface(cells, weld=self.params.get("weld", True), n_threads=None)

    def _known_cells(self, instead: str) -> Any:
        """Return the cells, or raise an error that suggests the function `instead`."""
        if self.cells is None:
            raise ValueError(
                f"this segmentation does not store its mesh: call {instead}(mesh, labels) instead"
            )
        return self.cells

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        if copy is None:  # NumPy 1 does not accept `np.array(copy=None)`
            return np.asarray(self.labels, dtype=dtype)
        return np.array(self.labels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return (
            f"Segmentation({len(self.labels)} cells, {self.n_segments} regions, "
            f"{self.n_iter} iterations, {self.stop_reason})"
        )

    def _repr_html_(self) -> str:
        """Return HTML for notebooks, with a picture if possible, and sizes of regions."""
        from ..pictures.notebook import html_of

        return html_of(self)

    def _repr_png_(self) -> bytes | None:
        """Return the picture as PNG, for notebooks that do not show HTML."""
        from ..pictures.notebook import png_of

        return png_of(self)
