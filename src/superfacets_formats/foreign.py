"""Read files with VTK and meshio; these functions run in a process of their own.

They return the fields of `Grid` as named arrays: ``point NAME`` and ``cell NAME`` are data of
vertices and cells, or the reason why they cannot be read, ``names NAME`` are names of values, and
``field NAME`` is the reason why other data are left out.
"""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, counted, shortened

from .grids import NAMES

Found = dict[str, "Array | str"]

NO_ROWS = "which belongs to neither points nor cells"

_DECLARED = re.compile(
    rb"^[ \t]*(POINTS|CELLS|POLYGONS|LINES|VERTICES|TRIANGLE_STRIPS)[ \t]+(\d{1,18})\b", re.M | re.I
)
"""Matches counts that a legacy VTK file declares."""

_KEYWORD = re.compile(rb"(?m)^[ \t]*(vertices|dimension|edges|triangles|quadrilaterals|tetrahedra)")

_MESHIO_KINDS = {name: kind for kind, name in NAMES.items()}
"""VTK types of cells, keyed by meshio's names."""

_DATA = re.compile(rb"^\$(Node|Element)Data[ \t\r]*\n.*?\$End\1Data\b[^\n]*\n?", re.M | re.S)
"""Matches data in an MSH file, which meshio would assign by position."""

_OWNERS = {b"$Nodes": "point", b"$Elements": "cell", b"$NodeData": "point", b"$ElementData": "cell"}
"""What the rows of each section of an MSH file belong to."""

_MAX_NAMED = 10_000
"""Largest value of a property of which the values have names."""


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
        raise MeshError(f"VTK cannot read the file: {shortened(error[1])}")
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


def _numbers_of(array: Any) -> Array | None:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    convert: Any = vtk_to_numpy
    return None if array is None else np.asarray(convert(array))


def _grid_of(found: Any) -> Found:
    none: Array = np.empty(0, np.int64)
    points = found.GetPoints()
    vertices = None if points is None else _numbers_of(points.GetData())
    parts: list[tuple[Any, Any]] = [
        (found.GetVerts(), 2), (found.GetLines(), 4), (found.GetPolys(), 7),
        (found.GetStrips(), 6),
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
    for what, expected, read in (
        ("point", n_points, len(found["vertices"])), ("cell", n_cells, len(found["sizes"]))
    ):  # fmt: skip
        if expected != read:
            raise MeshError(
                f"the file declares {counted(expected, what)}, but has {read}: it may be truncated"
            )


def read_with_meshio(data: bytes, ending: str) -> Found:
    """Return the cells of an MSH file of Gmsh, or of a MESH file of Medit."""
    from meshio import ReadError, gmsh, medit  # type: ignore[import-untyped]

    if ending == ".mesh":  # keywords in any letter case
        data = _KEYWORD.sub(lambda found: found[0].capitalize(), data)
    elif any(data.find(b"$End%s" % section) < 0 for section in (b"Nodes", b"Elements")):
        raise MeshError("the file has no end of its nodes and elements: it may be truncated")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"mesh{ending}")
        path.write_bytes(without_data := _DATA.sub(b"", data))
        try:
            mesh: Any = (medit if ending == ".mesh" else gmsh).read(path)
        except (ReadError, ValueError, LookupError) as error:
            reason = str(error) or "it is damaged, or binary with gaps in the numbers of nodes"
            raise MeshError(f"meshio cannot read the file: {reason}") from None
    if unknown := {block.type for block in mesh.cells} - _MESHIO_KINDS.keys():
        raise MeshError(f"cells of type {', '.join(sorted(unknown))} are not supported")
    points = np.asarray(mesh.points, np.float64)
    if points.shape[1:] != (3,):
        raise MeshError(f"expected 3 coordinates per point, got {points.shape[1]}")
    blocks = [np.asarray(block.data) for block in mesh.cells]
    kinds = [_MESHIO_KINDS[block.type] for block in mesh.cells]
    none = [np.empty(0, np.int64)]
    sizes = np.concatenate([*none, *(np.full(len(rows), rows.shape[1]) for rows in blocks)])
    result: Found = {
        "vertices": points,
        "kinds": np.repeat(kinds, [len(rows) for rows in blocks]).astype(np.int64),
        "sizes": sizes,
        "corners": np.concatenate([*none, *(rows.ravel() for rows in blocks)]),
    }
    for name, values in mesh.point_data.items():
        result[f"point {name}"] = np.asarray(values)
    for name, parts in mesh.cell_data.items():
        result[f"cell {name}"] = np.concatenate([np.asarray(part) for part in parts])
    if without_data != data:
        result |= _data_of(data, sizes)
    highest = max((kind for kind in kinds if kind in (5, 9, 10)), default=0)
    groups = {
        int(tag): name for name, (tag, dimension) in mesh.field_data.items()
        if dimension == (3 if highest == 10 else 2) and 0 <= tag < _MAX_NAMED
    }  # fmt: skip
    if groups:
        named = [groups.get(tag, "") for tag in range(max(groups) + 1)]
        result["names gmsh:physical"] = json.dumps(named)
    return result


def _data_of(content: bytes, sizes: Array) -> Found:
    """Return the data in an MSH file; `sizes` are the numbers of nodes of all elements."""
    with tempfile.TemporaryFile() as file:  # for `numpy.fromfile`
        file.write(content)
        file.seek(0)
        try:
            return _MshData(file, sizes).read()
        except (ValueError, LookupError) as error:
            raise MeshError(f"the data of nodes and elements are damaged: {error}") from None


class _MshData:
    """Cursor in an MSH file. Rows of data have the number of their node or element."""

    def __init__(self, file: IO[bytes], sizes: Array) -> None:
        while file.readline().strip() != b"$MeshFormat":  # meshio has found it
            pass
        self._version, is_binary, size = file.readline().split()[:3]
        self._file, self._sizes, self._count = file, sizes, f"u{int(size)}"
        self._is_old, self._is_text = self._version[:1] == b"2", is_binary == b"0"

    def read(self) -> Found:
        """Return data in the order of nodes and elements; missing values are NaN."""
        if self._version == b"4.0":
            return {"field data": "which are not read in version 4.0"}
        found: Found = {}
        numbers: dict[str, Array] = {}
        for line in iter(self._file.readline, b""):
            owner = _OWNERS.get(line.strip(), "")
            if owner and b"Data" not in line:
                numbers[owner] = self._numbers(are_of_nodes=owner == "point")
            elif owner:
                name, values = self._values_of(numbers[owner])
                if found.setdefault(f"{owner} {name}", values) is not values:
                    found[f"field {name}"] = "whose name is repeated"
        return found

    def _take(self, n: int, kind: str = "") -> Array:
        """Return the next numbers, by default counts."""
        return np.fromfile(self._file, kind or self._count, n, " " if self._is_text else "")

    def _table(self, n: int, width: int) -> tuple[Array, Array]:
        """Return the numbers of the next `n` rows, and their values, (n, width)."""
        if self._is_text:
            rows = self._take(n * (1 + width), "f8").reshape(n, 1 + width)
            return rows[:, 0], rows[:, 1:]
        stored = self._take(n, f"i4,({width},)f8")
        return stored["f0"], stored["f1"]

    def _numbers(self, *, are_of_nodes: bool) -> Array:
        """Return the numbers of all nodes or elements, in the order of the file."""
        n_rows = int(self._file.readline() if self._is_old else self._take(4)[1])
        if self._is_old and are_of_nodes:
            return self._table(n_rows, 3)[0]
        if self._is_old and self._is_text:
            return np.array([self._file.readline().split()[0] for _ in range(n_rows)], np.int64)
        parts, n_found = [], 0
        while n_found < n_rows:  # one block after the other
            if self._is_old:
                _, n, n_tags = self._take(3, "i4").tolist()
                width = 1 + n_tags + self._sizes[n_found]
            else:
                self._take(3, "i4")
                n = int(self._take(1)[0])
                width = 1 if are_of_nodes else 1 + self._sizes[n_found]
            rows = self._take(n * width, "i4" if self._is_old else "").reshape(n, width)
            parts.append(rows[:, 0])
            if are_of_nodes:
                self._take(3 * n, "f8")
            n_found += n
        return np.concatenate(parts)

    def _values_of(self, numbers: Array) -> tuple[str, Array]:
        """Return the name of data, and a value or row for each of the `numbers`."""
        names, _, counts = (
            [self._file.readline().decode().strip() for _ in range(int(self._file.readline()))]
            for _ in range(3)
        )
        width = int(counts[1])
        given, values = self._table(int(counts[2]), width)
        order = np.argsort(numbers, kind="stable")
        ranks = np.searchsorted(numbers, given, sorter=order)
        places = order[np.minimum(ranks, len(order) - 1)]
        if len(lost := given[numbers[places] != given]):
            raise ValueError(f"they have the number {lost[0]:.0f}, which no node or element has")
        found = np.full((len(numbers), width), np.nan)
        found[places] = values
        return (*names, "data")[0].strip('"'), found[:, 0] if width == 1 else found
