"""The ParaView plugin as a VTK filter, with a record of the calls of ParaView's decorators."""

import importlib.util
import sys
import types
from pathlib import Path

import numpy as np
import pytest
import shapes

import superfacets as sf

pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")

PLUGIN = Path(__file__).resolve().parents[2] / "integrations/paraview/superfacets_plugin.py"
SHEET = shapes.bumpy_sheet(8)
TETS = (np.vstack([np.zeros(3), np.eye(3), np.ones(3)]), np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))


class _Decorators:
    """Record all calls of ParaView's decorators, and return the decorated objects unchanged."""

    def __init__(self, told):
        self._told = told

    def __getattr__(self, kind):
        def _decorator(*args, **kwargs):
            self._told.append((kind, *args, kwargs))
            return lambda decorated: decorated

        return _decorator


@pytest.fixture(scope="module")
def plugin():
    """Return the module; its attribute `told` contains the recorded calls."""
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase

    told = []
    names = ("smdomain", "smhint", "smproperty", "smproxy")
    fake = types.ModuleType("paraview.util.vtkAlgorithm")
    vars(fake).update({name: _Decorators(told) for name in names})
    fake.VTKPythonAlgorithmBase = VTKPythonAlgorithmBase
    modules = {"paraview": types.ModuleType("paraview"), fake.__name__: fake}
    modules["paraview.util"] = types.ModuleType("paraview.util")
    with pytest.MonkeyPatch.context() as patch:
        for name, module in modules.items():
            patch.setitem(sys.modules, name, module)
        spec = importlib.util.spec_from_file_location("superfacets_plugin", PLUGIN)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    module.told = told
    return module


def run(plugin, dataset, **properties):
    """Return the output of the filter as a PyVista dataset."""
    plugged = plugin.Superfacets()
    plugged.SetInputDataObject(0, dataset)
    for name, value in properties.items():
        getattr(plugged, f"Set{name}")(value)
    plugged.Update()
    return pyvista.wrap(plugged.GetOutputDataObject(0))


def sheet():
    return pyvista.PolyData.from_regular_faces(SHEET.vertices, SHEET.faces)


def test_paraview_is_told_of_the_filter_and_of_each_property(plugin):
    assert "filter" in [entry[0] for entry in plugin.told]
    told = {entry[-1]["name"] for entry in plugin.told if "name" in entry[-1]}
    setters = {name[3:] for name in vars(plugin.Superfacets) if name.startswith("Set")}
    assert told - {"Superfacets", "Input"} == setters
    types_taken = [entry[-1]["dataTypes"] for entry in plugin.told if entry[0] == "datatype"]
    assert types_taken == [["vtkPolyData", "vtkUnstructuredGrid"]]


def test_a_surface_gets_the_labels_of_segment(plugin):
    surface = sheet()
    surface.cell_data["old"] = np.arange(SHEET.n_faces)
    made = run(plugin, surface, Regions=5, FollowRidges=0.2, ArrayName="Label")
    expected = sf.segment(SHEET, 5, weights=sf.Weights(eta_convex=0.2)).labels
    assert isinstance(made, pyvista.PolyData)
    assert np.array_equal(made.cell_data["Label"], expected)
    assert np.array_equal(made.cell_data["Label_colors"], sf.face_colors(SHEET, expected))
    assert np.array_equal(made.cell_data["old"], surface.cell_data["old"])
    assert "Label" not in surface.cell_data


def test_a_changed_property_runs_the_filter_again(plugin):
    plugged = plugin.Superfacets()
    plugged.SetInputDataObject(0, sheet())
    plugged.SetColors(0)
    for n_segments in (4, 7):
        plugged.SetRegions(n_segments)
        plugged.Update()
        made = pyvista.wrap(plugged.GetOutputDataObject(0))
        assert made.cell_data["superfacets"].max() == n_segments - 1
    assert "superfacets_colors" not in made.cell_data
    before = plugged.GetMTime()
    plugged.SetRegions(7)
    assert plugged.GetMTime() == before


def test_islands_keep_their_regions_or_join(plugin):
    islands = shapes.two_islands()
    surface = pyvista.PolyData.from_regular_faces(islands.vertices, islands.faces)
    assert run(plugin, surface, Regions=2).cell_data["superfacets"].max() == 1
    kept = run(plugin, surface, Regions=1, KeepIslands=0)
    assert set(kept.cell_data["superfacets"]) == {0}


def test_lines_and_vertices_of_a_surface_have_no_label(plugin):
    corners = np.array([[x, y, 0] for y in range(2) for x in range(3)], float)
    surface = pyvista.PolyData(
        corners, verts=[1, 5], lines=[2, 0, 5], faces=[4, 0, 1, 4, 3, 3, 1, 2, 5]
    )
    made = run(plugin, surface, Regions=2)
    assert made.cell_data["superfacets"][:2].tolist() == [-1, -1]
    assert sorted(made.cell_data["superfacets"][2:].tolist()) == [0, 1]
    assert made.cell_data["superfacets_colors"][0].tolist() == [128] * 3


def test_points_get_labels_of_points(plugin):
    made = run(plugin, pyvista.PolyData(SHEET.vertices), Regions=4)
    expected = sf.segment(sf.PointCloud(SHEET.vertices), 4).labels
    assert np.array_equal(made.point_data["superfacets"], expected)


def test_tetrahedra_come_before_faces(plugin):
    points, tets = TETS
    grid = pyvista.UnstructuredGrid({5: np.array([[0, 1, 2]]), 10: tets}, points)
    made = run(plugin, grid, Regions=2)
    assert isinstance(made, pyvista.UnstructuredGrid)
    kinds, labels = made.celltypes, made.cell_data["superfacets"]
    assert labels[kinds == 5].tolist() == [-1]
    assert sorted(labels[kinds == 10].tolist()) == [0, 1]


def test_faces_of_a_grid_are_a_surface(plugin):
    grid = pyvista.UnstructuredGrid({5: SHEET.faces}, SHEET.vertices)
    made = run(plugin, grid, Regions=5)
    assert np.array_equal(made.cell_data["superfacets"], sf.segment(SHEET, 5).labels)


def test_there_are_no_more_regions_than_cells(plugin):
    assert run(plugin, sheet(), Regions=5000).cell_data["superfacets"].max() == 127


def test_an_empty_dataset_goes_through(plugin):
    assert run(plugin, pyvista.PolyData()).n_points == 0


@pytest.mark.parametrize("dataset", ["hexahedra", "strips"])
def test_other_cells_are_refused(plugin, dataset):
    given = {
        "hexahedra": lambda: pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid(),
        "strips": lambda: sheet().strip(),
    }[dataset]()
    with pytest.raises(ValueError, match="apply Triangulate"):
        plugin._mesh_of(sf, given)
