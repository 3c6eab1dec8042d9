"""What an operation changes, in a form that can be done, undone, and kept in little memory."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .coding import pack_cells, unpack_cells

Kind = Literal["paint", "split", "segment", "classes"]
Classes = npt.NDArray[np.uint16]


@dataclass(frozen=True)
class Split:
    """Cells that became a region of their own, packed; the region gets the next free label."""

    cells: bytes

    def unpacked(self, n_cells: int) -> npt.NDArray[np.uint32]:
        """Its cells, ascending."""
        return unpack_cells(self.cells, n_cells)


@dataclass(frozen=True)
class Partition:
    """What the regions are: parameters that give them again, and the splits since.

    Attributes
    ----------
    parameters : dict
    digest : str
        Of the labels before splits, by which others are noticed; empty where they are not known.
    splits : tuple of Split
    """

    parameters: dict[str, Any]
    digest: str = ""
    splits: tuple[Split, ...] = ()

    def with_split(self, cells: npt.NDArray[np.uint32], digest: str) -> Partition:
        """The same with one more split, of labels with this digest."""
        return replace(self, digest=digest, splits=(*self.splits, Split(pack_cells(cells))))


@dataclass
class State:
    """What is painted, with which classes, by which regions."""

    classes: Classes  # (N,) class of each cell; 0: none
    class_list: tuple[dict[str, Any], ...]
    partition: Partition


@dataclass(frozen=True)
class Painted:
    """Classes of some cells before and after, packed: a byte or so for each cell."""

    cells: bytes
    n: int
    before: bytes
    after: bytes

    @classmethod
    def of(cls, classes: Classes, cells: npt.NDArray[np.uint32], wanted: Any) -> Painted | None:
        """Those of these ascending cells whose class changes; None if none does.

        `wanted` is one class, or one for each cell.
        """
        after = np.broadcast_to(np.asarray(wanted, np.uint16), cells.shape)
        before = classes[cells]
        differs = before != after
        n = int(np.count_nonzero(differs))
        if not n:
            return None
        packed = (_packed(values[differs]) for values in (before, after))
        return cls(pack_cells(cells[differs]), n, *packed)

    @property
    def one(self) -> int | None:
        """The class that all get, if it is one."""
        values = np.unique(self.unpacked(self.after))
        return int(values[0]) if len(values) == 1 else None

    def unpacked(self, values: bytes) -> Classes:
        """One of the two rows of classes."""
        row = np.frombuffer(zlib.decompress(values), np.uint16)
        return np.broadcast_to(row, self.n) if len(row) == 1 else row


def _packed(values: Classes) -> bytes:
    """One value where all are the same, as in a stroke over what had no class."""
    is_one = bool((values == values[0]).all())
    return zlib.compress((values[:1] if is_one else values).tobytes(), level=1)


@dataclass(frozen=True)
class Change:
    """A step that can be done and undone.

    Attributes
    ----------
    kind : {"paint", "split", "segment", "classes"}
    before, after : Painted, Partition, tuple
        What it changes; of paint, both are the same `Painted`.
    stroke : str or None
        Neighbors of the same stroke are undone together.
    """

    kind: Kind
    before: Any
    after: Any
    stroke: str | None = None

    def do(self, state: State) -> None:
        """Make the change."""
        _SET[self.kind](state, self.after, True)

    def undo(self, state: State) -> None:
        """Take it back."""
        _SET[self.kind](state, self.before, False)

    def cells(self, n_cells: int) -> npt.NDArray[np.uint32]:
        """The cells whose classes it changes."""
        if self.kind != "paint":
            return np.empty(0, np.uint32)
        return unpack_cells(self.after.cells, n_cells)


def _set_painted(state: State, painted: Painted, is_done: bool) -> None:
    cells = unpack_cells(painted.cells, len(state.classes))
    state.classes[cells] = painted.unpacked(painted.after if is_done else painted.before)


def _set_partition(state: State, partition: Partition, _: bool) -> None:
    state.partition = partition


def _set_class_list(state: State, classes: tuple[dict[str, Any], ...], _: bool) -> None:
    state.class_list = classes


_SET: dict[str, Callable[[State, Any, bool], None]] = {
    "paint": _set_painted,
    "split": _set_partition,
    "segment": _set_partition,
    "classes": _set_class_list,
}


def last_stroke(changes: list[Change]) -> list[Change]:
    """The last changes that are one stroke, the last first."""
    found: list[Change] = []
    for change in reversed(changes):
        if found and (change.stroke is None or change.stroke != found[0].stroke):
            break
        found.append(change)
    return found
