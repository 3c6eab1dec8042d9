"""Represent suggested objects, which do not change labels until the user accepts them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from superfacets.kit import Longs, Surface

from .classes import INSTANCES, MAX_CLASS, ClassList, stuff_of
from .coding import base64_of, bytes_from, pack_cells, unpack_cells
from .imports import Imported, checked_score

UNNAMED = "object"
"""Class name of objects whose class is unknown, such as objects from `superfacets lift`."""


@dataclass(frozen=True)
class Suggestion:
    """Set of cells that is suggested as an object."""

    id: int  # number from 1, in ascending order of class, object and piece in the imported file
    cells: bytes  # indices of the cells, encoded by `pack_cells`
    class_id: int  # 0 if the user must choose the class
    score: float | None  # confidence, 0 to 1; None if the file has no score

    def line(self) -> dict[str, Any]:
        """Return the suggestion as an entry of a journal line."""
        entry = {"id": self.id, "cells": base64_of(self.cells), "class": self.class_id}
        return {**entry, "score": self.score}

    @classmethod
    def of_line(cls, entry: Any, n_cells: int) -> Suggestion:
        """Return the suggestion in an entry; raise ValueError, TypeError or KeyError if damaged."""
        packed = bytes_from(entry["cells"], "cells")
        unpack_cells(packed, n_cells)  # raises a ValueError if the cells are damaged
        class_id = int(entry["class"])
        if not 0 <= class_id <= MAX_CLASS:
            raise ValueError(f"class must be 0 to {MAX_CLASS}, got {class_id}")
        return cls(int(entry["id"]), packed, class_id, checked_score(entry["score"]))


Suggestions = tuple[Suggestion, ...]


def suggestions_of(
    imported: Imported, known: ClassList, surface: Surface
) -> tuple[Suggestions, ClassList]:
    """Return a suggestion for each imported object, and the list of classes with new classes.

    If the file contains only class numbers, each connected component of a class becomes a
    suggestion. In other files, and in classes without objects (``stuff``), all cells of a class
    that are in no object become one suggestion. The user must choose the class of objects whose
    class name is `UNNAMED`, unless `known` has a class with this name.
    """
    new = [entry for entry in imported.class_list if entry not in known]
    unnamed = [entry for entry in new if entry["name"].casefold() == UNNAMED]
    classes = tuple(entry for entry in imported.class_list if entry not in unnamed)
    keys = imported.classes.astype(np.int64) * INSTANCES + imported.objects
    pieces = np.zeros(len(keys), np.int64) if imported.has_objects else _pieces(imported, surface)
    order = np.lexsort((pieces, keys))  # stable, so the cells of an object stay sorted
    keys, pieces = keys[order], pieces[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1) | np.diff(pieces, prepend=-1))
    parts = np.split(imported.cells[order], starts)[1:]  # the part before the first start is empty
    suggestions: list[Suggestion] = []
    for key, cells in zip(keys[starts].tolist(), parts, strict=True):
        class_id, object_id = divmod(key, INSTANCES)
        score = imported.scores.get((class_id, object_id))
        own = 0 if any(entry["id"] == class_id for entry in unnamed) else class_id
        if class_id:
            number = len(suggestions) + 1
            suggestions.append(Suggestion(number, pack_cells(cells), own, score))
    return tuple(suggestions), classes


def _pieces(imported: Imported, surface: Surface) -> Longs:
    """Return which connected component of its class each imported cell is in; 0 for stuff."""
    labels = np.zeros(len(surface.offsets) - 1, np.int32)
    labels[imported.cells] = imported.classes
    pieces = surface.components(labels)
    is_whole = np.isin(imported.classes, [0, *stuff_of(imported.class_list)])
    return np.where(is_whole, 0, pieces[imported.cells].astype(np.int64))
