"""The result of a segmentation: labels, centers, and facts about the run."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._types import Array, Ints
from ..cells.cell_graph import CellGraph
from ..cells.kinds import as_surface
from ..cells.patches import patches_of
from ..cells.region_adjacency import RegionGraph, region_graph_of
from ..cells.surface import Surface
from ..mesh.cells import Cells

if TYPE_CHECKING:
    from ..pictures.page.document import Page
    from ..pictures.plotting import Plot

StopReason = Literal["converged", "settled", "max_num_iter", "cancelled"]


@dataclass(frozen=True)
class Level:
    """Record of the loop on one graph: that of all cells, or one of coarser cells.

    Attributes
    ----------
    n_cells : int
        Number of its cells.
    n_iter : int
        Number of iterations on it. All faces after coarser cells get one, which is a
        classification.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why they ended, as for `Segmentation`.
    seconds : float
        Wall time of these iterations.
    """

    n_cells: int
    n_iter: int
    stop_reason: StopReason
    seconds: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`: a label for every face, and facts about the run.

    ``np.asarray(segmentation)`` is ``labels``. A notebook shows it with a picture, drawn without a
    display, if the extra `viz` is there and there are at most 200,000 faces or 50,000 points.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, 0..K-1, in the order of the input; -1 for those that a mask left out.
    centers : ndarray of int32, shape (K,)
        The face that represents each region, and belongs to it. The labels are the classification
        by these centers, or by the coarse cells that they are in, followed by the clean-up of
        regions, if there is one (as there is in `segment` by default).
    n_segments : int
        Number of regions, K.
    n_iter : int
        Number of iterations, on all levels together. Where regions have many faces, most of them
        are on coarser cells; see ``levels``.
    stop_reason : {"converged", "settled", "max_num_iter", "cancelled"}
        Why the loop ended: the centers moved less than `tol`; they alternate between a few states,
        none of which is better; the maximum number of iterations; `progress` returned False. With
        several levels, why it ended on the finest coarse one. On a level with `relocate`, why the
        last round of it ended.
    n_unreached : int
        Islands that no center reached: components that got no seed and, with `radius_factor`, faces
        out of reach. With ``islands="keep"`` each made one more region, which K counts; with
        ``"nearest"`` they joined the nearest region, or are regions where barriers keep them from
        all others.
    n_joined : int
        Pieces of regions that joined a neighbor, with ``enforce_connectivity``.
    n_merged : int
        Small regions that were merged into another, with ``min_size``: K was larger by as many.
    n_islands : int
        Small regions that have no neighbor, and were kept.
    n_extra_pieces : int
        Pieces of regions beyond one for each: with ``cells_per_region``, where no connected regions
        of these sizes were found.
    sliver_share : float or None
        Share of the area, 0 to 1, in faces longer than 2 r and thinner than r / 2, with the
        expected radius r. Above 0.1 regions become stripes, and `segment` warns. None for cells of
        a graph of one's own, which have no length.
    levels : tuple of Level
        Record of the loop on each level, the coarsest first, all faces last.
    timings : dict of str to float
        Seconds of wall time in each stage.
    params : dict
        The parameters as used. ``expected_radius`` is r in the unit of the vertices, where
        ``radius`` is the fraction of the diagonal that was asked for, or None.
    cells : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or None
        What was segmented, as `segment` understood it; it is not copied. `regions` needs it. None
        for a result that was made by hand.
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
        """The cells of each region, shape (K, size of the largest), padded with -1.

        With ``cells_per_region=64`` these are batches for networks over patches: all have 64 cells
        but one per component. The cells of a region are in the order of a walk along the surface:
        each is a neighbor of the one before, but where the walk came to a dead end and went on from
        the last cell on its way that had a neighbor left. It begins at the narrowest end.

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
        return patches_of(self._surface, self.labels, self.n_segments)

    @cached_property
    def regions(self) -> RegionGraph:
        """The region graph: areas, centroids, neighbors and borders; see `region_graph`.

        Made when it is first asked for, and kept. Its centers are those of the segmentation.

        Raises
        ------
        ValueError
            If ``cells`` is None, or a `CellGraph` without `ArcMeasures`.
        """
        return region_graph_of(self._surface, self.labels, self.n_segments, self.centers)

    def plot(self, **options: Any) -> Plot:
        """Return a picture of the regions: ``superfacets.plot`` of the cells with these labels.

        Raises
        ------
        ValueError
            If ``cells`` is None.
        """
        from ..pictures.plotting import plot

        return plot(self._known_cells("plot"), self.labels, **options)

    def view(self, **options: Any) -> Page:
        """Return a page to look at: ``superfacets.view`` of the cells with these labels.

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
        """The cells; an error if there are none says which function takes them."""
        if self.cells is None:
            raise ValueError(
                f"the segmentation does not know its cells: call {instead}(mesh, labels)"
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
        """Show a notebook a picture, where one can be drawn, counts, and the sizes of regions."""
        from ..pictures.notebook import html_of

        return html_of(self)

    def _repr_png_(self) -> bytes | None:
        """Show a notebook that takes no HTML the picture alone."""
        from ..pictures.notebook import png_of

        return png_of(self)
