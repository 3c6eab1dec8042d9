"""The shape diameter: known values, and faces without a value."""

import math

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, PolygonMesh, _core, shape_diameter
from superfacets.cells.thickness import rays_from
from superfacets.reference.spatial import cone_of_rays, ray_thickness, typical_length


def tube(x, radii, n_around=24):
    """Return a surface of revolution about the x axis, closed by a point at each end."""
    turns = 2 * math.pi * np.arange(n_around) / n_around
    rings = np.stack(np.broadcast_arrays(x[:, None], np.cos(turns), np.sin(turns)), axis=-1)
    rings[..., 1:] *= radii[:, None, None]
    ring, around = np.meshgrid(np.arange(len(x) - 1), np.arange(n_around), indexing="ij")
    a, b = ring * n_around + around, ring * n_around + (around + 1) % n_around
    quads = np.stack([a, b, b + n_around, a + n_around], axis=-1).reshape(-1, 4)
    ends = [[x[0], 0, 0], [x[-1], 0, 0]]
    first, n = len(x) * n_around, np.arange(n_around)
    caps = [
        np.stack([np.full(n_around, first), (n + 1) % n_around, n], 1),
        np.stack([np.full(n_around, first + 1), n, (n + 1) % n_around], 1) + [[0, 1, 1]] * n_around
        * np.array((len(x) - 1) * n_around),
    ]  # fmt: skip
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], *caps])
    mesh = Mesh(np.concatenate([rings.reshape(-1, 3), ends]), triangles)
    return mesh if volume(mesh) > 0 else Mesh(mesh.vertices, mesh.faces[:, ::-1])


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def ball(n=25):
    turns = np.linspace(0, math.pi, n)[1:-1]
    return tube(-np.cos(turns), np.sin(turns), 36)


def two_balls():
    """Return two balls of radius 1 around x = -2 and 2, joined by a neck of radius 0.2."""
    turns = np.linspace(0, math.pi, 40)[1:-1]
    x, radii = -np.cos(turns), np.maximum(np.sin(turns), np.where(turns > 1.5, 0.2, 0))
    left = np.concatenate([x - 2, np.linspace(-0.9, 0.9, 19)])
    around = np.concatenate([radii, np.full(19, 0.2)])
    return tube(np.concatenate([left, -x[::-1] + 2]), np.concatenate([around, radii[::-1]]))


def box(x, y, z):
    return Mesh(shapes.cube().vertices * [x, y, z], shapes.cube().faces)


def expected(length_along, n_rays=30):
    """Return the shape diameter for rays of known lengths."""
    directions, weights = cone_of_rays(n_rays)
    return typical_length([length_along(*d) for d in directions.tolist()], weights)


def test_a_sphere_is_as_thick_everywhere_as_its_chords():
    thickness = shape_diameter(ball(49), smoothing=0)
    assert np.allclose(thickness, expected(lambda x, y, z: 2 * z), rtol=0.05)


def test_the_middle_of_a_slab_is_as_thick_as_oblique_rays_are_long():
    slab = box(40, 40, 1)
    thickness = shape_diameter(slab, smoothing=0)[: 2 * 6]
    upper = np.abs(np.cross(*np.moveaxis(np.diff(slab.vertices[slab.faces], axis=1), 1, 0))[:, 2])
    sides = thickness[upper > 1]
    assert np.allclose(sides, expected(lambda x, y, z: 1 / z), rtol=1e-9)


def test_a_cylinder_is_as_thick_as_the_chords_of_its_section():
    x = np.linspace(-20, 20, 41)
    cylinder = tube(x, np.ones(41), 64)
    thickness = shape_diameter(cylinder, smoothing=0)
    at = cylinder.vertices[cylinder.faces].mean(axis=1)
    middle = np.abs(at[:, 0]) < 5
    # Rays are rotated about the normal by different angles.
    low = min(expected(turned_cylinder(angle)) for angle in np.linspace(0, math.pi, 40))
    high = max(expected(turned_cylinder(angle)) for angle in np.linspace(0, math.pi, 40))
    assert low * 0.97 < thickness[middle].min() <= thickness[middle].max() < high * 1.03


def turned_cylinder(angle):
    def length(x, y, z):
        across = x * math.sin(angle) + y * math.cos(angle)
        return 2 * z / (z * z + across * across)

    return length


def test_a_neck_is_thinner_than_the_balls_that_it_joins():
    mesh = two_balls()
    thickness = shape_diameter(mesh)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    balls, neck = thickness[np.abs(x) > 1.5], thickness[np.abs(x) < 0.5]
    assert balls.min() > 1.3
    assert balls.max() < 2.0
    assert neck.min() > 0.2
    assert neck.max() < 0.5


def double_cone(n=1000):
    """Return two fans of long thin triangles whose bounding boxes overlap."""
    turns = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(turns), np.sin(turns), np.zeros(n)], axis=1)
    ring = 2 + np.arange(n)
    above = np.stack([np.full(n, 0), ring, np.roll(ring, -1)], axis=1)
    below = np.stack([np.full(n, 1), np.roll(ring, -1), ring], axis=1)
    return Mesh(np.concatenate([[[0, 0, 0.5], [0, 0, -0.1]], rim]), np.concatenate([above, below]))


SOLIDS = [shapes.cube, two_balls, shapes.dumbbell, shapes.drilled_block, double_cone]


@pytest.mark.parametrize("make", SOLIDS)
def test_rays_meet_what_their_twin_meets(make):
    mesh = make()
    graph = sf.build_face_graph(mesh)
    some = np.arange(0, mesh.n_faces, max(1, mesh.n_faces // 25))
    normals = np.cross(*np.moveaxis(np.diff(mesh.vertices[mesh.faces[some]], axis=1), 1, 0))
    axes = -normals / np.linalg.norm(normals, axis=1)[:, None]
    ours = rays_from(mesh, graph, some, 13, 1)
    least = 1e-6 * graph.diagonal
    twin = ray_thickness(mesh.vertices, mesh.faces, graph.positions[some], axes, 13, least)
    assert np.array_equal(np.isnan(ours), np.isnan(twin))
    assert np.allclose(ours, twin, rtol=1e-9, equal_nan=True)


def test_the_result_depends_on_no_thread_and_not_on_the_way_normals_point():
    mesh = two_balls()
    one = shape_diameter(mesh, n_threads=1)
    assert np.array_equal(one, shape_diameter(mesh, n_threads=4))
    turned = Mesh(mesh.vertices, mesh.faces[:, ::-1])
    assert np.allclose(one, shape_diameter(turned), rtol=0.05)


def test_it_scales_with_the_mesh():
    mesh = two_balls()
    large = Mesh(1000 * mesh.vertices, mesh.faces)
    assert np.allclose(shape_diameter(large), 1000 * shape_diameter(mesh), rtol=1e-4)


def test_polygons_are_as_thick_as_their_triangles():
    mesh = box(40, 40, 1)
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    boxed = PolygonMesh.of_faces(mesh.vertices, sides)
    assert np.allclose(shape_diameter(boxed, smoothing=0)[:2], expected(lambda x, y, z: 1 / z))


@pytest.mark.parametrize("make", [shapes.bumpy_sheet, lambda: shapes.strip(8)])
def test_a_sheet_has_no_inside(make):
    assert np.isnan(shape_diameter(make())).all()


def test_points_and_tetrahedra_have_no_thickness():
    points = np.random.default_rng(0).random((50, 3))
    assert np.isnan(shape_diameter(points)).all()
    tet = sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    assert np.isnan(shape_diameter(tet)).all()


def test_faces_inside_of_nothing_take_what_their_neighbors_have():
    """The mesh is a cube with a fin, and a separate sheet."""
    cube, sheet = shapes.cube(), shapes.bumpy_sheet(3)
    finned = Mesh([*cube.vertices, [-1, -1, 0.5]], [*cube.faces, [0, 4, 8]])
    mesh = shapes.together([finned, Mesh(sheet.vertices + 50, sheet.faces)])
    raw, filled = shape_diameter(mesh, smoothing=0), shape_diameter(mesh, smoothing=0.01)
    assert np.isfinite(raw[:12]).all()
    assert np.isnan(raw[12:]).all()
    assert raw[:12].min() * 0.99 < filled[12] < raw[:12].max() * 1.01
    assert np.isnan(filled[13:]).all()


def test_degenerate_faces_are_inside_of_nothing():
    mesh = shapes.cube()
    flat = Mesh(mesh.vertices, np.concatenate([mesh.faces, [[0, 1, 1]]]))
    assert np.isnan(shape_diameter(flat, smoothing=0)).tolist() == [False] * 12 + [True]


def test_a_double_sheet_has_no_thickness():
    sheet = shapes.strip(6)
    both = Mesh(sheet.vertices, np.concatenate([sheet.faces, sheet.faces[:, ::-1]]))
    assert np.isnan(shape_diameter(both)).all()


@pytest.mark.parametrize("far", [1e9, 1e30])
def test_vertices_of_no_face_change_nothing(far):
    mesh = shapes.cube()
    more = Mesh([*mesh.vertices.tolist(), [far] * 3], mesh.faces)
    faces = np.arange(mesh.n_faces)
    one, other = (rays_from(m, sf.build_face_graph(m), faces, 30, 1) for m in (mesh, more))
    assert np.array_equal(one, other)
    assert np.isfinite(one).all()


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"smoothing": -1}, ValueError, "smoothing"),
        ({"n_rays": 0}, ValueError, "n_rays"),
        ({"n_rays": 1.5}, TypeError, "n_rays"),
        ({"n_rays": 10_001}, ValueError, "n_rays must be at most 10000, got 10001"),
        ({"n_rays": 10**12}, ValueError, "n_rays"),
        ({"n_threads": 0}, ValueError, "n_threads"),
    ],
)
def test_wrong_options_are_refused(options, error, match):
    with pytest.raises(error, match=match):
        shape_diameter(shapes.cube(), **options)


def test_smoothing_solves_its_equation():
    mesh = two_balls()
    graph = sf.build_face_graph(mesh)
    rng = np.random.default_rng(0)
    conductances, masses = np.full(graph.n_arcs, 0.5), rng.random(graph.n_cells)
    masses[::7] = 0.0
    values = rng.normal(size=graph.n_cells)
    ours = _core.diffuse(graph.offsets, graph.neighbors, conductances, masses, values, 0.3, 2)
    laplacian = np.zeros((graph.n_cells, graph.n_cells))
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    np.add.at(laplacian, (sources, graph.neighbors), -0.5)
    laplacian[np.diag_indices(graph.n_cells)] = -laplacian.sum(axis=1)
    true = np.linalg.solve(np.diag(masses) + 0.3 * laplacian, masses * values)
    assert np.allclose(ours, true, atol=1e-4)


def test_rays_hit_nothing_where_there_is_no_face():
    nothing, start, axis = np.empty((0, 3)), np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    faces = np.empty((0, 3), np.int32)
    assert np.isnan(_core.ray_thickness(nothing, faces, start, axis, 30, 0.0, False, 1)).all()
