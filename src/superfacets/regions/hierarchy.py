"""The function `hierarchy`, which computes nested levels of regions, and its result."""

from __future__ import annotations

import reprlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_choice, checked_count, checked_threads, counted
from ..base.errors import IslandWarning
from ..base.options import ISLANDS, Islands
from ..base.types import Floats, Ints
from ..cleanup.edit import read_labeled
from ..clustering.result import Segmentation
from ..clustering.run import segment_graph
from ..graph.cell_graph import CellGraph
from ..graph.constraints import ANY_GROUP, ConstraintOptions
from ..mesh.convert import MeshLike
from ..pipeline import segment
from ..stages.prepare import prepare, read_with_features
from ..weights.features import Features
from .merge_tree import merge_neighbors


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Result of `superfacets.hierarchy`: nested levels of regions.

    Each region of a level is a union of regions of every finer level. On all levels, regions are
    numbered in the order of their lowest regions in `finest`. Therefore, the labels of a level do
    not depend on the other levels.

    Attributes
    ----------
    counts : tuple of int
        Number of regions on each level, in descending order.
    finest : ndarray of int32, shape (N,)
        Labels before the first merge, from 0 to K - 1, and -1 for cells in no region.
    children : ndarray of int32, shape (M, 2)
        The two nodes that each merge joins, the lower node first. Nodes 0 to K - 1 are the regions
        of `finest`. Node K + m is the result of merge m. After m merges, there are K - m regions.
    costs : ndarray of float64, shape (M,)
        Cost of each merge. A merge usually costs more than the merge before. The unit is the
        squared unit of the positions or, with features, the squared unit of the features times the
        unit of area.
    segmentation : Segmentation or None
        Segmentation with the labels `finest`, or None if labels were given.
    """

    counts: tuple[int, ...]
    finest: Ints = field(repr=False)
    children: Ints = field(repr=False)
    costs: Floats = field(repr=False)
    segmentation: Segmentation | None = field(default=None, repr=False)

    @cached_property
    def n_finest(self) -> int:
        """Number of regions before the first merge, K, and largest valid argument of `cut`."""
        return int(self.finest.max()) + 1

    @property
    def n_fewest(self) -> int:
        """Number of regions after all merges, and smallest valid argument of `cut`."""
        return self.n_finest - len(self.children)

    @cached_property
    def levels(self) -> list[Ints]:
        """Labels of each level, (N,) int32, in the order of `counts`."""
        return [self.cut(n) for n in self.counts]

    @cached_property
    def parents(self) -> list[Ints]:
        """For each level except the last: the region of the next level that contains each region.

        ``parents[i]`` has shape (counts[i],). Except at cells labeled -1, ``parents[i][levels[i]]``
        equals ``levels[i + 1]``.
        """
        found = []
        at_all = [self._regions_at(n) for n in self.counts]
        for n, fine, coarse in zip(self.counts, at_all, at_all[1:], strict=False):
            parents = np.empty(n, np.int32)
            parents[fine] = coarse
            found.append(parents)
        return found

    def _regions_at(self, n: int, name: str = "n") -> Ints:
        """Check n, and return the label of each finest region after merging to n regions."""
        n = checked_count(n, name, self.n_finest, "regions on the finest level")
        if n < self.n_fewest:
            raise ValueError(
                f"{name} must be at least {self.n_fewest} because merging stops if no regions are"
                f" neighbors, got {n}: without barriers, islands='nearest' also merges across gaps"
            )
        merged = self.children[: self.n_finest - n]
        parents = np.arange(self.n_finest + len(merged))
        parents[merged.ravel()] = self.n_finest + np.repeat(np.arange(len(merged)), 2)
        while not np.array_equal(above := parents[parents], parents):
            parents = above  # pointer jumping: each pass halves the distance to the roots
        roots = parents[: self.n_finest]
        _, lowest, inverse = np.unique(roots, return_index=True, return_inverse=True)
        ranks = np.empty(n, np.int32)
        ranks[np.argsort(lowest)] = np.arange(n)
        return ranks[inverse]

    def cut(self, n: int) -> Ints:
        """Return the labels of the level with n regions.

        Parameters
        ----------
        n : int
            Number of regions, from `n_fewest` to `n_finest`. Others raise a ValueError or
            TypeError.

        Returns
        -------
        ndarray of int32, shape (N,)
            Region of each cell, from 0 to n - 1, or -1 for cells in no region. Each label occurs.
            Time is O(N + K log K).
        """
        return np.append(self._regions_at(n), np.int32(-1))[self.finest]

    def __repr__(self) -> str:
        counts = ", ".join(map(str, self.counts))
        cells, regions = counted(len(self.finest), "cell"), counted(self.n_finest, "region")
        return f"Hierarchy({cells}, {regions}, levels of {counts})"


def hierarchy(
    mesh: MeshLike | CellGraph, counts: Sequence[int] | npt.NDArray[np.integer[Any]], *,
    labels: npt.ArrayLike | None = None,
    features: npt.ArrayLike | str | Sequence[str] | Features | None = None,
    islands: Islands = "keep", barriers: npt.ArrayLike | None = None, weld: float = True,
    n_threads: int | None = None, **options: Any,
) -> Hierarchy:  # fmt: skip
    r"""Return nested levels of regions: each region is a union of regions of the finer levels.

    The finest level comes from `segment`, or from `labels`. Then the two neighboring regions with
    the lowest merge cost are merged repeatedly. The cost of merging two regions with areas a and b
    and centroids p and q is

    .. math:: \frac{a b}{a + b} \cdot \frac{|p - q| + 12 r (1 - c)}{L}, \qquad
              r = \sqrt{\frac{a + b}{\pi}}

    where L is the length of the border between them, and c is its openness: 1 if it is smooth, and
    0 if all of it is in a deep crease. The first factor (Ward's method) balances sizes; the second
    favors compact regions and borders in creases. In a volume, r is the radius of a ball, and L is
    an area.

    Parameters
    ----------
    mesh : Mesh or mesh-like, cloud-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph whose cells may be of any kind.
    counts : sequence of int
        Number of regions of each level. The numbers must differ and may be in any order.
    labels : array_like of int, shape (N,), optional
        Regions of the finest level. Each label from 0 to K - 1 must occur; -1 marks cells that are
        in no region. The default is ``segment(mesh, max(counts), **options)`` (`segment_graph` for
        a graph).
    features : array_like, shape (N, F) or (V, F), or str, or list of str, optional
        F numbers per cell or per vertex, or names of features as in `segment`. The cost of merging
        is then ``a b / (a + b)`` times the squared distance between the mean features of two
        regions, and the formula above only breaks ties. The finest regions from `segment` also
        follow the features.
    islands : {"keep", "nearest"}
        With ``"keep"``, only regions that touch are merged, so no level can have fewer regions than
        there are connected components. With ``"nearest"``, a component may also be merged with the
        nearest cell of a larger component; the gap costs as much as a border of length r in a deep
        crease.
    barriers : array_like of int, shape (N,) or (E, 2), optional
        As in `segment`, but not with ``islands="nearest"``. Regions never merge across barriers.
    weld, n_threads
        Same as in `segment`. The result does not depend on the number of threads.
    **options
        Further options of `segment` for the finest level, if `labels` are not given. Faces outside
        a `mask` have label -1 on all levels.

    Returns
    -------
    Hierarchy
        Levels with exactly the requested numbers of regions. If the finest regions are connected,
        all regions are, except those merged across a gap. Of several pairs with the same cost, the
        pair of the lowest nodes (see `Hierarchy`) is merged first.

    Warns
    -----
    SliverWarning
        Same as in `segment`.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid; if a level has more regions than the finest level, or fewer
        regions than there are components; if regions in `labels` extend across barriers; or if a
        parameter is out of range or of the wrong type.

    Notes
    -----
    The openness of a border is the mean of exp(-x) along it, where x is the cost of the crease at
    an edge in `crease_weights` (for a graph, in its own weights), in units of 1.6 expected radii of
    the finest level. Time is O(N + M), plus O(m log K) for each merge of regions with m neighbors.

    References
    ----------
    Ward, "Hierarchical Grouping to Optimize an Objective Function", 1963.

    Examples
    --------
    >>> import superfacets
    >>> mesh = superfacets.sample_mesh(5_000)
    >>> nested = superfacets.hierarchy(mesh, [200, 50, 10])
    >>> [int(labels.max()) + 1 for labels in nested.levels]
    [200, 50, 10]
    >>> int(nested.cut(77).max()) + 1
    77
    """
    wanted = _checked_counts(counts)
    checked_choice(islands, "islands", ISLANDS)
    threads = checked_threads(n_threads)
    given = Features.of(features)
    if labels is not None and options:
        raise TypeError(
            f"{', '.join(options)} would have no effect because labels are given: leave out either"
            " labels or these options"
        )
    source: Any = mesh
    mask = ConstraintOptions(options.get("mask"))
    if not isinstance(mesh, CellGraph):
        source, given = read_with_features(mesh, given, mask, threads)
    constraints = ConstraintOptions(None, barriers)
    if islands == "nearest" and constraints.is_used:
        raise ValueError(
            "islands='nearest' cannot be combined with barriers, because a merge across a gap could"
            " bypass a barrier: leave one of them out"
        )
    found = None
    if labels is None:
        if features is not None:
            options = {**options, "features": given}
        options = {**options, "islands": islands, "barriers": barriers, "n_threads": threads}
        found = _finest(source, wanted[0], weld, options)
        labels = found.labels
    with _core.Workspace():  # all steps share the threads of the workspace
        graph, costs, regions, n_regions = read_labeled(source, labels, None, weld, threads)
        mask = mask if mask.is_used else ConstraintOptions(regions >= 0)
        table = given.scaled(source, costs.surface.measures, mask)
        kept = constraints.kept_cells(source, graph, weld=weld, n_threads=threads)
        if kept is not None:
            _check_sides(regions, kept.groups)
            costs = costs.of_kept(kept)
        merges = merge_neighbors(costs, regions, n_regions, table, islands)
    nested = Hierarchy(wanted, regions, *merges, found)
    for count in (wanted[0], wanted[-1]):
        nested._regions_at(count, "each number in counts")
    return nested


def _checked_counts(counts: Any) -> tuple[int, ...]:
    """Return checked numbers of regions in descending order; raise an error if two are equal."""
    if not hasattr(counts, "__len__") or isinstance(counts, (str, bytes)):
        raise TypeError(
            f"counts must be a sequence of numbers of regions, got {reprlib.repr(counts)}"
        )
    checked = sorted((checked_count(n, "each number in counts") for n in counts), reverse=True)
    if not checked:
        raise ValueError("counts must contain at least one number of regions, but it is empty")
    for count, next_count in pairwise(checked):
        if count == next_count:
            raise ValueError(f"counts must contain distinct numbers, but {count} occurs repeatedly")
    return tuple(checked)


def _finest(source: Any, n: int, weld: float, options: dict[str, Any]) -> Segmentation:
    """Segment the cells into n regions, or more if some components get no seed."""
    if isinstance(source, CellGraph):
        return segment_graph(source, n, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IslandWarning)  # merging reduces the number to n later
        denoise = options.get("denoise", "auto")
        mesh = source if weld else prepare(source, weld=False, denoise=denoise)
        return segment(mesh, n, **options)


def _check_sides(regions: Ints, groups: Ints) -> None:
    """Raise a ValueError if a region has cells of different groups (see `KeptCells.groups`)."""
    has_both = (regions >= 0) & (groups != ANY_GROUP)
    group_of = np.full(int(regions.max()) + 1, ANY_GROUP, np.int32)
    group_of[regions[has_both]] = groups[has_both]
    is_wrong = has_both & (group_of[regions] != groups)
    if is_wrong.any():
        region = int(regions[np.argmax(is_wrong)])
        raise ValueError(
            f"labels must not cross barriers: region {region} has cells on both sides of a barrier"
        )
