"""Stage 5: reduce values of cells to one value per region, and copy region values to cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .._types import Array, Floats, Ints, Longs
from .._validate import (
    checked_choice,
    checked_classes,
    checked_nonnegative_array,
    checked_partial_labels,
    checked_threads,
    refuse_mask,
)
from ..adapters.convert import CloudLike, MeshLike
from ..cells.cell_graph import CellGraph
from ..cells.kinds import as_known, measures_of
from ..cells.sums import weighted_majority
from ..mesh.cells import Cells
from .vertices import corner_groups

Pooling = Literal["mean", "sum", "max", "min", "majority"]
_POOLINGS = ("mean", "sum", "max", "min", "majority")

_ROWS_AT_ONCE = 1 << 14
"""Number of rows processed at a time. Rows of 64 numbers then fit into a cache of 8 MB."""


def pool(
    values: npt.ArrayLike,
    labels: npt.ArrayLike,
    *,
    how: Pooling = "mean",
    cells: MeshLike | CloudLike | CellGraph | None = None,
    measures: npt.ArrayLike | None = None,
) -> Array:
    """Return one value, or one row of values, per region.

    Parameters
    ----------
    values : array_like of numbers or bools, shape (N,) or (N, F)
        One value or row per cell or, if ``cells`` have vertices, per vertex: shape (V,) or (V, F).
        Values of vertices count with equal parts of the areas of the cells around each vertex. If N
        equals V, values belong to cells.
    labels : array_like of int, shape (N,)
        Regions 0..K-1, each at least once. Cells labeled -1 are ignored. For labels of vertices,
        such as superpoints, pass values of vertices and no ``cells``.
    how : {"mean", "sum", "max", "min", "majority"}
        ``"mean"`` and ``"sum"`` weight each value by the area of its cell, so the sum is an
        integral over the region. All weights are 1 if neither ``cells`` nor ``measures`` are given.
        ``"max"`` and ``"min"`` do not depend on areas. ``"majority"`` is the value with the largest
        total area; ties go to the lowest value. It needs integers or bools; -1 means unknown, and
        is the result only if a region has no known value.
    cells : Mesh or mesh-like, or CellGraph, optional
        The labeled cells, as for `segment`. Their areas (volumes of tetrahedra) are the weights.
    measures : array_like, shape (N,), optional
        Weights, >= 0, in place of ``cells``.

    Returns
    -------
    ndarray, shape (K,) or (K, F)
        float64 for means and sums; else the dtype of `values`. If all cells of a region have area
        0, its mean is unweighted. A NaN makes the mean, sum, maximum and minimum of its region NaN.
        The mean of equal numbers is exactly this number.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If the shapes of values, labels and measures do not match, a dtype is wrong, `how` is
        unknown, or both ``cells`` and ``measures`` are given.

    See Also
    --------
    unpool : the reverse: copy values of regions to cells.
    snap : replace noisy labels by the majority in each region.

    Notes
    -----
    Time O(N log N) to sort the labels and O(N F) for the values. Sums have double precision and a
    fixed order.

    Examples
    --------
    >>> pool([1.0, 3.0, 5.0], [0, 0, 1])
    array([2., 5.])
    >>> pool([1.0, 3.0, 5.0], [0, 0, 1], measures=[3.0, 1.0, 1.0])
    array([1.5, 5. ])
    >>> pool([7, 2, 4], [0, 0, -1], how="max")
    array([7])
    """
    checked_choice(how, "how", _POOLINGS)
    table = _checked_values(values, how)
    source = _checked_source(cells, measures)
    array, n_regions = checked_partial_labels(
        labels, _count(labels, source), n_vertices=getattr(source, "n_vertices", None)
    )
    needs_weights = how not in ("max", "min")
    weights = _weights_of(source, measures, len(array)) if needs_weights else None
    members = _members_of(table, array, n_regions, weights, source)
    columns = table[:, np.newaxis] if table.ndim == 1 else table
    if how == "majority":
        pooled = [_majorities(column, members) for column in columns.T]
        return np.stack(pooled, axis=-1).reshape(n_regions, *table.shape[1:])
    reduce = {"mean": _means, "sum": _sums, "max": _highest, "min": _lowest}[how]
    return reduce(columns, members).reshape(n_regions, *table.shape[1:])


def unpool(values: npt.ArrayLike, labels: npt.ArrayLike, fill: float | None = None) -> Array:
    """Return, for each cell, the value or row of values of its region.

    Parameters
    ----------
    values : array_like, shape (K,) or (K, F)
        One value or row per region. Regions without cells are allowed.
    labels : array_like of int, shape (N,)
        Region of each cell, -1 to K - 1.
    fill : number, optional
        Value of cells labeled -1. By default NaN for floats and -1 for signed integers.

    Returns
    -------
    ndarray, shape (N,) or (N, F)
        Has the dtype of `values`.

    Raises
    ------
    ValueError, TypeError
        If labels are not integers from -1 to K - 1, or if cells are labeled -1 and the dtype of
        `values` cannot represent `fill`.

    Examples
    --------
    >>> unpool([1.5, 5.0], [0, 0, 1, -1])
    array([1.5, 1.5, 5. , nan])
    """
    refuse_mask(values, "values")
    table = np.asarray(values)
    if table.ndim == 0:
        raise ValueError("values must hold one value or row per region, got a single number")
    array = checked_classes(labels, np.size(labels), "labels")
    if array.max(initial=-1) >= len(table):
        place = int(np.argmax(array))
        raise ValueError(f"labels[{place}] is {array[place]} but there are {len(table)} values")
    is_outside = array < 0
    if not is_outside.any():
        return table[array]
    missing = _checked_fill(fill, table.dtype)
    if not len(table):
        return np.full((len(array), *table.shape[1:]), missing)
    spread: Array = table[array]
    spread[is_outside] = missing
    return spread


def snap(
    noisy_labels: npt.ArrayLike,
    regions: npt.ArrayLike,
    *,
    cells: MeshLike | CloudLike | CellGraph | None = None,
) -> Ints:
    """Return labels of cells after a majority vote in each region, to remove noise.

    Parameters
    ----------
    noisy_labels : array_like of int, shape (N,)
        Predicted classes, for example from a network: any integers >= 0. Cells labeled -1 (unknown)
        do not vote, and get the label of their region.
    regions : array_like of int, shape (N,)
        Regions 0..K-1, each at least once, as returned by `segment`. Cells in region -1 do not
        vote and keep their labels.
    cells : Mesh or mesh-like, or CellGraph, optional
        The labeled cells. Each cell votes with its area (volume). By default all votes are equal.

    Returns
    -------
    ndarray of int32, shape (N,)
        The label with the largest total area in the region of each cell; ties go to the lowest
        label. -1 in regions without labeled cells.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If labels are not integers >= -1, one per cell, or if a region 0..K-1 is missing.

    Examples
    --------
    >>> snap([4, 4, 9, -1, 9, 2], [0, 0, 0, 0, 1, -1])
    array([4, 4, 4, 4, 9, 2], dtype=int32)
    """
    source = _checked_source(cells, None)
    array, n_regions = checked_partial_labels(regions, _count(regions, source), "regions")
    noisy = checked_classes(noisy_labels, len(array), "noisy_labels")
    weights = _weights_of(source, None, len(array))
    members = _members_of(noisy, array, n_regions, weights, None)
    winners = _majorities(noisy, members)
    is_inside = array >= 0
    noisy[is_inside] = winners[array[is_inside]]
    return noisy


@dataclass(frozen=True, eq=False)
class _Members:
    """Cells, or corners of cells, sorted by region."""

    regions: npt.NDArray[np.integer]  # region of each member
    rows: npt.NDArray[np.integer]  # row in the values of each member
    weights: Floats | None  # one per member; None: all are 1
    starts: Longs  # (K + 1,) first member of each region; every region has members

    @property
    def n_regions(self) -> int:
        return len(self.starts) - 1

    def blocks(self) -> Iterator[tuple[slice, slice, Longs]]:
        """Yield ranges of regions and of their members, and the start of each region in a range."""
        first = 0
        while first < self.n_regions:
            end = self.starts[first] + _ROWS_AT_ONCE
            last = max(first + 1, int(np.searchsorted(self.starts, end, side="right")) - 1)
            begin = self.starts[first]
            yield (
                slice(first, last),
                slice(begin, self.starts[last]),
                self.starts[first:last] - begin,
            )
            first = last


def _members_of(
    values: Array,
    labels: Ints,
    n_regions: int,
    weights: Floats | None,
    source: Cells | CellGraph | None,
) -> _Members:
    """Sort cells by region; sort corners of cells if there is one value per vertex."""
    rows: npt.NDArray[np.integer] | None = None
    if len(values) != len(labels):
        n_vertices = getattr(source, "n_vertices", None)
        if len(values) != n_vertices:
            also = "" if n_vertices is None else f" and {n_vertices} vertices"
            raise ValueError(f"there are {len(values)} values for {len(labels)} cells{also}")
        rows, sizes = corner_groups(source)
        labels = np.repeat(labels, sizes)
        weights = None if weights is None else np.repeat(weights / sizes, sizes)
    order = np.argsort(labels, kind="stable")[np.count_nonzero(labels < 0) :]
    sorted_labels = labels[order]
    starts = np.concatenate([[0], np.cumsum(np.bincount(sorted_labels, minlength=n_regions))])
    return _Members(
        sorted_labels,
        order if rows is None else rows[order],
        None if weights is None else weights[order],
        starts.astype(np.int64),
    )


def _means(table: Array, members: _Members) -> Floats:
    means = np.empty((members.n_regions, table.shape[1]))
    weights = _positive_weights(members)
    with np.errstate(invalid="ignore", over="ignore"):  # of infinite values
        for regions, inside, starts in members.blocks():
            part = table[members.rows[inside]].astype(np.float64, copy=False)
            # Averaging differences to one value makes the mean of equal values exact.
            base = np.where(np.isfinite(part[starts]), part[starts], 0.0)
            part -= np.repeat(base, np.diff(starts, append=len(part)), axis=0)
            part *= weights[inside, np.newaxis]
            totals = np.add.reduceat(weights[inside], starts)
            means[regions] = base + np.add.reduceat(part, starts) / totals[:, np.newaxis]
    return means


def _positive_weights(members: _Members) -> Floats:
    """Return the weights of the members, replaced by 1 in regions where all weights are 0."""
    if members.weights is None:
        return np.ones(len(members.rows))
    highest = np.zeros(members.n_regions)
    np.maximum.at(highest, members.regions, members.weights)
    return np.where(highest[members.regions] > 0, members.weights, 1.0)


def _sums(table: Array, members: _Members) -> Floats:
    sums = np.empty((members.n_regions, table.shape[1]))
    with np.errstate(invalid="ignore", over="ignore"):
        for regions, inside, starts in members.blocks():
            part = table[members.rows[inside]].astype(np.float64, copy=False)
            if members.weights is not None:
                part *= members.weights[inside, np.newaxis]
            sums[regions] = np.add.reduceat(part, starts)
    return sums


def _highest(table: Array, members: _Members) -> Array:
    return _extremes(np.maximum, table, members)


def _lowest(table: Array, members: _Members) -> Array:
    return _extremes(np.minimum, table, members)


def _extremes(operation: np.ufunc, table: Array, members: _Members) -> Array:
    extremes = np.empty((members.n_regions, table.shape[1]), table.dtype)
    for regions, inside, starts in members.blocks():
        extremes[regions] = operation.reduceat(table[members.rows[inside]], starts)
    return extremes


def _majorities(column: Array, members: _Members) -> Array:
    """Return the value with the largest weight in each region; -1 if no value is known."""
    votes, names = _codes(column[members.rows])
    regions, weights = members.regions, members.weights
    if weights is None:
        weights = np.ones(len(votes))
    is_known = votes >= 0
    if not is_known.all():
        regions, votes, weights = regions[is_known], votes[is_known], weights[is_known]
    winners = weighted_majority(regions, votes, weights, members.n_regions).winners
    return winners.astype(column.dtype) if names is None else names[winners]


def _codes(values: Array) -> tuple[Ints, Array | None]:
    """Encode integers as int32 codes in the same order (-1 stays -1), and return their values.

    The values are None if each code is its own value.
    """
    low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
    if low >= -1 and high <= np.iinfo(np.int32).max:
        return values.astype(np.int32), None
    names, codes = np.unique(values, return_inverse=True)
    if low < 0:
        codes[values == -1] = -1
        names = np.append(names, -1)  # value of code -1
    return codes.astype(np.int32), names


def _checked_values(values: npt.ArrayLike, how: str) -> Array:
    """Return values as an array of numbers or bools of one or two dimensions."""
    refuse_mask(values, "values")
    array = np.asarray(values)
    if array.ndim not in (1, 2):
        raise ValueError(f"values must have shape (N,) or (N, F), got {array.shape}")
    if how == "majority":
        if array.size and array.dtype.kind not in "biu":
            raise TypeError(f"how='majority' needs integers or bools, got {array.dtype}")
    elif array.dtype.kind not in "biuf":
        raise TypeError(f"values must be numbers, got {array.dtype}")
    return array


def _checked_source(cells: Any, measures: Any) -> Cells | CellGraph | None:
    if cells is not None and measures is not None:
        raise ValueError("give cells or measures, not both: cells have measures of their own")
    return None if cells is None else as_known(cells)


def _count(labels: npt.ArrayLike, source: Cells | CellGraph | None) -> int:
    """Return the expected number of labels."""
    if source is None:
        return int(np.size(labels))
    return source.n_cells


def _weights_of(
    source: Cells | CellGraph | None, measures: npt.ArrayLike | None, n_cells: int
) -> Floats | None:
    threads = checked_threads(None)
    if measures is not None:
        return checked_nonnegative_array(measures, n_cells, "measures", "cell", threads)
    return None if source is None else measures_of(source, threads)


def _checked_fill(fill: Any, dtype: np.dtype[Any]) -> Array:
    """Return the fill value in this dtype; a ValueError if it cannot represent the value."""
    if fill is None:
        fill = np.nan if dtype.kind == "f" else -1
    given = np.asarray(fill)
    with np.errstate(invalid="ignore", over="ignore"):
        held = given.astype(dtype)
    is_of_kind = dtype.kind in "iufc" or given.dtype.kind == dtype.kind
    is_changed = dtype.kind not in "fc" and not np.array_equal(held, given)
    if is_changed or not is_of_kind:
        raise ValueError(
            f"some cells are labeled -1, and {dtype} cannot hold fill={fill}: choose another fill"
        )
    return held
