"""Tetrahedra in all stages: small cases by hand, degenerate meshes, and thousands of cells."""

import copy
import math
import pickle

import numpy as np
import pytest
import reference
import shapes
from shapes import AROUND, column

import superfacets as sf
from superfacets import CellGraph, MeshError, TetMesh, metrics
from superfacets_formats import build_tet_graph

TIP = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])


def ball(n=3_000, seed=0):
    """Return tetrahedra between random points in a ball."""
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(seed).normal(size=(n, 3))
    points *= np.random.default_rng(seed).uniform(size=(n, 1)) ** (1 / 3) / np.linalg.norm(
        points, axis=1, keepdims=True
    )
    return TetMesh(points, spatial.Delaunay(points).simplices)


def test_a_cube_of_six_tetrahedra_by_hand():
    cube = column(1)
    graph = build_tet_graph(cube)
    assert graph.measures == pytest.approx(np.full(6, 1 / 6))
    assert graph.triangle_counts == (18, 12, 0)
    around = [sorted(graph.neighbors[graph.offsets[i] : graph.offsets[i + 1]]) for i in range(6)]
    assert around == [sorted([(i - 1) % 6, (i + 1) % 6]) for i in range(6)]
    # Common faces have as sides an edge, the diagonal of a square, and the diagonal of the cube.
    given = graph.arc_measures
    assert given.border_lengths == pytest.approx(np.full(12, math.sqrt(2) / 2))
    assert given.open_lengths == pytest.approx(np.ones(6))
    steps = np.zeros(12)
    for arc, (cell, other) in enumerate(zip(np.repeat(range(6), 2), graph.neighbors, strict=True)):
        shared = np.intersect1d(cube.tets[cell], cube.tets[other])
        middle = cube.vertices[shared].mean(axis=0)
        steps[arc] = sum(np.linalg.norm(graph.positions[c] - middle) for c in (cell, other))
    assert given.step_lengths == pytest.approx(steps)
    assert metrics.compactness(cube, [0] * 6) == pytest.approx(6.0)
    info = sf.mesh_info(cube)
    assert (info.n_tets, info.n_components, info.n_flat_tets, info.volume) == (
        6, 1, 0, pytest.approx(1.0),
    )  # fmt: skip
    assert info.n_turned_tets in (0, 6)


def test_a_column_falls_into_two_halves():
    result = sf.segment(column(8), 2)
    cubes = result.labels.reshape(8, 6)
    lower, upper = cubes[:3].ravel(), cubes[5:].ravel()
    assert len(set(lower.tolist())) == len(set(upper.tolist())) == 1
    assert lower[0] != upper[0]
    assert result.params["radius"] == pytest.approx((3 * 4 / (4 * math.pi)) ** (1 / 3))
    diagonal = math.sqrt(8**2 + 2)
    by_radius = sf.segment(column(8), radius=0.12 * diagonal)
    assert by_radius.params["radius"] == 0.12 * diagonal
    assert by_radius.n_segments == round(8 / (4 / 3 * math.pi * (0.12 * diagonal) ** 3)) == 2


def test_the_clean_up_works_in_areas_and_volumes():
    tower = column(4)
    whole = np.repeat([0, 1, 2, 3], 6)
    # A piece of one tetrahedron in the second cube joins the region around it.
    pieces = whole.copy()
    pieces[8] = 3
    edit = sf.enforce_connectivity(tower, pieces)
    assert edit.labels.tolist() == whole.tolist()
    assert edit.n_joined == 1
    # A region of two tetrahedra has a third of the mean volume.
    small = whole.copy()
    small[18:22] = 2
    merged = sf.merge_small_regions(tower, small, 0.5)
    assert merged.labels.tolist() == [0] * 6 + [1] * 6 + [2] * 12
    assert sf.merge_small_regions(tower, small, 0.2).n_joined == 0
    smoothed = sf.smooth_borders(tower, pieces)
    assert set(smoothed.tolist()) <= {0, 1, 2, 3}
    assert len(smoothed) == 24


def test_regions_of_a_ball_are_connected_and_compact():
    body = ball()
    result = sf.segment(body, 40)
    found = metrics.evaluate(body, result.labels, [result.labels, np.zeros(body.n_tets, int)])
    assert (found["n_regions"], found["n_extra_pieces"]) == (40, 0)
    assert 5 < found["compactness"] < 9
    assert found["undersegmentation_error"] == 0.0
    assert metrics.compactness(body, sf.segment(body, 40, smooth=False)) > found["compactness"]
    for n_threads in (1, 3):
        assert np.array_equal(sf.segment(body, 40, n_threads=n_threads).labels, result.labels)
    volumes = np.bincount(result.labels, weights=build_tet_graph(body).measures)
    assert volumes.max() < 5 * volumes.mean()


def test_a_body_from_the_hull_of_a_mesh():
    spatial = pytest.importorskip("scipy.spatial")
    bear = sf.sample_mesh(5_000).vertices
    hull = spatial.ConvexHull(bear)
    body = TetMesh(bear, spatial.Delaunay(bear).simplices)
    graph = build_tet_graph(body)
    assert graph.measures.sum() == pytest.approx(hull.volume)
    outside, sources = body.boundary()
    assert sf.mesh_info(outside).area == pytest.approx(hull.area)
    assert not sf.mesh_info(outside).is_inside_out
    assert graph.arc_measures.open_lengths.sum() == pytest.approx(hull.area)
    labels = sf.segment(body, 30).labels
    assert 10 < len(np.unique(labels[sources])) <= 30  # others lie inside
    assert metrics.evaluate(body, labels)["n_extra_pieces"] == 0


@pytest.mark.parametrize("turned", [[0], [1, 4], range(6)])
def test_tetrahedra_may_be_inside_out(turned):
    cube = column(3)
    tets = cube.tets.copy()
    tets[list(turned)] = tets[list(turned)][:, [1, 0, 2, 3]]
    other = TetMesh(cube.vertices, tets)
    assert np.array_equal(sf.segment(other, 3).labels, sf.segment(cube, 3).labels)
    assert sf.mesh_info(other).volume == pytest.approx(3.0)
    assert not sf.mesh_info(other.boundary().mesh).is_inside_out
    assert sf.mesh_info(other.boundary().mesh).n_inconsistent_edges == 0


def test_flat_tetrahedra_are_cells_without_a_volume():
    flat = TetMesh([*column(1).vertices, [0.5, 0.5, 0]], [*AROUND, [0, 1, 3, 8], [0, 1, 1, 3]])
    assert build_tet_graph(flat).measures[6:].tolist() == [0.0, 0.0]
    assert sf.mesh_info(flat).n_flat_tets == 2
    result = sf.segment(flat, 2, islands="nearest")
    assert (len(result.labels), result.n_segments) == (8, 2)
    with pytest.raises(
        ValueError, match="the total area must be positive, but all cells have area 0"
    ):
        metrics.compactness(TetMesh(flat.vertices, [[0, 1, 3, 8]]), [0])


def test_tetrahedra_given_twice_are_neighbors_over_all_triangles():
    twice = TetMesh(TIP.vertices, [[0, 1, 2, 3], [3, 1, 0, 2]])
    graph = build_tet_graph(twice)
    assert graph.neighbors.tolist() == [1] * 4 + [0] * 4
    assert graph.triangle_counts == (4, 0, 0)
    assert sf.segment(twice, 1).labels.tolist() == [0, 0]
    with pytest.raises(MeshError, match="no boundary, because every triangle belongs to two or"):
        twice.boundary()
    with pytest.raises(MeshError, match="no boundary, because no tetrahedron is kept"):
        twice.boundary([False, False])
    thrice = TetMesh(TIP.vertices, [[0, 1, 2, 3]] * 3)
    assert build_tet_graph(thrice).triangle_counts == (4, 0, 4)


def test_too_many_on_one_triangle_are_refused():
    with pytest.raises(MeshError, match="one edge is shared by 64 faces"):
        build_tet_graph(TetMesh(*shapes.crowded_sides(3)))


def test_seams_are_welded_unless_told_not_to():
    tower = column(2)
    apart = TetMesh(
        np.concatenate([tower.vertices[:8], tower.vertices[4:]]),
        np.concatenate([tower.tets[:6], tower.tets[6:] + 4]),
    )
    assert build_tet_graph(apart).n_arcs == build_tet_graph(tower).n_arcs
    assert build_tet_graph(apart, weld=False).n_arcs == build_tet_graph(tower).n_arcs - 4
    assert sf.segment(apart, 1).n_segments == 1
    with pytest.warns(sf.IslandWarning):
        assert sf.segment(sf.prepare(apart, weld=False), 1).n_segments == 2


def test_the_outside_of_some():
    tower = column(3)
    upper, sources = tower.boundary(np.repeat([False, True, True], 6))
    assert sf.mesh_info(upper).area == pytest.approx(10.0)
    assert sources.min() == 6
    with pytest.raises(ValueError, match=r"keep must have shape \(18,\), got \(3,\)"):
        tower.boundary([True] * 3)
    with pytest.raises(TypeError, match="keep must be an array of bool, such as labels"):
        tower.boundary(np.ones(18, np.int64))


@pytest.mark.parametrize(("tets", "message"), [
    ([], "the mesh has no tetrahedra"),
    ([[0, 1, 2]], r"tets must have shape \(N, 4\), got \(1, 3\)"),
    ([[0.0, 1, 2, 3]], "tets must contain integers, got float64"),
    ([[0, 1, 2, 3], [0, 1, 2, 4]], r"tets\[1\] refers to vertex 4 but the mesh has 4 vertices"),
    ([[0, 1, 2, -1]], r"tets\[0\] refers to vertex -1"),
    ([[0, 0, 0, 0]], "all faces lie at one point"),
    ([["a", 1, 2, 3]], "tets must contain numbers, got <U21"),
])  # fmt: skip
def test_invalid_arrays_are_refused(tets, message):
    with pytest.raises(MeshError, match=message):
        TetMesh(TIP.vertices, tets)


def test_what_is_for_faces_says_so():
    with pytest.raises(
        MeshError, match=r"expected a surface mesh, got a TetMesh: use TetMesh\.boundary\(\)"
    ):
        sf.build_face_graph(TIP)
    with pytest.raises(MeshError, match="expected a tetrahedral mesh, got a Mesh"):
        build_tet_graph(shapes.cube())
    note = r"the weights 'superfacets' need angles between faces: call superfacets\.segment without"
    with pytest.raises(ValueError, match=note + " weights for tetrahedra"):
        sf.segment(TIP, weights="superfacets")
    with pytest.raises(ValueError, match=note):
        sf.paper.segment(TIP)
    with pytest.raises(
        ValueError, match="n_segments must be at most 1, the number of tetrahedra, got 2"
    ):
        sf.segment(TIP, 2)
    with pytest.raises(ValueError, match="the ground truths were prepared for another mesh"):
        metrics.evaluate(TIP, [0], metrics.GroundTruths(shapes.cube(), []))


def test_weights_of_ones_own():
    tower = column(2)
    graph = build_tet_graph(tower)
    sources = np.repeat(np.arange(12), np.diff(graph.offsets))
    steps = graph.arc_measures.step_lengths / graph.diagonal
    walls = (sources < 6) != (graph.neighbors < 6)
    labels = sf.segment(tower, 2, weights=steps + 5.0 * walls).labels
    assert labels.tolist() in ([0] * 6 + [1] * 6, [1] * 6 + [0] * 6)


def test_a_graph_of_tetrahedra_is_clustered_as_the_mesh():
    body = sf.prepare(ball(500)).cells  # in the order of `segment`
    cells = build_tet_graph(body).with_weights()
    assert cells.dimension == 3
    expected = sf.segment(body, 10, smooth=False)
    result = sf.segment_graph(cells, 10)
    assert np.array_equal(result.labels, expected.labels)
    assert result.params["radius"] == expected.params["radius"]
    assert metrics.compactness(cells, result) == pytest.approx(metrics.compactness(body, result))
    assert pickle.loads(pickle.dumps(cells)).dimension == 3
    with pytest.raises(ValueError, match="dimension must be 2 or 3, got 4"):
        CellGraph([[0, 0, 0]], [1], [0, 0], [], [], dimension=4)


def test_copies_and_texts():
    assert repr(TIP) == "TetMesh(4 vertices, 1 tet)"
    assert repr(build_tet_graph(TIP)) == "TetGraph(1 tet, 0 arcs)"
    other = copy.deepcopy(TIP)
    assert np.array_equal(other.tets, TIP.tets)
    assert not other.tets.flags.writeable
    assert sf.face_colors(column(1), [0, 1] * 3).shape == (6, 3)


def test_grids_of_pyvista():
    pyvista = pytest.importorskip("pyvista")
    tower = column(2)
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: tower.tets}, tower.vertices)
    assert np.array_equal(sf.segment(grid, 3).labels, sf.segment(tower, 3).labels)


def test_medit_files_of_meshio_are_read(tmp_path):
    """Triangles on the outside, which mesh generators write, are skipped."""
    meshio = pytest.importorskip("meshio")
    tower = column(2)
    outside = tower.boundary().mesh.faces
    blocks = [("triangle", outside), ("tetra", tower.tets[:7]), ("tetra", tower.tets[7:])]
    meshio.Mesh(tower.vertices, blocks).write(tmp_path / "a.mesh")
    found = sf.read_mesh(tmp_path / "a.mesh")
    assert np.array_equal(found.tets, tower.tets)
    assert np.array_equal(found.vertices, tower.vertices)


def test_other_cells_are_named(tmp_path):
    meshio = pytest.importorskip("meshio")
    cube = column(1).vertices
    corners = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])
    meshio.Mesh(cube, [("hexahedron", corners)]).write(tmp_path / "a.vtu")
    with pytest.raises(MeshError, match="must be tetrahedra, but there are hexahedron"):
        sf.read_mesh(tmp_path / "a.vtu")


def test_pictures_show_the_outside_and_the_inside(tmp_path):
    pytest.importorskip("pyvista")
    tower = column(4)
    labels = np.repeat([0, 1, 2, 3], 6)
    outside = sf.plot(tower, labels, size=(160, 120)).image
    half = sf.plot(tower, labels, size=(160, 120), clip="-z").image
    assert (outside != half).any()
    assert (sf.plot(tower, labels, size=(160, 120), clip="z").image != half).any()
    colors = sf.face_colors(tower, labels)
    assert np.array_equal(sf.plot(tower, labels, colors=colors, size=(160, 120)).image, outside)
    with pytest.raises(ValueError, match="clip must be one of x, -x, y, -y, z, -z, got 'w'"):
        sf.plot(tower, labels, clip="w")
    with pytest.raises(
        ValueError, match="omit clip: it is only for tetrahedra, and a surface has no interior"
    ):
        sf.plot(shapes.cube(), clip="x")
    with pytest.raises(ValueError, match=r"colors must have shape \(24, 3\), got \(2, 3\)"):
        sf.plot(tower, colors=np.zeros((2, 3), np.uint8))


@pytest.mark.parametrize("weld", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_arcs_are_those_of_the_reference(seed, weld):
    """Few vertices, equal positions and repeated corners give all kinds of neighbors."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 3, (12, 3)).astype(float)
    mesh = TetMesh(points, rng.integers(0, 12, (60, 4)))
    graph = build_tet_graph(mesh, weld=weld)
    sources = np.repeat(np.arange(mesh.n_tets), np.diff(graph.offsets))
    found = zip(sources, graph.arc_measures.sides, graph.neighbors, strict=True)
    expected = reference.build_tet_graph(mesh, weld=weld)
    assert [tuple(map(int, arc)) for arc in found] == [tuple(map(int, arc[:3])) for arc in expected]
