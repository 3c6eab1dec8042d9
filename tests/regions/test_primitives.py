"""Planes, cylinders, cones and spheres that fit regions."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, PointCloud, PolygonMesh, fit_primitives
from superfacets.regions import primitives

AXIS = np.array([2, 3, 6]) / 7
TURN = np.stack([np.array([3, -6, 2]) / 7, np.array([6, 2, -3]) / 7, AXIS])  # takes z to AXIS
ORIGIN = np.array([50.0, 60, 70])


def moved(mesh, *, flip=False, scale=1.0, noise=0.0, origin=ORIGIN):
    """Return the mesh turned so that z becomes AXIS, and moved to the origin."""
    vertices = mesh.vertices + np.random.default_rng(0).normal(0, noise or 0, mesh.vertices.shape)
    return Mesh(scale * (vertices @ TURN + origin), mesh.faces[:, :: -1 if flip else 1])


def primitive_of(mesh, tolerance=0.01):
    """Return the attributes for a mesh that is one region."""
    found = fit_primitives(mesh, np.zeros(mesh.n_faces, int), tolerance=tolerance)
    return (
        found.kinds[0], found.axes[0], found.points[0], found.radii[0], found.half_angles[0],
        found.is_convex[0], found.misfits[0],
    )  # fmt: skip


def sharp_regions(part):
    return sf.segment(part, 1, barriers=sf.sharp_edges(part, 30)).labels


TUBE = [(2, 0), (2, 3)]
DOME = [(np.sin(t), 1 - np.cos(t)) for t in np.linspace(0.2, 1.2, 6)]


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(
    ("n_around", "arc"), [(12, 2 * np.pi), (64, 2 * np.pi), (3, np.pi / 2), (16, np.pi)]
)
def test_cylinders_have_the_radius_of_their_vertices(n_around, arc, flip):
    kind, axis, point, radius, half_angle, is_convex, misfit = primitive_of(
        moved(shapes.revolved(TUBE, n_around, arc), flip=flip)
    )
    assert (kind, is_convex) == ("cylinder", not flip)
    assert axis == pytest.approx(AXIS)
    assert point == pytest.approx(ORIGIN + 1.5 * AXIS)
    assert radius == pytest.approx(2)
    assert np.isnan(half_angle)
    assert misfit < 1e-9


@pytest.mark.parametrize("n_sides", [3, 4, 5, 6, 8])
@pytest.mark.parametrize("n_strips", [1, 6])
def test_prisms_of_few_sides_are_no_cylinders(n_sides, n_strips):
    prism = shapes.revolved(TUBE, n_sides)
    corners = prism.vertices.reshape(n_sides + 1, 1, 2, 3)
    steps = np.linspace(0, 1, n_strips, endpoint=False)[:, np.newaxis, np.newaxis]
    strips = (corners[:-1] + steps * (corners[1:] - corners[:-1])).reshape(-1, 3)
    vertices = np.concatenate([strips, corners[-1, 0]])
    divided = Mesh(vertices, shapes.revolved(TUBE, n_sides * n_strips).faces)
    assert primitive_of(divided)[0] == "other"


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("arc", [2 * np.pi, np.pi / 2])
@pytest.mark.parametrize("height", [0.2, 1, 20])
def test_cones_and_countersinks(height, arc, flip):
    mesh = moved(shapes.revolved([(2, 0), (1, height)], 24, arc), flip=flip)
    kind, axis, point, radius, half_angle, is_convex, misfit = primitive_of(mesh)
    assert (kind, is_convex) == ("cone", not flip)
    assert axis == pytest.approx(-AXIS)  # from the apex into the cone
    assert point == pytest.approx(ORIGIN + 2 * height * AXIS)
    assert radius == pytest.approx(2)
    assert half_angle == pytest.approx(np.arctan(1 / height))
    assert misfit < 1e-9


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("arc", [2 * np.pi, 1])
def test_spheres(arc, flip):
    kind, axis, point, radius, half_angle, is_convex, _ = primitive_of(
        moved(shapes.revolved(DOME, 24, arc), flip=flip)
    )
    assert (kind, is_convex) == ("sphere", not flip)
    assert point == pytest.approx(ORIGIN + AXIS)
    assert radius == pytest.approx(1)
    assert np.isnan([*axis, half_angle]).all()


def test_planes_are_on_the_side_of_their_normals():
    for flip in (False, True):
        mesh = moved(shapes.revolved([(2, 0), (1, 0)], 24), flip=flip)
        kind, axis, point, *others, misfit = primitive_of(mesh)
        assert kind == "plane"
        assert axis == pytest.approx(-AXIS if flip else AXIS)
        assert point == pytest.approx(ORIGIN)
        assert np.isnan(others[:2]).all()
        assert others[2] == 0
        assert misfit < 1e-9
    assert primitive_of(shapes.strip(1))[0] == "plane"


@pytest.mark.parametrize("arc", [2 * np.pi, 0.5])
def test_other_surfaces(arc):
    fillet = [(5 - np.sin(t), 1 - np.cos(t)) for t in np.linspace(0, np.pi / 2, 9)]
    found = fit_primitives(shapes.revolved(fillet, 48, arc), np.zeros(48 * 16, int))
    assert found.kinds.tolist() == ["other"]
    assert np.isnan([*found.axes[0], *found.points[0], found.radii[0], found.misfits[0]]).all()
    assert not found.is_convex[0]
    assert repr(found) == "Primitives(1 other)"


def test_a_region_of_two_planes_or_without_area_is_other():
    assert primitive_of(shapes.fold(90))[0] == "other"
    line = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert primitive_of(line)[0] == "other"


@pytest.mark.parametrize(
    ("scale", "origin"), [(1e-6, [0, 0, 0]), (1e9, [0, 0, 0]), (0.01, [5e7, 5e8, 1e4])]
)
def test_neither_unit_nor_position_matters(scale, origin):
    mesh = moved(shapes.revolved(TUBE, 32), scale=scale, origin=np.array(origin))
    kind, axis, point, radius, *_ = primitive_of(mesh)
    assert kind == "cylinder"
    assert axis == pytest.approx(AXIS, abs=1e-6)
    assert radius == pytest.approx(2 * scale, rel=1e-5)
    assert point == pytest.approx((np.array(origin) + 1.5 * AXIS) * scale)


@pytest.mark.parametrize(
    ("profile", "kind", "size"),
    [
        (np.linspace((1, 0), (1, 2), 16), "cylinder", 1),
        (np.linspace((2, 0), (1, 1), 12), "cone", 2),
        (DOME, "sphere", 1),
        (np.linspace((2, 0), (1, 0), 12), "plane", np.nan),
    ],
)
def test_noise_needs_more_tolerance(profile, kind, size):
    mesh = moved(shapes.revolved(profile, 60), noise=0.01)
    assert primitive_of(mesh)[0] == "other"
    found, axis, _, radius, _, _, misfit = primitive_of(mesh, tolerance=0.05)
    assert found == kind
    assert kind == "sphere" or abs(axis @ AXIS) > 0.999
    assert radius == pytest.approx(size, rel=0.02, nan_ok=True)
    assert misfit == pytest.approx(0.01, rel=0.1)


def test_parts_are_measured_in_all_regions_at_once(monkeypatch):
    block = shapes.drilled_block(64)
    labels = sharp_regions(block)
    found = fit_primitives(block, labels)
    assert sorted(found.kinds) == ["cylinder"] + ["plane"] * 6
    hole = np.flatnonzero(found.kinds == "cylinder")[0]
    assert found.radii[hole] == pytest.approx(0.3)
    assert not found.is_convex[hole]
    monkeypatch.setattr(primitives, "BATCH_SIZE", 1)  # each region alone
    alone = fit_primitives(block, labels)
    for name, column in found.table().items():
        assert alone.table()[name].tolist() == pytest.approx(column.tolist(), nan_ok=True)
    without = np.where(labels == hole, -1, labels - (labels > hole))
    rest = fit_primitives(block, without)
    assert repr(rest) == "Primitives(6 plane)"
    assert rest.axes == pytest.approx(np.delete(found.axes, hole, axis=0))


def test_polygons_are_cut_into_triangles():
    tube = shapes.revolved(TUBE, 16)
    half = tube.n_faces // 2
    quads = np.column_stack([tube.faces[:half], tube.faces[half:, 2]])
    found = fit_primitives(PolygonMesh.of_faces(tube.vertices, quads.tolist()), np.zeros(16, int))
    assert (found.kinds[0], found.radii[0]) == ("cylinder", pytest.approx(2))


@pytest.mark.parametrize(("flip", "is_convex"), [(1, False), (-1, True)])
def test_a_tilted_bore_with_a_groove(flip, is_convex):
    block = shapes.drilled_block(64)
    labels = sharp_regions(block)
    hole = np.argmin(sf.region_graph(block, labels).normal_lengths)
    is_kept = np.ones(block.n_faces, bool)
    is_kept[np.flatnonzero(labels == hole)[:16]] = False
    part = Mesh(10 * block.vertices @ TURN + ORIGIN, block.faces[is_kept][:, ::flip])
    found = fit_primitives(part, sharp_regions(part))
    [bore] = np.flatnonzero(found.kinds != "plane")
    assert (found.kinds[bore], found.is_convex[bore]) == ("cylinder", is_convex)
    assert 2 * found.radii[bore] == pytest.approx(6)
    assert found.axes[bore] == pytest.approx(AXIS)
    assert np.cross(found.points[bore] - ORIGIN, AXIS) == pytest.approx([0] * 3, abs=1e-9)


def test_a_ring_with_little_noise():
    """Radii of 0.5 and 1, height 0.5, and noise of 0.001: the default tolerance is enough."""
    corners = np.array([[1, 0], [1, 0.5], [0.5, 0.5], [0.5, 0]])  # radius and height
    steps = np.linspace(0, 1, 10, endpoint=False)[:, np.newaxis]
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ring = shapes.revolved(
        np.concatenate([a + steps * (b - a) for a, b in sides] + [corners[:1]]), 100
    )
    distinct, places = np.unique(ring.vertices.round(9), axis=0, return_inverse=True)
    noise = np.random.default_rng(0).normal(0, 0.001, distinct.shape)
    part = Mesh(distinct + noise, places.reshape(-1)[ring.faces])
    found = fit_primitives(part, sharp_regions(part))
    assert sorted(found.kinds) == ["cylinder", "cylinder", "plane", "plane"]
    round_sides = found.kinds == "cylinder"
    sizes = zip(found.is_convex[round_sides], found.radii[round_sides], strict=True)
    assert sorted(sizes) == [
        (False, pytest.approx(0.5, abs=0.001)),
        (True, pytest.approx(1, abs=0.001)),
    ]
    assert np.abs(found.axes[:, 2]) == pytest.approx([1] * 4, abs=1e-3)


@pytest.mark.parametrize("n_sides", [9, 12])
def test_prisms_of_many_sides_are_cylinders(n_sides):
    assert primitive_of(shapes.revolved(TUBE, n_sides))[0] == "cylinder"


@pytest.mark.parametrize("sides", [(1, 1), (40, 40), (1, 0.5), (0.2, 0.2)])
def test_a_rounded_prism_is_no_cylinder(sides):
    """All corners of a square with small fillets have about the same distance from its center."""
    slab = shapes.rounded_slab(8)
    inner = np.sign(slab.vertices) * [4, 2, 0]  # centers of the fillets
    slab = Mesh(slab.vertices - inner + np.sign(inner) * [*sides, 0] * 10, slab.faces)
    found = fit_primitives(slab, sharp_regions(slab))
    assert sorted(found.kinds) == ["other", "plane", "plane"]


def test_errors():
    strip = shapes.strip(4)
    with pytest.raises(ValueError, match="tolerance must be finite and positive, got 0"):
        fit_primitives(strip, [0] * 4, tolerance=0)
    with pytest.raises(ValueError, match="labels"):
        fit_primitives(strip, [0, 0, 2, 2])
    with pytest.raises(ValueError, match="all labels are -1"):
        fit_primitives(strip, [-1] * 4)
    with pytest.raises(sf.MeshError):
        fit_primitives(PointCloud(np.eye(3)), [0, 0, 0])
