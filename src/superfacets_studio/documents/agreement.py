"""Compare and merge the labels that two people have given to the same mesh.

"My" labels are in the open document, and "their" labels are in another person's work file. Classes
are matched by name, and objects by their overlap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from superfacets.kit import Array, Bools, Floats, Longs, sums_by_label

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
    objects: dict[int, int]  # from each value in `paint` to the object number in their file


def read_theirs(
    name: str, data: bytes, source: Source, mine: State, areas: Floats, work: Path | None
) -> Theirs:
    """Read another person's work file, and convert its labels to my class and object numbers.

    `data` is the content of the file, `name` is its name for messages, and `work` its path if it is
    known. Raises JournalError if the data is not a work file, is damaged, belongs to another mesh,
    or has classes without names, or if a class would have more than 999 objects.
    """
    journal = parsed_work(Path(name), data)
    journal.check_source(source.path, source.digest, source.n_cells)
    history = History.replayed(journal, source.n_cells, None, work)
    state = history.state
    history.check_names(name)
    numbers, class_list = _matched_classes(state, mine.class_list)
    classes, objects = numbers[state.classes], state.objects
    own = mine.classes.astype(np.int64) * INSTANCES + mine.objects
    given = _matched_objects(own, classes * INSTANCES + objects, areas)
    paint = paint_of(classes, given)
    found, first = np.unique(paint, return_index=True)
    numbers_of_objects = dict(zip(found.tolist(), state.objects[first].tolist(), strict=True))
    return Theirs(name, paint, class_list, numbers_of_objects)


def _matched_classes(theirs: State, known: ClassList) -> tuple[Longs, ClassList]:
    """Return an array that maps their class numbers to mine, and the extended list of my classes.

    A class that they use is added to my list if I have no class with the same name.
    """
    numbers = np.zeros(1 + max(1, int(theirs.classes.max(initial=0))), np.int64)
    names = names_of(theirs.class_list)
    for class_id in np.unique(theirs.classes[theirs.classes > 0]).tolist():
        name = names.get(class_id, f"class {class_id}")
        numbers[class_id], known = with_named(known, name, class_id)
    return numbers, known


def _matched_objects(mine: Longs, theirs: Longs, areas: Floats) -> Longs:
    """Renumber the objects in `theirs` so that matching objects have the same number as in `mine`.

    Both arrays contain ``class * 1000 + object`` for each cell. Returns the new object number of
    each cell, or 0 for cells that are in no object of `theirs`. Objects of the same class are
    matched one to one, greedily in descending order of IoU. Unmatched objects of a class get
    numbers above all object numbers of this class in `mine`.
    """
    pairs = sorted(_overlaps(mine, theirs, areas), key=lambda pair: (-pair[2], pair[0], pair[1]))
    number_of: dict[int, int] = {}
    taken: set[int] = set()
    for own, other, _ in pairs:
        is_object = own % INSTANCES and other % INSTANCES and own // INSTANCES == other // INSTANCES
        if is_object and own not in taken and other not in number_of:
            number_of[other] = own % INSTANCES
            taken.add(own)
    highest = {own // INSTANCES: own % INSTANCES for own in np.unique(mine).tolist()}
    found, ranks = np.unique(theirs, return_inverse=True)
    numbers = np.zeros(len(found), np.int64)
    for rank, other in enumerate(found.tolist()):
        class_id, object_id = divmod(other, INSTANCES)
        if object_id and other not in number_of:
            number_of[other] = highest[class_id] = highest.get(class_id, 0) + 1
            if highest[class_id] >= INSTANCES:
                message = f"the two work files together have {INSTANCES} or more objects of a class"
                raise JournalError(message)
        numbers[rank] = number_of[other] if object_id else 0
    return numbers[ranks]


def _overlaps(mine: Array, theirs: Array, areas: Floats) -> list[tuple[int, int, float]]:
    """Return triples (my value, their value, IoU) for all pairs of values that share a cell.

    The IoU is the area with both values, divided by the area with at least one of the two values.
    The IoU is 0 if the divisor is 0.
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

    ``area`` is the area of the mesh. ``labeled`` is the fraction of this area that both people have
    labeled, and ``share`` is the fraction of this labeled part with equal class and object.
    ``classes`` is a list with the IoU, in this part, of each class and of its objects; the IoU is
    None if the class or object has no cell in this part. The ``area`` of a class is the divisor of
    its IoU. ``mine`` and ``theirs`` are the numbers of an object in the two files, or None, and
    ``object`` is its number in merged work: my number, or a new number if only their file has it.
    """
    paint = np.where(mine.objects > 0, mine.paint, mine.classes.astype(np.uint32))
    both = (paint > 0) & (theirs.paint > 0)
    whole, total = float(areas.sum()), float(areas[both].sum())
    agreed = float(areas[both & (paint == theirs.paint)].sum())
    return {
        "name": theirs.name, "area": whole, "labeled": total / whole if whole else 0.0,
        "share": agreed / total if total else 0.0,
        "classes": _rows(paint, theirs, both, areas[both]),
    }  # fmt: skip


def rounded(share: float) -> float:
    """Return a share for display with three digits: only a share of 1 becomes 1.000 or 100 %."""
    return share if share > 1 - 1e-12 else min(share, 0.9994)


def agreement_text(found: dict[str, Any]) -> str:
    """Return a result of `agreement` as text for people, with a table."""
    lines = [
        f"both labeled {100 * rounded(found['labeled']):.1f} % of the area",
        f"both agree on {100 * rounded(found['share']):.1f} % of the area that both have labeled",
    ]
    rows = [["IoU there", "class", "object in MINE", "object in THEIRS", "object when merged"]]
    for row in found["classes"]:
        for one in [{**row, "mine": "", "theirs": "", "object": ""}, *row["objects"]]:
            iou = None if one["iou"] is None else f"{rounded(one['iou']):.3f}"
            shown = (iou, row["name"], one["mine"], one["theirs"], one["object"])
            rows.append(["-" if value is None else str(value) for value in shown])
    return "\n".join([*lines, *_padded(rows)])


def with_means(name: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """Add a name, and the mean IoU of classes and of objects, or None, to an `agreement`."""
    classes = found["classes"]
    rows = {"class": classes, "object": [one for row in classes for one in row["objects"]]}
    ious = {of: [one["iou"] for one in rows[of] if one["iou"] is not None] for of in rows}
    means = {of: round(sum(some) / len(some), 6) if some else None for of, some in ious.items()}
    return {"file": name, **{f"mean_{of}_iou": mean for of, mean in means.items()}, **found}


def together(files: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the `agreement` on several files as if they were one mesh.

    Classes are matched by name. Objects of different files are different objects.
    """
    shares = [[one["area"], one["labeled"], one["share"]] for one in files]
    whole, both, same = np.cumprod(np.reshape(shares, (-1, 3)), axis=1).sum(axis=0).tolist()
    rows: dict[str, dict[str, Any]] = {}
    for row in (row for one in files for row in one["classes"]):
        new = {"name": row["name"], "iou": None, "area": 0.0, "objects": []}
        total = rows.setdefault(row["name"].casefold(), new)
        common = sum(one["area"] * (one["iou"] or 0.0) for one in (total, row))
        total["area"] += row["area"]
        total["objects"] += row["objects"]
        if row["iou"] is not None:
            total["iou"] = round(common / total["area"], 6) if total["area"] else 0.0
    labeled, share = both / whole if whole else 0.0, same / both if both else 0.0
    return {"area": whole, "labeled": labeled, "share": share, "classes": [*rows.values()]}


def folders_text(entries: Sequence[Mapping[str, Any]]) -> str:
    """Return a table for people with a row for each of the results of `with_means`."""
    rows = [["file", "both labeled", "agree there", "mean IoU of classes", "mean IoU of objects"]]
    for one in entries:
        agree = f"{100 * rounded(one['share']):.1f} %" if one["labeled"] else "-"
        ious = (one["mean_class_iou"], one["mean_object_iou"])
        means = ("-" if iou is None else f"{rounded(iou):.3f}" for iou in ious)
        rows.append([one["file"], f"{100 * rounded(one['labeled']):.1f} %", agree, *means])
    return "\n".join(_padded(rows))


def _padded(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = ((cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
    return ["  ".join(cells).rstrip() for cells in padded]


def _rows(mine: Paint, theirs: Theirs, both: Bools, areas: Floats) -> list[dict[str, Any]]:
    """Return the ``classes`` of `agreement`; `areas` has one area per cell in the mask `both`."""
    paint, other = mine[both], theirs.paint[both]
    of_classes = _ious(class_of(paint), class_of(other), areas)
    of_objects = _ious(paint, other, areas)
    names, own = names_of(theirs.class_list), {*np.unique(mine).tolist()}
    rows: dict[int, dict[str, Any]] = {}
    for one in sorted({*own, *theirs.objects} - {0}):
        object_id, class_id = divmod(one, 1 << 16)
        name = names.get(class_id, f"class {class_id}")
        iou, area = of_classes.get(class_id, (None, 0.0))
        new = {"class": class_id, "name": name, "iou": iou, "area": area, "objects": []}
        objects = rows.setdefault(class_id, new)["objects"]
        if object_id:
            numbers = {"mine": object_id if one in own else None, "theirs": theirs.objects.get(one)}
            iou, _ = of_objects.get(one, (None, 0.0))
            objects.append({"object": object_id, **numbers, "iou": iou})
    return [rows[class_id] for class_id in sorted(rows)]


def _ious(mine: Array, theirs: Array, areas: Floats) -> dict[int, tuple[float, float]]:
    """Return a dict from each positive value to its IoU, rounded to 6 digits, and the divisor."""
    values, ranks = np.unique(np.concatenate([mine, theirs]), return_inverse=True)
    a, b = np.split(ranks, 2)
    n, common = len(values), np.where(a == b, areas, 0.0)
    unions = sums_by_label(a, areas, n) + sums_by_label(b, areas - common, n)
    same = sums_by_label(a, common, n)
    shares = np.divide(same, unions, out=np.zeros(n), where=unions > 0).round(6)
    rows = zip(values.tolist(), shares.tolist(), unions.tolist(), strict=True)
    return {value: (share, union) for value, share, union in rows if value}
