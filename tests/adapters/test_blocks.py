"""Meshes of meshio, which store the cells of each type in a separate block."""

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
import shapes

from superfacets import Mesh, MeshError, PointCloud, PolygonMesh, TetMesh, segment
from superfacets.mesh.convert import as_cells

meshio = pytest.importorskip("meshio", reason="meshio is not installed")

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 1]], float)


def test_blocks_of_triangles_are_a_mesh_in_their_order():
    bumpy = shapes.bumpy_sheet(8)
    blocks = [("triangle", bumpy.faces[:50]), ("line", [[0, 1]]), ("triangle", bumpy.faces[50:])]
    cells = as_cells(meshio.Mesh(bumpy.vertices, blocks))
    assert isinstance(cells, Mesh)
    assert np.array_equal(cells.faces, bumpy.faces)
    ours = segment(bumpy, 6).labels
    assert np.array_equal(segment(meshio.Mesh(bumpy.vertices, blocks), 6).labels, ours)


def test_faces_of_all_types_keep_their_corners():
    blocks = [
        ("quad", [[0, 1, 2, 3]]),
        ("triangle6", [[1, 4, 2, 0, 3, 5]]),  # three corners, then three nodes on the edges
        ("polygon", [[0, 1, 4, 5, 3]]),
    ]
    cells = as_cells(meshio.Mesh(CORNERS, blocks))
    assert isinstance(cells, PolygonMesh)
    faces = [cells.face(i).tolist() for i in range(cells.n_faces)]
    assert faces == [[0, 1, 2, 3], [1, 4, 2], [0, 1, 4, 5, 3]]


def test_blocks_of_polygons_may_be_lists_of_faces_that_differ():
    quads, others = [[0, 1, 2, 3]], [[1, 4, 2], [0, 1, 4, 5, 3]]
    blocks = [
        SimpleNamespace(type="quad", data=np.array(quads, np.int32)),
        SimpleNamespace(type="polygon", data=others),
    ]
    cells = as_cells(SimpleNamespace(points=CORNERS, cells=blocks))
    assert [cells.face(i).tolist() for i in range(3)] == quads + others


def test_quads_are_not_made_objects_one_by_one():
    n = 20_000
    quads = np.tile(np.array([[0, 1, 2, 3]], np.int32), (n, 1))
    mesh = meshio.Mesh(CORNERS, [("quad", quads), ("triangle", quads[:, :3])])
    tracemalloc.start()
    try:
        cells = as_cells(mesh)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert cells.n_faces == 2 * n
    assert peak < 100 * 2 * n  # bytes; a separate array for each face would need more


def test_tetrahedra_come_before_the_faces_on_their_outside():
    blocks = [("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 5], [1, 4, 2, 5]])]
    cells = as_cells(meshio.Mesh(CORNERS, blocks))
    assert isinstance(cells, TetMesh)
    assert cells.tets.tolist() == [[0, 1, 2, 5], [1, 4, 2, 5]]


@pytest.mark.parametrize("blocks", [[], [("vertex", [[0], [1]])], [("line", [[0, 1]])]])
def test_points_without_faces_are_a_cloud(blocks):
    cells = as_cells(meshio.Mesh(CORNERS, blocks))
    assert isinstance(cells, PointCloud)
    assert np.array_equal(cells.points, CORNERS)


def test_cells_of_other_types_are_refused():
    grid = meshio.Mesh(np.vstack([CORNERS, CORNERS + [0, 0, 3]]), [("hexahedron", [range(8)])])
    with pytest.raises(MeshError, match="cells must be faces or tetrahedra, got hexahedron"):
        as_cells(grid)
