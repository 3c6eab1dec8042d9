"""Define graphs of cells with weighted arcs. These graphs are the input of the clustering."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import (
    checked_arcs,
    checked_bounds,
    checked_nonnegative_array,
    checked_number,
    checked_positions,
    checked_threads,
    counted,
    freeze,
    integer_array,
    numeric_array,
    owned,
    owned_indices,
    refuse_first,
    refuse_mask,
    restored,
)
from ..base.types import ArcLists, Array, Floats, Ints, Longs, Singles


@dataclass(frozen=True, eq=False)
class ArcMeasures:
    """Measures of the arcs of a `CellGraph`, for the clean-up and the metrics of regions.

    Lengths are in the unit of the positions of the graph, finite and >= 0. The arrays are checked
    when a `CellGraph` is made.

    Parameters
    ----------
    border_lengths : array_like, shape (M,)
        Length of the border between the two cells of each arc.
    step_lengths : array_like, shape (M,), optional
        Distance between the two cells of each arc, without the cost of creases. The default is the
        distance between the positions of the two cells.
    angles : array_like, shape (M,), optional
        Signed angle between the normals of the two cells of each arc, in radians from -pi to pi,
        positive if the border is concave. The default is 0.
    sides : array_like of integers, shape (M,), optional
        Index (>= 0) of the side by which each arc leaves its cell. The arcs of a cell must be
        sorted by this index. If three or more cells meet at a side, several arcs of a cell have the
        same index. By default, each arc crosses a different side.
    open_lengths : array_like, shape (N,), optional
        Length of the part of each cell's border that no other cell shares. The default is 0.
    """

    border_lengths: Floats
    step_lengths: Floats | None = None
    angles: Floats | None = None
    sides: Ints | None = None
    open_lengths: Floats | None = None

    def __repr__(self) -> str:
        given = (f".{name}" for name, values in vars(self).items() if values is not None)
        return f"ArcMeasures({', '.join(given)})"

    def checked(self, offsets: Longs, n_arcs: int, n_threads: int) -> ArcMeasures:
        """Check the arrays for a graph with these CSR `offsets`, and return read-only copies."""
        arrays: dict[str, Array] = {}
        for name, n, per in (
            ("border_lengths", n_arcs, "arc"),
            ("step_lengths", n_arcs, "arc"),
            ("open_lengths", len(offsets) - 1, "cell"),
        ):
            given = getattr(self, name)
            if given is not None or name == "border_lengths":
                array = checked_nonnegative_array(given, n, name, per, n_threads)
                arrays[name] = owned(array, np.float64)
        if self.angles is not None:
            arrays["angles"] = _checked_angles(self.angles, n_arcs)
        if self.sides is not None:
            arrays["sides"] = _checked_sides(self.sides, offsets)
        checked = ArcMeasures(**arrays)
        freeze(checked, **arrays)
        return checked


def _checked_angles(angles: Any, n_arcs: int) -> Floats:
    """Return checked angles as (M,) float64: one angle per arc, from -pi to pi."""
    array = owned(numeric_array(angles, "angles"), np.float64)
    if array.shape != (n_arcs,):
        raise ValueError(
            f"angles must have one value per arc, shape ({n_arcs},), got {array.shape}"
        )
    is_wrong = ~(np.abs(array) <= math.pi)  # True for NaN
    refuse_first(is_wrong, "angles", array, "from -pi to pi")
    return array


def _checked_sides(sides: Any, offsets: Longs) -> Ints:
    """Return checked sides as (M,) int32, which must be in ascending order for each cell."""
    array = owned_indices(integer_array(sides, "sides"))
    if len(array) != offsets[-1]:
        raise ValueError(f"sides must have shape ({offsets[-1]},), got {array.shape}")
    refuse_first(array < 0, "sides", sides, "not negative")
    if not np.isin(np.flatnonzero(np.diff(array) < 0) + 1, offsets).all():
        raise ValueError("sides must be in ascending order for the arcs of each cell")
    return array


class CsrArcs:
    """Base class that stores arcs between cells in CSR form, and the bounding box of the cells."""

    offsets: Longs  # (N + 1,) index of the first arc of each cell
    neighbors: Ints  # (M,) target cell of each arc
    bounds: Floats  # (2, 3) minimum and maximum corner of the bounding box

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return len(self.offsets) - 1

    @property
    def n_arcs(self) -> int:
        """Number of arcs, M. Two neighboring cells usually have one arc in each direction."""
        return len(self.neighbors)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of ``bounds``, in the unit of the positions."""
        x, y, z = (self.bounds[1] - self.bounds[0]).tolist()
        return math.sqrt(x * x + y * y + z * z)

    @property
    def arcs(self) -> ArcLists:
        """The pair (`offsets`, `neighbors`), for functions that take both as arguments."""
        return self.offsets, self.neighbors

    @property
    def sources(self) -> Ints:
        """Start cell of each arc, (M,)."""
        return np.repeat(np.arange(self.n_cells, dtype=np.int32), np.diff(self.offsets))


class BaseGraph(CsrArcs):
    """Base class of graphs of cells. The cells have positions, measures and arcs.

    Graphs of added kinds derive from this class if arcs have no weights, else from `CellGraph`.
    """

    positions: Floats  # (N, 3) representative point of each cell
    measures: Floats  # (N,) area or volume of each cell

    def quantized(
        self, weights: npt.ArrayLike, n_threads: int, unit_factor: float = 1.0
    ) -> tuple[Singles, float]:
        """Return the weights of arcs rounded to integers, and the unit of these integers.

        The unit is `unit_factor`, a power of two, times `CellGraph.unit`. If it is larger than 1,
        sums of lengths stay in range when costs are added to the lengths later.
        """
        checked_nonnegative_array(self.measures, self.n_cells, "measures", "cell", n_threads)
        checked = checked_weights(weights, self.n_arcs, n_threads)
        unit = unit_factor * _core.unit_of_lengths(_core.sum_of(checked, n_threads))
        return _core.round_weights(checked, unit, n_threads), unit

    def _weighted(
        self, weights: npt.ArrayLike, n_threads: int | None,
        arc_measures: ArcMeasures | None = None, dimension: int = 2,
    ) -> CellGraph:  # fmt: skip
        """Make a graph with these weights from this graph, whose arrays are already checked."""
        graph = object.__new__(CellGraph)
        fields = ("positions", "measures", "offsets", "neighbors", "bounds")
        values = {name: getattr(self, name) for name in fields}
        values |= {"weights": weights, "weight_unit": self.diagonal}
        values |= {"arc_measures": arc_measures, "dimension": dimension}
        for name, value in values.items():
            object.__setattr__(graph, name, value)
        graph._check_and_quantize(checked_threads(n_threads))
        return graph


@dataclass(frozen=True, eq=False)
class CellGraph(BaseGraph):
    """Cells and weighted arcs in CSR form: the input of seeding and clustering.

    Cells are elements of any kind; for faces, see `FaceGraph.with_weights`. Positions and measures
    are not copied if they are contiguous float64 arrays, so do not change them while the graph is
    in use.

    Parameters
    ----------
    positions : array_like, shape (N, 3)
        Representative point of each cell, finite. N is at least 1.
    measures : array_like, shape (N,)
        Area of each cell, finite and >= 0, in the squared unit of the positions; or volume, if
        ``dimension`` is 3. Centroids of regions are weighted by area. The sum A of all areas
        defines the expected radius r = sqrt(A / (pi k)) of k regions.
    offsets : array_like of integers, shape (N + 1,)
        The arcs that leave cell i are ``offsets[i]`` to ``offsets[i + 1] - 1``.
    neighbors : array_like of integers, shape (M,)
        Target cell of each arc. Arcs are directed. Regions are guaranteed to be connected only if
        each arc has a reverse arc. Connected components ignore the direction of arcs. Cells that no
        path from a center reaches become additional regions or, with ``islands="nearest"``, join
        the nearest region.
    weights : array_like, shape (M,)
        Length of each arc, finite and >= 0, in any unit.
    bounds : array_like, shape (2, 3), optional
        Minimum and maximum corner of the box that the seeding ``"grid"`` divides into cubes. The
        default is the bounding box of the positions.
    weight_unit : float, default 1.0
        Length of a weight of 1, in the unit of the positions, for the clean-up of regions. For the
        graph of a mesh, use the diagonal of the bounding box.
    dimension : {2, 3}, default 2
        2 if measures are areas, 3 if they are volumes. With 3, the expected radius is the cube root
        of 3 V / (4 pi k) for a total volume V, and ``border_lengths`` of `ArcMeasures` are areas.
    arc_measures : ArcMeasures, optional
        Measures of the arcs. The clean-up of regions and `metrics.compactness` need them.

    Attributes
    ----------
    lengths : ndarray of float32, shape (M,)
        Weight of each arc divided by `unit` and rounded to an integer, at least 1, so that sums are
        exact and shortest paths do not depend on the order of summation.
    unit : float
        The largest power of two that is at most the sum of all weights divided by 2**47, or 1 if
        all weights are 0.

    Raises
    ------
    ValueError, TypeError
        If an array has a wrong shape, type or value.

    Examples
    --------
    >>> path = CellGraph([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [1, 1, 1], [0, 1, 3, 4],
    ...                  [1, 0, 2, 1], [1.0, 1.0, 2.0, 2.0])
    >>> path.n_cells, path.n_arcs, path.diagonal
    (3, 4, 3.0)
    >>> path.lengths * path.unit
    array([1., 1., 2., 2.], dtype=float32)
    """

    positions: Floats
    measures: Floats
    offsets: Longs
    neighbors: Ints
    weights: Floats
    bounds: Floats = None  # type: ignore[assignment]  # an array after `__post_init__`
    lengths: Singles = field(init=False, repr=False)
    unit: float = field(init=False, repr=False)
    weight_unit: float = field(default=1.0, kw_only=True)
    arc_measures: ArcMeasures | None = field(default=None, kw_only=True, repr=False)
    dimension: int = field(default=2, kw_only=True)
    _ordered: _core.OrderedGraph | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        positions = checked_positions(self.positions)
        offsets, neighbors = checked_arcs(self.offsets, self.neighbors, len(positions))
        bounds = checked_bounds(self.bounds, positions)
        freeze(self, positions=positions, offsets=offsets, neighbors=neighbors, bounds=bounds)
        if self.dimension not in (2, 3):
            raise ValueError(f"dimension must be 2 or 3, got {self.dimension!r}")
        unit = checked_number(self.weight_unit, "weight_unit", zero=False)
        object.__setattr__(self, "weight_unit", unit)
        self._check_and_quantize(checked_threads(None))
        if self.arc_measures is not None:
            if not isinstance(self.arc_measures, ArcMeasures):
                kind = type(self.arc_measures).__name__
                raise TypeError(f"arc_measures must be an ArcMeasures object, got {kind}")
            checked = self.arc_measures.checked(offsets, self.n_arcs, checked_threads(None))
            object.__setattr__(self, "arc_measures", checked)

    def _check_and_quantize(self, n_threads: int) -> None:
        measures = checked_nonnegative_array(
            self.measures, self.n_cells, "measures", "cell", n_threads
        )
        refuse_mask(self.weights, "weights")
        copied = owned(np.asarray(self.weights), None)  # because the caller may change its array
        weights = checked_weights(copied, self.n_arcs, n_threads)
        lengths, unit = _core.quantize_weights(weights, n_threads)
        freeze(self, measures=measures, weights=weights, lengths=lengths)
        object.__setattr__(self, "unit", unit)

    def ordered(self, n_threads: int) -> _core.OrderedGraph:
        """Return the graph as an object of ``_core``, which the first call builds and caches."""
        if self._ordered is None:
            cells = _core.PlacedCells(self.positions, self.measures, n_threads)
            graph = _core.OrderedGraph(cells, self.offsets, self.neighbors, self.lengths, n_threads)
            object.__setattr__(self, "_ordered", graph)
        return self._ordered  # type: ignore[return-value]  # is never None here

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes to copy or pickle; the cached result of `ordered` is left out."""
        return {**self.__dict__, "_ordered": None}

    def __setstate__(self, state: Any) -> None:
        """Restore a copied or pickled graph, and check the arrays of the graph again."""
        names = ("positions", "measures", "offsets", "neighbors", "weights", "bounds")
        more = ("weight_unit", "arc_measures", "dimension")
        options = dict(zip(more, restored(state, more), strict=True))
        CellGraph.__init__(self, *restored(state, names), **options)

    def __repr__(self) -> str:
        return f"CellGraph({counted(self.n_cells, 'cell')}, {counted(self.n_arcs, 'arc')})"


def checked_weights(weights: npt.ArrayLike, n_arcs: int, n_threads: int) -> Floats:
    """Return weights as float64, after checking that there is one finite weight >= 0 per arc."""
    advice = "; for values of cells, use features"
    return checked_nonnegative_array(weights, n_arcs, "weights", "arc", n_threads, advice)


def checked_graph(graph: object) -> CellGraph:
    """Return `graph` if it is a `CellGraph`; otherwise raise a TypeError."""
    if isinstance(graph, CellGraph):
        return graph
    raise TypeError(
        f"expected a CellGraph, got {type(graph).__name__}: for a mesh, use"
        " build_face_graph(mesh).with_weights(weights)"
    )
