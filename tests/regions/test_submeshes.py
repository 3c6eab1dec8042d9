"""Regions as meshes: their contents, and the way back to the whole mesh."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import MeshError, TetMesh, region_graph, split_regions, submesh

TETS = shapes.two_tets()


def test_a_part_of_a_strip():
    part = submesh(shapes.strip(6), [0, 0, 1, 1, -1, 0], 0)
    assert part.cells.tolist() == [0, 1, 5]
    assert part.vertices.tolist() == [0, 1, 2, 3, 5, 6, 7]
    assert part.mesh.faces.tolist() == [[0, 2, 1], [1, 2, 3], [4, 5, 6]]
    assert np.array_equal(part.mesh.vertices, shapes.strip(6).vertices[part.vertices])


def test_parts_of_polygons_keep_their_corners():
    house = shapes.house()
    roof = submesh(house, [0, 1], 1)
    assert (roof.mesh.indices.tolist(), roof.mesh.offsets.tolist()) == ([1, 0, 2], [0, 3])
    assert roof.vertices.tolist() == [2, 3, 4]
    assert submesh(house, [0, 1], 0).mesh.indices.tolist() == [0, 1, 2, 3]


def test_parts_of_tetrahedra():
    part = submesh(TETS, [1, 0], 0)
    assert isinstance(part.mesh, TetMesh)
    assert part.mesh.tets.tolist() == [[0, 1, 2, 3]]
    assert (part.cells.tolist(), part.vertices.tolist()) == ([1], [1, 2, 3, 4])


def test_parts_of_clouds_keep_normals_and_colors():
    points = np.random.default_rng(0).uniform(size=(9, 3))
    cloud = sf.PointCloud(points, points - 0.5, points)
    part = submesh(cloud, [0, 1, 2] * 3, 1)
    assert part.cells.tolist() == part.vertices.tolist() == [1, 4, 7]
    assert np.array_equal(part.mesh.points, points[1::3])
    assert part.mesh.normals == pytest.approx(cloud.normals[1::3])
    assert np.array_equal(part.mesh.colors, cloud.colors[1::3])
    assert submesh(sf.PointCloud(points), [0, 1, 2] * 3, 1).mesh.normals is None


@pytest.mark.parametrize("mesh", [shapes.bumpy_sheet(12), shapes.soup(shapes.bumpy_sheet(6))])
def test_all_parts_together_are_the_mesh(mesh):
    labels = sf.segment(mesh, 8).labels
    parts = list(split_regions(mesh, labels))
    assert len(parts) == 8
    assert sorted(np.concatenate([p.cells for p in parts]).tolist()) == list(range(mesh.n_faces))
    areas = region_graph(mesh, labels).areas
    for region, part in enumerate(parts):
        assert (labels[part.cells] == region).all()
        assert np.array_equal(part.vertices[part.mesh.faces], mesh.faces[part.cells])
        alone = submesh(mesh, labels, region)
        assert np.array_equal(alone.mesh.faces, part.mesh.faces)
        assert np.array_equal(alone.vertices, part.vertices)
        assert sf.build_face_graph(part.mesh).measures.sum() == pytest.approx(areas[region])


def test_cells_in_no_region_are_in_no_part():
    parts = list(split_regions(shapes.strip(4), [-1, 1, 0, -1]))
    assert [part.cells.tolist() for part in parts] == [[2], [1]]
    assert repr(parts[0]) == "Submesh(Mesh(3 vertices, 1 face), .cells, .vertices)"
    edited = sf.merge_small_regions(shapes.strip(4), [0, 0, 1, 1], 0)
    assert repr(edited) == "RegionEdit(2 regions, 0 joined, 0 islands, .labels, .sources)"
    assert repr(sf.ArcMeasures(np.ones(2), angles=[])) == "ArcMeasures(.border_lengths, .angles)"


@pytest.mark.parametrize("region", [-1, 2])
def test_a_region_that_is_not_there_is_refused(region):
    with pytest.raises(ValueError, match=f"region must be 0 to 1, got {region}"):
        submesh(shapes.strip(4), [0, 0, 1, 1], region)
    for wrong in (0.5, [0, 1], np.array([0, 1])):
        with pytest.raises(TypeError, match="one integer; for several regions, join labels: np"):
            submesh(shapes.strip(4), [0, 0, 1, 1], wrong)


def test_a_region_of_one_point_is_a_cloud():
    part = submesh(np.eye(3), [0, 0, 1], 1)
    assert (part.mesh.points.tolist(), part.cells.tolist()) == ([[0, 0, 1]], [2])
    assert [part.mesh.n_points for part in split_regions(np.eye(3), [0, 0, 1])] == [2, 1]


def test_a_region_whose_faces_lie_at_one_point_is_no_mesh():
    mesh = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [1, 1, 1]])
    with pytest.raises(MeshError, match="region 1: all faces lie at one point"):
        submesh(mesh, [0, 1], 1)
    parts = split_regions(mesh, [0, 1])
    assert next(parts).cells.tolist() == [0]
    with pytest.raises(MeshError, match="region 1: all faces lie at one point"):
        next(parts)


def test_wrong_labels_are_refused_at_once():
    with pytest.raises(ValueError, match="no cell has label 0"):
        split_regions(shapes.strip(4), [1, 1, 1, 1])
