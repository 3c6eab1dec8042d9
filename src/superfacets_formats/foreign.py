"""Read files with VTK and meshio; these functions run in a process of their own.

The functions return the fields of `Grid` as named arrays: ``point NAME`` and ``cell NAME`` are data
of vertices and cells, or the reason why the data cannot be read, ``names NAME`` are names of
values, and ``field NAME`` is the reason why other data are left out.
"""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, BinaryReader, Lines, counted, shortened, shown

from .grids import NAMES, as_count

Found = dict[str, "Array | str"]

NO_ROWS = "which belongs to neither points nor cells"

_DECLARED = re.compile(
    rb"^[ \t]*(POINTS|CELLS|POLYGONS|LINES|VERTICES|TRIANGLE_STRIPS)[ \t]+(\d{1,18})\b", re.M | re.I
)
"""Matches counts that a legacy VTK file declares."""

_KEYWORD = re.compile(rb"(?m)^[ \t]*(vertices|dimension|edges|triangles|quadrilaterals|tetrahedra)")

_MESHIO_KINDS = {name: kind for kind, name in NAMES.items()}
"""VTK types of cells, keyed by meshio's names."""

_BEGIN = re.compile(rb"\s*\$(\S+)[ \t\r]*\n")
"""Matches the first line of a section of an MSH file."""

_MESH = {"MeshFormat": 1, "PhysicalNames": 0, "Entities": 0, "Nodes": 1, "Elements": 1}
"""Sections that meshio reads, in the required order, and the minimum number of each."""

_MAX_NAMED = 10_000
"""Largest value of a property whose values have names."""


def read_with_vtk(data: bytes, ending: str) -> Found:
    """Return the surface or unstructured grid in a legacy or XML file of VTK."""
    from vtkmodules import vtkCommonCore, vtkIOLegacy, vtkIOXML

    log = vtkCommonCore.vtkStringOutputWindow()
    vtkCommonCore.vtkOutputWindow.SetInstance(log)
    reader: Any
    is_xml = data.lstrip()[:1] == b"<"
    if is_xml:
        is_grid = ending == ".vtu"
        reader = getattr(vtkIOXML, f"vtkXML{'UnstructuredGrid' if is_grid else 'PolyData'}Reader")()
        reader.ReadFromInputStringOn()
        reader.SetInputString(data.decode("latin-1"))
    else:
        reader = vtkIOLegacy.vtkGenericDataObjectReader()
        reader.ReadFromInputStringOn()
        reader.SetBinaryInputString(data, len(data))
        kinds = ("Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields", "ColorScalars")
        for what in kinds:
            getattr(reader, f"ReadAll{what}On")()
    reader.Update()
    if error := re.search(r"ERR(?:.*\n.*?\): )?(.*)", log.GetOutput()):
        way = ": save it as .vtu or .vtp, or read a grid with meshio" * ("Unsupp" in error[1])
        raise MeshError(f"VTK cannot read the file: {shortened(error[1])}{way}")
    found = reader.GetOutput()
    if found is None or not (found.IsA("vtkPolyData") or found.IsA("vtkUnstructuredGrid")):
        kind = "no data" if found is None else found.GetClassName().removeprefix("vtk")
        raise MeshError(f"expected PolyData or an UnstructuredGrid, got {kind}")
    result = _grid_of(found)
    if not is_xml:
        _check_declared(data, result)
    for owner, stored in (("point", found.GetPointData()), ("cell", found.GetCellData())):
        for place in range(stored.GetNumberOfArrays()):
            array = stored.GetAbstractArray(place)
            values = _numbers_of(stored.GetArray(place))
            result[f"{owner} {array.GetName()}"] = "which are texts" if values is None else values
    fields = found.GetFieldData()
    for place in range(fields.GetNumberOfArrays()):
        result[f"field {fields.GetAbstractArray(place).GetName()}"] = NO_ROWS
    return result


def as_small(values: Array) -> Array:
    """Return integers of 64 bits as int32 if they fit."""
    is_long = values.dtype.kind in "iu" and values.itemsize == 8
    return small if is_long and np.array_equal(small := values.astype(np.int32), values) else values


def _numbers_of(array: Any) -> Array | None:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    convert: Any = vtk_to_numpy
    return None if array is None else np.asarray(convert(array))


def _grid_of(found: Any) -> Found:
    none: Array = np.empty(0, np.int64)
    points = found.GetPoints()
    vertices = None if points is None else _numbers_of(points.GetData())
    parts: list[tuple[Any, Any]] = [
        (found.GetVerts(), 2), (found.GetLines(), 4), (found.GetPolys(), 7), (found.GetStrips(), 6),
    ] if found.IsA("vtkPolyData") else [
        (found.GetCells(), _numbers_of(found.GetCellTypesArray()))
    ]  # fmt: skip
    kinds, sizes, corners = [none], [none], [none]
    for cells, kind in parts:
        ends, places = (
            _numbers_of(array) for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray())
        )
        lengths = none if ends is None else np.diff(ends)
        sizes.append(lengths)
        corners.append(none if places is None else places)
        kinds.append(np.broadcast_to(none if kind is None else kind, lengths.shape))
    return {
        "vertices": np.empty((0, 3)) if vertices is None else vertices,
        "kinds": np.concatenate(kinds), "sizes": np.concatenate(sizes),
        "corners": np.concatenate(corners),
    }  # fmt: skip


def _check_declared(data: bytes, found: Found) -> None:
    """Raise a MeshError if a legacy file declares other counts than VTK has read."""
    version = re.match(rb"# vtk DataFile Version (\d)", data)
    shift = int(version is not None and int(version[1]) >= 5)  # offsets have one entry more
    declared: dict[str, int] = {}
    for word, count in _DECLARED.findall(data):
        declared.setdefault(word.decode().upper(), int(count))
    n_points = declared.pop("POINTS", 0)
    n_cells = sum(max(count - shift, 0) for count in declared.values())
    for what, n, key in (("point", n_points, "vertices"), ("cell", n_cells, "sizes")):
        if n != (n_read := len(found[key])):
            message = f"the file declares {counted(n, what)}, but has {n_read}: it may be truncated"
            raise MeshError(message)


def read_with_meshio(data: bytes, ending: str) -> Found:
    """Return the cells of an MSH file of Gmsh, or of a MESH file of Medit."""
    if ending == ".msh":
        return _MshFile(data).read()
    return _mesh_in(_KEYWORD.sub(lambda found: found[0].capitalize(), data), ending)


def _mesh_in(data: bytes, ending: str) -> Found:
    """Return what meshio reads, without the data of MSH files."""
    from meshio import ReadError, gmsh, medit  # type: ignore[import-untyped]

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"mesh{ending}")
        path.write_bytes(data)
        try:
            mesh: Any = (medit if ending == ".mesh" else gmsh).read(path)
        except (ReadError, ValueError, LookupError, OverflowError) as error:
            reason = "" if isinstance(error, LookupError) else str(error)
            reason = reason or "it is damaged, or binary with nodes that are not 1, 2, 3, ..."
            raise MeshError(f"meshio cannot read the file: {reason}") from None
    if unknown := {block.type for block in mesh.cells} - _MESHIO_KINDS.keys():
        raise MeshError(f"cells of type {', '.join(sorted(unknown))} are not supported")
    points = np.asarray(mesh.points, np.float64)
    if points.shape[1:] != (3,):
        raise MeshError(f"expected 3 coordinates per point, got {points.shape[1]}")
    blocks = [np.asarray(block.data) for block in mesh.cells]
    kinds = [_MESHIO_KINDS[block.type] for block in mesh.cells]
    none = [np.empty(0, np.int64)]
    result: Found = {
        "vertices": points,
        "kinds": np.repeat(kinds, [len(rows) for rows in blocks]).astype(np.int64),
        "sizes": np.concatenate([*none, *(np.full(len(rows), rows.shape[1]) for rows in blocks)]),
        "corners": np.concatenate([*none, *(rows.ravel() for rows in blocks)]),
    }
    for name, values in mesh.point_data.items():
        result[f"point {name}"] = as_small(np.asarray(values))
    for name, parts in mesh.cell_data.items():
        result[f"cell {name}"] = as_small(np.concatenate([np.asarray(part) for part in parts]))
    highest = max((kind for kind in kinds if kind in (5, 9, 10)), default=0)
    groups = {
        int(tag): name for name, (tag, dimension) in mesh.field_data.items()
        if dimension == (3 if highest == 10 else 2) and 0 <= tag < _MAX_NAMED
    }  # fmt: skip
    if groups:
        named = [groups.get(tag, "") for tag in range(max(groups) + 1)]
        result["names gmsh:physical"] = json.dumps(named)
    return result


class _MshFile:
    """The sections of an MSH file. A row of data begins with the number of its node or element."""

    def __init__(self, data: bytes) -> None:
        self._data, self._left, at = data, kit.most_bytes_of(len(data)), 0
        self._sections: dict[str, list[slice]] = {}
        while at < len(data):
            if (begin := _BEGIN.match(data, at)) is None:
                raise MeshError(f"expected a section like $Nodes, got {shown(data[at : at + 50])}")
            name = begin[1].decode("utf-8", "replace")
            ends = re.compile(rb"\$End%b[ \t\r]*(\n\s*|\Z)" % re.escape(begin[1]))
            if (end := ends.search(data, begin.end())) is None:
                raise MeshError(f"the section ${name} has no end: the file may be truncated")
            self._sections.setdefault(name, []).append(slice(begin.end(), end.start()))
            at = end.end()

    def read(self) -> Found:
        """Return the mesh, and data in the order of nodes and elements; missing values are NaN."""
        content = b""
        for name, n_needed in _MESH.items():
            places = self._sections.get(name, [])
            if not n_needed <= len(places) <= 1:
                raise MeshError(f"expected one section ${name}, got {len(places)}")
            for part in (self._data[place] for place in places):
                text = part.decode("utf-8", "replace").encode() if name == "PhysicalNames" else part
                content += b"$%b\n%b$End%b\n" % (name.encode(), text, name.encode())
        result = _mesh_in(content, ".msh")
        try:
            numbers = self._numbers_of(len(result["vertices"]), np.asarray(result["sizes"]))
        except (ValueError, LookupError):
            raise MeshError("$Nodes or $Elements has other rows than it declares") from None
        for name, places in self._sections.items():
            if name not in (*_MESH, *numbers):
                result[f"field ${name}"] = "which is not read"
            for place in places if name in numbers else []:
                with kit.named_errors(f"the section ${name}"):
                    title, values = self._values_of(place, numbers[name])
                owner = "point" if name == "NodeData" else "cell"
                if result.setdefault(f"{owner} {title}", values) is not values:
                    result[f"field {title}"] = "whose name is repeated"
        return result

    def _numbers_of(self, n_nodes: int, sizes: Array) -> dict[str, Array]:
        """Return the numbers of nodes and elements, in their order, keyed by sections of data."""
        version, is_binary, size = self._data[self._sections["MeshFormat"][0]].split()[:3]
        self._is_text, count = is_binary == b"0", f"u{int(size)}"
        # The number of counts before the first block (none: a line), and the type of other numbers:
        form = (0, "i4") if version[:1] == b"2" else (2, "i4") if version == b"4.0" else (4, count)
        nodes = np.full(n_nodes, 0 if form[0] == 4 else 3 if self._is_text else 6)  # coordinates
        return {
            "NodeData": self._numbers("Nodes", nodes, *form, count),
            "ElementData": self._numbers("Elements", sizes, *form, count),
        }

    def _content(self, begin: int, end: int, *, only_first: bool = False) -> bytes:
        """Return numbers as bytes; numbers of a text are float64, all or the first of each line."""
        if not self._is_text:
            return self._data[begin:end]
        lines = Lines.of(self._data, begin=begin, end=end)
        values = lines.parse(np.float64)
        return (values[np.cumsum(lines.counts) - lines.counts] if only_first else values).tobytes()

    def _numbers(self, name: str, sizes: Array, n_counts: int, kind: str, count: str) -> Array:
        """Return the first number in each row of a section; `sizes` counts the other numbers."""
        place, parts, n_found = self._sections[name][0], [np.empty(0)], 0
        begin = place.start if n_counts else self._data.index(b"\n", place.start) + 1
        only_first = self._is_text and name == "Elements" and not n_counts
        content = self._content(begin, place.stop, only_first=only_first)
        reader, widths = BinaryReader(content), np.append(1 + sizes * (not only_first), 1)

        def take(n: int, kind: str) -> Array:
            return reader.numbers(n, "f8" if self._is_text else kind)

        take(n_counts, count)
        while len(content) - reader.at > 2:  # one block per round; blocks may be empty
            n, width = max(len(sizes), 1), int(widths[n_found])
            if n_counts:
                _, n = take(3, "i4"), int(take(1, count)[0])
            elif name == "Elements" and not self._is_text:
                _, n, n_tags = take(3, "i4").tolist()
                width += n_tags
            parts.append(take(n * width, kind)[::width])
            take(3 * n if name == "Nodes" and n_counts == 4 else 0, "f8")
            n_found += n
        if n_found != len(sizes):
            raise MeshError("rows that are not declared")
        return np.concatenate(parts).astype(np.int64)

    def _values_of(self, place: slice, numbers: Array) -> tuple[str, Array]:
        """Return the name of data, and a value or row for each of the `numbers`."""
        reader = BinaryReader(self._data, "<", place.start)

        def lines() -> list[str]:
            n_lines = as_count(reader.text(b"\n").strip(), "numbers of tags")
            return [reader.text(b"\n").strip() for _ in range(n_lines)]

        names, _, tags = lines(), lines(), lines()
        if len(tags) < 3:
            raise MeshError(f"expected 3 integer tags, got {len(tags)}")
        width, n = (as_count(tag, "integer tags") for tag in tags[1:3])
        declared = f"{counted(n, 'row')} of {counted(width, 'value')}"
        self._left -= 8 * width * max(n, len(numbers), 1)
        if self._left < 0:
            raise MeshError(f"it declares {declared}, too many for the file size")
        stored = np.dtype(f"{'f8' if self._is_text else 'i4'},({width},)f8")
        content, n_bytes = self._content(reader.at, place.stop), n * stored.itemsize
        if reader.at > place.stop or len(content) < n_bytes or content[n_bytes:].strip():
            raise MeshError(f"it declares {declared}, but has more or less")
        rows = np.frombuffer(content, stored, n)
        given = kit.as_integers(rows["f0"], "numbers of nodes and elements")
        if len(lost := given[~np.isin(given, numbers)]):
            raise MeshError(f"it has the number {lost[0]}, which no node or element has")
        for what, some in (("rows", np.sort(given)), ("nodes or elements", np.sort(numbers))):
            if len(twice := some[1:][np.diff(some) == 0]):
                raise MeshError(f"two {what} have the number {twice[0]}")
        found, order = np.full((len(numbers), width), np.nan), np.argsort(numbers)
        found[order[np.searchsorted(numbers, given, sorter=order)]] = rows["f1"]
        return (*names, "data")[0].strip('"'), found[:, 0] if width == 1 else found
