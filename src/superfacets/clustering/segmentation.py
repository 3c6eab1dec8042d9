"""The result of a segmentation: labels, centers, and a record of the run."""

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
from ..mesh.cells import Cells

if TYPE_CHECKING:
    from ..pictures.page.document import Page
    from ..pictures.plotting import Plot

StopReason = Literal["converged", "settled", "max_num_iter", "cancelled"]


@dataclass(frozen=True)
class Level:
    """Record of the loop on one level: on all cells, or on coarse cells.

    Attributes
    ----------
    n_cells : int
        Number of cells of the level.
    n_iter : int
        Number of iterations. The classification of all faces after coarse levels counts as an
        iteration.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why the iterations ended; see `Segmentation`.
    seconds : float
        Wall time.
    """

    n_cells: int
    n_iter: int
    stop_reason: StopReason
    seconds: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`: one label per face, and a record of the run.

    ``np.asarray(segmentation)`` is ``labels``. A notebook shows the regions as a picture if the
    extra `viz` is installed and there are at most 200,000 faces or 50,000 points.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, 0..K-1, in the order of the input; -1 for faces outside the mask.
    centers : ndarray of int32, shape (K,)
        One face that represents each region. Each face has the label of the center with the
        shortest path (large regions use paths on coarse cells), unless the clean-up of stage 5
        changed the label.
    n_segments : int
        Number of regions, K.
    n_iter : int
        Total number of iterations on all levels; see ``levels``.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why the loop ended. ``"converged"``: the centers moved less than `tol`. ``"settled"``: the
        centers alternate between a few equally good states. ``"max_num_iter"``: the limit of the
        user, of a round of relocation, or of a short loop was reached. ``"cancelled"``: `progress`
        returned False. With several levels, the reason on the finest coarse level; with `relocate`,
        the reason of its last round.
    n_unreached : int
        Number of islands that no center reached: components without a seed and, with
        `radius_factor`, faces out of reach. With ``islands="keep"`` each island is a region and
        counts in K. With ``"nearest"`` each island joined the nearest region, unless barriers
        enclose the island.
    n_joined : int
        Number of pieces of regions that joined a neighbor, with ``enforce_connectivity``.
    n_merged : int
        Number of small regions merged into others, with ``min_size``. They do not count in K.
    n_islands : int
        Number of small regions that were kept because they have no neighbor.
    n_extra_pieces : int
        Number of connected pieces minus K. It is above 0 only with ``cells_per_region``, if no
        connected regions of these sizes were found.
    sliver_share : float or None
        Fraction of the area, 0 to 1, in faces longer than 2 r and thinner than r / 2, with the
        expected radius r. With more than 0.1, regions become stripes, and `segment` warns. None for
        a `CellGraph`, whose cells have no shape.
    levels : tuple of Level
        Record of the loop on each level, from the coarsest cells to all faces.
    timings : dict of str to float
        Wall time of each stage, in seconds.
    params : dict
        The parameters used. ``expected_radius`` is r in the unit of the vertices. ``radius`` is the
        parameter, a fraction of the diagonal, or None.
    cells : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or None
        The segmented mesh, cloud or graph, not copied. `regions`, `plot` and `view` need it. None
        for a `Segmentation` made by hand.
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
        """The cells of each region, shape (K, size of the largest region), padded with -1.

        With ``cells_per_region=64`` the rows are batches for networks over patches: each row has 64
        cells, except one row per component. The cells of a region are in the order of a depth-first
        walk that starts at its narrowest end: each cell is a neighbor of the previous cell, unless
        the walk has to backtrack.

        Raises
        ------
        ValueError
            As for `regions`.

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
        """The region graph: areas, centroids, neighbors and borders; see `region_graph`.

        The graph is computed on first use, and has the centers of the segmentation.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.
        """
        return region_graph_of(self._surface, self.labels, self.n_segments, self.centers)

    def plot(self, **options: Any) -> Plot:
        """Draw the regions: ``superfacets.plot(cells, labels)``.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        from ..pictures.plotting import plot

        return plot(self._known_cells("plot"), self.labels, **options)

    def view(self, **options: Any) -> Page:
        """Return an interactive page of the regions: ``superfacets.view(cells, labels)``.

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
        """Return the cells, or raise an error that names the function that takes cells."""
        if self.cells is None:
            raise ValueError(
                f"this segmentation does not store its cells: call {instead}(mesh, labels) instead"
            )
        return self.cells

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        if copy is None:  # numpy 1 refuses `array(copy=None)`
            return np.asarray(self.labels, dtype=dtype)
        return np.array(self.labels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return (
            f"Segmentation({len(self.labels)} cells, {self.n_segments} regions, "
            f"{self.n_iter} iterations, {self.stop_reason})"
        )

    def _repr_html_(self) -> str:
        """Return HTML for notebooks: a picture if possible, counts, and the sizes of regions."""
        from ..pictures.notebook import html_of

        return html_of(self)

    def _repr_png_(self) -> bytes | None:
        """Return the picture alone, for notebooks that do not show HTML."""
        from ..pictures.notebook import png_of

        return png_of(self)
