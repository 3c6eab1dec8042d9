"""Creases of hollow shapes: smooth convex and concave edges count equally."""

import math

import numpy as np
import pytest
import shapes
from shapes import subdivided

import superfacets as sf
from superfacets import Mesh, build_face_graph, crease_weights
from superfacets.graph.surface import arc_measures
from superfacets.weights.formulas import CURVATURE_BITS, HOLLOW, MAX_EVENED, SOLID, convex_share_of

SHARP = math.radians(40)


def shares(mesh):
    """Return the crease cost of each arc per unit of angle, and its angle (> 0 if concave)."""
    graph = build_face_graph(mesh)
    angles = arc_measures(mesh, graph).angles
    weights = crease_weights(mesh, graph, graph.diagonal, alpha=math.pi)
    priced = weights - crease_weights(mesh, graph, graph.diagonal, alpha=0.0)
    return priced / np.maximum(abs(angles), 1e-12), angles


def is_evened(mesh, **options):
    graph = build_face_graph(mesh)
    weights = [crease_weights(mesh, graph, 0.1, hollows=on, **options) for on in (True, False)]
    return not np.array_equal(*weights)


def flipped(mesh, which):
    faces = mesh.faces.copy()
    faces[which] = faces[which][:, ::-1]
    return Mesh(mesh.vertices, faces)


def test_a_bowl_is_hollow():
    counted, angles = shares(shapes.bowl())
    is_smooth = (abs(angles) < SHARP) & (abs(angles) > 1e-6)
    assert counted[is_smooth & (angles > 0)] == pytest.approx(1 - MAX_EVENED)
    assert counted[is_smooth & (angles < 0)] == pytest.approx(MAX_EVENED)
    assert counted[angles <= -SHARP] == pytest.approx(0.35)  # ridges, along the rim
    assert (angles <= -SHARP).sum() == 2 * 48


def test_ridges_and_what_is_asked_for_convex_edges_count_as_ever():
    mesh = shapes.bowl()
    graph = build_face_graph(mesh)
    is_sharp = abs(arc_measures(mesh, graph).angles) >= SHARP
    on, off = (crease_weights(mesh, graph, 0.1, hollows=hollows) for hollows in (True, False))
    assert np.array_equal(on[is_sharp], off[is_sharp])
    on, off = (
        crease_weights(mesh, graph, 0.1, eta_convex=0.4, hollows=hollows)
        for hollows in (True, False)
    )
    is_convex = arc_measures(mesh, graph).angles <= 0
    assert np.array_equal(on[is_convex], off[is_convex])


@pytest.mark.parametrize(
    "mesh",
    [sf.sample_mesh(3_000), shapes.dumbbell(), subdivided(shapes.bowl(thickness=0.9))],
    ids=["bear", "dumbbell", "nearly half a ball"],
)
def test_solid_shapes_are_not_hollow(mesh):
    assert not is_evened(mesh)


def test_what_is_open_or_has_no_orientation_is_not_hollow():
    mesh = shapes.bowl()
    assert is_evened(mesh)
    assert not is_evened(Mesh(mesh.vertices, mesh.faces[1:]))
    assert not is_evened(flipped(mesh, [7]))
    assert not is_evened(mesh, alpha=0)
    sheet = [[0, 0, 0], [2, 0, 0], [0, 1, 0]]
    assert not is_evened(Mesh(sheet, [[0, 1, 2], [0, 2, 1]]))  # encloses no volume


def test_weights_do_not_depend_on_which_way_all_normals_point():
    mesh = shapes.bowl()
    one, other = (
        np.sort(crease_weights(cells, build_face_graph(cells), 0.1))
        for cells in (mesh, flipped(mesh, slice(None)))
    )
    assert one == pytest.approx(other, rel=1e-12)


def test_subdivision_and_scale_change_nothing():
    mesh = shapes.bowl(thickness=0.6)  # between hollow and solid
    expected, angles = shares(mesh)
    is_convex = (angles < -0.05) & (angles > -SHARP)
    share = expected[is_convex].max()
    assert 0.01 < share < MAX_EVENED - 0.01
    for other in subdivided(mesh), Mesh(7 * mesh.vertices + 3, mesh.faces):
        found, angles = shares(other)
        is_convex = (angles < -0.05) & (angles > -SHARP)
        assert found[is_convex] == pytest.approx(share, abs=1e-4)


@pytest.mark.parametrize("n_threads", [2, 8])
def test_weights_do_not_depend_on_the_number_of_threads(n_threads):
    for mesh in (subdivided(shapes.bowl(thickness=0.6), 3), subdivided(shapes.gears(4), 1)):
        graph = build_face_graph(mesh)
        one, other = (crease_weights(mesh, graph, 0.3, n_threads=n) for n in (1, n_threads))
        assert np.array_equal(one, other)


def test_polygons_that_are_triangles_weigh_the_same():
    mesh = shapes.bowl(thickness=0.6)
    offsets = 3 * np.arange(mesh.n_faces + 1)
    polygons = sf.PolygonMesh(mesh.vertices, offsets, mesh.faces.reshape(-1))
    weights = [crease_weights(cells, build_face_graph(cells), 0.1) for cells in (mesh, polygons)]
    assert weights[0] == pytest.approx(weights[1], rel=1e-12)
    assert is_evened(polygons)


def test_regions_are_those_of_the_weights():
    mesh = sf.prepare(subdivided(shapes.bowl(), 2), denoise=0).cells  # in the order of `segment`
    result = sf.segment(mesh, 40, weights="creases", smooth=False)
    graph = build_face_graph(mesh)
    radius = result.params["radius"]
    on, off = (
        sf.segment(
            mesh, 40, weights=crease_weights(mesh, graph, radius, hollows=hollows), smooth=False
        )
        for hollows in (True, False)
    )
    assert np.array_equal(result.labels, on.labels)
    assert not np.array_equal(result.labels, off.labels)


def share_of(roundness, volume=2.0, area=3.0, diagonal=5.0):
    unit = 2.0 ** (2 - CURVATURE_BITS)
    turn = 2 * roundness * area**2 / (3 * volume)
    return convex_share_of(round(turn / unit), volume, area, diagonal)


def test_the_share_falls_from_hollow_to_solid():
    assert share_of(-1) == share_of(0) == share_of(HOLLOW - 1e-4) == MAX_EVENED
    assert share_of((HOLLOW + SOLID) / 2) == pytest.approx(MAX_EVENED / 2, abs=1e-4)
    assert share_of(SOLID + 1e-4) == share_of(1) == 0
    assert convex_share_of(0, 0.0, 3.0, 5.0) == convex_share_of(0, 0.0, 0.0, 5.0) == 0
