"""Borders as lines: exact lines of small meshes, and sums that agree with the region graph."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, MeshError, PolygonMesh, border_lines, find_boundaries, region_graph


def chains(lines):
    """Return {regions: (vertices, is closed)}, and check that each pair of regions has one line."""
    pairs = [tuple(pair) for pair in lines.regions.tolist()]
    assert len(set(pairs)) == len(pairs)
    return {p: (lines.line(i).tolist(), bool(lines.is_closed[i])) for i, p in enumerate(pairs)}


def test_the_lines_of_a_strip():
    # 1---3---5---7
    # |0/1|2/3|4/5|
    # 0---2---4---6
    lines = border_lines(shapes.strip(6), [0, 0, 0, 1, 1, 1])
    assert chains(lines) == {
        (0, 1): ([4, 3], False), (0, -1): ([3, 1, 0, 2, 4], False),
        (1, -1): ([4, 6, 7, 5, 3], False),
    }  # fmt: skip
    assert lines.junctions.tolist() == [3, 4]
    assert lines.lengths == pytest.approx([4, np.sqrt(2), 4])
    assert repr(lines) == "BorderLines(3 lines, 2 junctions)"


def test_the_boundary_of_one_region_is_a_closed_line():
    lines = border_lines(shapes.strip(2), [0, 0])
    assert chains(lines) == {(0, -1): ([1, 0, 2, 3], True)}
    assert (lines.junctions.tolist(), lines.lengths.tolist()) == ([], [4])


@pytest.mark.parametrize("cube", [shapes.cube(), shapes.quad_cube(), shapes.soup(shapes.cube())])
def test_the_sides_of_a_cube_meet_in_twelve_lines(cube):
    labels = np.arange(cube.n_faces) * 6 // cube.n_faces
    lines = border_lines(cube, labels)
    assert (len(lines), len(lines.junctions)) == (12, 8)
    assert lines.lengths.tolist() == [1] * 12
    assert len(lines.junctions) - len(lines) + 6 == 2  # Euler's formula
    lid = border_lines(cube, np.where(labels == 1, 1, 0))
    assert (len(lid), lid.is_closed.tolist(), lid.regions.tolist()) == (1, [True], [[0, 1]])
    assert lid.paths[0].tolist() == [*lid.line(0), lid.line(0)[0]]
    assert lid.lengths.tolist() == [4]
    positions = cube.vertices[lid.line(0)]
    assert positions[:, 2].tolist() == [1] * 4
    assert (np.abs(np.diff(positions, axis=0)).sum(axis=1) == 1).all()


def test_a_mesh_without_borders_has_no_lines():
    lines = border_lines(shapes.cube(), [0] * 12)
    assert (len(lines), lines.offsets.tolist(), lines.regions.shape) == (0, [0], (0, 2))
    assert lines.vertices.size == lines.junctions.size == 0


def test_three_regions_on_one_edge_make_a_line_for_each_pair():
    lines = border_lines(shapes.fins(3), [0, 1, 2])
    assert {pair: sorted(line) for pair, (line, _) in chains(lines).items()} == {
        (0, 1): [0, 1], (0, 2): [0, 1], (1, 2): [0, 1],
        (0, -1): [0, 1, 2], (1, -1): [0, 1, 3], (2, -1): [0, 1, 4],
    }  # fmt: skip
    assert lines.junctions.tolist() == [0, 1]


def test_boxes_that_touch_have_one_line_around():
    near = shapes.quad_cube()
    corners = np.concatenate([near.vertices, near.vertices + [1, 0, 0]])
    faces = near.indices.reshape(-1, 4)
    boxes = PolygonMesh.of_faces(corners, np.concatenate([faces, faces + 8]))
    lines = border_lines(boxes, np.repeat([0, 1], 6))
    assert (len(lines), lines.is_closed.tolist(), lines.lengths.tolist()) == (1, [True], [4])
    assert len(border_lines(boxes, np.repeat([0, 1], 6), weld=False)) == 0


def test_cells_in_no_region_are_outside():
    lines = border_lines(shapes.strip(6), [0, 0, -1, -1, 1, 1])
    assert chains(lines) == {(0, -1): ([1, 0, 2, 3], True), (1, -1): ([5, 4, 6, 7], True)}


def test_regions_that_touch_at_a_vertex_have_a_junction_there():
    # In a checkerboard, four edges of one pair of regions meet in the middle.
    points = [[x, y, 0] for y in range(3) for x in range(3)]
    squares = [[v, v + 1, v + 4, v + 3] for v in (0, 1, 3, 4)]
    lines = border_lines(PolygonMesh.of_faces(points, squares), [0, 1, 1, 0])
    assert lines.junctions.tolist() == [1, 3, 4, 5, 7]
    assert (lines.regions[:, 1] == 1).sum() == 4
    assert sorted(lines.lengths.tolist()) == [1] * 4 + [2] * 4


@pytest.mark.parametrize("n_regions", [2, 7, 40])
def test_lines_add_up_to_the_borders_of_the_region_graph(n_regions):
    mesh = shapes.bumpy_sheet(20)
    labels = np.random.default_rng(n_regions).permutation(np.arange(mesh.n_faces) % n_regions)
    lines, graph = border_lines(mesh, labels), region_graph(mesh, labels)
    table = np.zeros((n_regions, n_regions + 1))
    np.add.at(table, tuple(lines.regions.T), lines.lengths)
    assert table[*graph.edge_index] == pytest.approx(graph.border_lengths)
    assert table[:, -1] == pytest.approx(graph.open_lengths)
    assert table.sum() == pytest.approx(graph.border_lengths.sum() + graph.open_lengths.sum())


def test_the_first_region_lies_to_the_left():
    mesh = shapes.bumpy_sheet(20)
    labels = sf.segment(mesh, 12).labels
    lines = border_lines(mesh, labels)
    sides = {
        (a, b): face
        for face, ring in enumerate(mesh.faces.tolist())
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True)
    }
    for i, (first, _) in enumerate(lines.regions.tolist()):
        line = lines.line(i).tolist()
        around = line[1:] + line[:1] if lines.is_closed[i] else line[1:]
        steps = list(zip(line, around, strict=False))
        assert steps
        assert all(labels[sides[step]] == first for step in steps)


def test_lines_end_where_they_meet_on_a_closed_surface():
    mesh = sf.sample_mesh(5_000)
    labels = sf.segment(mesh, 40).labels
    lines = border_lines(mesh, labels)
    ends = np.concatenate([[lines.line(i)[0], lines.line(i)[-1]] for i in range(len(lines))
                           if not lines.is_closed[i]])  # fmt: skip
    assert np.array_equal(np.unique(ends), lines.junctions)
    assert (np.bincount(ends)[lines.junctions] >= 3).all()
    inner = [v for i in range(len(lines)) for v in lines.line(i)[1:-1].tolist()]
    assert not set(inner) & set(lines.junctions.tolist())
    assert len(set(inner)) == len(inner)


def test_inconsistent_faces_break_no_line():
    mesh = shapes.moebius()
    lines = border_lines(mesh, [0] * mesh.n_faces)
    assert (len(lines), lines.is_closed.tolist()) == (1, [True])  # a Moebius band has one boundary
    assert len(lines.line(0)) == mesh.n_vertices
    mesh = shapes.strip(6)
    turned = mesh.faces.copy()
    turned[2] = turned[2][::-1]
    labels = [0, 0, 0, 1, 1, 1]
    lines = border_lines(Mesh(mesh.vertices, turned), labels)
    assert sorted(map(len, np.split(lines.vertices, lines.offsets[1:-1]))) == [2, 5, 5]


def test_there_are_no_other_lines():
    lines = border_lines(shapes.strip(2), [0, 0])
    for i in (-1, 1):
        with pytest.raises(IndexError, match=f"there is no line {i}: the number of lines is 1"):
            lines.line(i)
    with pytest.raises(
        MeshError, match=r"expected a surface mesh, got a TetMesh: use TetMesh\.boundary\(\)"
    ):
        border_lines(sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]]), [0])


def test_cells_beside_a_border():
    strip = shapes.strip(6)
    assert find_boundaries(strip, [0, 0, 0, 1, 1, 1]).tolist() == [False, False, True] + [
        True, False, False,
    ]  # fmt: skip
    assert find_boundaries(strip, [0, 0, -1, -1, -1, -1]).tolist() == [False, True, True] + 3 * [
        False
    ]
    assert not find_boundaries(strip, [0] * 6).any()
    line = shapes.line_graph([1, 1, 1])
    assert find_boundaries(line, [0, 0, 1, 1]).tolist() == [False, True, True, False]
    points = [[x, 0, 0] for x in range(6)]
    assert find_boundaries(points_of(points), [0, 0, 0, 0, 0, 1]).any()


def points_of(rows):
    return np.array(rows, dtype=float)
