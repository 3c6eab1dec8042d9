"""The accessor of PyVista datasets, found through the entry point of the installed package."""

from importlib.metadata import entry_points

import numpy as np
import pytest
import shapes

import superfacets as sf

pyvista = pytest.importorskip("pyvista", reason="PyVista is not installed")

SHEET = shapes.bumpy_sheet(8)


def sheet():
    return pyvista.PolyData.from_regular_faces(SHEET.vertices, SHEET.faces)


def test_pyvista_finds_the_accessor_by_its_entry_point():
    values = {entry.value for entry in entry_points(group="pyvista.accessors")}
    assert "superfacets.mesh.pyvista_accessor" in values
    assert "superfacets" in dir(sheet())


def test_segment_writes_labels_and_returns_the_result():
    surface, expected = sheet(), sf.segment(SHEET, 5, weights=sf.Weights(eta_convex=0.2))
    result = surface.superfacets.segment(5, weights=sf.Weights(eta_convex=0.2))
    assert np.array_equal(result.labels, expected.labels)
    assert np.array_equal(surface.cell_data["superfacets"], expected.labels)
    assert "superfacets_colors" not in surface.cell_data
    surface.superfacets.segment(3, name="coarse", colors=True)
    assert surface.cell_data["coarse"].max() == 2
    assert surface.cell_data["coarse_colors"].shape == (SHEET.n_faces, 3)


def test_points_and_tetrahedra_are_segmented_too():
    cloud = pyvista.PolyData(SHEET.vertices)
    cloud.superfacets.segment(4)
    assert cloud.point_data["superfacets"].max() == 3
    corner = np.vstack([np.zeros(3), np.eye(3), np.ones(3)])
    tets = pyvista.UnstructuredGrid({10: np.array([[0, 1, 2, 3], [1, 2, 3, 4]])}, corner)
    assert tets.superfacets.segment(2).n_segments == 2
    with pytest.raises(TypeError, match="extract_surface"):
        pyvista.ImageData(dimensions=(3, 3, 3)).superfacets.segment(2)


def test_borders_are_the_edges_between_regions():
    corners = [[x, y, 0] for y in range(2) for x in range(4)]
    row = pyvista.PolyData(
        np.array(corners, float),
        lines=[2, 0, 4],
        faces=[4, 0, 1, 5, 4, 4, 1, 2, 6, 5, 4, 2, 3, 7, 6],
    )
    row.superfacets.attach([0, 0, 1], name="half")
    borders = row.superfacets.borders("half")
    assert borders.n_cells == 1
    assert sorted(borders.points.tolist()) == [[2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]
    row.superfacets.attach([3, 3, 3], name="half")
    assert row.superfacets.borders("half").n_cells == 0
    with pytest.raises(KeyError, match="superfacets"):
        row.superfacets.borders()
