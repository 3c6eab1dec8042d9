"""Masks, barriers and warm starts of `segment` and `segment_graph`."""

import warnings
from functools import partial

import loops
import numpy as np
import pytest
import shapes

import superfacets
import superfacets as sf
from superfacets.cleanup.edit import BorderCosts
from superfacets.cleanup.smooth import SmoothOptions, straighten
from superfacets.graph.constraints import ConstraintOptions
from superfacets.graph.kinds import as_surface
from superfacets.graph.point_graph import find_point_graph
from superfacets.regions.region_graph import region_graph_of
from superfacets_formats import build_tet_graph


def tets():
    whole = shapes.block(4)
    moves = 0.05 * np.random.default_rng(0).uniform(-1, 1, whole.vertices.shape)
    return sf.TetMesh(whole.vertices + moves, whole.tets)


def points():
    return sf.PointCloud(np.random.default_rng(0).uniform(size=(700, 3)) * [1, 1, 0])


CELLS = {
    "triangles": lambda: shapes.bumpy_sheet(16), "parts": lambda: shapes.gears(8),
    "polygons": lambda: shapes.squares(16), "points": points, "tets": tets,
}  # fmt: skip


def graph_of(cells):
    if isinstance(cells, sf.PointCloud):
        return sf.build_point_graph(cells)
    return build_tet_graph(cells) if isinstance(cells, sf.TetMesh) else sf.build_face_graph(cells)


def random_field(graph, n, rng):
    """Return one of n numbers for each cell, mostly equal for cells near each other."""
    steps = graph.positions[:, None] - graph.positions[rng.integers(0, graph.n_cells, n)]
    return np.argmin((steps * steps).sum(axis=2), axis=1)


def count_pieces(graph, labels):
    """Return the number of connected pieces of cells with labels >= 0."""
    named = np.where(labels < 0, labels.max() + 1 + np.arange(len(labels)), labels)
    return shapes.count_pieces(graph, named) - int((labels < 0).sum())


def run(cells, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        return loops.segment(cells, *arguments, **options)


OPTIONS = [
    {}, {"smooth": False}, {"islands": "nearest"}, {"radius_factor": 2.0, "islands": "nearest"},
    {"init": "grid", "islands": "nearest"}, {"init": "flood"}, {"weights": "creases"},
    {"weights": "superfacets", "init": "farthest"},
]  # fmt: skip


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("name", CELLS)
def test_masks_are_never_labeled_and_labels_never_crossed(name, options):
    if name == "tets" and options.get("weights") == "superfacets":
        options = {"init": "farthest"}
    cells = CELLS[name]()
    graph = graph_of(cells)
    rng = np.random.default_rng(len(str(options)))
    for k in (1, 9):
        mask = rng.uniform(size=12)[random_field(graph, 12, rng)] < 0.7
        mask[int(rng.integers(graph.n_cells))] = True
        sides = rng.integers(-9, 9, 6)[random_field(graph, 6, rng)]
        result = run(cells, min(k, int(mask.sum())), mask=mask, barriers=sides, **options)
        labels = result.labels
        assert ((labels == -1) == ~mask).all()
        assert np.array_equal(np.unique(labels[mask]), np.arange(result.n_segments))
        assert np.array_equal(labels[result.centers], np.arange(result.n_segments))
        pairs = np.unique(np.stack([labels[mask], sides[mask]]), axis=1)
        assert pairs.shape[1] == result.n_segments  # a region has one number only
        if "islands" not in options:
            if isinstance(cells, sf.PointCloud):  # neighbors are searched inside the mask
                graph = find_point_graph(cells, 1, is_kept=mask)
            assert count_pieces(graph, labels) == result.n_segments
        assert result.params["mask"] == result.params["barriers"] == "given"


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("name", ["triangles", "parts", "polygons"])
def test_closed_loops_of_edges_are_never_crossed(name, options):
    """Edges around fields divide the mesh like labels do; without them, regions are connected."""
    mesh = CELLS[name]()
    graph = sf.build_face_graph(mesh)
    rng = np.random.default_rng(len(str(options)))
    sides = random_field(graph, 5, rng)
    edges = edges_between(mesh, graph, sides)
    result = run(mesh, 7, barriers=edges, **options)
    labels = result.labels
    pieces = pieces_of(graph, sides)
    whole = pieces_of(graph, np.zeros(graph.n_cells, int))
    for region in range(result.n_segments):
        for component in np.unique(whole[labels == region]):
            assert len(np.unique(pieces[(labels == region) & (whole == component)])) == 1
    assert np.array_equal(labels[result.centers], np.arange(result.n_segments))


def edges_between(mesh, graph, sides):
    """Return the edges whose faces have different numbers."""
    from superfacets.kit import corners_of

    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    differ = sides[sources] != sides[graph.neighbors]
    return corners_of(mesh).ends_of_sides(sources[differ], graph.sides[differ])


def pieces_of(graph, sides):
    from superfacets import _core

    return _core.find_components(graph.offsets, graph.neighbors, sides.astype(np.int32))[0]


@pytest.mark.parametrize("name", CELLS)
def test_a_mask_of_all_and_barriers_of_none_change_nothing(name):
    cells = CELLS[name]()
    expected = run(cells, 15)
    n = len(expected.labels)
    for options in (
        {"mask": np.ones(n, bool)}, {"barriers": np.zeros(n, int)},
        {"mask": np.ones(n, bool), "barriers": np.full(n, 7)},
    ):  # fmt: skip
        result = run(cells, 15, **options)
        assert np.array_equal(result.labels, expected.labels)
        assert np.array_equal(result.centers, expected.centers)


def test_barriers_that_nothing_crosses_anyway_change_nothing():
    mesh = shapes.bumpy_sheet(20)
    expected = sf.segment(mesh, 15).labels
    assert np.array_equal(sf.segment(mesh, 15, barriers=np.empty((0, 2), int)).labels, expected)
    boundary = [[0, 1], [2, 1]]  # edges of the outline
    assert np.array_equal(sf.segment(mesh, 15, barriers=boundary).labels, expected)


@pytest.mark.parametrize("name", ["triangles", "polygons", "fins"])
def test_what_is_left_has_the_measures_of_a_mesh_of_its_own(name):
    """Lengths, angles, sides and open borders are equal, and smoothing gives the same borders."""
    mesh = shapes.fins(9) if name == "fins" else CELLS[name]()
    graph = sf.build_face_graph(mesh)
    rng = np.random.default_rng(2)
    mask = rng.uniform(size=8)[random_field(graph, 8, rng)] < 0.7
    mask[0] = True
    if name == "polygons":
        alone = sf.PolygonMesh.of_faces(mesh.vertices, mesh.indices.reshape(-1, 4)[mask])
    else:
        alone = sf.Mesh(mesh.vertices, mesh.faces[mask])
    surface = as_surface(alone, weld=True, n_threads=1)
    cut = ConstraintOptions(mask, None).kept_cells(mesh, graph, weld=True, n_threads=1)
    part = cut.surface_of(as_surface(mesh, weld=True, n_threads=1))
    assert np.array_equal(part.offsets, surface.offsets)
    assert np.array_equal(part.neighbors, surface.neighbors)
    assert np.array_equal(part.positions, surface.positions)
    for one, other in zip(part.handle.arc_measures(2), surface.handle.arc_measures(1), strict=True):
        assert one == pytest.approx(other, abs=1e-12)
    labels = (rng.permutation(surface.n_cells) % min(9, surface.n_cells)).astype(np.int32)
    costs = [
        BorderCosts.of_weights(whole, np.ones(surface.n_arcs), 1.0) for whole in (part, surface)
    ]
    one, other = (
        straighten(cost, labels, np.empty(0, np.int32), SmoothOptions()) for cost in costs
    )
    assert np.array_equal(one, other)
    one, other = (region_graph_of(whole, labels, labels.max() + 1) for whole in (part, surface))
    for field in ("measures", "centroids", "normals", "deviations", "bounds", "perimeters"):
        expected = getattr(other, field)
        assert getattr(one, field) == pytest.approx(expected, abs=1e-7, nan_ok=True), field


def test_only_the_area_that_is_kept_counts():
    mesh = shapes.flat(12)
    left = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] < 6
    alone = sf.Mesh(mesh.vertices, mesh.faces[left])
    result = sf.segment(mesh, 9, mask=left, smooth=False)
    expected = sf.segment(alone, 9, smooth=False)
    assert result.params["radius"] == pytest.approx(np.sqrt(72 / (9 * np.pi)))
    assert np.array_equal(result.labels[left], expected.labels)
    assert np.array_equal(result.centers, np.flatnonzero(left)[expected.centers])
    with pytest.raises(
        ValueError, match="n_segments must be at most 144, the number of faces, got 145"
    ):
        sf.segment(mesh, 145, mask=left)


def test_an_open_line_of_edges_is_walked_around():
    mesh = shapes.flat(4)
    wall = [[2, 7], [7, 12], [12, 17]]  # from the outline up to the middle of the last row
    assert sf.segment(mesh, 1, barriers=wall).n_segments == 1
    by_steps = sf.segment(mesh, init=[0], barriers=wall, max_num_iter=0, smooth=False)
    assert by_steps.n_segments == 1
    cut = sf.segment(mesh, barriers=[*wall, [22, 17]], init=[0], smooth=False)
    assert cut.n_segments == 2
    assert count_pieces(sf.build_face_graph(mesh), cut.labels) == 2


def test_edges_are_welded_as_the_mesh_is():
    mesh = shapes.soup(shapes.flat(4))
    joined = shapes.flat(4)
    wall = np.array([[2, 7], [7, 12], [12, 17], [17, 22]])
    places = {tuple(p): i for i, p in enumerate(mesh.vertices.tolist())}  # any of several
    named = [[places[tuple(joined.vertices[v].tolist())] for v in edge] for edge in wall]
    assert run(mesh, 1, barriers=named).n_segments == 2
    with pytest.raises(
        ValueError, match=r"barriers\[0\] must be an edge of the mesh, got \[15, 39\]"
    ):
        sf.segment(sf.prepare(mesh, weld=False), 1, barriers=named)


def test_pieces_between_edges_stay_and_whole_parts_join_the_nearest():
    square = shapes.flat(4)
    speck = sf.Mesh([[9, 0, 0], [9.1, 0, 0], [9, 0.1, 0]], [[0, 1, 2]])
    mesh = shapes.together([square, speck])
    wall = [[2, 7], [7, 12], [12, 17], [17, 22]]
    with pytest.warns(sf.IslandWarning, match="2 regions instead of 1: 1 part between barriers"):
        result = sf.segment(mesh, 1, barriers=wall, islands="nearest")
    right = square.vertices[square.faces].mean(axis=1)[:, 0] > 2
    labels = result.labels
    assert len(np.unique(labels[:-1][right])) == len(np.unique(labels[:-1][~right])) == 1
    assert labels[-1] == labels[:-1][right][0]
    assert result.n_unreached == 2


def test_islands_join_the_nearest_region_of_their_number():
    parts = [
        sf.Mesh(shapes.strip(4).vertices + [x, 0, 0], shapes.strip(4).faces) for x in (0, 5, 30)
    ]
    specks = [sf.Mesh([[x, 5, 0], [x + 0.1, 5, 0], [x, 5.1, 0]], [[0, 1, 2]]) for x in (0, 6, 9)]
    mesh = shapes.together([*parts, *specks])
    sides = np.repeat([0, 1, 2, 2, 0, 3], [4, 4, 4, 1, 1, 1])
    with pytest.warns(sf.IslandWarning, match=r"4 regions instead of 3: 1 part between"):
        result = sf.segment(mesh, 3, barriers=sides, islands="nearest")
    assert result.labels[12:14].tolist() == result.labels[[0, 4, 8]][[2, 0]].tolist()
    assert result.labels[14] == 3


@pytest.mark.parametrize("cells", [shapes.bumpy_sheet(20), points()], ids=["mesh", "points"])
def test_a_run_begins_where_another_ended(cells):
    first = sf.segment(cells, 15, smooth=False)
    again = sf.segment(cells, init=first, smooth=False)
    assert again.n_iter < first.n_iter
    assert again.params["init"] == "given"
    still = sf.segment(cells, init=first, smooth=False, max_num_iter=0)
    assert np.array_equal(still.labels, first.labels)
    assert np.array_equal(still.centers, first.centers)
    assert (still.n_iter, still.stop_reason) == (0, "max_num_iter")


def test_labels_begin_with_their_central_cells():
    mesh = shapes.flat(4)
    halves = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 2).astype(int)
    result = sf.segment(mesh, init=halves, max_num_iter=0, smooth=False)
    graph = sf.build_face_graph(mesh)
    for label in (0, 1):
        cells = np.flatnonzero(halves == label)
        steps = graph.positions[cells] - graph.positions[cells].mean(axis=0)
        assert result.centers[label] == cells[np.argmin((steps * steps).sum(axis=1))]
    partly = np.where(mesh.vertices[mesh.faces].mean(axis=1)[:, 1] > 3, -1, halves)
    assert sf.segment(mesh, init=partly).n_segments == 2
    assert sf.segment(mesh, init=partly, mask=partly >= 0).n_segments == 2
    # Centers are those of the remaining cells; a label without remaining cells makes no region.
    upper = mesh.vertices[mesh.faces].mean(axis=1)[:, 1] > 3
    assert sf.segment(mesh, init=halves, mask=upper).n_segments == 2
    assert sf.segment(mesh, init=halves, mask=halves == 1).n_segments == 1
    with pytest.raises(
        ValueError, match="init must have a label >= 0 for a cell inside the mask, got only -1"
    ):
        sf.segment(mesh, init=np.where(upper, -1, halves), mask=upper)


def test_all_cells_may_be_seeds():
    mesh = shapes.strip(5)
    order = [4, 2, 0, 1, 3]
    assert sf.segment(mesh, init=order, smooth=False).centers.tolist() == order


def test_without_iterations_cells_go_to_the_centers_given():
    mesh = shapes.strip(9)
    result = sf.segment(mesh, init=[0, 1], max_num_iter=0, smooth=False)
    assert result.centers.tolist() == [0, 1]
    assert result.labels.tolist() == [0] + [1] * 8
    assert sf.segment(mesh, 3, max_num_iter=0).n_iter == 0


@pytest.mark.parametrize("options", [{}, {"islands": "nearest"}, {"radius_factor": 2.0}], ids=str)
def test_graphs_have_masks_and_barriers_too(options):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(5, 200))
        graph = shapes.random_graph(n, 2 * n, seed)
        mask = rng.uniform(size=n) < 0.8
        mask[0] = True
        sides = rng.integers(0, 3, n)
        k = int(rng.integers(1, mask.sum() + 1))
        segment_graph = loops.segment_graph if "radius_factor" in options else sf.segment_graph
        result = segment_graph(graph, k, mask=mask, barriers=sides, **options)
        assert ((result.labels == -1) == ~mask).all()
        pairs = np.unique(np.stack([result.labels[mask], sides[mask]]), axis=1)
        assert pairs.shape[1] == result.n_segments
        if "radius_factor" in options:
            continue  # the reach depends on the number of regions
        same = {"mask": mask, "barriers": sides, **options}
        again = sf.segment_graph(graph, init=result, max_num_iter=0, **same)
        assert np.array_equal(again.labels, result.labels)


def test_results_of_graphs_are_those_of_meshes():
    mesh = shapes.bumpy_sheet(12)
    faces = sf.build_face_graph(mesh)
    rng = np.random.default_rng(0)
    mask = rng.uniform(size=9)[random_field(faces, 9, rng)] < 0.7
    sides = random_field(faces, 3, rng)
    options = {"mask": mask, "barriers": sides}
    expected = run(mesh, 12, weights="creases", smooth=False, denoise=0, **options)
    weights = sf.crease_weights(mesh, faces, expected.params["radius"])
    graph = faces.with_weights(weights)
    found = sf.segment_graph(graph, 12, **options)
    assert np.array_equal(found.labels, expected.labels)
    assert np.array_equal(found.centers, expected.centers)


def test_constrained_labels_do_not_depend_on_threads():
    mesh = shapes.bumpy_sheet(60)
    graph = sf.build_face_graph(mesh)
    rng = np.random.default_rng(1)
    mask = rng.uniform(size=20)[random_field(graph, 20, rng)] < 0.8
    sides = random_field(graph, 7, rng)
    one, two = (run(mesh, 40, mask=mask, barriers=sides, n_threads=n) for n in (1, 3))
    assert np.array_equal(one.labels, two.labels)


@pytest.mark.parametrize(("options", "error", "message"), [
    ({"mask": [1, 0]}, TypeError, "bool, such as labels >= 0, got int64"),
    ({"mask": [True]}, ValueError, r"mask must have shape \(4,\), got \(1,\)"),
    ({"mask": [False] * 4}, ValueError,
     "mask must be True for at least one cell, but it is False everywhere"),
    ({"mask": np.ma.array([True] * 4, mask=[0, 0, 0, 1])}, ValueError,
     "mask must not have masked entries: fill or remove these entries"),
    ({"mask": [True, True, False, True], "init": [1, 2]}, ValueError,
     r"init\[1\] is cell 2, but the mask excludes this cell"),
    ({"barriers": [0.5] * 4}, TypeError, "barriers must contain integers, got float64"),
    ({"barriers": [1, 2]}, ValueError,
     r"barriers must have one number per cell, shape \(4,\), or be edges of a mesh, shape \(E,"
     r" 2\), got shape \(2,\)"),
    ({"barriers": [[0, 1, 2]]}, ValueError, r"barriers must have shape \(E, 2\), got \(1, 3\)"),
    ({"barriers": [[0, 9]]}, ValueError,
     r"barriers\[0\] must be vertices from 0 to 5, got \[0, 9\]"),
    ({"barriers": [[0, 1], [0, 5]]}, ValueError,
     r"barriers\[1\] must be an edge of the mesh, got \[0, 5\]"),
    ({"barriers": [[0.0, 1.0]]}, TypeError, "barriers must contain integers, got float64"),
    ({"barriers": np.ma.array([1] * 4, mask=[0, 0, 0, 1])}, ValueError,
     "barriers must not have masked entries: fill or remove these entries"),
    ({"max_num_iter": -1}, ValueError, "max_num_iter must be at least 0, got -1"),
    ({"init": [0, 0, 2, 2]}, ValueError,
     "init must be seeds, or valid labels of all cells: labels must be consecutive integers"
     " from 0, but no cell has label 1"),
    ({"init": [-1] * 4}, ValueError,
     "init must have a label >= 0 for a cell inside the mask, got only -1"),
    ({"init": [0, 0, 1, 1], "n_segments": 3}, ValueError,
     "n_segments must be the number of seeds in init, 2, got 3: leave n_segments out"),
])  # fmt: skip
def test_wrong_arguments_are_named(options, error, message):
    with pytest.raises(error, match=message):
        sf.segment(shapes.strip(4), **options)


def test_seeds_of_a_cloud_are_named_by_their_numbers_in_the_input():
    mask = np.arange(700) != 123
    with pytest.raises(ValueError, match=r"init\[1\] is cell 123, but the mask excludes this cell"):
        sf.segment(points(), mask=mask, init=[7, 123])
    with pytest.raises(ValueError, match=r"init\[1\] must be 0 to 699, got 700"):
        sf.segment(points(), init=[7, 700])


def scan():
    """Return points of a roof, and a mask that keeps every tenth, so most neighbors are left out.

    The third result is a cloud of only these points.
    """
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-1, 1, (2, 6000))
    heights = 5 - np.abs(x) + 0.001 * rng.normal(size=6000)
    cloud = sf.PointCloud(np.stack([x, y, heights], axis=1), viewpoints=[0, 0, 99])
    kept = np.flatnonzero(rng.uniform(size=6000) < 0.1)
    mask = np.zeros(6000, bool)
    mask[kept] = True
    return cloud, mask, cloud.taken(kept)


OF_POINTS = {
    "defaults": {}, "radius": {"n_segments": None, "radius": 0.3},
    "creases": {"weights": "creases"}, "balance": {"sizes": sf.Sizes(balance=1.0)},
    "ends": {"radius_factor": 2.0}, "normals": {"features": "normals"},
    "height": {"features": "height"},
}  # fmt: skip


@pytest.mark.parametrize("options", OF_POINTS.values(), ids=OF_POINTS)
def test_a_mask_of_a_cloud_is_the_same_as_no_other_points(options):
    cloud, mask, alone = scan()
    options = {"n_segments": 12, **options}
    result, expected = (run(cloud, mask=mask, **options), run(alone, **options))
    whole = np.full(cloud.n_points, -1)
    whole[mask] = expected.labels
    assert np.array_equal(result.labels, whole)
    assert np.array_equal(result.centers, np.flatnonzero(mask)[expected.centers])
    assert result.n_unreached == expected.n_unreached
    for regions in (result.regions, sf.region_graph(cloud, result.labels, centers=result.centers)):
        for name, values in expected.regions.table().items():
            if name != "center":
                assert np.array_equal(regions.table()[name], values, equal_nan=True), name
        assert np.array_equal(regions.edge_index, expected.regions.edge_index)


def test_arrays_for_masked_clouds_have_a_row_per_point_of_the_cloud():
    cloud, mask, alone = scan()
    kept = np.flatnonzero(mask)
    sides = (cloud.points[:, 1] > 0.2).astype(int)
    weights = sf.build_point_graph(alone).weights
    for given, of_alone in (
        ({"barriers": sides}, {"barriers": sides[mask]}),
        ({"init": kept[::50]}, {"init": np.arange(len(kept))[::50]}),
        ({"init": sides}, {"init": sides[mask]}), ({"features": sides}, {"features": sides[mask]}),
        ({"n_segments": 9, "weights": weights}, {"n_segments": 9, "weights": weights}),
    ):  # fmt: skip
        found, expected = run(cloud, mask=mask, **given), run(alone, **of_alone)
        assert np.array_equal(found.labels[mask], expected.labels), given.keys()


def test_edits_of_partly_labeled_clouds_are_those_of_the_labeled_points():
    cloud, mask, alone = scan()
    few = sf.segment(alone, 40, smooth=False).labels
    labels = np.full(cloud.n_points, -1)
    labels[mask] = few
    assert np.array_equal(sf.smooth_borders(cloud, labels)[mask], sf.smooth_borders(alone, few))
    for edit in (sf.enforce_connectivity, partial(sf.merge_small_regions, min_size=1.1)):
        assert np.array_equal(edit(cloud, labels).labels[mask], edit(alone, few).labels)
    levels = {"counts": [12, 3], "features": "normals"}
    found, expected = sf.hierarchy(cloud, mask=mask, **levels), sf.hierarchy(alone, **levels)
    for at_all, at_kept in zip(found.levels, expected.levels, strict=True):
        assert np.array_equal(at_all[mask], at_kept)


@pytest.mark.parametrize("kept", [[3], [0, 4]], ids=["one", "coincident"])
def test_masks_of_one_position_work(kept):
    cloud = sf.PointCloud([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 1, 0], [0, 0, 0]])
    result = sf.segment(cloud, 1, mask=np.isin(np.arange(5), kept))
    assert np.flatnonzero(result.labels == 0).tolist() == kept
    assert result.regions.cell_counts.tolist() == [len(kept)]


def test_what_does_not_fit_the_cells_is_named():
    with pytest.raises(
        ValueError, match="init must be a segmentation of 5 cells, got one of 4 cells"
    ):
        sf.segment(shapes.strip(5), init=sf.segment(shapes.strip(4), 2))
    for cells in (points(), tets()):
        with pytest.raises(ValueError, match=r"barriers of shape \(E, 2\) need a mesh"):
            sf.segment(cells, 2, barriers=[[0, 1]])
    with pytest.raises(ValueError, match=r"barriers of shape \(E, 2\) need a mesh"):
        sf.segment_graph(shapes.line_graph([1.0, 1.0]), 2, barriers=[[0, 1]])


def test_sharp_edges_divide_a_part_into_its_faces():
    block = shapes.drilled_block(64)
    edges = sf.sharp_edges(block)
    labels = sf.segment(block, 1, barriers=edges).labels  # without a warning
    assert sorted(np.bincount(labels)) == [2, 2, 2, 2, 68, 68, 128]  # sides, ends, the hole
    with pytest.warns(sf.IslandWarning) as warned:
        sf.segment(block, 2, barriers=edges)
    assert str(warned[0].message) == (
        "7 regions instead of 2: barriers divide the cells into components, each of which has at"
        " least one region"
    )
    assert len(sf.sharp_edges(block, 5)) == len(edges) + 64  # the hole bends by 360 / 64 degrees
    assert len(sf.sharp_edges(block, 90)) == len(edges)
    assert len(sf.sharp_edges(block, 91)) == 0


def test_sharp_edges_are_those_of_polygons_and_of_part_of_faces():
    cube = shapes.cube()
    rim = sf.sharp_edges(cube)
    assert rim.shape == (12, 2)
    assert rim.dtype == np.int32
    assert (rim[:, 0] < rim[:, 1]).all()
    assert (np.ptp(cube.vertices[rim], axis=1) > 0).sum() == 12  # along the axes, no diagonals
    faces = np.array(cube.faces)
    faces[::3] = faces[::3, ::-1]
    assert sf.sharp_edges(sf.Mesh(cube.vertices, faces)).tolist() == rim.tolist()
    assert (
        sf.sharp_edges(sf.PolygonMesh.of_faces(cube.vertices, cube.faces)).tolist() == rim.tolist()
    )
    assert len(sf.sharp_edges(shapes.flat(3))) == 0


def test_sharp_edges_are_welded_as_barriers_are():
    block = shapes.drilled_block(16)
    soup = shapes.soup(block)
    edges = sf.sharp_edges(soup)
    assert len(edges) == len(sf.sharp_edges(block))
    assert len(sf.sharp_edges(soup, weld=False)) == 0
    labels = sf.segment(soup, 1, barriers=edges).labels
    assert np.array_equal(labels, sf.segment(block, 1, barriers=sf.sharp_edges(block)).labels)


def test_an_edge_of_three_faces_is_sharp_at_any_angle():
    fan = sf.Mesh(
        [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [-1, 0.1, 0]],
        [[0, 1, 2], [1, 0, 3], [1, 0, 4]],
    )
    assert sf.sharp_edges(fan, 180).tolist() == [[0, 1]]


@pytest.mark.parametrize("angle", [0, -1, 181, np.nan])
def test_angles_out_of_range_are_refused(angle):
    with pytest.raises(ValueError, match="angle must be"):
        sf.sharp_edges(shapes.flat(1), angle)


def test_sharp_edges_need_faces():
    with pytest.raises(
        ValueError, match="expected a surface mesh, got a PointCloud, which has no faces"
    ):
        sf.sharp_edges(points())


def test_a_mask_and_barriers_of_vertices_keep_the_faces_of_the_same_labels():
    mesh = superfacets.sample_mesh(3_000)
    areas = np.random.default_rng(0).integers(-1, 3, mesh.n_vertices)  # many ties of three
    of_faces = superfacets.face_labels(mesh, areas)
    found = run(mesh, 300, mask=areas >= 0, barriers=areas).labels
    assert np.array_equal(found >= 0, of_faces >= 0)
    expected = run(mesh, 300, mask=of_faces >= 0, barriers=of_faces).labels
    assert np.array_equal(found, expected)


def parts_of_a_block():
    """Return a fine mesh of a drilled block, and the face of the part of each of its faces."""
    block = shapes.drilled_block(64)
    fine = sf.subdivide(block, 0.08)
    return fine.mesh, sf.cad_faces(block)[fine.sources]


@pytest.mark.parametrize("init", ["geodesic", "curve", "farthest"])
@pytest.mark.parametrize("k", [7, 20, 60])
def test_areas_between_barriers_share_the_regions_in_proportion_to_their_size(init, k):
    mesh, faces = parts_of_a_block()
    result = sf.segment(mesh, k, barriers=faces, init=init)
    shares = np.bincount(faces, sf.build_face_graph(mesh).measures)
    shares *= k / shares.sum()
    counts = [len(np.unique(result.labels[faces == face])) for face in range(7)]
    assert result.n_segments == sum(counts) == k
    assert (np.abs(counts - np.maximum(shares, 1)) < 1).all() or k == 7


def test_each_area_between_barriers_has_a_region_even_if_fewer_are_requested():
    mesh, faces = parts_of_a_block()
    with pytest.warns(sf.IslandWarning, match="7 regions instead of 3: barriers divide"):
        labels = sf.segment(mesh, 3, barriers=faces).labels
    assert len(np.unique(np.stack([labels, faces]), axis=1).T) == 7
    disks = np.bincount(faces, sf.build_face_graph(mesh).measures) / np.pi / 0.36**2
    counts = np.maximum(disks.round(), 1).astype(int)  # of 1.76, 1.39 and 0.74 disks
    labels = sf.segment(mesh, radius=0.36, barriers=faces).labels
    assert [len(np.unique(labels[faces == face])) for face in range(7)] == counts.tolist()
    line = ([[x, 0, 0] for x in range(4)], [[0, 1, 2], [1, 2, 3]])  # faces without area
    with pytest.warns(sf.RadiusWarning):
        assert sf.segment(line, radius=1.0, barriers=[0, 1]).labels.tolist() == [0, 1]


def test_areas_without_a_seed_join_the_nearest_region_if_islands_do():
    """A small square and a large one of the same barrier number, and a large one of another."""
    squares = [shapes.flat(8), shapes.flat(8), shapes.flat(1)]
    moved = [sf.Mesh(mesh.vertices + [20 * i, 0, 0], mesh.faces) for i, mesh in enumerate(squares)]
    groups = np.repeat([0, 1, 1], [mesh.n_faces for mesh in moved])
    result = sf.segment(shapes.together(moved), 4, barriers=groups, islands="nearest")
    assert result.n_segments == 4
    assert len(np.unique(result.labels[groups == 0])) == 2
