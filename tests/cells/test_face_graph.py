"""Stage 1: arcs of small meshes, counted by hand."""

import dataclasses

import numpy as np
import pytest
import reference
import shapes

from superfacets import Mesh, MeshError, PolygonMesh, TetMesh, border_lines, build_face_graph
from superfacets.graph.face_graph import EdgeCounts
from superfacets.graph.kinds import kind_of
from superfacets_formats import build_tet_graph


def arcs_of(graph):
    """Return (face, side, neighbor, same_turn) for each arc."""
    faces = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    columns = (faces, graph.sides, graph.neighbors, graph.same_turn)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def test_a_strip_is_a_path():
    graph = build_face_graph(shapes.strip(4))
    assert sorted((face, neighbor) for face, _, neighbor, _ in arcs_of(graph)) == [
        (0, 1), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2),
    ]  # fmt: skip
    assert graph.edge_counts == EdgeCounts(edges=9, boundary=6, non_manifold=0, inconsistent=0)
    assert graph.measures.tolist() == [0.5] * 4
    assert graph.positions[0].tolist() == [1 / 3, 1 / 3, 0]


def test_sides_tell_which_edge_is_crossed():
    mesh = shapes.strip(2)  # faces (0, 2, 1) and (1, 2, 3) share the edge 1-2
    assert arcs_of(build_face_graph(mesh)) == [(0, 1, 1, 0), (1, 0, 0, 0)]


def test_every_face_of_a_cube_has_three_neighbors():
    graph = build_face_graph(shapes.cube())
    assert np.diff(graph.offsets).tolist() == [3] * 12
    assert graph.edge_counts == EdgeCounts(edges=18, boundary=0, non_manifold=0, inconsistent=0)
    assert graph.bounds.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert graph.diagonal == np.sqrt(3)


def test_islands_have_no_arc_between_them():
    graph = build_face_graph(shapes.two_islands())
    island = np.arange(8) // 4
    sources = np.repeat(np.arange(8), np.diff(graph.offsets))
    assert np.array_equal(island[sources], island[graph.neighbors])
    assert graph.n_arcs == 12


def test_a_moebius_band_has_one_inconsistent_edge_with_unknown_normals():
    kind = kind_of(mesh := shapes.moebius(12))
    graph, _ = kind.build_graph(mesh, True, 1)
    assert graph.edge_counts == EdgeCounts(edges=48, boundary=24, non_manifold=0, inconsistent=1)
    assert [(f, n) for f, _, n, turn in arcs_of(graph) if turn] == [(0, 23), (23, 0)]
    normals = kind.normals(kind.surface(mesh, graph, 1), graph)
    assert np.flatnonzero(~normals.any(axis=1)).tolist() == [0, 23]


def test_a_shared_vertex_makes_no_neighbors():
    graph = build_face_graph(shapes.bowtie())
    assert graph.neighbors.dtype == np.int32
    assert graph.offsets.tolist() == [0, 0, 0]


def test_all_pairs_around_a_non_manifold_edge_are_neighbors():
    graph = build_face_graph(shapes.fins(4))
    assert arcs_of(graph) == [
        (face, 0, neighbor, 1) for face in range(4) for neighbor in range(4) if face != neighbor
    ]
    assert graph.edge_counts == EdgeCounts(edges=9, boundary=8, non_manifold=1, inconsistent=0)


def test_degenerate_faces_stay_cells_and_never_meet_themselves():
    graph = build_face_graph(shapes.slivers())
    # Faces 0 (0 1 2) and 1 (2 1 3) share edge 1-2. Face 3 (0 1 1) has edge 0-1 of face 0 twice.
    assert arcs_of(graph) == [(0, 0, 3, 1), (0, 1, 1, 0), (1, 0, 0, 0), (3, 0, 0, 1)]
    assert graph.measures.tolist() == [2.0, 0.0, 0.0, 0.0]


def test_faces_that_share_two_edges_have_two_arcs():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    assert build_face_graph(mesh).neighbors.tolist() == [1, 1, 1, 0, 0, 0]


def test_soup_is_connected_by_position_unless_asked_not_to():
    mesh = shapes.soup(shapes.cube())
    welded = build_face_graph(mesh)
    assert np.array_equal(welded.neighbors, build_face_graph(shapes.cube()).neighbors)
    assert build_face_graph(mesh, weld=False).n_arcs == 0


def test_negative_zero_is_the_same_position_as_zero():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0], [1, -0.0, 0], [0, -1, -0.0]]
    assert build_face_graph(Mesh(vertices, [[0, 1, 2], [4, 3, 5]])).n_arcs == 2


def test_positions_that_differ_in_the_last_bit_are_not_welded():
    almost = np.nextafter(1.0, 2.0)
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [almost, 0, 0], [0, -1, 0]]
    assert build_face_graph(Mesh(vertices, [[0, 1, 2], [4, 3, 5]])).n_arcs == 0


def test_a_regular_lattice_of_positions_is_welded_right():
    steps = np.arange(40) / 8
    lattice = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    n = len(lattice)
    triangles = np.stack([np.arange(n - 2), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    twice = Mesh(np.concatenate([lattice, lattice]), np.concatenate([triangles, triangles + n]))
    once = Mesh(lattice, np.concatenate([triangles, triangles]))
    assert np.array_equal(build_face_graph(twice).neighbors, build_face_graph(once).neighbors)


def test_unused_vertices_do_not_count_for_the_bounds():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [99, 99, 99]], [[0, 1, 2]])
    assert build_face_graph(mesh).bounds.tolist() == [[0, 0, 0], [1, 1, 0]]


def test_too_many_arcs_are_refused_before_memory_is_taken():
    with pytest.raises(MeshError, match=r"17740800 pairs .* one edge is shared by 64 faces"):
        build_face_graph(Mesh(*shapes.crowded_sides(2)))


def test_the_arrays_of_a_graph_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        build_face_graph(shapes.cube()).neighbors[0] = 99


@pytest.mark.parametrize("n", [64, 65, 128, 129, 1000])
@pytest.mark.parametrize("kind", ["triangles", "polygons", "tetrahedra"])
def test_cells_on_a_crowded_side_are_joined_as_in_the_twin(kind, n):
    rng = np.random.default_rng(n)
    vertices = rng.normal(size=(n + 3, 3))
    tips = rng.permutation(n)[:, np.newaxis] + 3
    if kind == "tetrahedra":
        mesh = TetMesh(vertices, np.concatenate([np.tile([0, 1, 2], (n, 1)), tips], axis=1))
        graph, arcs = build_tet_graph(mesh), reference.build_tet_graph(mesh)
    else:
        ends = rng.permuted(np.tile([0, 1], (n, 1)), axis=1)
        faces = np.concatenate([tips, ends], axis=1)
        mesh = (
            Mesh(vertices, faces) if kind == "triangles" else PolygonMesh.of_faces(vertices, faces)
        )
        graph, arcs = build_face_graph(mesh, n_threads=3), reference.build_face_graph(mesh)
        assert graph.same_turn.tolist() == [arc.same_turn for arc in arcs]
        assert graph.sides.tolist() == [arc.side for arc in arcs]
    assert graph.sources.tolist() == [arc.face for arc in arcs]
    assert graph.neighbors.tolist() == [arc.neighbor for arc in arcs]


def test_few_arcs_join_each_pair_of_many_faces_on_one_edge():
    n = 4000
    graph = build_face_graph(shapes.fins(n))
    assert graph.n_arcs == 22 * n
    reached = np.zeros(n, bool)
    reached[0] = True
    for _ in range(11):  # fewer than log2(n)
        reached[graph.neighbors[reached[graph.sources]]] = True
    assert reached.all()
    lines = border_lines(shapes.fins(n), (np.arange(n) == 1999).astype(int))
    assert lines.regions.tolist().count([0, 1]) == 1


def test_a_million_faces_on_one_edge_are_refused_in_linear_time():
    n = 1_000_000
    tips = np.stack([np.arange(n), np.ones(n), np.zeros(n)], axis=1)
    vertices = np.concatenate([[[0, 0, 0], [0, 0, 1]], tips])
    faces = np.stack([np.zeros(n, int), np.ones(n, int), np.arange(2, n + 2)], axis=1)
    with pytest.raises(MeshError, match=r"38000000 pairs .* is shared by 1000000 faces"):
        build_face_graph(Mesh(vertices, faces))


def test_a_hub_of_many_faces_is_no_trap():
    n = 100_000
    angles = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)
    faces = np.stack([np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n], axis=1)
    graph = build_face_graph(Mesh(np.concatenate([[[0, 0, 1]], rim]), faces))
    assert graph.edge_counts == EdgeCounts(2 * n, n, 0, 0)
    expected = np.stack([np.arange(n) - 1, np.arange(n) + 1], axis=1) % n
    assert np.array_equal(graph.neighbors.reshape(-1, 2), expected)


def test_arcs_around_an_edge_go_by_face_and_turn_whatever_the_order_of_corners():
    rng = np.random.default_rng(3)
    tips = rng.permutation(6) + 2
    faces = [np.roll([0, 1, tip] if tip % 2 else [1, 0, tip], tip) for tip in tips]
    vertices = np.concatenate([[[0, 0, 0], [0, 0, 1]], rng.normal(size=(6, 3))])
    arcs = arcs_of(build_face_graph(Mesh(vertices, faces)))
    assert [(face, neighbor, turn) for face, _, neighbor, turn in arcs] == [
        (i, j, int(tips[i] % 2 == tips[j] % 2)) for i in range(6) for j in range(6) if i != j
    ]


def _arrays_of(graph):
    fields = [getattr(graph, field.name) for field in dataclasses.fields(graph)]
    return [np.asarray(field) for field in fields]


def _tangle(rng):
    """Return random faces with boundaries, edges of many faces, degenerate faces and islands."""
    near = rng.integers(0, 39_000, (60_000, 1)) + rng.integers(0, 12, (60_000, 3))
    far = rng.integers(0, 40_000, (5_000, 3))
    vertices = rng.normal(size=(40_000, 3))
    vertices[20_000:] = vertices[rng.integers(0, 40_000, 20_000)]  # welded
    return Mesh(vertices, np.concatenate([near, far]))


@pytest.mark.parametrize(
    "make", [lambda: shapes.bumpy_sheet(220), lambda: _tangle(np.random.default_rng(5))]
)
def test_the_graph_does_not_depend_on_the_number_of_threads(make):
    mesh = make()
    one, *others = (build_face_graph(mesh, n_threads=n) for n in (1, 2, 3, 8))
    for other in others:
        assert all(map(np.array_equal, _arrays_of(one), _arrays_of(other)))


def test_the_graph_of_a_tangle_is_that_of_a_dictionary_of_edges():
    mesh = _tangle(np.random.default_rng(6))
    _, corners = np.unique(mesh.vertices, axis=0, return_inverse=True)
    sides_on = {}
    for face, (a, b, c) in enumerate(corners.ravel()[mesh.faces].tolist()):
        for side, (u, v) in enumerate([(a, b), (b, c), (c, a)]):
            if u != v:
                sides_on.setdefault((min(u, v), max(u, v)), {}).setdefault(face, (side, u < v))
    expected = sorted(
        (face, side, other, int(turn == other_turn))
        for faces in sides_on.values()
        for face, (side, turn) in faces.items()
        for other, (_, other_turn) in faces.items()
        if face != other
    )
    graph = build_face_graph(mesh, n_threads=3)
    assert arcs_of(graph) == expected
    assert graph.edge_counts.edges == len(sides_on)
    assert graph.edge_counts.boundary == sum(len(faces) == 1 for faces in sides_on.values())
    assert graph.edge_counts.non_manifold == sum(len(faces) > 2 for faces in sides_on.values())
    two = [list(faces.values()) for faces in sides_on.values() if len(faces) == 2]
    assert graph.edge_counts.inconsistent == sum(a[1] == b[1] for a, b in two)
    assert graph.edge_counts.non_manifold > 100
    assert graph.edge_counts.inconsistent > 100
