"""Features of cells, such as colors. Costs of feature differences are added to arc weights."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_number, counted, exact_doubles, refuse_first, refuse_mask
from ..base.errors import FeatureWarning, MeshError
from ..base.types import Bools, Floats, Ints
from ..graph.cell_graph import CellGraph
from ..graph.constraints import NO_CONSTRAINTS, ConstraintOptions, in_order
from ..graph.kinds import kind_of
from ..graph.surface import Surface
from ..mesh.base import Cells

FEATURE_WEIGHT = 5.0
"""Default cost of a feature difference of one standard deviation, as a multiple of the expected
radius of a region. Larger weights hardly help: on three slightly smoothed color photographs, the
borders of 200 regions contain 70 % of the image edges with a weight of 5, and 71 % with 20."""

CONSTANT = 1e-12
"""Standard deviation, relative to the largest value, up to which a feature counts as constant."""


@dataclass(frozen=True, eq=False)
class FeatureTable:
    """Features of cells, and the groups of columns, such as colors, with a common scale factor."""

    values: Floats  # (N, F) features of each cell
    groups: tuple[tuple[int, float], ...]
    """For each group of consecutive columns: number of columns, and lower bound of the standard
    deviation that the columns are divided by."""

    names: tuple[str, ...] = ()  # name of the feature of each column

    def __getitem__(self, rows: Any) -> FeatureTable:
        return FeatureTable(self.values[rows], self.groups, self.names)


@dataclass(frozen=True, eq=False)
class Features:
    """Features of cells and the weight of their differences: the argument `features` of `segment`.

    Parameters
    ----------
    table : array_like, shape (N, F) or (V, F), or str, or list of str
        F numbers per face or per vertex, or names of features, as in `segment`. Each feature is
        divided by its standard deviation.
    weight : float, default 5.0
        Cost of a feature difference of one standard deviation, as a multiple of the expected radius
        of a region, >= 0. With 0, features have no effect.

    Raises
    ------
    ValueError, TypeError
        If the weight is negative, not finite or not a number. The table is checked later, together
        with the mesh.
    """

    table: Any
    weight: float = FEATURE_WEIGHT

    def __post_init__(self) -> None:
        """Check the weight."""
        object.__setattr__(self, "weight", checked_number(self.weight, "weight", zero=True))
        if isinstance(self.table, str):
            object.__setattr__(self, "table", (self.table,))

    @classmethod
    def of(cls, features: Any, weight: float = FEATURE_WEIGHT) -> Features:
        """Return the argument `features` of `segment`, which may be None, as Features."""
        return features if isinstance(features, Features) else cls(features, weight)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of features, or an empty tuple for numbers; raise a TypeError for a mixture."""
        given = self.table
        if isinstance(given, (list, tuple)) and given and isinstance(given[0], str):
            if not all(isinstance(name, str) for name in given):
                raise TypeError("features must be either names or numbers, but they contain both")
            return tuple(given)
        return ()

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` for features; empty if there are no features."""
        return {} if self.table is None else {"feature_weight": self.weight}

    def costs(
        self, source: Cells | CellGraph, measures: Floats, n_threads: int,
        constraints: ConstraintOptions = NO_CONSTRAINTS, order: Ints | None = None,
    ) -> FeatureCosts | None:  # fmt: skip
        """Return an object that adds costs of feature differences to the weights of arcs.

        The result is None if there are no features or their weight is 0. If the cells were sorted,
        `order` is the index of each cell in `source`, the input mesh or cloud. Features of cells
        outside the mask have no effect. Raises a ValueError if other features are not finite, or if
        there is not one row per cell or per vertex.
        """
        table = self.scaled(source, measures, constraints, order)
        if table is None or not self.weight:
            return None
        _warn_if_constant(table, self.table.names if isinstance(self.table, FeatureTable) else ())
        return FeatureCosts(table, self.weight, n_threads)

    def scaled(
        self, source: Cells | CellGraph, measures: Floats,
        constraints: ConstraintOptions = NO_CONSTRAINTS, order: Ints | None = None,
    ) -> Floats | None:  # fmt: skip
        """Return the scaled features of all cells, (N, F), or None if there are no features."""
        if self.table is None:
            return None
        given, groups, names = self.table, None, tuple[str, ...]()
        if isinstance(self.table, FeatureTable):
            given, groups, names = self.table.values, self.table.groups, self.table.names
        table = _checked_table(given, len(measures), source, constraints.kept_values(source))
        is_kept = constraints.per_cell(source).mask
        _refuse_infinite(table, is_kept, names, kind_of(source).noun)
        if is_kept is not None:  # the row of a kept cell has no effect
            is_kept = np.asarray(is_kept)
            table = np.where(is_kept[:, np.newaxis], table, table[np.argmax(is_kept)])
            measures = measures * in_order(is_kept, order)
        table = in_order(table, order)
        scales = _scales(table, measures, groups or ((1, 0.0),) * table.shape[1])
        return np.ascontiguousarray(table * scales)


@dataclass(frozen=True, eq=False)
class FeatureCosts:
    """Features of cells, to add the cost of the feature difference along each arc to its weight."""

    features: Floats  # (N, F) features of each cell
    weight: float  # cost of a difference of 1, as a multiple of the expected region radius
    n_threads: int

    def added(self, weights: npt.ArrayLike, graph: Surface | CellGraph, radius: float) -> Floats:
        """Return `weights` plus costs of feature differences that are proportional to `radius`."""
        factor = self.weight * (radius / graph.weight_unit)
        given = exact_doubles(np.asarray(weights))
        return _core.add_feature_steps(*graph.arcs, given, self.features, factor, self.n_threads)


def _checked_table(given: Any, n_cells: int, source: Any, is_kept: Bools | None) -> Floats:
    """Return features with one row per cell, (N, F); see `Corners.means` for `is_kept`."""
    refuse_mask(given, "features")
    array = np.asarray(given)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"features must contain numbers, got {array.dtype}")
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2 or not array.shape[1]:
        raise ValueError(f"features must have shape (N, F), F >= 1, got shape {np.shape(given)}")
    table = exact_doubles(array)
    if len(table) == n_cells:
        return table
    corners = kind_of(source).corners(source)
    n_vertices = None if corners is None else source.n_vertices
    if corners is not None and len(table) == n_vertices:
        return corners.means(table, is_kept)
    vertices = "" if n_vertices is None else f" or per vertex ({n_vertices})"
    is_turned = table.shape[1] in (n_cells, n_vertices)
    raise ValueError(
        f"features must have one row per cell ({n_cells}){vertices}, got"
        f" {counted(len(table), 'row')}{': use numpy.column_stack(features)' * is_turned}"
    )


def _refuse_infinite(
    table: Floats, is_kept: Bools | None, names: tuple[str, ...], noun: str
) -> None:
    """Raise an error if kept cells have features that are not finite, a MeshError for names."""
    is_bad = ~np.isfinite(table) & (True if is_kept is None else np.asarray(is_kept)[:, np.newaxis])
    rows, columns = is_bad.any(axis=1), is_bad.any(axis=0)
    if names and rows.any():
        bad = ", ".join(dict.fromkeys(np.array(names)[columns].tolist()))
        where = "" if is_kept is None else " in the mask"
        raise MeshError(
            f"{bad}: {counted(int(rows.sum()), noun)}{where} without a finite value: leave them out"
            " with a mask, or fill in values"
        )
    refuse_first(rows, "features", table, "finite (leave out cells with a mask)")


def _warn_if_constant(table: Floats, names: tuple[str, ...]) -> None:
    """Issue a FeatureWarning if a feature is constant; a table without names is one feature."""
    is_spread = np.ptp(table, axis=0) > 4 * CONSTANT * np.abs(table).max(axis=0)
    of_columns = np.array(names or ("features",) * len(is_spread))
    constant = [one for one in dict.fromkeys(of_columns) if not is_spread[of_columns == one].any()]
    if constant:
        note = f"{', '.join(constant)}: all cells have the same value, so this has no effect"
        warnings.warn(note, FeatureWarning, stacklevel=7)


def _scales(table: Floats, measures: Floats, groups: tuple[tuple[int, float], ...]) -> Floats:
    """Return the scale factor of each column: 1 / deviation of its group, or 0 if that is 0.

    The deviation of a group is the root mean square of its columns, weighted by area, or its lower
    bound in `groups` if this is larger.
    """
    total = float(measures.sum())
    weights = measures / total if total > 0 else np.full(len(measures), 1 / len(measures))
    largest = np.abs(table).max(axis=0)
    unit = np.where(largest > 0, largest, 1.0)  # avoids overflow of squares
    part = table / unit
    variance = weights @ (part - weights @ part) ** 2
    is_spread = variance > CONSTANT**2  # constant columns vary by rounding errors
    deviation = np.sqrt(np.where(is_spread, variance, 1.0)) * unit
    scales = np.where(is_spread, 1.0 / deviation, 0.0)
    start = 0
    for width, least in groups:
        columns = slice(start, start + width)
        start += width
        if (width > 1 or least) and is_spread[columns].any():
            squares = np.where(is_spread[columns], deviation[columns] ** 2, 0.0)
            scales[columns] = 1.0 / max(float(np.sqrt(squares.mean())), least)
    return scales
