"""Cells that are left out, and borders that no region may cross: what is left of a graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Bools, Ints, Longs
from .._validate import checked_edges, checked_mask, checked_seeds, refuse_mask
from ..mesh.faces import ends_of_sides, face_sizes
from .face_graph import FaceGraph
from .surface import Surface

__all__ = ["ANY_GROUP", "NO_GROUPS", "ConstraintOptions", "Cut", "in_order"]

ANY_GROUP = -1
"""The group of cells that barriers say nothing about."""

NO_GROUPS = np.empty(0, np.int32)
"""In the place of groups where any cells may come together."""


@dataclass(frozen=True)
class ConstraintOptions:
    """The mask and the barriers, as `segment` is given them."""

    mask: Any = None  # None: all cells are kept
    barriers: Any = None  # None: there are none

    @property
    def is_used(self) -> bool:
        """Whether anything is left out at all."""
        return self.mask is not None or self.barriers is not None

    @property
    def params(self) -> dict[str, Any]:
        """As they are reported; nothing where there are none."""
        given = {"mask": self.mask, "barriers": self.barriers}
        return {name: "given" for name, value in given.items() if value is not None}

    def cut(
        self, source: object, graph: Any, *, weld: bool, n_threads: int, order: Ints | None = None
    ) -> Cut | None:
        """Return what is left of the graph of a source, which has edges if it is a mesh.

        None if nothing is left out.
        Where the graph has the cells in another order, ``order`` holds their numbers in the source.
        A ValueError or TypeError if the mask or the barriers do not fit it.
        """
        if not self.is_used:
            return None
        n_cells = len(graph.offsets) - 1
        is_kept = in_order(_checked_kept(self.mask, n_cells), order)
        sources = np.repeat(np.arange(n_cells, dtype=np.int32), np.diff(graph.offsets))
        keeps_arc = is_kept[sources] & is_kept[graph.neighbors]
        groups = NO_GROUPS
        if self.barriers is not None:
            refuse_mask(self.barriers, "barriers")
            if np.ndim(self.barriers) == 2:
                crosses = _crossed_by(
                    self.barriers, source, (graph, sources), weld, n_threads, order
                )
                groups = _groups_apart(graph, keeps_arc, keeps_arc & ~crosses, sources)
            else:
                sides = in_order(_checked_sides(self.barriers, n_cells), order)
                crosses = sides[sources] != sides[graph.neighbors]
                groups = sides
            keeps_arc &= ~crosses
        return Cut.of(graph, is_kept, keeps_arc, sources, groups)


@dataclass(frozen=True, eq=False)
class Cut:
    """What is left of a graph of cells: some of them, renumbered, and some of their arcs.

    Attributes
    ----------
    n_whole : int
        Number of all cells, N.
    cells, arcs : ndarray
        The cells and the arcs that are left, by their old numbers, ascending.
    offsets, neighbors : ndarray
        The arcs between them, by new numbers.
    groups : ndarray of int32, shape (n_cells,) or (0,)
        Cells of different groups must not come to be in one region, not even across a gap; those
        with `ANY_GROUP` may go with any, and where this is empty, all.
    """

    n_whole: int
    cells: Ints
    arcs: Longs
    offsets: Longs
    neighbors: Ints
    groups: Ints

    @classmethod
    def of(cls, graph: Any, is_kept: Bools, keeps_arc: Bools, sources: Ints, groups: Ints) -> Cut:
        """Keep these cells and arcs; an arc is kept only with both of its cells."""
        cells = np.flatnonzero(is_kept).astype(np.int32)
        arcs = np.flatnonzero(keeps_arc)
        numbers = np.cumsum(is_kept, dtype=np.int32) - np.int32(1)
        counts = np.bincount(sources[arcs], minlength=len(is_kept))[cells]
        return cls(
            len(is_kept),
            cells,
            arcs,
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            numbers[graph.neighbors[arcs]],
            groups[cells] if len(groups) else NO_GROUPS,
        )

    def surface_of(self, whole: Surface) -> Surface:
        """Return the cells that are left, with the measures that they have in the whole."""
        handle = _core.SubSurface(whole.handle, self.offsets, self.neighbors, self.cells, self.arcs)
        return Surface(
            handle, self.offsets, self.neighbors, whole.bounds, whole.weight_unit,
            whole.n_threads, dimension=whole.dimension,
        )  # fmt: skip

    def new_cells(self, cells: npt.ArrayLike, name: str, order: Ints | None = None) -> Ints:
        """Return new numbers of cells; a ValueError if one is not left.

        It tells the number of a cell in the source, which ``order`` holds if it is another.
        """
        given = checked_seeds(cells, self.n_whole, name)
        places = np.minimum(np.searchsorted(self.cells, given), len(self.cells) - 1)
        is_out = self.cells[places] != given
        if is_out.any():
            place = int(np.argmax(is_out))
            number = given[place] if order is None else order[given[place]]
            raise ValueError(f"{name}[{place}] is {number}, which the mask leaves out")
        return places.astype(np.int32)

    def whole_labels(self, labels: Ints) -> Ints:
        """Return labels of all cells, -1 for those that were left out."""
        whole = np.full(self.n_whole, -1, np.int32)
        whole[self.cells] = labels
        return whole


def in_order(values: Array, order: Ints | None) -> Array:
    """Values of cells in another order, which holds the numbers that cells had; None: the same."""
    return values if order is None else values[order]


def _checked_kept(mask: Any, n_cells: int) -> Bools:
    refuse_mask(mask, "mask")
    is_kept = checked_mask(mask, n_cells, "mask")
    if not is_kept.any():
        raise ValueError("the mask leaves no cell: it is False everywhere")
    return is_kept


def _checked_sides(barriers: Any, n_cells: int) -> Ints:
    """Labels of any numbers as 0, 1, 2, ..."""
    given = np.asarray(barriers)
    if given.dtype.kind not in "iub":
        raise TypeError(f"barriers must be integers, got {given.dtype}")
    if given.shape != (n_cells,):
        raise ValueError(
            f"barriers must have shape ({n_cells},), a label per cell, or (E, 2), edges of a mesh;"
            f" got {given.shape}"
        )
    _, sides = np.unique(given, return_inverse=True)
    return sides.astype(np.int32)


def _crossed_by(
    barriers: Any, source: Any, arcs: tuple[Any, Ints], weld: bool, n_threads: int,
    order: Ints | None,
) -> Bools:  # fmt: skip
    """Which arcs, of a graph with the cell that each begins at, cross one of these edges."""
    graph, sources = arcs
    if not isinstance(graph, FaceGraph):
        raise ValueError("barriers of shape (E, 2) are edges of a mesh: give a label per cell")
    given = checked_edges(barriers, source.n_vertices, "barriers")
    lowest = np.arange(source.n_vertices, dtype=np.int32)
    if weld:
        lowest = _core.weld_vertices(source.vertices, n_threads)
    wanted = lowest[given]
    is_end = np.zeros(source.n_vertices, bool)
    is_end[wanted] = True
    sizes = face_sizes(source)
    starts = np.cumsum(sizes) - sizes
    faces = np.repeat(np.arange(source.n_faces), sizes)
    sides = np.arange(len(faces)) - np.repeat(starts, sizes)
    ends = lowest[ends_of_sides(source, faces, sides)]
    is_crossed: Bools = np.asarray(
        is_end[ends].all(axis=1)
    )  # so far: most sides have no name to look for
    names = _names_of(ends[is_crossed])
    is_none = ~np.isin(_names_of(wanted), names)
    if is_none.any():
        place = int(np.argmax(is_none))
        raise ValueError(f"barriers[{place}] is {given[place].tolist()}, which is no edge")
    is_crossed[is_crossed] = np.isin(names, _names_of(wanted))
    return np.asarray(is_crossed[in_order(starts, order)[sources] + graph.sides])


def _names_of(edges: Ints) -> Longs:
    """One number for each edge, (n, 2), whichever way it leads."""
    low, high = edges.min(axis=1).astype(np.int64), edges.max(axis=1)
    return np.asarray((low << 32) | high)


def _groups_apart(graph: Any, before: Bools, after: Bools, sources: Ints) -> Ints:
    """A group for each piece that edges cut a component into; `ANY_GROUP` in what is not cut.

    ``before`` and ``after`` are the arcs without and with the barriers.
    """
    whole, n_whole = _components_of(graph, before, sources)
    pieces, n_pieces = _components_of(graph, after, sources)
    whole_of_piece = np.empty(n_pieces, np.int32)
    whole_of_piece[pieces] = whole
    is_cut = np.bincount(whole_of_piece, minlength=n_whole) > 1
    return np.where(is_cut[whole], pieces, np.int32(ANY_GROUP))


def _components_of(graph: Any, keeps_arc: Bools, sources: Ints) -> tuple[Ints, int]:
    n_cells = len(graph.offsets) - 1
    counts = np.bincount(sources[keeps_arc], minlength=n_cells)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return _core.find_components(offsets, graph.neighbors[keeps_arc], np.zeros(n_cells, np.int32))
