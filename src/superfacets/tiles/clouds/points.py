"""Some points of a tiled cloud, with the places that they are joined with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ...cells.cell_graph import box_diagonal
from ...cells.surface import Surface
from ..faces import rows
from ..store import TileStore
from .columns import Columns, joined_columns, load_columns, save_columns, taken

__all__ = ["PointCells", "Points"]

Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Points:
    """Points by place, with all that is known of them.

    Attributes
    ----------
    columns : Columns
        ``places``, ``cells``, ``positions``, ``measures``, and perhaps ``normals``.
    offsets, arcs : ndarray of int64, and Columns
        Arcs of point i are offsets[i] to offsets[i + 1] - 1, with the places ``targets``, and
        perhaps more.
    """

    columns: Columns
    offsets: Longs
    arcs: Columns

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def take(self, chosen: npt.NDArray[np.integer[Any]]) -> Points:
        """The points of these indices, in this order."""
        offsets, at = rows(self.offsets, chosen)
        return Points(taken(self.columns, chosen), offsets, taken(self.arcs, at))

    def at(self, places: npt.NDArray[np.integer[Any]]) -> Points:
        """The points at some places, all of which are here."""
        return self.take(np.searchsorted(self.columns["places"], places))

    def save(self, store: TileStore, tile: int, folder: str) -> None:
        """Write them into a folder of a tile."""
        columns = self.columns | {"offsets": self.offsets}
        save_columns(store.scratch, f"tile{tile}/{folder}", columns)
        save_columns(store.scratch, f"tile{tile}/{folder}/arcs", self.arcs)

    @classmethod
    def load(cls, store: TileStore, tile: int, folder: str, names: Sequence[str]) -> Points:
        """Read what was saved, with columns of these names."""
        folder = f"tile{tile}/{folder}"
        offsets = store.scratch.load(f"{folder}/offsets")
        arcs = load_columns(store.scratch, f"{folder}/arcs", ("targets",))
        return cls(load_columns(store.scratch, folder, names), offsets, arcs)

    @classmethod
    def joined(cls, parts: Sequence[Points]) -> Points:
        """All points of some parts, in the order of places."""
        columns = joined_columns([part.columns for part in parts])
        arcs = joined_columns([part.arcs for part in parts])
        counts = np.concatenate([np.diff(part.offsets) for part in parts])
        every = cls(columns, np.append(0, np.cumsum(counts)), arcs)
        return every.take(np.argsort(columns["places"]))


@dataclass(frozen=True, eq=False)
class PointCells:
    """Some points as cells of their own, in the order of their numbers in the whole.

    Arcs that lead to other points are left out.

    Attributes
    ----------
    order : ndarray of int64
        Index of each cell in the points.
    arcs : ndarray of int64
        Index of each arc in those of the points.
    surface : Surface
    """

    order: Longs
    arcs: Longs
    surface: Surface

    @classmethod
    def of(cls, store: TileStore, points: Points, n_threads: int) -> PointCells:
        """Make cells of points that are in the order of places."""
        places, cells = points.columns["places"], points.columns["cells"]
        n_points = len(places)
        order = np.argsort(cells)
        rank = np.empty(n_points, np.int32)
        rank[order] = np.arange(n_points)
        at = np.minimum(np.searchsorted(places, points.arcs["targets"]), n_points - 1)
        sources = np.repeat(rank, np.diff(points.offsets))
        targets = rank[at]
        kept = np.flatnonzero(places[at] == points.arcs["targets"])
        if np.any(cells[1:] < cells[:-1]):  # there are copies: arcs are in the order of places
            kept = kept[np.lexsort((targets[kept], sources[kept]))]
        offsets = np.searchsorted(sources[kept], np.arange(n_points + 1)).astype(np.int64)
        neighbors = targets[kept]
        normals = points.columns.get("normals")
        handle = _core.PointSurface(
            points.columns["positions"][order],
            points.columns["measures"][order],
            np.empty((0, 3)) if normals is None else normals[order],
            np.arange(n_points, dtype=np.int32),
            offsets,
            neighbors,
        )
        diagonal = box_diagonal(store.bounds)
        surface = Surface(handle, offsets, neighbors, store.bounds, diagonal, n_threads)
        return cls(order, kept, surface)
