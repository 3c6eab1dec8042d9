"""Superfacets in ParaView: load this file with Tools > Manage Plugins > Load New.

The package has to be importable by ParaView's Python (3.11 or newer). Install it for that Python
into a folder, and start ParaView with the folder in PYTHONPATH:

    python3.12 -m pip install --target ~/superfacets --no-deps superfacets
    PYTHONPATH=~/superfacets paraview

NumPy is ParaView's own.
"""

from __future__ import annotations

import numpy as np
from paraview.util.vtkAlgorithm import (
    VTKPythonAlgorithmBase,
    smdomain,
    smhint,
    smproperty,
    smproxy,
)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkPolyData

# Kinds of cells, as VTK numbers them. Others that have no area, such as lines, are left out.
_FACES = (5, 7, 9)  # triangle, polygon, quad
_TET = 10
_WITHOUT_AREA = (0, 1, 2, 3, 4)  # empty, vertex, vertices, line, lines

_CHECKBOX = '<BooleanDomain name="bool"/>'


@smproxy.filter(name="Superfacets", label="Superfacets")
@smhint.xml('<ShowInMenu category="Superfacets"/>')
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkPolyData", "vtkUnstructuredGrid"], composite_data_supported=False)
class Superfacets(VTKPythonAlgorithmBase):
    """Label faces, tetrahedra or points with compact regions that follow the creases.

    The output is the input with one more array of cells (of points, where there are no faces).
    Of a grid that has tetrahedra, these are segmented; cells that are not get -1.
    """

    def __init__(self):
        super().__init__(nInputPorts=1, inputType="vtkPointSet", outputType="vtkPointSet")
        self._n_segments = 150
        self._follow_ridges = 0.0
        self._keep_islands = True
        self._colors = True
        self._name = "superfacets"

    @smproperty.intvector(name="Regions", default_values=150)
    @smdomain.intrange(min=1, max=5000)
    def SetRegions(self, n_segments):  # noqa: N802
        """Set the number of regions."""
        self._set("_n_segments", int(n_segments))

    @smproperty.doublevector(name="FollowRidges", label="Follow Ridges", default_values=0.0)
    @smdomain.doublerange(min=0.0, max=1.0)
    def SetFollowRidges(self, share):  # noqa: N802
        """Set what rounded ridges count against grooves; sharp ones count 0.35 at least."""
        self._set("_follow_ridges", float(share))

    @smproperty.intvector(name="KeepIslands", label="Keep Islands", default_values=1)
    @smdomain.xml(_CHECKBOX)
    def SetKeepIslands(self, keep):  # noqa: N802
        """Set whether each part that touches no other has a region of its own."""
        self._set("_keep_islands", bool(keep))

    @smproperty.intvector(name="Colors", default_values=1)
    @smdomain.xml(_CHECKBOX)
    def SetColors(self, wanted):  # noqa: N802
        """Set whether to add colors that differ where regions touch; show without Map Scalars."""
        self._set("_colors", bool(wanted))

    @smproperty.stringvector(name="ArrayName", label="Array Name", default_values="superfacets")
    def SetArrayName(self, name):  # noqa: N802
        """Set the name of the array."""
        self._set("_name", str(name))

    def _set(self, name, value):
        if getattr(self, name) != value:
            setattr(self, name, value)
            self.Modified()

    def RequestDataObject(self, request, in_info, out_info):  # noqa: N802
        """Make an output of the class of the input."""
        given, made = self.GetInputData(in_info, 0, 0), self.GetOutputData(out_info, 0)
        if made is None or not made.IsA(given.GetClassName()):
            information = out_info.GetInformationObject(0)
            information.Set(vtkDataObject.DATA_OBJECT(), given.NewInstance())
        return 1

    def RequestData(self, request, in_info, out_info):  # noqa: N802
        """Segment the input."""
        import superfacets

        given, made = self.GetInputData(in_info, 0, 0), self.GetOutputData(out_info, 0)
        made.ShallowCopy(given)
        if not given.GetNumberOfPoints():
            return 1
        mesh, chosen = _mesh_of(superfacets, given)
        n_cells = given.GetNumberOfPoints() if chosen is None else len(chosen)
        labels = superfacets.segment(
            mesh,
            min(self._n_segments, n_cells),
            # 0: what suits the cells
            weights=superfacets.Weights(eta_convex=self._follow_ridges or None),
            islands="keep" if self._keep_islands else "nearest",
        ).labels
        arrays = {self._name: (labels, -1)}
        if self._colors:
            arrays[f"{self._name}_colors"] = (superfacets.face_colors(mesh, labels), 128)
        for name, (values, nothing) in arrays.items():
            _add(made, name, values, nothing, chosen)
        return 1


def _mesh_of(superfacets, given):
    """What is segmented, and which cells of a dataset that is; None where it is the points."""
    points = vtk_to_numpy(given.GetPoints().GetData())
    kinds, starts, corners = _cells_of(given)
    if not np.isin(kinds, (*_WITHOUT_AREA, *_FACES, _TET)).all():
        raise ValueError(
            "superfacets takes triangles, polygons and tetrahedra: apply Triangulate,"
            " Tetrahedralize or Extract Surface first"
        )
    chosen = np.flatnonzero(kinds == _TET)
    if len(chosen):
        return superfacets.TetMesh(
            points, corners[starts[chosen, np.newaxis] + np.arange(4)]
        ), chosen
    chosen = np.flatnonzero(np.isin(kinds, _FACES))
    if not len(chosen):
        return superfacets.PointCloud(points), None
    sizes = np.diff(starts)[chosen]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    within = np.arange(offsets[-1]) - np.repeat(offsets[:-1], sizes)
    indices = corners[np.repeat(starts[chosen], sizes) + within]
    if (sizes == 3).all():
        return superfacets.Mesh(points, indices.reshape(-1, 3)), chosen
    return superfacets.PolygonMesh(points, offsets, indices), chosen


def _cells_of(given):
    """Kind of each cell, (N,), where its corners begin, (N + 1,), and the corners of all."""
    if not isinstance(given, vtkPolyData):
        if not given.GetNumberOfCells():
            return np.empty(0, np.int64), *_arrays_of(given.GetCells())
        # VTK 9.6 gave the array the name of what was the list of different kinds.
        is_new = hasattr(given, "GetDistinctCellTypes")
        kinds = given.GetCellTypes() if is_new else given.GetCellTypesArray()
        return vtk_to_numpy(kinds), *_arrays_of(given.GetCells())
    # The cells of a surface are in this order; -1 is a strip.
    groups = ((1, given.GetVerts()), (3, given.GetLines()), (7, given.GetPolys()))
    groups += ((-1, given.GetStrips()),)
    kinds, sizes, corners = [], [], []
    for kind, cells in groups:
        starts, members = _arrays_of(cells)
        kinds.append(np.full(len(starts) - 1, kind))
        sizes.append(np.diff(starts))
        corners.append(members)
    starts = np.concatenate([[0], np.cumsum(np.concatenate(sizes))])
    return np.concatenate(kinds), starts, np.concatenate(corners)


def _arrays_of(cells):
    """Offsets, (N + 1,), and corners of a vtkCellArray."""
    if cells is None or not cells.GetNumberOfCells():
        return np.zeros(1, np.int64), np.empty(0, np.int64)
    offsets, corners = cells.GetOffsetsArray(), cells.GetConnectivityArray()
    return vtk_to_numpy(offsets).astype(np.int64), vtk_to_numpy(corners).astype(np.int64)


def _add(made, name, values, nothing, chosen):
    """Add an array to the points, or to the cells, of which those not chosen have nothing."""
    data = made.GetPointData()
    if chosen is not None:
        data = made.GetCellData()
        whole = np.full((made.GetNumberOfCells(), *values.shape[1:]), nothing, values.dtype)
        whole[chosen] = values
        values = whole
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    data.AddArray(array)
