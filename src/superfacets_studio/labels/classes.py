"""Encode classes and objects of cells, and edit the list of classes."""

from __future__ import annotations

import contextlib
import csv
import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from superfacets.kit import atomic_outputs, parsed_json, shortened
from superfacets_show import color_distances

CLASSES_FILE = "superfacets-classes.json"  # file in a folder that lists the classes of its meshes
MAX_CLASS = 65_535  # highest class number that fits uint16; 0 means no class
MAX_OBJECT = 999
"""Highest object number in a class; 0 means no object. An instance is the number ``class *
INSTANCES + object``, as in the ground truth of the ScanNet benchmark."""

INSTANCES = 1000
_MAX_NAME = 200
_EXPECTED = 'expected a JSON list of classes, or an object with a list "categories"'

_STUFF = ("wall", "floor", "ceiling", "ground", "sky", "water")
"""Names of classes that have no objects by default."""

_COLUMNS = ("id", "name", "color", "stuff")
"""Columns of a CSV file without a header."""

_NO_CLASS = ("unlabeled", "unannotated", "void", "background", "ignore", "none", "no class")
"""Names that number 0 may have in a CSV file."""

_ANSWERS = {"0": False, "no": False, "false": False, "1": True, "yes": True, "true": True}

_CODES = """
    e69f00 56b4e9 009e73 f0e442 0072b2 d55e00 cc79a7 2b3fb0 aadd99 5a5a00 ffcccc 225533 8c6bb1
    8c510a 1b9e9e c51b8a 66a61e a1140f 00ff00 ff00ff eecc99 ff8877 ff0000 771133 7700bb ff1155
    eeccff 00eedd 998855 996666 554466 9999ff 005566 aaeeff 227700 5566ff cc9977 88bbaa bbaa33
    007766 00ffaa aa33ff cc88ee bb1144 99aa77 00cc55 bbccff 00ccdd bb7700 cc9999 aadd33 668855
    774433 ff8822 885577 3388ff 881177 ff2299 556699 ffaacc bbeedd cc6655 0088aa 00cc99 dddd99
    888800 ff7799 886600 bb5577 5533ff aa99cc aa4411 9944aa aa7755 ffcc44 ffbb99 7788bb ff88dd
    cc3333 cc55bb bbaa77 667722 ff6633 115588 009933 117744 335500 66aabb 664499 aa8800 997799
    773300 669988 66aa66 9977ee aabb55 00bbaa 77aaff 886644 eeaa66
"""

_COLORS = tuple(f"#{code}" for code in _CODES.split())
"""Default colors of classes 1, 2, 3 and so on. The first seven are the palette of Okabe and Ito,
which color-blind people can distinguish; the first twelve differ by at least 10 (CIEDE2000), also
for color-blind people. Each other color has a large distance from all colors before it, and from
gray, because unlabeled cells are gray: at least 13 up to color 40, and at least 9 up to the last
color. A difference of 6 is clear on two separate surfaces."""

_MIN_DISTANCE = 0.046
"""Minimum OKLab distance of a new color to the colors in use: the minimum between two `_COLORS`."""

_N_DEFAULT = 6

_COLOR = re.compile(r"#[0-9a-f]{6}")

ClassList = tuple[dict[str, Any], ...]
"""List of classes, as dicts with ``id``, ``name``, ``color`` and ``key``. The key is a shortcut
that the user has assigned, or empty. A class without objects, such as walls, also has ``stuff``,
which is True."""

ObjectNames = tuple[dict[str, Any], ...]
"""Objects that the user has named, as dicts with ``class``, ``object`` and ``name``."""

Paint = npt.NDArray[np.uint32]
"""Class and object of each cell, encoded as one number by `paint_of`."""


def is_unicode(text: str) -> bool:
    """Return whether a text is valid Unicode, without lone surrogates."""
    return re.search(r"[\ud800-\udfff]", text) is None


def paint_of(classes: npt.ArrayLike, objects: npt.ArrayLike = 0) -> Paint:
    """Encode class and object of each cell as one number; cells without a class get no object."""
    of_class = np.asarray(classes).astype(np.uint32)
    of_object = np.asarray(objects).astype(np.uint32)
    return of_class | np.where(of_class > 0, of_object << np.uint32(16), np.uint32(0))


def class_of(paint: Paint) -> npt.NDArray[np.uint16]:
    """Return the class of each cell; 0 means no class."""
    return (paint & np.uint32(0xFFFF)).astype(np.uint16)


def object_of(paint: Paint) -> npt.NDArray[np.uint16]:
    """Return the object number of each cell within its class; 0 means no object."""
    return (paint >> np.uint32(16)).astype(np.uint16)


def new_class(class_id: int, name: str | None = None, color: str | None = None) -> dict[str, Any]:
    """Return a new class; `color` replaces the default color of this number."""
    name = f"class {class_id}" if name is None else name
    color = color or _COLORS[_index_of_color(class_id)]
    entry = {"id": class_id, "name": name, "color": color, "key": ""}
    is_stuff = name.strip().casefold() in _STUFF
    return {**entry, "stuff": True} if is_stuff else entry


def with_new(classes: ClassList, names: Mapping[int, str | None]) -> ClassList:
    """Return the list with new classes: numbers, and names or None (a name like "class 7")."""
    colors = _free_colors(names, classes)
    new = (new_class(*named, color) for named, color in zip(names.items(), colors, strict=True))
    return (*classes, *new)


def _index_of_color(class_id: int) -> int:
    return (class_id - 1) % len(_COLORS)


def _free_colors(class_ids: Collection[int], classes: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return a default color for each new class, given other classes, some without a color.

    The result is the first default color that differs clearly from all colors in use and from the
    colors of the new classes before it. The search begins with the default color of the class
    number, and returns this color if none differs clearly.
    """
    is_free = np.ones(len(_COLORS), bool)
    used = {entry["color"] for entry in classes} - {None}
    if used and class_ids:
        given, others = (
            np.array([[*bytes.fromhex(c[1:])] for c in some]) for some in (_COLORS, used)
        )
        is_free = color_distances(given, others, ("normal",)).min(axis=1) >= _MIN_DISTANCE
    colors = []
    for class_id in class_ids:
        first = _index_of_color(class_id)
        index = (first + int(np.argmax(np.roll(is_free, -first)))) % len(_COLORS)
        is_free[index] = False  # all other default colors differ clearly from this color
        colors.append(_COLORS[index])
    return colors


def with_named(classes: ClassList, name: str, wanted: object = 0) -> tuple[int, ClassList]:
    """Return the number of the class with this name, ignoring case, and the list of classes.

    If there is no such class, a new class is added to the list. Its number is `wanted` if this is a
    free class number, and otherwise the number after the highest number in use.
    """
    for entry in classes:
        if entry["name"].casefold() == name.casefold():
            return int(entry["id"]), classes
    used = names_of(classes)
    is_free = type(wanted) is int and 1 <= wanted <= MAX_CLASS and wanted not in used
    class_id = cast(int, wanted) if is_free else max(used, default=0) + 1
    return class_id, with_new(classes, {class_id: name})


def names_of(classes: ClassList) -> dict[int, str]:
    """Return a dict from class numbers to names."""
    return {entry["id"]: entry["name"] for entry in classes}


def stuff_of(classes: ClassList) -> set[int]:
    """Return the numbers of all classes that have no objects."""
    return {entry["id"] for entry in classes if entry.get("stuff")}


def default_classes(names: Sequence[str] = ()) -> ClassList:
    """Return new classes with these names or, by default, six classes named "class 1" and so on."""
    if names:
        return checked_class_list([new_class(i, name) for i, name in enumerate(names, 1)])
    return tuple(new_class(number) for number in range(1, _N_DEFAULT + 1))


def with_missing(classes: ClassList, used: Iterable[int]) -> ClassList:
    """Return the list, extended by new classes for numbers in `used` (except 0) that it lacks."""
    lacking = sorted({*used} - {0, *names_of(classes)})
    return with_new(classes, dict.fromkeys(lacking))


def checked_class_list(value: object, places: Sequence[str] = ()) -> ClassList:
    """Return a checked copy of a list of classes; classes without a color get a free default color.

    `places` are the places of the classes in a file, such as "line 2". Raises ValueError if an
    entry is invalid, or if two classes have the same number or key or, with `places`, name.
    """
    if not isinstance(value, (list, tuple)):
        raise ValueError("classes must be a list")
    places, is_file = places or [f"classes[{i}]" for i in range(len(value))], bool(places)
    checked = tuple(map(_checked, value, places))
    bare = [entry for entry in checked if entry["color"] is None]
    colors = _free_colors([entry["id"] for entry in bare], checked)
    for entry, color in zip(bare, colors, strict=True):
        entry["color"] = color
    for name in ("id", "key", "name")[: 3 if is_file else 2]:
        seen: set[Any] = set()
        for entry, place in zip(checked, places, strict=True):
            given = entry[name].casefold() if name == "name" else entry[name]
            if given in seen:
                raise ValueError(f"{place}: two classes have the same {name}: {entry[name]}")
            seen |= {given} - {""}
    return checked


def _checked(entry: Any, place: str) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise ValueError(f"{place} must have an id, a name and a color")
    class_id, name, color, key = (entry.get(part) for part in ("id", "name", "color", "key"))
    if type(class_id) is not int or not 1 <= class_id <= MAX_CLASS:
        raise ValueError(f"{place}: id must be a whole number from 1 to {MAX_CLASS}")
    if not isinstance(name, str) or not name.strip() or len(name) > _MAX_NAME:
        message = f"{place}: name must have 1 to {_MAX_NAME} characters, not only spaces"
        raise ValueError(message)
    is_color = isinstance(color, str) and _COLOR.fullmatch(color.lower())
    if color is not None and not is_color:
        raise ValueError(f"{place}: color must be #rrggbb, such as #e69f00")
    key = "" if key is None else key
    if not isinstance(key, str) or len(key) > 1:
        raise ValueError(f"{place}: key must be one character, or empty")
    for part, text in (("name", name), ("key", key)):
        if not is_unicode(text):
            raise ValueError(f"{place}: {part} is not valid Unicode: lone surrogate")
    is_stuff = entry.get("stuff", False)
    if not isinstance(is_stuff, bool):
        raise ValueError(f"{place}: stuff must be true or false")
    checked = {"id": class_id, "name": name.strip(), "color": color and color.lower(), "key": key}
    return {**checked, "stuff": True} if is_stuff else checked


def with_object_name(
    names: ObjectNames, class_id: int, object_id: int, name: object
) -> ObjectNames:
    """Return the list of names with a new name for one object; an empty name removes the entry.

    Raises ValueError if the name is too long, is not a string, or is not valid Unicode.
    """
    if not isinstance(name, str) or not is_unicode(name):
        raise ValueError("the name of an object must be a string of valid Unicode")
    if len(name) > _MAX_NAME:
        raise ValueError(f"the name of an object must have at most {_MAX_NAME} characters")
    others = [one for one in names if (one["class"], one["object"]) != (class_id, object_id)]
    if name.strip():
        others.append({"class": class_id, "object": object_id, "name": name.strip()})
    return tuple(sorted(others, key=lambda entry: (entry["class"], entry["object"])))


def checked_object(value: object) -> int:
    """Return an object number from 0 (no object) to `MAX_OBJECT`, or raise a ValueError."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_OBJECT:
        raise ValueError(f"object must be a whole number from 0 to {MAX_OBJECT}")
    return value


def read_classes(path: Path) -> ClassList:
    """Read classes from a JSON or CSV file, or from a text file with one name per line.

    A JSON file contains a list of classes, as written by `write_classes`, a list of names, or COCO
    categories, as in an exported ``.objects.json`` file. A CSV file has the columns id, name, color
    and stuff, of which the last two are optional, or a header with the names of its columns. Raises
    ValueError if the file contains no list of classes, and OSError if it cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        if path.suffix.lower() == ".json":
            listed = _listed(parsed_json(text))
            is_ours = path.name == CLASSES_FILE  # older versions stored equal names
            given = [] if is_ours else [f"classes[{i}]" for i in range(len(listed))]
            return checked_class_list(listed, given)
        lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1) if line.strip()]
        named = [(i, new_class(rank, name)) for rank, (i, name) in enumerate(lines, 1)]
        found = _tabled(text) if path.suffix.lower() == ".csv" else named
        if not found:
            raise ValueError("no line has a class")
        return checked_class_list([one for _, one in found], [f"line {i}" for i, _ in found])
    except UnicodeDecodeError:
        raise ValueError(f"{path}: save the file as UTF-8 (in Excel: CSV UTF-8)") from None
    except ValueError as error:
        raise ValueError(f"{path}: not a list of classes: {error}") from None


def shared_classes(folders: Iterable[Path]) -> ClassList:
    """Return the shared classes of the first folder that has a list; empty if none has."""
    lists = (folder / CLASSES_FILE for folder in folders)
    return next((read_classes(one) for one in lists if one.is_file()), ())


def new_classes(file: Path | None, folder: Path) -> ClassList:
    """Return the classes in a file for new work, or no classes if `file` is None.

    If `folder` stores these numbers and names, its list is returned, which may have more classes,
    other colors, and keys. Raises a ValueError if it stores other classes, or if the file contains
    no list.
    """
    if file is None:
        return ()
    given, stored = read_classes(file), folder / CLASSES_FILE
    if not stored.is_file():
        return given
    known = read_classes(stored)
    if names_of(given).items() - names_of(known).items():
        raise ValueError(
            f"{stored} stores other classes than {file}: omit --classes, or edit the stored classes"
        )
    return known


def _listed(content: Any) -> list[Any]:
    """Return the classes in JSON: a list of classes or names, or a dict with COCO categories."""
    if isinstance(content, list):
        return [
            {**new_class(i, entry), "color": None} if isinstance(entry, str) else entry
            for i, entry in enumerate(content, 1)
        ]
    if not isinstance(content, dict):
        raise ValueError(f"{_EXPECTED}, found {json.dumps(content)[:_MAX_NAME]}")
    if not isinstance(content.get("categories"), list):
        keys = ", ".join(map(json.dumps, content))[:_MAX_NAME]
        found = f"with the keys {keys}" if keys else "without keys"
        raise ValueError(f"{_EXPECTED}, found an object {found}")
    return [_of_category(entry) for entry in content["categories"]]


def _of_category(entry: Any) -> Any:
    """Convert a COCO category, perhaps with ``isthing`` and a list of red, green and blue."""
    if not isinstance(entry, dict):
        return entry
    color = entry.get("color")
    with contextlib.suppress(TypeError, ValueError):  # an invalid color is reported by `_checked`
        color = "#" + bytes(color).hex() if isinstance(color, list) else color
    given = {name: entry.get(name) for name in ("id", "name")}
    return {**given, "color": color, "stuff": not entry.get("isthing", True)}


def _tabled(text: str) -> list[tuple[int, dict[str, Any]]]:
    """Return line and class of each row of a CSV file; commas, semicolons or tabs divide it."""
    mark = max(",;\t", key=text.count)
    table = csv.reader(text.splitlines(), delimiter=mark, skipinitialspace=True)
    rows = [(table.line_num, [cell.strip() for cell in row]) for row in table if any(row)]
    header = [name.casefold().replace("_", "") for name in rows[0][1]] if rows else []
    columns = header if "name" in header else _COLUMNS
    classes = []
    for number, row in rows[columns is header :]:
        try:
            classes += [(number, one) for one in _of_row(dict(zip(columns, row, strict=False)))]
        except ValueError as error:
            raise ValueError(f"line {number}: {error}") from None
    return classes


def _of_row(row: Mapping[str, str]) -> list[dict[str, Any]]:
    """Convert a row to a class; the result is empty for number 0, which means no class.

    The columns ``isthing`` and ``hasinstances`` are the opposite of ``stuff``. A row without an
    answer is stuff if its name is one of `_STUFF`.
    """
    number, name, color = (row.get(part, "") for part in ("id", "name", "color"))
    if not re.fullmatch(r"-?\d{1,9}", number):
        raise ValueError(f'expected a whole number as id, found "{shortened(number)}"')
    if int(number) == 0:
        if name.casefold() in _NO_CLASS:
            return []
        raise ValueError(f"the id of {shortened(name)} is 0, which means no class: count from 1")
    values = [int(value) for value in re.findall(r"\b\d{1,3}\b", color)]
    if len(values) == 3 and max(values) < 256:  # red, green and blue
        color = bytes(values).hex()
    entry = {**new_class(int(number), name), "color": f"#{color.lstrip('#')}" if color else None}
    for column, is_stuff in (("stuff", True), ("isthing", False), ("hasinstances", False)):
        answer = row.get(column, "").casefold()
        if answer and answer not in _ANSWERS:
            raise ValueError(f"{column} must be 0 or 1, found {shortened(answer)}")
        entry |= {"stuff": _ANSWERS[answer] == is_stuff} if answer else {}
    return [{**entry, "key": row.get("key", "")}]


def write_classes(path: Path, classes: ClassList) -> None:
    """Write classes to a JSON file; if writing fails, an existing file stays unchanged."""
    with atomic_outputs([path]) as (temporary,):
        temporary.write_text(json.dumps(list(classes), indent=1) + "\n", encoding="utf-8")
