"""Read MSH files of Gmsh, versions 2.2 and 4.1, text or binary."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Content, as_integers, shown

from .grids import Cursor, Grid, as_count

# VTK cell type and number of nodes, indexed by Gmsh type, 1 to 19. Other types are not supported.
_KINDS = np.array([0, 3, 5, 9, 10, 12, 13, 14, 21, 22, 28, 24, 29, 32, 14, 1, 23, 25, 26, 27])
_N_NODES = np.array([0, 2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13])

Parts = tuple[Array, ...]
"""Elements: tags, types, physical tags, geometrical tags, and the nodes of all elements, flat."""


def read_msh(data: Content, name: str) -> Grid:
    """Read the elements of a file, with the element data `name`.

    For the names ``gmsh:physical`` and ``gmsh:geometrical``, the data are the physical or
    geometrical tags of the elements.
    """
    return _MshReader(data, name).read()


class _MshReader(Cursor):
    def __init__(self, data: Content, name: str) -> None:
        super().__init__(data)
        self._name = name
        self._nodes: tuple[Array, Array] | None = None
        self._elements: list[Parts] = []
        self._physical: dict[int, int] = {}  # first physical tag of each volume, keyed by volume
        self._values: tuple[Array, Array] | None = None

    def read(self) -> Grid:
        if self.line() != b"$MeshFormat":
            raise MeshError("not an MSH file of Gmsh: it does not begin with $MeshFormat")
        sections = self._read_format()
        self._close(b"MeshFormat")
        while head := self.line():
            section = head[1:]
            if head[:1] != b"$":
                raise MeshError(f"expected the name of a section, got {shown(head)}")
            if section not in sections or not sections[section]():
                self._skip(section)
            self._close(section)
        return self._grid()

    def _read_format(self) -> dict[bytes, Callable[[], bool]]:
        """Parse the format; return a reader for each section, which returns False to skip it."""
        words = self.line().split()
        if len(words) != 3 or words[0] not in (b"2.2", b"2.1", b"2", b"4.1"):
            raise MeshError(f"expected version 2.2 or 4.1 of MSH, got {shown(b' '.join(words))}")
        if words[1:] not in ([b"0", b"8"], [b"1", b"8"]):
            raise MeshError(f"expected numbers of 8 bytes, got {shown(b' '.join(words[1:]))}")
        if words[1] == b"1":
            one = self.data[self.place : self.place + 4]
            self.place += 4
            self.byte_order = "<" if one == b"\1\0\0\0" else ">"
        if words[0] == b"4.1":
            return {
                b"Entities": self._read_entities,
                b"Nodes": self._read_node_blocks,
                b"Elements": self._read_element_blocks,
                b"ElementData": self._read_data,
            }
        elements = self._read_binary_elements if self.byte_order else self._read_elements
        return {b"Nodes": self._read_nodes, b"Elements": elements, b"ElementData": self._read_data}

    def _skip(self, section: bytes) -> None:
        end = self.data.find(b"$End" + section, self.place)
        if end < 0:
            raise MeshError(f"the section {shown(section)} has no end: the file may be truncated")
        self.place = end

    def _close(self, section: bytes) -> None:
        line = self.line()
        if line != b"$End" + section:
            raise MeshError(f"expected the end of {shown(section)}, got {shown(line)}")

    def _integers(self, n: int, what: str) -> Array:
        return self.numbers(n, "i4", what)

    def _sizes(self, n: int, what: str) -> Array:
        """Read `n` counts or tags, which have 8 bytes in binary files."""
        return self.numbers(n, "i8", what)

    def _count(self, what: str) -> int:
        return self.counts(1, f"the number of {what}")[0]

    def _read_nodes(self) -> bool:
        self._nodes = self._tagged(self._count("Nodes"), 3, "Nodes")
        return True

    def _tagged(self, n: int, width: int, what: str) -> tuple[Array, Array]:
        """Read `n` rows of a tag and `width` doubles; return all tags and all doubles."""
        if not self.byte_order:
            rows = self.numbers((1 + width) * n, "f8", what).reshape(-1, 1 + width)
            return as_integers(rows[:, 0], f"tags of {what}"), np.ascontiguousarray(rows[:, 1:])
        size, order = 4 + 8 * width, self.byte_order
        raw = self.numbers(size * n, "u1", what, "byte").reshape(-1, size)
        tags, doubles = np.ascontiguousarray(raw[:, :4]), np.ascontiguousarray(raw[:, 4:])
        doubles = doubles.view(order + "f8").astype("f8")
        return tags.view(order + "i4")[:, 0].astype(np.int64), doubles

    def _read_elements(self) -> bool:
        """Read elements from text lines: tag, type, number of other tags, other tags, nodes."""
        n_elements = self._count("Elements")
        rows = self.rows(n_elements, "Elements")
        values = as_integers(rows.parse_integers_or_floats(), "Elements")
        if n_elements and rows.counts.min() < 3:
            raise MeshError("an element has fewer than 3 numbers: the file may be truncated")
        starts = np.cumsum(rows.counts, dtype=np.int64) - rows.counts
        types, n_tags = values[starts + 1], values[starts + 2]
        n_nodes = _N_NODES[_checked_types(types)]
        wrong = np.flatnonzero((n_tags < 0) | (3 + n_tags + n_nodes != rows.counts))
        if len(wrong):
            line = rows.number(int(wrong[0]))
            raise MeshError(f"line {line}: the element has too many or too few numbers")
        values = np.append(values, 0)  # read by index -1, which stands for a missing tag
        tags = [values[np.where(n_tags > i, starts + 3 + i, -1)] for i in range(2)]
        is_node = np.arange(len(values) - 1) >= np.repeat(starts + 3 + n_tags, rows.counts)
        nodes = values[:-1][is_node]
        self._elements.append((values[starts], types, *tags, nodes))
        return True

    def _read_binary_elements(self) -> bool:
        n_left = self._count("Elements")
        while n_left:
            begin = self.place
            head = self._integers(3, "Elements")
            _checked_types(head[:1])
            n_rows, n_tags = int(head[1]), int(head[2])
            width = 1 + n_tags + int(_N_NODES[head[0]])
            if not 0 < n_rows <= n_left or n_tags < 0:
                raise MeshError("a block of Elements declares a wrong number of elements")
            if n_rows == 1:  # Gmsh writes a separate block for each element
                self.place = begin
                rows = self._equal_blocks(head, 3 + width, n_left)[:, 3:]
            else:
                rows = self._integers(n_rows * width, "Elements").reshape(-1, width)
            n_left -= len(rows)
            tags = [rows[:, i] if i <= n_tags else np.zeros_like(rows[:, 0]) for i in (0, 1, 2)]
            types, nodes = np.full(len(rows), head[0]), rows[:, 1 + n_tags :].ravel()
            self._elements.append((tags[0], types, *tags[1:], nodes))
        return True

    def _equal_blocks(self, head: Array, width: int, n_left: int) -> Array:
        """Read consecutive blocks that have one element each, and the same header `head`."""
        begin, n_rows, n_equal = self.place, 1, 1
        while n_equal == n_rows:  # n_rows doubles, so at most half of the rows are read twice
            n_fitting = (len(self.data) - begin) // (4 * width)
            n_rows = max(1, min(2 * n_rows, n_left, n_fitting))
            self.place = begin
            rows = self._integers(n_rows * width, "Elements").reshape(-1, width)
            differs = np.flatnonzero((rows[:, :3] != head).any(axis=1))
            n_equal = int(differs[0]) if len(differs) else n_rows
            if n_rows == max(1, min(n_left, n_fitting)):
                break
        self.place = begin + 4 * width * n_equal
        return rows[:n_equal]

    def _read_data(self) -> bool:
        """Read the requested element data, one value per element; return False for other data."""
        begin = self.place
        texts = [self.line() for _ in range(self._few("texts"))]
        for _ in range(self._few("reals")):
            self.line()
        integers = [self.line() for _ in range(self._few("integers"))]
        name = texts[0].strip(b'"').decode("utf-8", "replace") if texts else ""
        if name != self._name or len(integers) < 3 or integers[1] != b"1" or self._values:
            self.place = begin
            return False
        n = as_count(integers[2], "the number of ElementData")
        tags, values = self._tagged(n, 1, "ElementData")
        self._values = tags, values[:, 0]
        return True

    def _few(self, what: str) -> int:
        n = self._count(f"{what} of ElementData")
        if n > 1000:
            raise MeshError(f"ElementData declares {n} {what}; at most 1000 are supported")
        return n

    def _read_entities(self) -> bool:
        what = "Entities"
        counts = [_natural(count, what) for count in self._sizes(4, what)]
        for dimension, count in enumerate(counts):
            for _ in range(count):
                if not self.byte_order:
                    words = self.rows(1, what).content(0).split()
                    if dimension == 3 and len(words) > 8 and words[7] != b"0":
                        self._physical[as_count(words[0], what)] = as_count(words[8], what)
                    continue
                tag = int(self._integers(1, what)[0])
                self.numbers(6 if dimension else 3, "f8", what)
                physical = self._integers(_natural(self._sizes(1, what)[0], what), what)
                if dimension == 3 and len(physical):
                    self._physical[tag] = int(physical[0])
                if dimension:
                    self._integers(_natural(self._sizes(1, what)[0], what), what)
        return True

    def _block(self, what: str) -> tuple[int, int, int, int]:
        """Read a block header: three numbers, and the number of rows of the block."""
        if self.byte_order:
            first, second, third = self._integers(3, what).tolist()
            return first, second, third, _natural(self._sizes(1, what)[0], what)
        first, second, third, n = self._sizes(4, what).tolist()
        return first, second, third, _natural(n, what)

    def _read_node_blocks(self) -> bool:
        tags, points = [np.empty(0, np.int64)], [np.empty(0)]
        for _ in range(_natural(self._sizes(4, "Nodes")[0], "Nodes")):
            _, _, has_parameters, n = self._block("Nodes")
            if has_parameters:
                raise MeshError("parametric nodes are not supported: save the mesh without them")
            tags.append(self._sizes(n, "Nodes"))
            points.append(self.numbers(3 * n, "f8", "Nodes"))
        self._nodes = np.concatenate(tags), np.concatenate(points).reshape(-1, 3)
        return True

    def _read_element_blocks(self) -> bool:
        for _ in range(_natural(self._sizes(4, "Elements")[0], "Elements")):
            dimension, entity, kind, n = self._block("Elements")
            width = 1 + int(_N_NODES[_checked_types(np.array([kind]))[0]])
            rows = self._sizes(n * width, "Elements").reshape(-1, width)
            physical = self._physical.get(entity, 0) if dimension == 3 else 0
            types, first, second = (np.full(n, one) for one in (kind, physical, entity))
            self._elements.append((rows[:, 0], types, first, second, rows[:, 1:].ravel()))
        return True

    def _grid(self) -> Grid:
        if self._nodes is None or not self._elements:
            raise MeshError("the section Nodes or Elements is missing: the file may be truncated")
        node_tags, points = self._nodes
        tags, types, first, second, nodes = map(np.concatenate, zip(*self._elements, strict=True))
        corners = _places(node_tags, nodes, "nodes")
        values: Array | None = None
        if self._name == "gmsh:physical":
            values = first
        elif self._name == "gmsh:geometrical":
            values = second
        elif self._values is not None:
            values = self._values[1][_places(self._values[0], tags, "ElementData")]
        return Grid(points, _KINDS[types], _N_NODES[types], corners, values)


def _natural(value: Any, what: str) -> int:
    if value < 0:
        raise MeshError(f"the counts in {what} must be 0 or greater, got {value}")
    return int(value)


def _checked_types(types: Array) -> Array:
    wrong = (types < 1) | (types >= len(_KINDS))
    if wrong.any():
        raise MeshError(f"Gmsh elements of type {types[wrong][0]} are not supported")
    return types


def _places(tags: Array, wanted: Array, what: str) -> Array:
    """Return the index of each wanted tag in `tags`; fast if the tags are 1, 2, 3, ..."""
    if np.array_equal(tags, np.arange(1, len(tags) + 1)):
        wrong = (wanted < 1) | (wanted > len(tags))
        places = wanted - 1
    else:
        order = np.argsort(tags, kind="stable")
        places = order[np.minimum(np.searchsorted(tags, wanted, sorter=order), len(tags) - 1)]
        wrong = tags[places] != wanted
    if wrong.any():
        raise MeshError(f"an element refers to tag {int(wanted[wrong][0])}, which is not in {what}")
    return places
