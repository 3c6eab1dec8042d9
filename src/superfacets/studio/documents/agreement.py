"""Compare and merge the labels that two people have given to the same mesh.

"My" labels are in the open document, and "their" labels are in another person's work file. Classes
are matched by name, and objects by their overlap.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..._types import Array, Bools, Floats, Longs
from ...cells.sums import sums_by_label
from ..labels.classes import INSTANCES, ClassList, Paint, class_of, names_of, paint_of, with_named
from .changes import State
from .history import History
from .journal import JournalError, parsed_work
from .source import Source

Side = Literal["mine", "theirs"]


@dataclass
class Theirs:
    """Labels from another person's work file, converted to my class and object numbers."""

    name: str
    paint: Paint  # class and object of each cell, (N,), encoded by `paint_of`
    class_list: ClassList  # my classes, followed by classes that only they use
    objects: dict[int, int]  # from ``class * 1000 + object`` in `paint` to their object number

    def differs(self, mine: Paint) -> Bools:
        """Return a mask of cells that both people have labeled, but with different labels."""
        return np.asarray((self.paint != mine) & (self.paint > 0) & (mine > 0))


def read_theirs(name: str, data: bytes, source: Source, mine: State, areas: Floats) -> Theirs:
    """Read another person's work file, and convert its labels to my class and object numbers.

    `data` is the content of the file, and `name` is its name for messages. Raises JournalError if
    the data is not a work file, is damaged, or belongs to another mesh, or if a class would have
    more than 999 objects.
    """
    journal = parsed_work(Path(name), data)
    journal.check_source(source.path, source.digest, source.n_cells)
    is_shared = journal.header["classes"] is None  # None if all files of a folder share classes
    state = History.replayed(journal, source.n_cells, mine.class_list if is_shared else None).state
    numbers, class_list = _matched_classes(state, mine.class_list)
    classes, objects = numbers[state.classes], state.objects
    own = mine.classes.astype(np.int64) * INSTANCES + mine.objects
    given, numbers_of_theirs = _matched_objects(own, classes * INSTANCES + objects, areas)
    return Theirs(name, paint_of(classes, given), class_list, numbers_of_theirs)


def _matched_classes(theirs: State, known: ClassList) -> tuple[Longs, ClassList]:
    """Return an array that maps their class numbers to mine, and the extended list of my classes.

    A class that they use is added to my list if I have no class with the same name.
    """
    numbers = np.zeros(1 + max(1, int(theirs.classes.max(initial=0))), np.int64)
    names = names_of(theirs.class_list)
    for class_id in np.unique(theirs.classes[theirs.classes > 0]).tolist():
        numbers[class_id], known = with_named(known, names.get(class_id, f"class {class_id}"))
    return numbers, known


def _matched_objects(mine: Longs, theirs: Longs, areas: Floats) -> tuple[Longs, dict[int, int]]:
    """Renumber the objects in `theirs` so that matching objects have the same number as in `mine`.

    Both arrays contain ``class * 1000 + object`` for each cell. Returns the new object number of
    each cell, or 0 for cells that are in no object of `theirs`, and a dict that maps
    ``class * 1000 + new number`` to the old number. Objects of the same class are matched one to
    one, greedily in descending order of IoU. Unmatched objects of a class get numbers above all
    object numbers of this class in `mine`.
    """
    pairs = sorted(_overlaps(mine, theirs, areas), key=lambda pair: (-pair[2], pair[0], pair[1]))
    number_of: dict[int, int] = {}
    taken: set[int] = set()
    for own, other, _ in pairs:
        is_object = own % INSTANCES and other % INSTANCES and own // INSTANCES == other // INSTANCES
        if is_object and own not in taken and other not in number_of:
            number_of[other] = own % INSTANCES
            taken.add(own)
    highest: dict[int, int] = {}
    for own in np.unique(mine).tolist():
        highest[own // INSTANCES] = own % INSTANCES
    found, ranks = np.unique(theirs, return_inverse=True)
    numbers, old_numbers = np.zeros(len(found), np.int64), {}
    for rank, other in enumerate(found.tolist()):
        class_id, object_id = divmod(other, INSTANCES)
        if object_id and other not in number_of:
            number_of[other] = highest[class_id] = highest.get(class_id, 0) + 1
            if highest[class_id] >= INSTANCES:
                raise JournalError(
                    f"the two work files together have {INSTANCES} or more objects of a class"
                )
        if object_id:
            numbers[rank] = number_of[other]
            old_numbers[class_id * INSTANCES + number_of[other]] = object_id
    return numbers[ranks], old_numbers


def _overlaps(mine: Array, theirs: Array, areas: Floats) -> list[tuple[int, int, float]]:
    """Return triples (my value, their value, IoU) for all pairs of values that share a cell.

    The IoU is the area with both values, divided by the area with at least one of the two values.
    It is 0 if the divisor is 0.
    """
    (own, a), (other, b) = (np.unique(one, return_inverse=True) for one in (mine, theirs))
    keys, pairs = np.unique(a * len(other) + b, return_inverse=True)
    common = sums_by_label(pairs, areas, len(keys))
    of_own, of_other = sums_by_label(a, areas, len(own)), sums_by_label(b, areas, len(other))
    i, j = np.divmod(keys, len(other))
    union = of_own[i] + of_other[j] - common
    shares = np.divide(common, union, out=np.zeros(len(keys)), where=union > 0)
    return list(zip(own[i].tolist(), other[j].tolist(), shares.tolist(), strict=True))


def agreement(mine: State, theirs: Theirs, areas: Floats) -> dict[str, Any]:
    """Return a dict that says how well my labels and their labels agree.

    ``labeled`` is the fraction of the whole area that both people have labeled. All other numbers
    refer to this area only: ``share`` is the fraction of it with equal class and object, and
    ``classes`` is a list with the IoU of each class and of its objects. ``object`` is the number of
    the object in merged labels, and ``mine`` and ``theirs`` are its numbers in my and their labels;
    None if it does not exist there.
    """
    paint = np.where(mine.objects > 0, mine.paint, mine.classes.astype(np.uint32))
    both = (paint > 0) & (theirs.paint > 0)
    own = set(np.unique(paint).tolist())
    whole = float(areas.sum())
    paint, other, areas = paint[both], theirs.paint[both], areas[both]
    total = float(areas.sum())
    agreed = float(areas[paint == other].sum())
    of_classes = _ious(class_of(paint), class_of(other), areas)
    of_objects = _ious(paint, other, areas)
    names = names_of(theirs.class_list)
    rows = []
    for class_id, iou in of_classes.items():
        objects = [
            {
                "object": one >> 16,
                "mine": one >> 16 if one in own else None,
                "theirs": theirs.objects.get(class_id * INSTANCES + (one >> 16)),
                "iou": round(share, 6),
            }
            for one, share in of_objects.items()
            if one & 0xFFFF == class_id and one >> 16
        ]
        name = names.get(class_id, f"class {class_id}")
        rows.append({"class": class_id, "name": name, "iou": round(iou, 6), "objects": objects})
    return {
        "name": theirs.name,
        "labeled": total / whole if whole else 0.0,
        "share": agreed / total if total else 0.0,
        "classes": rows,
    }


def _ious(mine: Array, theirs: Array, areas: Floats) -> dict[int, float]:
    """Return a dict from each positive value to the IoU of its areas in `mine` and `theirs`."""
    same = {own: iou for own, other, iou in _overlaps(mine, theirs, areas) if own == other}
    return {value: same.get(value, 0.0) for value in np.union1d(mine, theirs).tolist() if value}
