"""Stage 5: straight borders."""

import time

import numpy as np
import pytest
import reference
import shapes

import superfacets as sf
from superfacets.cleanup.edit import CREASE_SCALE, read_labeled
from superfacets.cleanup.smooth import MAX_CHAIN, MAX_SWEEPS, ROUNDNESS, smooth_borders


def sheet(drawing, height=lambda x, y: 0.0):
    """Return a mesh and labels from a drawing: two characters per square, lower triangle first.

    The squares are cut from the lower left to the upper right; rows are drawn from the top.
    """
    rows = [row.split() for row in drawing.split("\n") if row.strip()][::-1]
    n_rows, n_columns = len(rows), len(rows[0])
    points = [(x, y, height(x, y)) for y in range(n_rows + 1) for x in range(n_columns + 1)]
    faces, labels = [], []
    for y, row in enumerate(rows):
        for x, (lower, upper) in enumerate(row):
            a = y * (n_columns + 1) + x
            b, c, d = a + 1, a + n_columns + 2, a + n_columns + 1
            faces += [[a, b, c], [a, c, d]]
            labels += [int(lower), int(upper)]
    return sf.Mesh(points, faces), labels


def check_smoothed(drawing, expected, height=lambda x, y: 0.0, **parameters):
    mesh, labels = sheet(drawing, height)
    _, expected_labels = sheet(expected, height)
    assert smooth_borders(mesh, labels, **parameters).tolist() == expected_labels


def test_a_zigzag_is_made_straight():
    check_smoothed(
        """
        00 00 01 11 11
        00 00 10 11 11
        00 00 01 11 11
        00 00 10 11 11
        """,
        """
        00 00 00 11 11
        00 00 00 11 11
        00 00 00 11 11
        00 00 00 11 11
        """,
    )
    # In a tooth of three squares, moving one face alone never shortens the border.
    check_smoothed(
        """
        00 00 00 11 11 11
        00 00 11 11 11 11
        00 00 11 11 11 11
        00 00 00 11 11 11
        """,
        """
        00 00 00 11 11 11
        00 00 00 11 11 11
        00 00 00 11 11 11
        00 00 00 11 11 11
        """,
    )


def test_a_straight_border_stays():
    drawing = """
        00 00 11 11
        00 00 11 11
        00 00 11 11
        """
    check_smoothed(drawing, drawing)


CORNER = """
    00 00 11 11
    00 00 11 11
    11 11 11 11
    11 11 11 11
    """
CUT_CORNER = """
    00 00 11 11
    00 10 11 11
    11 11 11 11
    11 11 11 11
    """


def test_a_corner_is_cut_on_a_plane_but_not_where_it_is_in_a_crease():
    def walls(x, y):
        """Return the height: flat at the upper left, rising to the right and below."""
        return max(0, x - 2, 2 - y)

    check_smoothed(CORNER, CUT_CORNER, max_distance=0.3)
    check_smoothed(CORNER, CORNER, walls)


def test_a_convex_edge_is_no_crease_but_a_ridge_is():
    def falling(slope):
        return lambda x, y: -slope * max(0, x - 2, 2 - y)

    check_smoothed(CORNER, CUT_CORNER, falling(0.8), max_distance=0.3)  # 39 degrees
    check_smoothed(CORNER, CORNER, falling(1.0), max_distance=0.3)


def test_a_zigzag_goes_to_the_valley_at_its_side():
    check_smoothed(
        """
        00 00 10 11 11
        00 00 10 11 11
        00 00 10 11 11
        """,
        """
        00 00 11 11 11
        00 00 11 11 11
        00 00 11 11 11
        """,
        lambda x, y: abs(x - 2),
    )


def test_no_face_goes_farther_than_it_may():
    drawing = """
        00 00 01 11 11
        00 00 10 11 11
        """
    check_smoothed(drawing, drawing, max_distance=0.0)


def test_centers_stay():
    mesh, labels = sheet("""
        00 00 01 11 11
        00 00 10 11 11
        00 00 01 11 11
        """)
    smoothed = smooth_borders(mesh, labels)
    moved = np.flatnonzero(smoothed != labels)
    assert len(moved)
    kept = smooth_borders(mesh, labels, centers=moved)
    assert np.array_equal(kept[moved], np.array(labels)[moved])


def test_one_region_and_a_region_for_each_face_stay():
    mesh = shapes.bumpy_sheet(4)
    assert smooth_borders(mesh, [0] * 32).tolist() == [0] * 32
    assert smooth_borders(mesh, range(32)).tolist() == list(range(32))
    assert smooth_borders(shapes.strip(1), [0]).tolist() == [0]


def test_faces_without_area_have_borders_without_length():
    line = sf.Mesh([[x, 0, 0] for x in range(4)], [[0, 1, 2], [1, 2, 3]])
    assert smooth_borders(line, [0, 1]).tolist() == [0, 1]


def test_given_weights_decide_what_a_crease_is():
    drawing = """
        00 00 01 11 11
        00 00 10 11 11
        00 00 01 11 11
        """
    mesh, labels = sheet(drawing)
    graph = sf.build_face_graph(mesh)
    sources = np.repeat(np.arange(mesh.n_faces), np.diff(graph.offsets))
    is_border = np.array(labels)[sources] != np.array(labels)[graph.neighbors]
    weights = np.where(is_border, 100.0, 0.1)
    assert smooth_borders(mesh, labels, weights=weights).tolist() == labels


@pytest.mark.parametrize("weld", [True, False])
def test_soup_is_smoothed_where_it_is_welded(weld):
    mesh, labels = sheet("""
        00 00 01 11 11
        00 00 10 11 11
        """)
    smoothed = smooth_borders(shapes.soup(mesh), labels, weld=weld)
    expected = smooth_borders(mesh, labels).tolist() if weld else labels
    assert smoothed.tolist() == expected


def steps_of(costs):
    """Return the lengths of arcs, in the unit of the vertices."""
    return costs.lengths.astype(float) * (costs.unit * costs.surface.weight_unit)


MESHES = {
    "sheet": lambda: shapes.bumpy_sheet(16), "moebius": lambda: shapes.moebius(40),
    "fins": lambda: shapes.fins(7), "slivers": shapes.slivers,
    "soup": lambda: shapes.soup(shapes.bumpy_sheet(9)), "sample": lambda: sf.sample_mesh(3000),
    "two sheets as one": lambda: doubled(shapes.bumpy_sheet(8)),
}  # fmt: skip


def doubled(mesh):
    """Return the mesh with each face twice, so that inner edges have four faces."""
    return sf.Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[::-1]]))


def labelings(mesh):
    """Yield the regions of `segment`, then random labels, whose regions are in pieces."""
    rng = np.random.default_rng(3)
    k = min(12, mesh.n_faces)
    yield sf.segment(mesh, k, smooth=False).labels
    yield np.unique(rng.integers(0, k, mesh.n_faces), return_inverse=True)[1]


@pytest.mark.parametrize("name", MESHES)
def test_the_kernel_equals_its_twin(name):
    mesh = MESHES[name]()
    for labels in labelings(mesh):
        _, costs, array, _ = read_labeled(mesh, labels, None, True, 1)
        fixed = {int(np.argmax(array == 0))}
        expected = reference.smooth_borders(
            sf.build_face_graph(mesh), mesh, steps_of(costs), array.tolist(), fixed,
            max_distance=1.0 * costs.radius, crease_scale=CREASE_SCALE * costs.radius,
            max_chain=MAX_CHAIN, max_sweeps=MAX_SWEEPS,
        )  # fmt: skip
        assert smooth_borders(mesh, labels, centers=sorted(fixed)).tolist() == expected


def check_twin(mesh, labels, max_chain, max_sweeps, stiffness=0.0, sizes=(), goals=()):
    _, costs, array, _ = read_labeled(mesh, labels, None, True, 1)
    stiff = (stiffness / costs.radius, ROUNDNESS * stiffness / costs.radius**3)
    expected = reference.smooth_borders(
        sf.build_face_graph(mesh), mesh, steps_of(costs), array.tolist(), set(),
        max_distance=costs.radius, crease_scale=CREASE_SCALE * costs.radius,
        max_chain=max_chain, max_sweeps=max_sweeps, stiffness=stiff[0], roundness=stiff[1],
        sizes=sizes, goals=goals,
    )  # fmt: skip
    none = np.zeros(0, np.int32)
    options = sf._core.SmoothOptions(
        costs.radius, max_chain, max_sweeps, *stiff, np.array(sizes, float), np.array(goals, float)
    )
    assert sf._core.smooth_borders(*costs.args, array, none, options, 1).tolist() == expected


@pytest.mark.parametrize("stiffness", [0.5, 20.0])
def test_the_kernel_with_stiffness_and_goals_equals_its_twin(stiffness):
    rng = np.random.default_rng(4)
    for mesh in (shapes.bumpy_sheet(16), shapes.dumbbell()):
        sizes = (0.5 + rng.random(mesh.n_faces)).tolist()
        for labels in labelings(mesh):
            goals = [sum(sizes) / (max(labels) + 1)] * (max(labels) + 1)
            check_twin(mesh, labels, 16, MAX_SWEEPS, stiffness)
            check_twin(mesh, labels, 16, MAX_SWEEPS, stiffness, sizes, goals)


def test_stiff_regions_keep_their_areas():
    """Most of these small regions would shrink to a few faces without stiffness."""
    mesh = shapes.bumpy_sheet(60)
    small = np.random.default_rng(2).choice(mesh.n_faces, 60, replace=False)
    labels = sf.segment(mesh, init=small, max_num_iter=0, smooth=False, alpha=0).labels
    areas = np.bincount(labels)
    free, stiff = (smooth_borders(mesh, labels, max_distance=3.0, stiffness=s) for s in (0.0, 5.0))
    changes = [np.abs(np.bincount(x, minlength=60) / areas - 1).mean() for x in (free, stiff)]
    assert changes[1] < 0.45 * changes[0]


@pytest.mark.parametrize("stiffness", [-1.0, np.nan, np.inf, "firm"])
def test_stiffness_is_checked(stiffness):
    mesh = shapes.bumpy_sheet(4)
    with pytest.raises((ValueError, TypeError), match="stiffness"):
        smooth_borders(mesh, np.zeros(mesh.n_faces, int), stiffness=stiffness)


def test_regions_without_area_take_part():
    """All vertices are on a line, so all areas are 0; smoothing must not divide by them."""
    mesh = shapes.bumpy_sheet(8)
    flat = sf.Mesh(mesh.vertices * [1.0, 0.0, 0.0], mesh.faces)
    labels = np.arange(mesh.n_faces) * 4 // mesh.n_faces
    assert np.unique(smooth_borders(flat, labels, stiffness=2.0)).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("n", "k", "seed"), [(5, 2, 4), (5, 2, 28), (6, 4, 10), (6, 3, 41)])
def test_of_moves_that_win_the_same_that_of_the_lowest_cell_is_first(n, k, seed):
    """On squares many moves gain the same; with these labels the result depends on their order."""
    mesh, labels = sheet("\n".join(["00 " * n] * n))
    labels = np.random.default_rng(seed).integers(0, k, len(labels))
    check_twin(mesh, labels, MAX_CHAIN, MAX_SWEEPS)


@pytest.mark.parametrize(("max_chain", "max_sweeps"), [(1, 9), (2, 1), (3, 2)])
def test_no_more_cells_move_at_once_and_no_more_often_than_allowed(max_chain, max_sweeps):
    mesh = shapes.bumpy_sheet(12)
    for labels in labelings(mesh):
        check_twin(mesh, labels, max_chain, max_sweeps)


@pytest.mark.parametrize("name", MESHES)
def test_no_region_vanishes_or_falls_apart(name):
    mesh = MESHES[name]()
    graph = sf.build_face_graph(mesh)
    for labels in labelings(mesh):
        smoothed = smooth_borders(mesh, labels, max_distance=100.0)
        assert np.array_equal(np.unique(smoothed), np.unique(labels))
        assert shapes.count_pieces(graph, smoothed) <= shapes.count_pieces(graph, labels)


def test_labels_do_not_depend_on_place_or_size():
    mesh = shapes.bumpy_sheet(128)
    labels = sf.segment(mesh, 60, alpha=0, smooth=False).labels
    smoothed = smooth_borders(mesh, labels)
    assert (smoothed != labels).any()
    moved = sf.Mesh(2.0 * mesh.vertices[:, [1, 2, 0]] + [4.0, -8.0, 2.0], mesh.faces)
    assert np.mean(smooth_borders(moved, labels) == smoothed) > 0.999


@pytest.mark.parametrize("k", [2, 60, 3000])
def test_labels_do_not_depend_on_threads(k):
    """The 80,000 faces are enough for four threads."""
    mesh = shapes.bumpy_sheet(200)
    labels = sf.segment(mesh, k, alpha=0, smooth=False).labels
    for stiffness in (0.0, 1.5):
        options = {"stiffness": stiffness, "max_distance": 3.0}
        expected = smooth_borders(mesh, labels, n_threads=1, **options)
        assert (expected != labels).any()
        for n_threads in (2, 3, 8):
            again = smooth_borders(mesh, labels, n_threads=n_threads, **options)
            assert np.array_equal(again, expected)


def stripes(first):
    """Return a sheet of regions side by side, `first` to 9; region 8 is one square wide.

    Holes at the left of region 7 and at one end of region 8 make the borders of region 7 shortest.
    """
    left = 4 * first
    squares = [(y, x) for y in range(40) for x in range(left, 37)]
    squares = [s for s in squares if not ((s[1] == 27 and s[0] < 10) or (s[1] == 32 and s[0] > 34))]
    points = [(x, y, 0.0) for y in range(41) for x in range(38)]
    corners = [38 * y + x for y, x in squares]
    faces = [t for a in corners for t in ([a, a + 1, a + 39], [a, a + 39, a + 38])]
    labels = [8 if x == 32 else 9 if x > 32 else x // 4 for _, x in squares]
    return sf.Mesh(points, faces), np.repeat(labels, 2) - first


def test_patches_of_one_color_never_touch():
    """Region 9 is the first to share a color, that of region 7: region 8 must keep them apart."""

    def do_touch(labels, graph):
        sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
        pairs = np.c_[labels[sources], labels[graph.neighbors]]
        return (np.sort(pairs) == np.array([n - 3, n - 1])).all(axis=1).any()

    for first, is_expected in ((0, False), (4, True)):
        mesh, labels = stripes(first)
        n = 10 - first
        smoothed = smooth_borders(mesh, labels)
        assert (smoothed != labels).any() == is_expected
        assert do_touch(smoothed, sf.build_face_graph(mesh)) == is_expected
        check_twin(mesh, labels, MAX_CHAIN, MAX_SWEEPS)


def test_arcs_that_lead_one_way_only_are_followed_in_turn():
    """In this grid of cells, some cells have no arc to their neighbor on the left."""
    side = 200
    cells = np.arange(side * side)
    row, column = np.divmod(cells, side)
    rng = np.random.default_rng(1)
    knows_left = (column > 0) & (rng.random(len(cells)) < 0.9)
    steps = [(knows_left, -1), (column < side - 1, 1), (row > 0, -side), (row < side - 1, side)]
    arcs = np.concatenate([np.c_[cells[has], cells[has] + step] for has, step in steps])
    arcs = arcs[np.argsort(arcs[:, 0], kind="stable")]
    offsets = np.searchsorted(arcs[:, 0], np.arange(len(cells) + 1))
    ones = np.ones(len(arcs))
    graph = sf.CellGraph(
        np.c_[column, row, 0 * row].astype(float), np.ones(len(cells)), offsets, arcs[:, 1], ones,
        arc_measures=sf.ArcMeasures(ones),
    )  # fmt: skip
    labels = (row + rng.integers(0, 2, len(cells))) // 20 * 10 + column // 20
    labels = np.unique(labels, return_inverse=True)[1]
    expected = smooth_borders(graph, labels, n_threads=1)
    for n_threads in (2, 3, 8):
        assert np.array_equal(smooth_borders(graph, labels, n_threads=n_threads), expected)


def test_a_region_that_is_touched_and_touches_none():
    graph = sf.CellGraph(
        [[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 1], [1], [1], arc_measures=sf.ArcMeasures([1.0])
    )
    assert smooth_borders(graph, [0, 1]).tolist() == [0, 1]


def test_the_labels_given_are_left_as_they_are():
    mesh, labels = sheet("""
        00 00 01 11
        00 00 10 11
        """)
    array = np.array(labels, np.int32)
    smooth_borders(mesh, array)
    assert array.tolist() == labels


@pytest.mark.parametrize(("parameters", "error", "message"), [
    ({"labels": [0, 0, 2, 2]}, ValueError, "no cell has label 1"),
    ({"labels": [0, 0, 1]}, ValueError,
     r"labels must have one value per cell \(4\), got 3 values"),
    ({"labels": [0.0] * 4}, TypeError, "labels must contain integers, got float64"),
    ({"centers": [0, 9]}, ValueError, r"centers\[1\] must be 0 to 3, got 9"),
    ({"max_distance": -1}, ValueError, "max_distance must be finite and not negative"),
    ({"weights": [1.0]}, ValueError, "weights must have one value per arc"),
    ({"n_threads": 0}, ValueError, "n_threads must be at least 1"),
    ({"mesh": 5}, TypeError,
     r"expected a mesh of superfacets, a \(vertices, faces\) pair, a path, or a mesh of"
     r" trimesh, PyVista \(PolyData\), Open3D or meshio, got int"),
])  # fmt: skip
def test_faults_are_found(parameters, error, message):
    arguments = {"mesh": shapes.strip(4), "labels": [0, 0, 1, 1]} | parameters
    with pytest.raises(error, match=message):
        smooth_borders(arguments.pop("mesh"), arguments.pop("labels"), **arguments)


def test_thousands_of_faces_on_one_edge_take_no_longer_to_smooth_than_to_join():
    """Each face has neighbors in all 500 regions, so a sum for each of them takes too long."""
    mesh = shapes.fins(1500)
    begin = time.process_time()
    graph = sf.build_face_graph(mesh)
    weights = sf.crease_weights(mesh, graph, 0.1)
    built = time.process_time() - begin
    begin = time.process_time()
    labels = np.arange(1500) // 3
    assert np.array_equal(smooth_borders(mesh, labels, weights=weights), labels)
    assert time.process_time() - begin < 5 * built + 1
