"""Weights by parts: regions stay within parts."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, Weights, segment
from superfacets.weights.formulas import WEIGHTS

BEAR = sf.sample_mesh(5_000)


def test_regions_stay_within_parts():
    """With two regions, each end of a dumbbell is one region."""
    mesh = shapes.dumbbell(121, 40)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    result = segment(mesh, 2, weights="parts")
    assert np.mean(result.labels[x > 0.1] != result.labels[np.argmax(x)]) < 0.02
    assert result.n_segments == 2


SOURCES = {
    "open": shapes.dumbbell, "sheet": shapes.bumpy_sheet,
    "soup": lambda: shapes.soup(shapes.dumbbell()),
    "inside out": lambda: Mesh(BEAR.vertices, BEAR.faces[:, ::-1]),
    "components": lambda: shapes.together([shapes.cube(), shapes.table()]),
    "moebius": shapes.moebius, "non-manifold": shapes.fins, "slivers": shapes.slivers,
    "points": lambda: np.random.default_rng(0).random((400, 3)), "tets": lambda: shapes.block(3),
    "flat": lambda: Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 1]]),
}  # fmt: skip


@pytest.mark.parametrize("kind", SOURCES)
@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
def test_cells_of_all_kinds_have_regions(kind):
    source = SOURCES[kind]()
    k = 2
    result = segment(source, k, weights="parts", islands="nearest")
    assert result.n_segments == k
    assert np.array_equal(np.unique(result.labels), np.arange(k))


def test_inside_out_meshes_have_the_same_parts():
    turned = Mesh(BEAR.vertices, BEAR.faces[:, ::-1])
    one, other = segment(BEAR, 30, weights="parts"), segment(turned, 30, weights="parts")
    overlap = sf.metrics.area_overlap(one.labels, other.labels, np.ones(BEAR.n_faces))
    assert sf.metrics.undersegmentation_error(overlap) < 0.2


@pytest.mark.parametrize(
    "mesh", [shapes.cube(), sf.subdivide(shapes.cube(), max_edge=0.05).mesh, shapes.strip(60)]
)
def test_without_concave_creases_there_are_no_parts(mesh, monkeypatch):
    """Costs between parts are 0 for any factor. Ridges are off, because they divide a cube."""
    expected = segment(mesh, 8, weights=Weights(ridges=0)).labels
    weight = WEIGHTS["parts"]
    other = replace(weight, defaults={**weight.defaults, "gamma": 50.0})
    monkeypatch.setitem(WEIGHTS, "parts", other)
    assert np.array_equal(segment(mesh, 8, weights=Weights(ridges=0)).labels, expected)
    assert not np.array_equal(segment(BEAR, 8).labels, segment(BEAR, 8, weights="creases").labels)


FINE = sf.sample_mesh(60_000)


@pytest.fixture
def few_are_many(limit):
    """Lower the number of faces from which groups of cells are embedded."""
    limit("cells that are grouped", 20_000)


@pytest.mark.usefixtures("few_are_many")
@pytest.mark.parametrize("n_segments", [40, 1_000])
def test_labels_of_groups_depend_on_no_thread(n_segments):
    one, other = (segment(FINE, n_segments, n_threads=n) for n in (1, 3))
    assert np.array_equal(one.labels, other.labels)
    assert one.n_segments == n_segments


def test_large_meshes_have_five_iterations_on_all_faces(request):
    k = FINE.n_faces // 120
    small = segment(FINE, k, tol=1e-9)
    request.getfixturevalue("few_are_many")
    large = segment(FINE, k, tol=1e-9)
    assert small.levels[-1].n_iter > large.levels[-1].n_iter == 5
    assert len(small.levels) > 1
    assert [level.n_cells for level in small.levels] == [level.n_cells for level in large.levels]


def test_groups_have_the_parts_of_their_faces(limit):
    faces = segment(FINE, 1_000).labels
    limit("cells that are grouped", 20_000)
    groups = segment(FINE, 1_000).labels
    large, areas = segment(FINE, 20).labels, np.ones(FINE.n_faces)
    errors = [
        sf.metrics.undersegmentation_error(sf.metrics.area_overlap(labels, large, areas))
        for labels in (faces, groups)
    ]
    assert errors[1] < 1.2 * errors[0]
    assert not np.array_equal(groups, faces)


@pytest.mark.usefixtures("few_are_many")
@pytest.mark.parametrize("n_segments", [30, 1_000])
def test_many_polygons_have_the_labels_of_triangles(n_segments):
    mesh = sf.PolygonMesh.of_faces(FINE.vertices, FINE.faces)
    triangles, polygons = (segment(m, n_segments) for m in (FINE, mesh))
    assert np.mean(triangles.labels == polygons.labels) > 0.99


@pytest.mark.usefixtures("few_are_many")
def test_many_points_have_parts():
    points = np.random.default_rng(0).random((50_000, 3)) * [1, 1, 0]
    assert segment(points, 20).n_segments == 20


@pytest.mark.usefixtures("few_are_many")
def test_soup_of_many_faces_has_regions():
    """All faces are separate, so groups of cells would be single faces."""
    mesh = shapes.soup(FINE)
    result = segment(sf.prepare(mesh, weld=False), 20, islands="nearest")
    assert result.n_segments == 20


def test_many_points_at_one_place_have_regions():
    positions = np.zeros((4000, 3))
    positions[-1] = 1
    labels = segment(sf.PointCloud(positions), 5, weights="parts").labels
    assert len(np.unique(labels)) == 5
