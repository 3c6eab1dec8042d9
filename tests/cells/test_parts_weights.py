"""Weights by parts: the embedding tells parts apart, and regions stay within them."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import Mesh, segment, spectral_embedding
from superfacets.cells import parts
from superfacets.cells.parts import Embedding, embed, part_weights
from superfacets.cells.weights import WeightOptions

BEAR = sf.sample_mesh(5_000)
CREASES = WeightOptions.checked("creases", None, None)
PARTS = WeightOptions.checked("parts", None, None)


def distances(embedding, one, other):
    return np.linalg.norm(embedding[one] - embedding[other], axis=-1)


def test_the_embedding_separates_two_balls():
    mesh = shapes.dumbbell(61, 28)
    embedding = spectral_embedding(mesh)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    left, right = embedding[x < -0.3, 0], embedding[x > 0.3, 0]
    assert np.sign(left.mean()) != np.sign(right.mean())
    spread = max(left.std(), right.std())
    assert abs(left.mean() - right.mean()) > 6 * spread


def test_the_embedding_depends_on_no_thread():
    one = spectral_embedding(BEAR, n_threads=1)
    assert np.array_equal(one, spectral_embedding(BEAR, n_threads=3))


def test_the_embedding_scales_and_moves_with_nothing():
    moved = Mesh(100 * BEAR.vertices + [1, 2, 3], BEAR.faces)
    one, other = spectral_embedding(BEAR), spectral_embedding(moved)
    i, j = np.random.default_rng(0).integers(0, BEAR.n_faces, (2, 500))
    before, after = distances(one, i, j), distances(other, i, j)
    assert np.corrcoef(before, after)[0, 1] > 0.99


def test_columns_that_do_not_exist_are_0():
    embedding = spectral_embedding(shapes.strip(4), 6)
    assert embedding.shape == (4, 6)
    assert np.abs(embedding[:, :3]).sum(axis=0).min() > 0
    assert not embedding[:, 3:].any()


@pytest.mark.parametrize("n", [0, 16])
def test_the_number_of_vectors_is_limited(n):
    with pytest.raises(ValueError, match="n_vectors"):
        spectral_embedding(BEAR, n)


def test_regions_stay_within_parts():
    """Fewer regions extend over both sides of the neck of two balls."""
    mesh = shapes.dumbbell(121, 40)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    result = segment(mesh, 2, weights="parts")
    assert np.mean(result.labels[x > 0.1] != result.labels[np.argmax(x)]) < 0.02
    assert result.n_segments == 2


def test_labels_depend_on_no_thread():
    one = segment(BEAR, 40, weights="parts", n_threads=1)
    other = segment(BEAR, 40, weights="parts", n_threads=3)
    assert np.array_equal(one.labels, other.labels)
    assert one.n_segments == 40
    assert one.params["weights"] == "parts"
    assert one.params["alpha"] == 25.0


def test_weights_are_the_same_both_ways():
    graph = sf.build_face_graph(BEAR)
    surface = sf.cells.surface.Surface.of_faces(BEAR, graph, 1)
    base = sf.crease_weights(BEAR, graph, 0.1, alpha=25)
    weights, _ = part_weights(BEAR, graph, surface, base, 0.1, PARTS)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    there = np.lexsort((graph.neighbors, sources))
    back = np.lexsort((sources, graph.neighbors))
    assert np.array_equal(weights[there], weights[back])
    assert np.isfinite(weights).all()
    assert (weights >= 0).all()


def tets():
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    corner = [i for i, p in enumerate(grid) if (p < 3).all()]
    cut = [[0, 16, 20, 21], [0, 16, 17, 21], [0, 4, 20, 21], [0, 4, 5, 21], [0, 1, 17, 21],
           [0, 1, 5, 21]]  # fmt: skip
    return sf.TetMesh(grid, [[c + step for step in tet] for c in corner for tet in cut])


SOURCES = {
    "open": shapes.dumbbell,
    "sheet": shapes.bumpy_sheet,
    "soup": lambda: shapes.soup(shapes.dumbbell()),
    "inside out": lambda: Mesh(BEAR.vertices, BEAR.faces[:, ::-1]),
    "components": lambda: shapes.together([shapes.cube(), shapes.table()]),
    "moebius": shapes.moebius,
    "non-manifold": shapes.fins,
    "slivers": shapes.slivers,
    "points": lambda: np.random.default_rng(0).random((400, 3)),
    "tets": tets,
    "flat": lambda: Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 1]]),
}


@pytest.mark.parametrize("kind", SOURCES)
@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
def test_what_has_no_inside_has_parts_all_the_same(kind):
    source = SOURCES[kind]()
    k = 2
    result = segment(source, k, weights="parts", islands="nearest")
    assert result.n_segments == k
    assert np.array_equal(np.unique(result.labels), np.arange(k))
    embedding = spectral_embedding(source)
    assert np.isfinite(embedding).all()
    assert len(embedding) == len(result.labels)


def test_inside_out_meshes_have_the_same_parts():
    turned = Mesh(BEAR.vertices, BEAR.faces[:, ::-1])
    one, other = segment(BEAR, 30, weights="parts"), segment(turned, 30, weights="parts")
    overlap = sf.metrics.area_overlap(one.labels, other.labels, np.ones(BEAR.n_faces))
    assert sf.metrics.undersegmentation_error(overlap) < 0.2


def test_thousands_of_islands_have_no_parts():
    """There is nothing to be slow about."""
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    n = 13_000
    vertices = (triangle[None] + 3 * np.arange(n)[:, None, None]).reshape(-1, 3)
    mesh = Mesh(vertices, np.arange(3 * n).reshape(-1, 3))
    graph = sf.build_face_graph(mesh)
    surface = sf.cells.surface.Surface.of_faces(mesh, graph, 1)
    embedding = embed(mesh, graph, surface, np.zeros(0), 1.0, CREASES)
    assert embedding.vectors.shape == (n, 0)
    assert embedding.logs is None


FINE = sf.sample_mesh(60_000)
N_GROUPS = 6_000


@pytest.fixture
def few_groups(monkeypatch):
    """Let groups be made on meshes of fewer faces."""
    monkeypatch.setattr("superfacets.cells.parts.N_BASE", N_GROUPS)


def embedded(mesh, n_threads=1):
    graph = sf.build_face_graph(mesh)
    surface = sf.cells.surface.Surface.of_faces(mesh, graph, n_threads)
    radius = 0.05 * graph.diagonal
    weights = sf.crease_weights(mesh, graph, radius, alpha=25)
    return graph, embed(mesh, graph, surface, weights, radius, PARTS)


@pytest.mark.usefixtures("few_groups")
def test_on_meshes_of_many_faces_groups_take_their_place():
    _, few = embedded(BEAR)
    assert len(few.group_of) == 0
    assert len(few.vectors) == BEAR.n_faces
    graph, many = embedded(FINE)
    assert len(many.group_of) == FINE.n_faces
    n_groups = many.group_of.max() + 1
    assert 0.8 * N_GROUPS < n_groups < 1.6 * N_GROUPS
    assert len(many.vectors) == len(many.logs) == n_groups
    assert many.vectors.shape[1] >= 8
    assert np.allclose(many.measures, np.bincount(many.group_of, weights=graph.measures))


def test_groups_have_the_thickness_and_the_parts_of_their_faces(monkeypatch):
    _, faces = embedded(FINE)
    assert len(faces.group_of) == 0
    monkeypatch.setattr("superfacets.cells.parts.N_BASE", N_GROUPS)
    graph, groups = embedded(FINE)
    difference = groups.logs[groups.group_of] - faces.logs
    assert np.average(np.abs(difference), weights=graph.measures) < 0.05
    i, j = np.random.default_rng(0).integers(0, FINE.n_faces, (2, 2_000))
    slowest = faces.vectors[:, :1], groups.vectors[groups.group_of, :1]
    before, after = (distances(vectors, i, j) for vectors in slowest)
    assert np.corrcoef(before, after)[0, 1] > 0.9


@pytest.mark.usefixtures("few_groups")
def test_labels_of_groups_depend_on_no_thread():
    one, other = (segment(FINE, 40, **sf.PARTS, n_threads=n) for n in (1, 3))
    assert np.array_equal(one.labels, other.labels)
    assert one.n_segments == 40
    assert np.array_equal(spectral_embedding(FINE, n_threads=1), spectral_embedding(FINE))


@pytest.mark.usefixtures("few_groups")
def test_many_polygons_have_groups_too():
    mesh = sf.PolygonMesh.of_faces(FINE.vertices, FINE.faces)
    triangles, polygons = (segment(m, 30, **sf.PARTS) for m in (FINE, mesh))
    assert np.mean(triangles.labels == polygons.labels) > 0.99


@pytest.mark.usefixtures("few_groups")
def test_many_faces_that_are_inside_out_have_the_same_parts():
    _, one = embedded(FINE)
    _, other = embedded(Mesh(FINE.vertices, FINE.faces[:, ::-1]))
    assert np.allclose(one.logs, other.logs, atol=0.2)


@pytest.mark.usefixtures("few_groups")
def test_many_points_have_parts_without_a_thickness():
    points = np.random.default_rng(0).random((50_000, 3)) * [1, 1, 0]
    result = segment(points, 20, **sf.PARTS)
    assert result.n_segments == 20


@pytest.mark.usefixtures("few_groups")
def test_soup_of_many_faces_has_no_groups():
    """Groups of single faces would be nothing else than the faces."""
    mesh = shapes.soup(FINE)
    graph = sf.build_face_graph(mesh, weld=False)
    surface = sf.cells.surface.Surface.of_faces(mesh, graph, 1)
    embedding = embed(mesh, graph, surface, np.zeros(0), 1.0, CREASES)
    assert len(embedding.group_of) == 0
    assert embedding.vectors.shape == (mesh.n_faces, 0)


def test_many_points_at_one_place_have_regions():
    positions = np.zeros((4000, 3))
    positions[-1] = 1
    labels = segment(sf.PointCloud(positions), 5, weights="parts").labels
    assert len(np.unique(labels)) == 5


def test_a_thickness_of_cells_without_area_counts_nothing():
    logs, measures = np.array([np.nan, 0.5]), np.array([1.0, 0.0])
    embedding = embed_nothing(logs, measures)
    assert parts._exponents(embedding, 1).tolist() == [0.0, 0.0]


def embed_nothing(logs, measures):
    none = np.zeros(0, np.int32)
    return Embedding(np.zeros((2, 0), np.float32), logs, measures, none, 0.0, None)
