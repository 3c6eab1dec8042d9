"""The up axis (z if the mesh stands much more stably with z up), and border lines."""

import numpy as np
import pytest
from models import read_off
from shapes import bumpy_sheet, cube, soup, strip, table, two_tets

from superfacets import Mesh, View, build_face_graph, sample_mesh
from superfacets_show import plotting
from superfacets_show.camera import Camera
from superfacets_show.scene import border_edges, default_border_width, guess_up, surface_of

# Number of a benchmark model, and the axis that points up in it.
UP_OF_MODELS = {5: "y", 89: "z", 101: "y", 105: "z", 145: "y", 153: "z", 381: "y", 389: "z"}


def guess(mesh):
    return guess_up(*surface_of(mesh))


def turned(mesh, steps):
    """Return the mesh with x, y and z shifted cyclically by this many axes."""
    return Mesh(np.roll(mesh.vertices, steps, axis=1), mesh.faces)


def room():
    """Return a floor and four walls, 5 x 4 and 2.5 high, z up, without a ceiling."""
    mesh = cube()
    is_ceiling = (mesh.vertices[mesh.faces][:, :, 2] == 1).all(axis=1)
    return Mesh(mesh.vertices * [5, 4, 2.5], mesh.faces[~is_ceiling])


def hill():
    """Return a hill on a plain, z up."""
    mesh = bumpy_sheet()
    across = mesh.vertices[:, :2]
    distance = np.linalg.norm(across - across.mean(axis=0), axis=1) / np.ptp(across[:, 0])
    return Mesh(np.column_stack([across, np.maximum(0, 0.3 - distance)]), mesh.faces)


def test_a_table_stands_on_its_legs():
    assert guess(table()) == "z"
    assert guess(turned(table(), 2)) == "y"  # z has become y


def test_a_table_upside_down_is_no_reason_for_another_axis():
    assert guess(turned(Mesh(-table().vertices, table().faces), 2)) == "y"


def test_rooms_and_terrain_with_z_up_are_found():
    assert guess(room()) == "z"
    assert guess(hill()) == "z"
    assert guess(turned(hill(), 2)) == "y"


def test_what_stands_either_way_has_y_up():
    assert guess(cube()) == "y"
    assert guess(Mesh(cube().vertices * [1, 3, 1], cube().faces)) == "y"


def test_what_would_tip_over_has_y_up():
    """A triangle on its tip, leaning toward y: it stands on neither axis."""
    assert guess(Mesh([[0, 0, 0], [1, 2, 1], [-1, 2, 1]], [[0, 1, 2]])) == "y"


def test_the_sample_has_y_up():
    assert guess(sample_mesh(3_000)) == "y"


@pytest.mark.parametrize("scale", [1e-14, 1.0, 1e14])
def test_place_scale_and_order_do_not_matter(scale):
    mesh = table()
    order = np.random.default_rng(0).permutation(mesh.n_faces)
    moved = Mesh(mesh.vertices * scale + scale * np.array([7, -5, 3]), mesh.faces[order])
    assert guess(moved) == "z"
    assert guess(soup(mesh)) == "z"


def test_a_sample_of_a_large_mesh_gives_the_same(limit):
    meshes = [hill(), turned(hill(), 2), sample_mesh(3_000)]
    whole = [guess(mesh) for mesh in meshes]
    assert min(mesh.n_faces for mesh in meshes) > 1_000
    limit("faces that show what is up", 100)
    assert [guess(mesh) for mesh in meshes] == whole == ["z", "y", "y"]


def test_meshes_without_area_have_y_up():
    assert guess(Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])) == "y"


def test_models_of_the_benchmark(benchmark_paths):
    paths = {int(path.stem): path for path in benchmark_paths}
    models = UP_OF_MODELS.keys() & paths.keys()
    if not models:
        pytest.skip("none of these models is there")
    assert {model: guess(read_off(paths[model])) for model in models} == {
        model: UP_OF_MODELS[model] for model in models
    }


def test_georeferenced_coordinates_have_z_up():
    tower = Mesh(cube().vertices * [1, 1, 9] + [350_000, 5_600_000, 80], cube().faces)
    assert guess(tower) == "z"
    assert guess(Mesh(cube().vertices * [1, 1, 9] + [5, 7, 0], cube().faces)) == "y"


def test_the_guess_does_not_depend_on_the_clip(monkeypatch):
    seen = []
    monkeypatch.setattr(plotting, "upright", lambda view, *surface: seen.append(surface) or view)
    monkeypatch.setattr(plotting, "draw_scene", lambda *given: [np.zeros((2, 2, 3), np.uint8)])
    for clip in (None, "x", "-y"):
        plotting.plot(two_tets(), [0, 1], size=(2, 2), view=View(up="z"), clip=clip)
    for points, triangles in seen:
        assert np.array_equal(points, seen[0][0])
        assert np.array_equal(triangles, seen[0][1])


def test_borders_run_between_faces_of_different_labels_only():
    mesh = strip(4)
    ((edge,), _) = border_edges(mesh, build_face_graph(mesh), [np.array([0, 0, 1, 1])])
    assert {*edge} == {*mesh.faces[1]} & {*mesh.faces[2]}


@pytest.mark.parametrize(("diameter", "half_slope", "height", "expected"), [
    (0.1, 0.5, 1000, 1.0),  # 50 pixels
    (0.15, 0.5, 1000, 1.5),
    (1.0, 0.5, 1000, 4.0),  # the maximum width
    (1.0, 0.5, 500, 2.0),
    (0.01, 0.5, 1000, 0.6),  # the minimum width
    (1.0, 0.5, 20, 0.6),
    (0.08, 0.5, 1000, 0.8),
    (0.08, 0.25, 1000, 1.6),  # zoomed in
])  # fmt: skip
def test_borders_are_two_percent_of_the_diameter_of_regions(diameter, half_slope, height, expected):
    camera = Camera(np.array([0.0, 0.0, 2.0]), np.zeros(3), np.array([0.0, 1.0, 0.0]), half_slope)
    width = default_border_width(np.pi / 4 * diameter**2, camera, height)
    assert width == pytest.approx(expected)
