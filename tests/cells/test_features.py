"""Features, which borders follow in addition to creases."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Features, Mesh, MeshAttributes, PointCloud, segment, segment_graph
from superfacets.mesh.attributes import stored_colors


def plane(n):
    """Return a flat square of 2 n^2 triangles."""
    vertices = [[x, y, 0] for y in range(n + 1) for x in range(n + 1)]
    corners = [v for v in range(n * (n + 1)) if v % (n + 1) < n]
    halves = [((v, v + 1, v + n + 2), (v, v + n + 2, v + n + 1)) for v in corners]
    return Mesh(vertices, [face for pair in halves for face in pair])


def checks(positions):
    """Return the color of the oblique stripe that contains each position."""
    return ((positions[:, 0] + 0.4 * positions[:, 1]) // 7 % 2).astype(float)


def impurity(labels, colors):
    """Return the fraction of cells whose color is not the majority color of their region."""
    of_one = np.bincount(labels, colors)
    return np.minimum(of_one, np.bincount(labels) - of_one).sum() / len(labels)


def test_borders_follow_colors_and_ignore_them_at_weight_0():
    mesh = plane(40)
    colors = checks(mesh.vertices[mesh.faces].mean(axis=1))
    plain = segment(mesh, 30)
    ignored = segment(mesh, 30, features=Features(colors, weight=0))
    assert np.array_equal(ignored.labels, plain.labels)
    assert np.array_equal(ignored.centers, plain.centers)
    followed = segment(mesh, 30, features=colors)
    assert impurity(plain.labels, colors) > 0.1
    assert impurity(followed.labels, colors) < 0.01
    assert followed.params["feature_weight"] == 5.0
    assert "feature_weight" not in plain.params


@pytest.mark.parametrize("n_vertices", [0, 121])
def test_features_outside_the_mask_have_no_effect(n_vertices):
    mesh = plane(10)
    places = mesh.vertices if n_vertices else mesh.vertices[mesh.faces].mean(axis=1)
    mask, values = places[:, 0] < 6.2, places[:, 1] % 4
    labels = segment(mesh, 9, features=values, mask=mask).labels
    for other in (np.nan, np.inf, 1e9):
        found = segment(mesh, 9, features=np.where(mask, values, other), mask=mask)
        assert np.array_equal(found.labels, labels)


def test_stored_colors_are_those_of_the_cloud_or_else_of_the_file():
    mesh = plane(1)
    shades = {name: np.full(mesh.n_vertices, 7) for name in ("red", "green", "blue")}
    attributes = MeshAttributes(vertex=shades)
    assert stored_colors(mesh, attributes).tolist() == [[7, 7, 7]] * mesh.n_vertices
    cloud = PointCloud(mesh.vertices, colors=np.full((mesh.n_vertices, 3), [0, 128, 255], np.uint8))
    assert stored_colors(cloud, attributes).tolist() == [[0, 128, 255]] * mesh.n_vertices
    assert stored_colors(PointCloud(mesh.vertices), attributes).tolist() == [[7, 7, 7]] * 4
    black = PointCloud(mesh.vertices, colors=np.zeros((mesh.n_vertices, 3), np.uint8))
    assert stored_colors(black, None) is None
    assert stored_colors(mesh, MeshAttributes(vertex={"heat": [1.0] * mesh.n_vertices})) is None
    assert stored_colors(mesh, None) is None


def test_clouds_and_graphs_have_features_too():
    points = np.column_stack([np.random.default_rng(0).random((4000, 2)) * 40, np.zeros(4000)])
    colors = checks(points)
    assert impurity(segment(points, 30).labels, colors) > 0.1
    assert impurity(segment(points, 30, features=colors).labels, colors) < 0.02
    graph = sf.build_point_graph(points)
    assert impurity(segment_graph(graph, 30, features=colors).labels, colors) < 0.02
    same = segment_graph(graph, 30, features=Features(colors, weight=0))
    assert np.array_equal(same.labels, segment_graph(graph, 30).labels)


def test_a_step_costs_what_the_docs_say():
    graph = sf.CellGraph(
        [[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 2], [1, 0], [1.0, 1.0], weight_unit=2.0
    )
    steps = Features([[0.0, 5.0], [3.0, 1.0]], weight=0.5).costs(graph, graph.measures, 1)
    of_two = steps.added(graph.weights, graph, 4.0)
    assert of_two == pytest.approx([1 + 8**0.5] * 2)  # a difference of 2 deviations per feature


def test_scaled_features_do_not_depend_on_their_unit():
    mesh = plane(20)
    colors = checks(mesh.vertices[mesh.faces].mean(axis=1))
    table = np.column_stack([colors, np.full(len(colors), 1e9)])
    first = segment(mesh, 12, features=colors).labels
    assert np.array_equal(segment(mesh, 12, features=1024 * colors).labels, first)
    assert np.array_equal(segment(mesh, 12, features=table).labels, first)
    with pytest.warns(sf.FeatureWarning, match="^features: all cells have the same value, so this"):
        flat = segment(mesh, 12, features=np.ones(len(colors)))
    assert np.array_equal(flat.labels, segment(mesh, 12).labels)


@pytest.mark.parametrize("weights", ["superfacets", "given"])
def test_other_weights_take_features(weights):
    mesh = plane(30)
    colors = checks(mesh.vertices[mesh.faces].mean(axis=1))
    if weights == "given":
        graph = sf.build_face_graph(mesh)
        weights = np.full(graph.n_arcs, 1 / graph.diagonal).tolist()
    plain = segment(mesh, 20, weights=weights)
    followed = segment(mesh, 20, weights=weights, features=Features(colors, weight=50))
    assert impurity(followed.labels, colors) < 0.3 * impurity(plain.labels, colors)


def test_features_of_vertices_are_means_of_corners():
    mesh = plane(8)
    of_vertices = np.random.default_rng(0).random((mesh.n_vertices, 2))
    of_faces = of_vertices[mesh.faces].mean(axis=1)
    both = [segment(mesh, 6, features=table).labels for table in (of_vertices, of_faces)]
    assert np.array_equal(*both)


def test_features_of_vertices_of_polygons():
    faces = [[0, 1, 2, 3], [1, 4, 2], [3, 2, 4, 5]]
    positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0], [0, 3, 0]]
    mesh = sf.PolygonMesh.of_faces(positions, faces)
    table = Features(np.arange(6.0)).scaled(mesh, np.ones(3)).ravel()
    means = np.array([1.5, 7 / 3, 3.5])
    assert table == pytest.approx(means / means.std())


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"features": [np.zeros(9)] * 2}, ValueError,
     r"per vertex \(9\), got 2 rows: use numpy\.column_stack\(features\)"),
    ({"features": np.zeros((8, 0))}, ValueError, r"shape \(N, F\)"),
    ({"features": np.zeros((8, 1, 1))}, ValueError, r"shape \(N, F\)"),
    ({"features": [np.nan] * 8}, ValueError, r"features\[0\] must be finite .*, got \[nan\]"),
    ({"features": np.array(["a"] * 8)}, TypeError, "features must contain numbers, got <U1"),
    ({"features": np.ma.masked_equal(np.zeros(8), 0)}, ValueError, "masked entries"),
    ({"features": ["color", 1]}, TypeError, "features must be either names or numbers, but"),
    ({"features": Features(np.zeros(3), weight=0)}, ValueError,
     r"features must have one row per cell \(8\) or per vertex \(9\), got 3 rows"),
])  # fmt: skip
def test_wrong_features_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        segment(plane(2), 2, **arguments)


@pytest.mark.parametrize(("weight", "error", "message"), [
    (-1, ValueError, "weight must be finite and not negative, got -1"),
    (np.inf, ValueError, "weight must be finite and not negative, got inf"),
    ("5", TypeError, "weight must be a number, got '5'"),
])  # fmt: skip
def test_a_wrong_weight_of_features_is_refused(weight, error, message):
    with pytest.raises(error, match=message):
        Features(np.zeros(8), weight=weight)


def test_features_with_the_usual_weight_are_the_same_as_their_table():
    mesh = plane(30)
    colors = checks(mesh.vertices[mesh.faces].mean(axis=1))
    results = [segment(mesh, 20, features=given) for given in (colors, Features(colors))]
    assert np.array_equal(results[0].labels, results[1].labels)
    assert results[1].params["feature_weight"] == 5.0
    strong = segment(mesh, 20, features=Features(colors, weight=50))
    assert strong.params["feature_weight"] == 50.0
    assert impurity(strong.labels, colors) <= impurity(results[0].labels, colors)
    assert Features("height").names == Features(["height"]).names == ("height",)
    ball = sf.sample_mesh(3_000)
    named = [segment(ball, 20, features=given).labels for given in ("normals", Features("normals"))]
    assert np.array_equal(*named)


def test_labels_do_not_depend_on_the_number_of_threads():
    mesh = plane(180)
    colors = np.random.default_rng(0).random((mesh.n_faces, 3))
    first = segment(mesh, 50, features=colors, n_threads=1).labels
    for n_threads in 2, 3, 8:
        assert np.array_equal(segment(mesh, 50, features=colors, n_threads=n_threads).labels, first)


def test_regions_stay_connected():
    mesh = plane(40)
    colors = np.random.default_rng(0).random(mesh.n_faces)
    labels = segment(mesh, 30, features=Features(colors, weight=20)).labels
    assert shapes.count_pieces(sf.build_face_graph(mesh), labels) == 30


def test_the_warning_points_at_the_call_of_segment():
    mesh = plane(8)
    with pytest.warns(sf.FeatureWarning) as caught:
        segment(mesh, 4, features=np.ones(mesh.n_faces))
    assert caught[0].filename == __file__
