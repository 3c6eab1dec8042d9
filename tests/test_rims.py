"""Borders follow the rims of made things, for any number of regions."""

import numpy as np
import pytest
import shapes
from shapes import subdivided

import superfacets as sf
from superfacets import _core
from superfacets.graph.kinds import as_surface, kind_of
from superfacets.graph.surface import NO_NORMALS, arc_measures
from superfacets.weights.formulas import MADE_FACTOR, WEIGHTS, WeightOptions, weights_of_kind

pytestmark = pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")


def box(*sizes):
    cube = shapes.cube()
    return sf.Mesh(cube.vertices * sizes, cube.faces)


def bracket():
    """Return a part with an L-shaped profile: six sides and two ends."""
    outline = np.array([[0, 0], [4, 0], [4, 0.5], [0.5, 0.5], [0.5, 3], [0, 3]])
    vertices = np.concatenate([np.insert(outline, 2, z, axis=1) for z in (0.0, 2.0)])
    here, after = np.arange(6), (np.arange(6) + 1) % 6
    sides = [(here, after, 6 + after), (here, 6 + after, 6 + here)]
    ends = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    faces = [*(np.stack(corners, 1) for corners in sides), ends[:, ::-1], ends + 6]
    return sf.Mesh(vertices, np.concatenate(faces))


PARTS = {
    "cube": lambda: subdivided(box(1, 1, 1), 4), "plate": lambda: subdivided(box(4, 4, 0.1), 5),
    "bar": lambda: subdivided(box(10, 0.5, 0.5), 5), "bracket": lambda: subdivided(bracket(), 4),
    "drilled block": lambda: subdivided(shapes.drilled_block(), 2),
    "table": lambda: subdivided(shapes.table(), 3),
    "gear": lambda: subdivided(shapes.gear(12, 1.0, 0.3, np.zeros(3)), 3),
    "coarse gear": lambda: shapes.gear(12, 1.0, 0.3, np.zeros(3)),
}  # fmt: skip

SIDES_OF_TABLE = 30
"""With fewer regions, one of them must contain two sides, across a rim."""

KS = (20, 22, 25, 30, 33, 40, 53, 64, 80, 110, 150, 170, 200, 251, 300)


def sides_of(graph, measures):
    """Return the side of a part that each face is on, flat or round.

    Sides meet at edges of 40 degrees or more.
    """
    is_within = np.abs(measures.angles) < np.radians(40)
    counts = np.bincount(graph.sources[is_within], minlength=graph.n_cells)
    offsets = np.append(0, np.cumsum(counts))
    neighbors = graph.neighbors[is_within]
    return _core.find_components(offsets, neighbors, np.zeros(graph.n_cells, np.int32))


def share_of_rims(graph, measures, labels):
    """Return the share of the length of convex edges of 60 degrees or more that is in borders."""
    lengths = np.where(measures.angles <= -np.pi / 3, measures.border_lengths, 0.0)
    return lengths[labels[graph.sources] != labels[graph.neighbors]].sum() / lengths.sum()


def rounded(mesh, radius):
    """Return a box after rounding its edges and corners, and the normals of its vertices."""
    inner = np.clip(mesh.vertices, mesh.bounds[0] + radius, mesh.bounds[1] - radius)
    normals = mesh.vertices - inner
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return sf.Mesh(inner + radius * normals, mesh.faces), normals


def test_no_region_crosses_a_rounded_edge():
    """Each region has faces of at most one of the six flat sides, whatever the share of fillets."""
    mesh, normals = rounded(subdivided(box(2, 1, 1.2), 4), 0.2)
    labels = sf.segment(mesh, 30).labels
    faces, sides = np.nonzero((np.hstack([normals, -normals]) == 1)[mesh.faces].all(axis=1))
    pairs = np.unique(np.stack([labels[faces], sides]), axis=1)
    assert len(pairs.T) == len(np.unique(pairs[0]))


@pytest.mark.parametrize("name", PARTS)
def test_rims_are_borders(name):
    """With 1.25 times as many regions as sides, each side is one region or several."""
    mesh = PARTS[name]()
    graph = sf.build_face_graph(mesh)
    measures = arc_measures(mesh, graph)
    sides, n_sides = sides_of(graph, measures)
    for k in KS:
        if k > mesh.n_faces or (name == "table" and k < SIDES_OF_TABLE):
            continue
        labels = sf.segment(mesh, k).labels
        assert labels.max() + 1 == k
        assert share_of_rims(graph, measures, labels) >= 0.99
        if k < 1.25 * n_sides:
            continue
        shares = np.zeros((k, n_sides))
        np.add.at(shares, (labels, sides), graph.measures)
        assert np.array_equal(np.unique(shares.argmax(axis=1)), np.arange(n_sides))


def weighed(mesh, n_threads=1, **options):
    kind = kind_of(mesh)
    graph, _ = kind.build_graph(mesh, True, n_threads)
    surface = kind.surface(mesh, graph, n_threads)
    options = WeightOptions.checked(sf.Weights(**options), None)
    return graph, weights_of_kind(kind, surface, graph, 0.3, options)


def weights_of_parts(mesh, n_threads=1, **options):
    graph, found = weighed(mesh, n_threads, **options)
    return graph, np.asarray(found.weights)


def is_made_thing(mesh):
    return weighed(mesh)[1].of_made_thing


def costs_and_angles(mesh):
    """Return the cost of the bend at each arc, in the unit of positions, and its angle."""
    graph, weights = weights_of_parts(mesh)
    ends = graph.positions[graph.sources], graph.positions[graph.neighbors]
    costs = weights * np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return costs - np.linalg.norm(ends[1] - ends[0], axis=1), arc_measures(mesh, graph).angles


def is_ridge(mesh, **options):
    return weights_of_parts(mesh, **options)[1] != weights_of_parts(mesh, ridges=0.0)[1]


def test_all_bends_of_made_things_cost_the_same():
    gear = shapes.gear(12, 1.0, 0.3, np.zeros(3))
    polygons = sf.PolygonMesh.of_faces(gear.vertices, gear.faces.tolist())
    for mesh in (gear, polygons):
        costs, angles = costs_and_angles(mesh)
        factor = MADE_FACTOR * WEIGHTS["parts"].defaults["alpha"] * 0.3 / np.pi
        assert costs == pytest.approx(factor * np.abs(angles), abs=1e-9)
        assert np.array_equal(*(weights_of_parts(mesh, n_threads=n)[1] for n in (1, 3)))


def turned(mesh, seed, scale):
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    matrix *= np.linalg.det(matrix) * scale
    return sf.Mesh(mesh.vertices @ matrix.T, mesh.faces)


def prism(n_sides, n_rings, height):
    """Return a prism over a regular polygon, with its ends."""
    angles = 2 * np.pi * np.arange(n_sides) / n_sides
    outline = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    heights = np.linspace(0.0, height, n_rings + 1)
    rings = np.concatenate([np.insert(outline, 2, z, axis=1) for z in heights])
    vertices = np.concatenate([rings, [[0, 0, 0], [0, 0, height]]])
    here = np.arange(n_sides * n_rings)
    after = here + 1 - n_sides * (here % n_sides == n_sides - 1)
    sides = [(here, after, after + n_sides), (here, after + n_sides, here + n_sides)]
    first, second = here[:n_sides], after[:n_sides]
    last, ends = n_sides * n_rings, np.full(n_sides, len(rings))
    caps = [(second, first, ends), (last + first, last + second, ends + 1)]
    return sf.Mesh(vertices, np.concatenate([np.stack(corners, 1) for corners in sides + caps]))


def test_neither_rounding_nor_units_nor_orientation_decide_what_is_a_made_thing():
    block = subdivided(shapes.drilled_block(), 2)
    single = sf.Mesh(block.vertices.astype(np.float32).astype(float), block.faces)
    polygons = sf.PolygonMesh.of_faces(block.vertices, block.faces.tolist())
    inside_out = sf.Mesh(block.vertices, block.faces[:, ::-1])
    scaled = turned(block, 1, 1e-3), turned(block, 2, 1e9)
    assert all(map(is_made_thing, (block, single, polygons, inside_out, *scaled)))
    assert not is_made_thing(sf.Mesh(np.eye(4, 3), [[0, 1, 3], [1, 2, 3], [2, 0, 3], [2, 1, 0]]))
    bear = sf.sample_mesh(5_000)
    assert not any(map(is_made_thing, (bear, subdivided(bear, 2))))  # most edges are flat


def test_at_least_a_quarter_of_the_edges_of_made_things_are_flat():
    cube = shapes.cube()
    cubes = shapes.together([cube, sf.Mesh(cube.vertices + 2, cube.faces)])
    squares = cubes.faces.reshape(12, 6)[:, [0, 1, 2, 5]].tolist()
    for n in range(13):  # n squares are cut in two, so n of the 24 + n edges are flat
        faces = [*cubes.faces[: 2 * n].tolist(), *squares[n:]]
        assert is_made_thing(sf.PolygonMesh.of_faces(cubes.vertices, faces)) == (n >= 8)


def share_of_flat_sides(mesh):
    """Return the share, computed from normals, and from angles."""
    surface = as_surface(mesh, weld=True, n_threads=2)
    first, second, third = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    vectors = np.cross(second - first, third - first)
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return [
        _core.share_of_flat_sides(surface.handle, surface.measures, given, 2)
        for given in (normals, NO_NORMALS)
    ]


def test_borders_follow_the_ridge_of_an_open_gable_roof():
    x, y, _ = shapes.flat(40).vertices.T
    roof = sf.Mesh(np.stack([x, y, -0.3 * np.abs(x - 20)], axis=1), shapes.flat(40).faces)
    is_left = roof.vertices[roof.faces].mean(axis=1)[:, 0] < 20
    labels = sf.segment(roof, 20).labels
    assert not {*labels[is_left]} & {*labels[~is_left]}


@pytest.mark.parametrize("n_times", [0, 1, 3])
def test_subdivision_does_not_change_the_share_of_flat_sides(n_times):
    """The triangles of a pointed roof are flat sides, because they are large."""
    bear, cube = sf.sample_mesh(3_000), shapes.cube()
    roof = [c for c in cube.faces.tolist() if not (cube.vertices[c, 2] == 1.0).all()]
    top = np.flatnonzero(cube.vertices[:, 2] == 1.0)
    around = top[np.argsort(np.arctan2(*(cube.vertices[top, :2] - 0.5).T))]
    tip = len(cube.vertices)
    roof += [[a, b, tip] for a, b in zip(around, np.roll(around, -1), strict=True)]
    house = sf.Mesh(np.append(cube.vertices, [[0.5, 0.5, 2.0]], axis=0), roof)
    for mesh, share in ((cube, 1.0), (house, 1.0), (bear, 0.0143506286)):
        assert share_of_flat_sides(subdivided(mesh, n_times)) == pytest.approx([share, share])
    open_cube = sf.Mesh(cube.vertices, roof[:-4])  # its sides have a boundary
    assert share_of_flat_sides(subdivided(open_cube, n_times)) == pytest.approx([1.0, 1.0])
    faces = np.where(np.arange(len(cube.faces))[:, None] % 3 == 0, cube.faces[:, ::-1], cube.faces)
    turned_over = sf.Mesh(cube.vertices, faces)  # each third face
    assert share_of_flat_sides(subdivided(turned_over, n_times)) == pytest.approx([1.0, 1.0])


def test_regions_follow_the_fillets_of_a_block_without_sharp_edges():
    """The areas are 6 flat sides, 12 rounded edges and 8 corners."""
    block, _ = rounded(subdivided(shapes.cube(), 5), 0.1)
    assert is_made_thing(block)
    areas = sf.build_face_graph(block).measures
    at = block.vertices[block.faces].mean(axis=1) - block.vertices.mean(axis=0)
    places = np.where(np.abs(at) < 0.4, 0, np.sign(at)).astype(int)
    found, truth = np.unique(places, axis=0, return_inverse=True)
    is_flat = np.abs(found).sum(axis=1) == 1
    for k in (30, 60, 150):
        shares = np.zeros((k, len(found)))
        np.add.at(shares, (sf.segment(block, k).labels, truth.ravel()), areas)
        assert ((shares[:, is_flat] > 0).sum(axis=1) <= 1).all()
        assert shares.max(axis=1).sum() >= 0.87 * areas.sum()


def test_coarse_cells_end_at_all_edges_of_a_hexagonal_prism():
    """Edges have angles of 60 degrees, plus or minus rounding errors, in every position."""
    nut = subdivided(prism(6, 1, 1.0), 3)
    for seed in range(6):
        costs, angles = costs_and_angles(turned(nut, seed, 1.0))
        is_rim = angles < -np.radians(59.9)
        limit = WeightOptions.checked("parts", None).crease_limit(0.3)
        assert np.array_equal(costs >= limit, is_rim)


def test_sharp_edges_of_other_shapes_are_not():
    rng = np.random.default_rng(0)
    cube = subdivided(shapes.cube(), 3)
    rough = sf.Mesh(cube.vertices + rng.normal(size=cube.vertices.shape) * 0.03, cube.faces)
    graph, _ = weights_of_parts(rough)
    is_sharp = arc_measures(rough, graph).angles <= -np.radians(40)
    assert is_ridge(rough).sum() < 0.1 * is_sharp.sum()
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    assert not is_ridge(sf.Mesh(corners, faces)).any()  # no edge is flat
