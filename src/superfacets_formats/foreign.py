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
from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, counted, shortened

Found = dict[str, "Array | str"]

NO_ROWS = "which belongs to neither points nor cells"

_DECLARED = re.compile(
    rb"^[ \t]*(POINTS|CELLS|POLYGONS|LINES|VERTICES|TRIANGLE_STRIPS)[ \t]+(\d{1,18})\b", re.M | re.I
)
"""Matches counts that a legacy VTK file declares."""

_KEYWORD = re.compile(rb"(?m)^[ \t]*(vertices|dimension|edges|triangles|quadrilaterals|tetrahedra)")

_MESHIO_KINDS = {
    "vertex": 1, "line": 3, "triangle": 5, "polygon": 7, "quad": 9, "tetra": 10, "hexahedron": 12,
    "wedge": 13, "pyramid": 14, "line3": 21, "triangle6": 22, "quad8": 23, "tetra10": 24,
    "hexahedron20": 25, "wedge15": 26, "pyramid13": 27, "quad9": 28, "hexahedron27": 29,
    "wedge18": 32,
}  # fmt: skip
"""VTK cell types, keyed by meshio's names."""

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
    from meshio import ReadError, _common, gmsh, medit  # type: ignore[import-untyped]

    # Blocks of cells are pairs in version 2; meshio takes 2 as the size of each.
    gmsh._gmsh22.cell_data_from_raw = lambda blocks, data: _common.cell_data_from_raw(
        [each[1] if isinstance(each, tuple) else each for each in blocks], data
    )
    if ending == ".mesh":  # keywords in any letter case
        data = _KEYWORD.sub(lambda found: found[0].capitalize(), data)
    elif any(data.find(b"$End%s" % section) < 0 for section in (b"Nodes", b"Elements")):
        raise MeshError("the file has no end of its nodes and elements: it may be truncated")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"mesh{ending}")
        path.write_bytes(data)
        try:
            mesh: Any = (medit if ending == ".mesh" else gmsh).read(path)
        except (ReadError, ValueError, LookupError) as error:
            raise MeshError(f"meshio cannot read the file: {str(error) or 'damaged'}") from None
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
        result[f"point {name}"] = np.asarray(values)
    for name, parts in mesh.cell_data.items():
        result[f"cell {name}"] = np.concatenate([np.asarray(part) for part in parts])
    highest = max((kind for kind in kinds if kind in (5, 9, 10)), default=0)
    groups = {
        int(tag): name for name, (tag, dimension) in mesh.field_data.items()
        if dimension == (3 if highest == 10 else 2) and 0 <= tag < _MAX_NAMED
    }  # fmt: skip
    if groups:
        named = [groups.get(tag, "") for tag in range(max(groups) + 1)]
        result["names gmsh:physical"] = json.dumps(named)
    return result
