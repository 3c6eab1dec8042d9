"""What the clusterer sees: cells with a position and a measure, and weighted arcs between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import (
    checked_arcs,
    checked_bounds,
    checked_nonnegative_array,
    checked_positions,
    checked_threads,
    freeze,
)

__all__ = ["CellGraph", "OrderedCells", "box_diagonal", "checked_graph"]


class OrderedCells(NamedTuple):
    """A cell graph laid out for the cache, which is what the kernels of stages 3 and 4 work on."""

    graph: _core.OrderedGraph
    bounds: npt.NDArray[np.float64]
    """Low and high corner of the box that `radius` and the grid refer to, shape (2, 3)."""


@dataclass(frozen=True, eq=False)
class CellGraph:
    """Cells and weighted arcs, in CSR form: the input of seeding and clustering.

    Faces of a mesh make one (`FaceGraph.with_weights`), but cells can be anything.

    Parameters
    ----------
    positions : array_like, shape (N, 3)
        A point that stands for each cell, finite. N >= 1.
    measures : array_like, shape (N,)
        Area of each cell, in the squared unit of the positions, finite, >= 0: what a cell weighs in
        the mean of its region. The sum A makes the expected radius r = sqrt(A / (pi k)), which
        `tol`, `radius`, ``"flood"``, ``"grid"`` and the halted mode go by.
    offsets : array_like of integers, shape (N + 1,)
        The arcs that leave cell i are ``offsets[i]`` to ``offsets[i + 1] - 1``.
    neighbors : array_like of integers, shape (M,)
        The cell that each arc leads to. Arcs lead one way: where regions are to be connected, give
        both directions of each.
    weights : array_like, shape (M,)
        The length of each arc, finite, >= 0, in any unit.
    bounds : array_like, shape (2, 3), optional
        Low and high corner of the box whose diagonal a ``radius`` is a fraction of; the bounding
        box of the positions if not given.

    Attributes
    ----------
    lengths : ndarray of float32, shape (M,)
        The weights as whole numbers (>= 1) of `unit`: sums of these are exact, so shortest paths
        are the same in whatever order they are found.
    unit : float
        The power of two that is 2**47 to 2**48 times smaller than the sum of all weights.

    Raises
    ------
    ValueError, TypeError
        If an array has the wrong shape, type or values.

    Examples
    --------
    >>> path = CellGraph([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [1, 1, 1], [0, 1, 3, 4],
    ...                  [1, 0, 2, 1], [1.0, 1.0, 2.0, 2.0])
    >>> path.n_cells, path.n_arcs, path.diagonal
    (3, 4, 3.0)
    >>> path.lengths * path.unit
    array([1., 1., 2., 2.], dtype=float32)
    """

    positions: npt.NDArray[np.float64]
    measures: npt.NDArray[np.float64]
    offsets: npt.NDArray[np.int64]
    neighbors: npt.NDArray[np.int32]
    weights: npt.NDArray[np.float64]
    bounds: npt.NDArray[np.float64] = None  # type: ignore[assignment]  # set in __post_init__
    lengths: npt.NDArray[np.float32] = field(init=False, repr=False)
    unit: float = field(init=False, repr=False)
    _ordered: OrderedCells | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        positions = checked_positions(self.positions)
        offsets, neighbors = checked_arcs(self.offsets, self.neighbors, len(positions))
        bounds = checked_bounds(self.bounds, positions)
        freeze(self, positions=positions, offsets=offsets, neighbors=neighbors, bounds=bounds)
        self._check_and_quantize(checked_threads(None))

    @classmethod
    def _of_checked_arcs(cls, n_threads: int, **fields: Any) -> CellGraph:
        """Make a graph of which all but measures and weights has been checked and frozen before."""
        graph = object.__new__(cls)
        for name, value in fields.items():
            object.__setattr__(graph, name, value)
        graph._check_and_quantize(n_threads)
        return graph

    def _check_and_quantize(self, n_threads: int) -> None:
        measures = checked_measures(self.measures, self.n_cells, n_threads)
        weights = checked_weights(self.weights, self.n_arcs, n_threads)
        lengths, unit = _core.quantize_weights(weights, n_threads)
        freeze(self, measures=measures, weights=weights, lengths=lengths)
        object.__setattr__(self, "unit", unit)

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return len(self.positions)

    @property
    def n_arcs(self) -> int:
        """Number of arcs, M: two for each pair of neighbors."""
        return len(self.neighbors)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of ``bounds``, in the unit of the positions."""
        return box_diagonal(self.bounds)

    def ordered(self, n_threads: int) -> OrderedCells:
        """Return the graph as the kernels take it; made when first asked for, then kept."""
        if self._ordered is None:
            graph = _core.OrderedGraph(
                self.positions, self.measures, self.offsets, self.neighbors, self.lengths, n_threads
            )
            object.__setattr__(self, "_ordered", OrderedCells(graph, self.bounds))
        return self._ordered  # type: ignore[return-value]  # set just above

    def __getstate__(self) -> dict[str, Any]:
        """Leave out of copies what is made anew when it is needed."""
        return {**self.__dict__, "_ordered": None}

    def __repr__(self) -> str:
        return f"CellGraph({self.n_cells} cells, {self.n_arcs} arcs)"


def checked_measures(
    measures: npt.ArrayLike, n_cells: int, n_threads: int
) -> npt.NDArray[np.float64]:
    """One measure per cell, finite and >= 0."""
    return checked_nonnegative_array(measures, n_cells, "measures", "cell", n_threads)


def checked_weights(weights: npt.ArrayLike, n_arcs: int, n_threads: int) -> npt.NDArray[np.float64]:
    """One weight per arc, finite and >= 0."""
    return checked_nonnegative_array(weights, n_arcs, "weights", "arc", n_threads)


def checked_graph(graph: object) -> CellGraph:
    """Raise a TypeError where a mesh or a graph without weights is taken for a cell graph."""
    if isinstance(graph, CellGraph):
        return graph
    raise TypeError(
        f"expected a CellGraph, got {type(graph).__name__}; of a mesh,"
        " build_face_graph(mesh).with_weights(weights) is one"
    )


def box_diagonal(bounds: npt.NDArray[np.float64]) -> float:
    """Length of the diagonal of a box given by its low and high corner, shape (2, 3)."""
    x, y, z = (bounds[1] - bounds[0]).tolist()
    return math.sqrt(x * x + y * y + z * z)
