"""What coarse cells take over from the surface below: against a few lines of numpy."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.cells.surface import Surface

LEAST = 1e-6


def polygons():
    """A bumpy sheet whose triangles are polygons for all that is known of them."""
    sheet = shapes.bumpy_sheet(24)
    return sf.PolygonMesh.of_faces(sheet.vertices, sheet.faces.tolist())


MESHES = {
    "triangles": lambda: shapes.bumpy_sheet(24),
    "polygons": polygons,
    "fins": lambda: shapes.fins(40),
}


def coarse_cells(mesh, size=6, n_threads=2):
    """The graph of a mesh, its lengths with their unit, and coarse cells of it."""
    graph = sf.build_face_graph(mesh)
    weights = sf.crease_weights(mesh, graph, 0.1 * graph.diagonal)
    lengths, unit = _core.quantize_weights(weights, n_threads)
    placed = _core.PlacedCells(graph.positions, graph.measures, n_threads)
    ordered = _core.OrderedGraph(placed, graph.offsets, graph.neighbors, lengths, n_threads, True)
    return (
        graph,
        lengths.astype(float) * unit * graph.diagonal,
        unit,
        _core.CoarseGraph(ordered, size, n_threads),
    )


def dense(coarse, values):
    """Values of coarse arcs as a matrix."""
    offsets, neighbors, _ = coarse.arcs()
    n = len(offsets) - 1
    table = np.zeros((n, n))
    table[np.repeat(np.arange(n), np.diff(offsets)), neighbors] = values
    return table


@pytest.mark.parametrize("crease_unit", [0.0, 2.0])
@pytest.mark.parametrize("kind", MESHES)
def test_what_fine_arcs_conduct_is_summed_between_coarse_cells(kind, crease_unit):
    graph, lengths, unit, coarse = coarse_cells(MESHES[kind]())
    areas = np.random.default_rng(0).random(graph.n_cells)
    ours = coarse.crossing_conductances(areas, unit * graph.diagonal, crease_unit, 20.0, 2)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    targets, of = graph.neighbors, coarse.coarse_cells(2)
    steps = np.linalg.norm(graph.positions[sources] - graph.positions[targets], axis=1)
    kappa = np.maximum(lengths - steps, 0) / crease_unit if crease_unit else 0.0
    widths = np.sqrt(areas[sources] + areas[targets])
    true = np.zeros((coarse.graph.n_cells,) * 2)
    np.add.at(true, (of[sources], of[targets]), widths * np.exp(-20 * kappa) + LEAST * steps)
    np.fill_diagonal(true, 0)
    assert coarse.graph.n_cells > 5
    assert np.allclose(dense(coarse, ours), true, rtol=1e-9)
    assert np.array_equal(dense(coarse, ours), dense(coarse, ours).T)


@pytest.mark.parametrize("kind", ["triangles", "polygons"])
def test_area_vectors_of_coarse_cells_are_sums(kind):
    mesh = MESHES[kind]()
    graph, _, _, coarse = coarse_cells(mesh)
    surface = Surface.of_faces(mesh, graph, 1)
    sheet = MESHES["triangles"]()
    a, b, c = np.moveaxis(sheet.vertices[sheet.faces], 1, 0)
    true = np.zeros((coarse.graph.n_cells, 3))
    np.add.at(true, coarse.coarse_cells(1), 0.5 * np.cross(b - a, c - a))
    assert np.allclose(coarse.area_vectors(surface.handle, 2), true)


def test_coarse_cells_are_where_their_cells_are():
    graph, _, _, coarse = coarse_cells(shapes.bumpy_sheet(24))
    positions, measures = coarse.cells()
    of = coarse.coarse_cells(1)
    assert np.allclose(measures, np.bincount(of, weights=graph.measures))
    moments = np.zeros_like(positions)
    np.add.at(moments, of, graph.measures[:, None] * graph.positions)
    assert np.allclose(positions, moments / measures[:, None])


def test_steps_between_coarse_cells_are_straight():
    _, _, _, coarse = coarse_cells(shapes.bumpy_sheet(24))
    positions, measures = coarse.cells()
    offsets, neighbors, _ = coarse.arcs()
    sources = np.repeat(np.arange(len(measures)), np.diff(offsets))
    ways = np.linalg.norm(positions[sources] - positions[neighbors], axis=1)
    assert np.allclose(coarse.steps(2), ways)


def test_steps_between_coarse_cells_at_one_place_are_not_0():
    """The two sides of a sheet without thickness."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    mesh = sf.Mesh(corners, [[0, 1, 2], [0, 2, 1]])
    _, _, _, coarse = coarse_cells(mesh, size=1)
    assert np.allclose(coarse.steps(1), 0.2 * np.sqrt(1.0))
    placed = _core.PlacedCells(np.zeros((2, 3)), np.zeros(2), 1)
    arcs = (np.array([0, 1, 2]), np.array([1, 0], np.int32), np.ones(2, np.float32))
    of_no_size = _core.CoarseGraph(_core.OrderedGraph(placed, *arcs, 1, True), 1, 1)
    assert (of_no_size.steps(1) == 1.0).all()
