"""Facts about small meshes."""

import numpy as np
import pytest
import shapes

from superfacets import Mesh, PolygonMesh, SliverWarning, mesh_info, segment


def test_a_cube_is_closed_and_consistent():
    info = mesh_info(shapes.cube())
    assert (info.n_faces, info.n_vertices, info.n_positions, info.n_edges) == (12, 8, 8, 18)
    assert (info.n_components, info.n_boundary_edges, info.n_nonmanifold_edges) == (1, 0, 0)
    assert not info.is_inside_out
    assert info.area == 6
    assert info.bounds == ((0, 0, 0), (1, 1, 1))
    assert info.diagonal == pytest.approx(3**0.5)


def test_slivers_are_those_beside_150_regions():
    """The cube gets one region per face, and its faces are wider than half a region's radius."""
    assert mesh_info(shapes.cube()).sliver_share == 0
    block = shapes.drilled_block(256)
    with pytest.warns(SliverWarning):
        share = segment(block, 150).sliver_share
    assert share > 0.3
    assert mesh_info(block).sliver_share == pytest.approx(share)


def test_soup_has_more_vertices_than_positions_and_boundaries_where_not_welded():
    soup = shapes.soup(shapes.cube())
    assert (mesh_info(soup).n_vertices, mesh_info(soup).n_positions) == (36, 8)
    assert mesh_info(soup).n_boundary_edges == 0
    assert mesh_info(soup, weld=False).n_boundary_edges == 36
    assert mesh_info(soup, weld=False).n_components == 12


@pytest.mark.parametrize(("make", "field", "count"), [
    (shapes.inside_out_cube, "is_inside_out", True), (shapes.two_islands, "n_components", 2),
    (shapes.bowtie, "n_components", 2), (shapes.moebius, "n_inconsistent_edges", 1),
    (shapes.fins, "n_nonmanifold_edges", 1), (shapes.slivers, "n_degenerate_faces", 3),
    (lambda: shapes.strip(4), "n_boundary_edges", 6),
])  # fmt: skip
def test_what_is_odd_about_a_mesh_is_counted(make, field, count):
    assert getattr(mesh_info(make()), field) == count


def turned(mesh):
    """The mesh with all faces in the opposite direction."""
    if isinstance(mesh, PolygonMesh):
        return PolygonMesh.of_faces(
            mesh.vertices, [mesh.face(i)[::-1] for i in range(mesh.n_faces)]
        )
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def test_terrain_that_faces_down_is_found():
    sheet = shapes.bumpy_sheet(12)
    quad = PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1]], [[0, 1, 2, 3]])
    for mesh in (sheet, quad):
        assert (mesh_info(mesh).faces_down, mesh_info(turned(mesh)).faces_down) == (False, True)
    wall = Mesh(sheet.vertices[:, [1, 2, 0]], sheet.faces)
    plate = Mesh(shapes.inside_out_cube().vertices * [9, 9, 1], shapes.inside_out_cube().faces)
    for mesh in (wall, turned(wall), plate, turned(plate)):  # vertical, or closed
        assert not mesh_info(mesh).faces_down


def roof(slopes):
    """Return a unit square, seen from z, whose strips have these slopes along x and face down."""
    x = np.linspace(0, 1, len(slopes) + 1)
    z = np.concatenate([[0], np.cumsum(slopes) / len(slopes)])
    vertices = np.column_stack([np.repeat(x, 2), np.tile([0, 1], len(x)), np.repeat(z, 2)])
    first = 2 * np.arange(len(slopes))[:, np.newaxis]
    return Mesh(vertices, np.concatenate([first + [0, 1, 2], first + [1, 3, 2]]))


@pytest.mark.parametrize(("mean_z", "expected"), [(-0.51, True), (-0.49, False)])
def test_terrain_faces_down_if_its_mean_normal_is_less_than_60_degrees_from_down(mean_z, expected):
    """All strips of a corrugated roof are equally steep, and their normals have this z."""
    slope = np.sqrt(1 / mean_z**2 - 1)
    assert mesh_info(roof([slope, -slope] * 8)).faces_down is expected


@pytest.mark.parametrize(("height", "expected"), [(0.49, True), (0.51, False)])
def test_terrain_is_at_most_half_as_high_as_wide(height, expected):
    assert mesh_info(roof([2 * height, -2 * height])).faces_down is expected
