"""Read legacy VTK files of unstructured grids, versions 3.0 to 5.1, text and binary."""

from __future__ import annotations

import re
from urllib.parse import unquote_to_bytes

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Content, counted, shown

from .grids import Cursor, Grid, as_count, sizes_between
from .vtk_xml import NUMBER_TYPES

_TYPES = {
    "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "float": "f4", "double": "f8",
    "vtkidtype": "i4",
    **{f"vtktype{word.lower()}": stored for word, stored in NUMBER_TYPES.items()},
}  # fmt: skip
"""NumPy type codes, keyed by VTK type names. Binary files store ids (``vtkidtype``) as ``int``."""

_WIDTHS = {
    "VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6, "GLOBAL_IDS": 1, "PEDIGREE_IDS": 1,
}  # fmt: skip
"""Number of components of attributes whose header line has a name and a type."""


def read_vtk(data: Content, name: str) -> Grid:
    """Read the cells of a file, and the cell data with this name."""
    return _LegacyReader(data, name).read()


class _LegacyReader(Cursor):
    def __init__(self, data: Content, name: str) -> None:
        super().__init__(data)
        self._name = name
        self._arrays: dict[str, Array] = {}
        self._values: Array | None = None
        self._owner = ""  # current section of attributes: CELL_DATA or POINT_DATA
        self._n_values = 0  # number of cells or points in this section

    def read(self) -> Grid:
        version = re.fullmatch(rb"# vtk DataFile Version (\d)\.\d", self.any_line())
        if version is None:
            raise MeshError("not a VTK file: it does not begin with # vtk DataFile Version")
        self._has_offsets = int(version[1]) >= 5
        self.any_line()  # skip the title
        form = self.line()
        if form not in (b"ASCII", b"BINARY"):
            raise MeshError(f"expected ASCII or BINARY, got {shown(form)}")
        words = self._words()
        if words != ["DATASET", "UNSTRUCTURED_GRID"]:
            raise MeshError(f"expected DATASET UNSTRUCTURED_GRID, got {shown(' '.join(words))}")
        self.byte_order = ">" if form == b"BINARY" else ""
        while words := self._words():
            self._read_section(words)
        return self._grid()

    def _words(self) -> list[str]:
        return self.line().decode("latin-1").split()

    def _read_section(self, words: list[str]) -> None:
        keyword = words[0].upper()
        if keyword == "METADATA":
            while self.any_line():
                pass
        elif keyword == "FIELD":
            for _ in range(as_count(_word(words, 2), "arrays of a field")):
                self._read_field()
        elif keyword == "POINTS":
            self._arrays["points"] = self._numbers(
                3 * self._count(words, 1), _word(words, 2), "POINTS"
            )
        elif keyword == "CELLS":
            self._read_cells(self._count(words, 1), self._count(words, 2))
        elif keyword == "CELL_TYPES":
            self._arrays["kinds"] = self._numbers(self._count(words, 1), "int", "CELL_TYPES")
        elif keyword in ("CELL_DATA", "POINT_DATA"):
            self._owner, self._n_values = keyword, self._count(words, 1)
        else:
            self._read_attribute(keyword, words)

    def _read_cells(self, n_rows: int, n_values: int) -> None:
        if not self._has_offsets:
            rows = self._numbers(n_values, "int", "CELLS")
            self._arrays["sizes"], self._arrays["corners"] = _split_rows(rows, n_rows)
            return
        for keyword, name, n in (
            ("OFFSETS", "sizes", n_rows),
            ("CONNECTIVITY", "corners", n_values),
        ):
            words = self._words()
            if _word(words, 0) != keyword:
                raise MeshError(f"expected {keyword} of CELLS, got {shown(' '.join(words))}")
            self._arrays[name] = self._numbers(n, _word(words, 1), keyword)
        self._arrays["sizes"] = sizes_between(self._arrays["sizes"], "CELLS")[1:]

    def _read_field(self) -> None:
        words = self._words()
        if words and words[0] == "METADATA":
            self._read_section(words)
            words = self._words()
        width, n = self._count(words, 1), self._count(words, 2)
        self._keep(words[0], self._numbers(width * n, _word(words, 3), "a field"))

    def _read_attribute(self, keyword: str, words: list[str]) -> None:
        n, place = self._n_values, 2  # `place` is the index of the type in `words`
        if keyword == "SCALARS":
            n *= self._count(words, 3) if len(words) > 3 else 1
            begin = self.place
            if self._words()[:1] != ["LOOKUP_TABLE"]:
                self.place = begin
        elif keyword == "TEXTURE_COORDINATES":
            n, place = self._count(words, 2) * n, 3
        elif keyword in ("COLOR_SCALARS", "LOOKUP_TABLE"):
            n = (4 if keyword == "LOOKUP_TABLE" else n) * self._count(words, 2)
            self._numbers(n, "unsigned_char" if self.byte_order else "float", keyword)
            return
        elif keyword in _WIDTHS:
            n *= _WIDTHS[keyword]
        else:
            raise MeshError(f"expected a VTK keyword, got {shown(words[0])}")
        self._keep(_word(words, 1), self._numbers(n, _word(words, place), keyword))

    def _count(self, words: list[str], place: int) -> int:
        return as_count(
            _word(words, place), f"the sizes of {shown(words[0]) if words else 'FIELD'}"
        )

    def _numbers(self, n: int, word: str, what: str) -> Array:
        if word.lower() not in _TYPES:
            raise MeshError(f"{what} must have a type such as double, got {shown(word)}")
        return self.numbers(n, _TYPES[word.lower()], what)

    def _keep(self, name: str, values: Array) -> None:
        """Store an array if it is the requested cell data; names in files are percent-encoded."""
        stored = unquote_to_bytes(name.encode("latin-1")).decode("utf-8", "replace")
        if self._owner == "CELL_DATA" and self._values is None and stored == self._name:
            self._values = values

    def _grid(self) -> Grid:
        missing = [key for key in ("points", "corners", "kinds") if key not in self._arrays]
        if missing:
            section = {"points": "POINTS", "corners": "CELLS", "kinds": "CELL_TYPES"}[missing[0]]
            raise MeshError(f"the file has no section {section}: it may be truncated")
        points = self._arrays["points"].reshape(-1, 3)
        kinds, sizes, corners = (self._arrays[key] for key in ("kinds", "sizes", "corners"))
        return Grid(points, kinds, sizes, corners, self._values)


def _word(words: list[str], place: int) -> str:
    if place >= len(words):
        raise MeshError(
            f"the line {shown(' '.join(words))} is too short: the file may be truncated"
        )
    return words[place]


def _split_rows(rows: Array, n_rows: int) -> tuple[Array, Array]:
    """Split rows (size, corner, corner, ...) into sizes and flat corners."""
    width = len(rows) // n_rows if n_rows else 0
    if width and len(rows) == width * n_rows and (rows[::width] == width - 1).all():
        return np.full(n_rows, width - 1), rows.reshape(n_rows, width)[:, 1:].ravel()
    place, places, sizes = 0, [], rows.tolist()
    while place < len(sizes):
        places.append(place)
        if sizes[place] < 0:
            break
        place += 1 + sizes[place]
    if place != len(rows) or len(places) != n_rows:
        raise MeshError(f"the numbers in CELLS do not match the declared {counted(n_rows, 'cell')}")
    return rows[places], np.delete(rows, places)
