"""Represent suggested objects, which do not change labels until the user accepts them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .classes import INSTANCES, MAX_CLASS, ClassList
from .coding import base64_of, bytes_from, pack_cells, unpack_cells
from .imports import Imported, checked_score

UNNAMED = "object"
"""Class name of objects whose class is unknown, such as objects from `superfacets lift`."""


@dataclass(frozen=True)
class Suggestion:
    """Set of cells that is suggested as an object."""

    id: int  # number from 1, in ascending order of class and object in the imported file
    cells: bytes  # indices of the cells, encoded by `pack_cells`
    class_id: int  # 0 if the user must choose the class
    score: float | None  # confidence, 0 to 1; None if the file has no score

    def line(self) -> dict[str, Any]:
        """Return the suggestion as an entry of a journal line."""
        return {
            "id": self.id,
            "cells": base64_of(self.cells),
            "class": self.class_id,
            "score": self.score,
        }

    @classmethod
    def of_line(cls, entry: Any, n_cells: int) -> Suggestion:
        """Return the suggestion in an entry of a journal line.

        Raises ValueError, TypeError or KeyError if the entry is damaged.
        """
        packed = bytes_from(entry["cells"], "cells")
        unpack_cells(packed, n_cells)  # raises a ValueError if the cells are damaged
        class_id = int(entry["class"])
        if not 0 <= class_id <= MAX_CLASS:
            raise ValueError(f"class must be 0 to {MAX_CLASS}, got {class_id}")
        return cls(int(entry["id"]), packed, class_id, checked_score(entry["score"]))


Suggestions = tuple[Suggestion, ...]


def suggestions_of(imported: Imported, known: ClassList) -> tuple[Suggestions, ClassList]:
    """Return a suggestion for each imported object, and the list of classes with new classes.

    In each class, all cells that are in no object become one suggestion. The user must choose the
    class of objects whose class name is `UNNAMED`, unless `known` has a class with this name.
    """
    unnamed = [
        entry
        for entry in imported.class_list
        if entry["name"].casefold() == UNNAMED and entry not in known
    ]
    classes = tuple(entry for entry in imported.class_list if entry not in unnamed)
    keys = imported.classes.astype(np.int64) * INSTANCES + imported.objects
    order = np.argsort(keys, kind="stable")  # stable, so the cells of an object stay sorted
    found, starts = np.unique(keys[order], return_index=True)
    parts = np.split(imported.cells[order], starts)[1:]  # the part before the first start is empty
    suggestions = []
    for number, (key, cells) in enumerate(zip(found.tolist(), parts, strict=True), 1):
        class_id, object_id = divmod(key, INSTANCES)
        score = imported.scores.get((class_id, object_id))
        own = 0 if any(entry["id"] == class_id for entry in unnamed) else class_id
        if class_id:
            suggestions.append(Suggestion(number, pack_cells(cells), own, score))
    return tuple(suggestions), classes
