"""Stage 5: convert values of cells to values of regions, and back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..base.checks import (
    checked_choice,
    checked_classes,
    checked_nonnegative_array,
    checked_partial_labels,
    checked_threads,
    counted,
    ranked_labels,
    refuse_first,
    refuse_mask,
    refuse_order,
)
from ..base.types import Array, Floats, Ints, Longs
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_known, kind_of
from ..graph.sums import weighted_majority
from ..mesh.base import Cells
from ..mesh.convert import MeshLike
from .crease_labels import corners_in

Pooling = Literal["mean", "sum", "max", "min", "majority"]
_POOLINGS = ("mean", "sum", "max", "min", "majority")

_ROWS_AT_ONCE = 1 << 14
"""Number of table rows that are processed together, which takes 8 MB if rows have 64 numbers."""


def pool(
    labels: npt.ArrayLike, values: npt.ArrayLike, *, how: Pooling = "mean",
    mesh: MeshLike | CellGraph | None = None, measures: npt.ArrayLike | None = None,
) -> Array:  # fmt: skip
    """Combine the values of the cells of each region into one value, or one row of values.

    Parameters
    ----------
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur. Cells labeled -1 are ignored. To
        pool values of vertices with labels of vertices (superpoints), leave out `mesh`.
    values : array_like of numbers or bools, shape (N,) or (N, F)
        One value or row per cell or, if `mesh` has vertices, per vertex: shape (V,) or (V, F). Then
        each cell divides its area equally among its corners. If N = V, values are values of cells.
    how : {"mean", "sum", "max", "min", "majority"}
        ``"mean"`` and ``"sum"`` weight each value by the area of its cell, so the sum is an
        integral over the region. If neither `mesh` nor `measures` is given, all cells count the
        same. ``"max"`` and ``"min"`` do not depend on areas. ``"majority"`` is the integer or bool
        with the largest total area, or the lowest of several; -1 is unknown and does not count, and
        a region of unknown values gets -1.
    mesh : Mesh or mesh-like, or CellGraph, optional
        The labeled cells, whose areas (volumes of tetrahedra) are the weights.
    measures : array_like, shape (N,), optional
        Weights of the cells, >= 0, if `mesh` is not given.

    Returns
    -------
    ndarray, shape (K,) or (K, F)
        Values of regions: float64 for means and sums, and the dtype of `values` otherwise. If all
        cells of a region have area 0, its mean is not weighted. A NaN value makes the result of its
        region NaN. The mean of equal numbers is exactly this number.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if the shapes of values, labels and measures do not match, if a
        dtype is wrong, if `how` is unknown, or if both `mesh` and `measures` are given.

    Examples
    --------
    >>> pool([0, 0, 1], [1.0, 3.0, 5.0], measures=[3.0, 1.0, 1.0])
    array([1.5, 5. ])
    """
    checked_choice(how, "how", _POOLINGS)
    table = _checked_values(values, how)
    if mesh is not None and measures is not None:
        raise ValueError("the mesh already defines the measures: leave out mesh or measures")
    source = None if mesh is None else as_known(mesh)
    refuse_order(labels, "labels")
    n_cells = np.asarray(labels).size if source is None else source.n_cells
    n_vertices = getattr(source, "n_vertices", None)
    array, n_regions = checked_partial_labels(labels, n_cells, n_vertices=n_vertices)
    weights = None
    if how not in ("max", "min"):
        threads = checked_threads(None)
        if measures is not None:
            weights = checked_nonnegative_array(measures, len(array), "measures", "cell", threads)
        elif source is not None:
            weights = kind_of(source).measures(source, threads)
    members = _members_of(table, array, n_regions, weights, source)
    columns = table[:, np.newaxis] if table.ndim == 1 else table
    shape = (n_regions, *table.shape[1:])
    if how == "majority":
        pooled = [_majorities(column, members) for column in columns.T]
        return np.stack(pooled, axis=-1).reshape(shape)
    if how in ("max", "min"):
        extreme = np.maximum if how == "max" else np.minimum
        return _extremes(extreme, columns, members).reshape(shape)
    return (_means if how == "mean" else _sums)(columns, members).reshape(shape)


def unpool(labels: npt.ArrayLike, values: npt.ArrayLike, *, fill: float | None = None) -> Array:
    """Copy the value, or the row of values, of each region to its cells.

    Parameters
    ----------
    labels : array_like of int, shape (N,)
        Region of each cell, from -1 to K - 1.
    values : array_like, shape (K,) or (K, F)
        One value or row per region. Regions without cells are allowed.
    fill : number, optional
        Value of cells labeled -1. The default is NaN for floats and -1 for integers.

    Returns
    -------
    ndarray, shape (N,) or (N, F)
        Value or row of each cell, with the dtype of `values`.

    Raises
    ------
    ValueError, TypeError
        If labels are not integers from -1 to K - 1, or if cells are labeled -1 and the dtype of
        `values` cannot represent `fill`.

    Examples
    --------
    >>> unpool([0, 0, 1, -1], [1.5, 5.0])
    array([1.5, 1.5, 5. , nan])
    """
    refuse_order(labels, "labels")
    refuse_mask(values, "values")
    table = np.asarray(values)
    if table.ndim == 0:
        raise ValueError("values must have one value or row per region, got a single number")
    array = checked_classes(labels, np.asarray(labels).size, "labels")
    must = f"less than {len(table)}, the number of values"
    refuse_first(array >= len(table), "labels", array, must)
    is_outside = array < 0
    if not is_outside.any():
        return table[array]
    missing = _checked_fill(fill, table.dtype)
    if not len(table):
        return np.full((len(array), *table.shape[1:]), missing)
    spread: Array = table[array]
    spread[is_outside] = missing
    return spread


@dataclass(frozen=True, eq=False)
class _Members:
    """Table of the members of all regions, sorted by region. Members are cells or their corners."""

    regions: npt.NDArray[np.integer]  # (m,) region of each member
    rows: npt.NDArray[np.integer]  # (m,) row of each member in the table of values
    weights: Floats | None  # (m,) weight of each member; None if all weights are 1
    starts: Longs  # (K + 1,) index of the first member of each region

    @property
    def n_regions(self) -> int:
        return len(self.starts) - 1

    def blocks(self) -> Iterator[tuple[slice, slice, Longs]]:
        """Yield blocks: slices of regions and of their members, and the first member of each.

        A block has at most `_ROWS_AT_ONCE` members, or a single region.
        """
        first = 0
        while first < self.n_regions:
            start = self.starts[first]
            end = start + _ROWS_AT_ONCE
            last = max(first + 1, int(np.searchsorted(self.starts, end, side="right")) - 1)
            members = slice(start, self.starts[last])
            yield slice(first, last), members, self.starts[first:last] - start
            first = last


def _members_of(
    values: Array, labels: Ints, n_regions: int, weights: Floats | None,
    source: Cells | CellGraph | None,
) -> _Members:  # fmt: skip
    """Return the members of all regions, sorted by region: cells, or corners for vertex values."""
    rows: npt.NDArray[np.integer] | None = None
    if len(values) != len(labels):
        n_vertices = getattr(source, "n_vertices", None)
        if len(values) != n_vertices:
            vertices = "" if n_vertices is None else f" or per vertex ({n_vertices})"
            hint = "; for values of vertices, pass mesh=" if source is None else ""
            raise ValueError(
                f"values must have one row per cell ({len(labels)}){vertices}, got"
                f" {counted(len(values), 'row')}{hint}"
            )
        corners = corners_in(source)
        rows, sizes = corners.vertices, corners.sizes
        labels = np.repeat(labels, sizes)
        weights = None if weights is None else np.repeat(weights / sizes, sizes)
    order = np.argsort(labels, kind="stable")[np.count_nonzero(labels < 0) :]
    sorted_labels = labels[order]
    starts = np.concatenate([[0], np.cumsum(np.bincount(sorted_labels, minlength=n_regions))])
    weights = None if weights is None else weights[order]
    rows = order if rows is None else rows[order]
    return _Members(sorted_labels, rows, weights, starts.astype(np.int64))


def _means(table: Array, members: _Members) -> Floats:
    means = np.empty((members.n_regions, table.shape[1]))
    weights = _positive_weights(members)
    with np.errstate(invalid="ignore", over="ignore"):  # values may be infinite
        for regions, inside, starts in members.blocks():
            part = table[members.rows[inside]].astype(np.float64, copy=False)
            # The mean of equal values is exact: differences from the first value are averaged.
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


def _extremes(operation: np.ufunc, table: Array, members: _Members) -> Array:
    extremes = np.empty((members.n_regions, table.shape[1]), table.dtype)
    for regions, inside, starts in members.blocks():
        extremes[regions] = operation.reduceat(table[members.rows[inside]], starts)
    return extremes


def _majorities(column: Array, members: _Members) -> Array:
    """Return the value with the largest total weight in each region, or -1 if all values are -1."""
    values = column[members.rows]
    votes, names = ranked_labels(values if values.itemsize > 2 else values.astype(np.int32))
    regions, weights = members.regions, members.weights
    if weights is None:
        weights = np.ones(len(votes))
    is_known = votes >= 0
    if not is_known.all():
        regions, votes, weights = regions[is_known], votes[is_known], weights[is_known]
    winners = weighted_majority(regions, votes, weights, members.n_regions).winners
    names = np.append(names.astype(column.dtype), np.array([-1]).astype(column.dtype))
    return names[winners]


def _checked_values(values: npt.ArrayLike, how: str) -> Array:
    refuse_mask(values, "values")
    array = np.asarray(values)
    if array.ndim not in (1, 2):
        raise ValueError(f"values must have shape (N,) or (N, F), got {array.shape}")
    if how == "majority":
        if array.size and array.dtype.kind not in "biu":
            raise TypeError(f"values must be integers or bools for 'majority', got {array.dtype}")
    elif array.dtype.kind not in "biuf":
        raise TypeError(f"values must be numbers or bools, got {array.dtype}")
    return array


def _checked_fill(fill: Any, dtype: np.dtype[Any]) -> Array:
    """Convert `fill` to a dtype; raise a ValueError if the dtype cannot represent the value."""
    if fill is None:
        fill = np.nan if dtype.kind == "f" else -1
    given = np.asarray(fill)
    with np.errstate(invalid="ignore", over="ignore"):
        converted = given.astype(dtype)
    is_of_kind = dtype.kind in "iufc" or given.dtype.kind == dtype.kind
    is_changed = dtype.kind not in "fc" and not np.array_equal(converted, given)
    if is_changed or not is_of_kind:
        raise ValueError(
            f"fill must be representable as {dtype} because some cells are labeled -1, got {fill}:"
            " choose another fill"
        )
    return converted
