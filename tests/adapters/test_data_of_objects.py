"""Data arrays and colors of meshes of other libraries are features."""

import numpy as np
import pytest

import superfacets as sf


def test_data_and_colors_of_pyvista_are_features():
    mesh = pytest.importorskip("pyvista").Sphere(theta_resolution=40, phi_resolution=40)
    mesh["a height"] = mesh.points[:, 2]
    mesh.cell_data["RGB"] = np.repeat([[255, 0, 0], [0, 0, 255]], mesh.n_cells // 2, axis=0)
    mesh.cell_data["RGB"] = mesh.cell_data["RGB"].astype(np.uint8)
    assert sf.segment(mesh, 20, features=["a height", "color"]).n_segments == 20
    shades = sf.segment(mesh, 2, features=sf.Features("color", weight=100.0)).labels
    assert np.array_equal(shades == shades[0], np.arange(mesh.n_cells) < mesh.n_cells // 2)
    with pytest.raises(sf.MeshError, match=r"it has color, normals, height.* a height"):
        sf.segment(mesh, 20, features="press")


def test_data_and_colors_of_trimesh_are_features():
    mesh = pytest.importorskip("trimesh").creation.icosphere(3)
    mesh.visual.vertex_colors = np.tile(np.uint8([200, 9, 9, 255]), (len(mesh.vertices), 1))
    mesh.visual.vertex_colors[: len(mesh.vertices) // 2] = 0
    mesh.vertex_attributes["heat"] = mesh.vertices[:, 2]
    assert sf.segment(mesh, 20, features=["heat", "color"]).n_segments == 20
