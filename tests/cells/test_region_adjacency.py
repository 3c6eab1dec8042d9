"""The region graph: numbers computed by hand, comparison with the reference, and invariances."""

import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
import reference
import shapes
from shapes import column

import superfacets as sf
from superfacets.graph.kinds import as_surface
from superfacets.graph.point_graph import find_point_graph, point_surface
from superfacets.graph.surface import arc_measures
from superfacets.paper import superfacet_weights
from superfacets.regions.region_graph import region_graph_of

QUARTER = np.pi / 2
NAN = float("nan")
SPREAD = np.sqrt(1 / 12)  # standard deviation along a line of length 1

CORNERS = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
OUTWARDS = [[0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]]


def arcs_of(graph):
    """Return the values of each pair of adjacent regions, as a dict of tuples."""
    values = np.stack([graph.arc_values(name) for name in graph.ARC_VALUES], axis=1)
    pairs = zip(*graph.edge_index.tolist(), strict=True)
    return {
        pair: pytest.approx(row, nan_ok=True)
        for pair, row in zip(pairs, values.tolist(), strict=True)
    }


@pytest.mark.parametrize("is_cut", [False, True])
def test_the_sides_of_a_cube(is_cut):
    """The sides are squares, or are cut into two triangles each, which must not matter."""
    cube, labels = (
        (shapes.cube(), np.repeat(range(6), 2)) if is_cut else (shapes.quad_cube(), range(6))
    )
    graph = sf.region_graph(cube, labels)
    pairs = [(a, b) for a in range(6) for b in range(a + 1, 6) if a // 2 != b // 2]
    assert arcs_of(graph) == dict.fromkeys(pairs, (1, QUARTER, -QUARTER, -QUARTER, 1, QUARTER))
    assert graph.measures.tolist() == graph.areas.tolist() == [1] * 6
    assert graph.centroids == pytest.approx(np.array(OUTWARDS) / 2 + 0.5)
    assert graph.normals == pytest.approx(np.array(OUTWARDS))
    assert graph.plane_normals == pytest.approx(np.array(OUTWARDS))
    assert graph.normal_lengths == pytest.approx(np.ones(6))
    assert graph.deviations == pytest.approx(np.array([[SPREAD, SPREAD, 0]] * 6))
    assert graph.bounds[1].tolist() == [[0, 0, 1], [1, 1, 1]]
    assert graph.perimeters.tolist() == graph.compactness.tolist() == [4] * 6
    assert graph.open_lengths.tolist() == [0] * 6
    assert not graph.is_open.any()
    assert graph.cell_counts.tolist() == [1 + is_cut] * 6
    assert graph.neighbor_counts.tolist() == [4] * 6
    assert graph.centers.tolist() == list(range(0, 6 * (1 + is_cut), 1 + is_cut))
    assert graph.neighbors(2).tolist() == [0, 1, 4, 5]
    assert graph.planarity == pytest.approx(np.ones(6))
    for flat in (graph.linearity, graph.sphericity, graph.surface_variation):
        assert flat == pytest.approx(np.zeros(6), abs=1e-12)
    assert repr(graph) == (
        "RegionGraph(6 regions, 12 pairs; .to_pandas(), .to_networkx(), .to_scipy(), .to_pyg())"
    )


def test_a_cube_in_one_region_has_no_normal_and_no_border():
    graph = sf.region_graph(shapes.cube(), [0] * 12)
    assert np.isnan(graph.normals).all()
    assert np.isnan(graph.plane_normals).all()
    assert graph.normal_lengths == pytest.approx([0], abs=1e-12)
    assert (graph.n_arcs, graph.perimeters.tolist()) == (0, [0])
    assert graph.centroids.tolist() == [[0.5, 0.5, 0.5]]
    # Along an axis, two squares are at 1/2 from the center, and four have a length of 1.
    assert graph.deviations == pytest.approx(np.sqrt([[(2 * 0.25 + 4 / 12) / 6] * 3]))
    assert graph.sphericity == pytest.approx([1])
    assert not hasattr(graph, "curvature")  # old name, although the value is not 1/r
    assert graph.surface_variation == pytest.approx([1 / 3])
    assert graph.linearity == pytest.approx([0], abs=1e-12)


def test_a_box_and_its_lid():
    graph = sf.region_graph(shapes.quad_cube(), [0, 1, 0, 0, 0, 0])
    assert arcs_of(graph) == {(0, 1): (4, QUARTER, -QUARTER, -QUARTER, 4, np.pi)}
    assert graph.areas.tolist() == [5, 1]
    assert graph.perimeters.tolist() == [4, 4]
    # Normals of opposite sides cancel, so only the bottom remains.
    assert graph.normals == pytest.approx(np.array([[0, 0, -1], [0, 0, 1]]))
    assert graph.normal_lengths == pytest.approx([1 / 5, 1])
    assert graph.centroids[0] == pytest.approx([0.5, 0.5, (0 + 4 * 0.5) / 5])


# A floor of 2 x 1, a wall at x = 0, and a shelf behind the wall at its top. Seen from above, the
# edge at the floor is concave, and the edge at the shelf is convex.
L_SHAPE = sf.PolygonMesh.of_faces(
    [[2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1], [-1, 0, 1], [-1, 1, 1]],
    [[0, 1, 2, 3], [3, 2, 5, 4], [4, 5, 7, 6]],
)


def test_an_l_shape_has_a_groove_and_a_ridge():
    graph = sf.region_graph(L_SHAPE, [0, 1, 2])
    assert arcs_of(graph) == {
        (0, 1): (1, QUARTER, QUARTER, QUARTER, 1, QUARTER),
        (1, 2): (1, QUARTER, -QUARTER, -QUARTER, 1, QUARTER),
    }
    assert graph.areas.tolist() == [2, 1, 1]
    assert graph.perimeters.tolist() == [6, 4, 4]
    assert graph.open_lengths.tolist() == [5, 2, 3]
    assert graph.is_open.all()
    assert graph.normals == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 0, 1]]))
    assert graph.deviations[0] == pytest.approx([2 * SPREAD, SPREAD, 0])
    assert graph.linearity == pytest.approx([0.5, 0, 0], abs=1e-12)
    assert graph.planarity == pytest.approx([0.5, 1, 1])
    assert graph.compactness == pytest.approx([6 / np.sqrt(2), 4, 4])


def test_means_over_a_border_are_weighted_by_length():
    # A floor of 2 x 1. The other region is a wall at x = 0, and more floor beyond y = 1.
    floor = sf.PolygonMesh.of_faces(
        [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [2, 3, 0], [0, 3, 0]],
        [[0, 1, 2, 3], [0, 3, 5, 4], [3, 2, 6, 7]],
    )
    graph = sf.region_graph(floor, [0, 1, 1])
    assert arcs_of(graph) == {(0, 1): (3, QUARTER / 3, QUARTER, QUARTER / 3, 2, np.arctan(1 / 4))}


def test_two_boxes_that_touch():
    """Four faces meet at each edge of the square in which the boxes touch, two of each box."""
    corners = np.concatenate([CORNERS, np.add(CORNERS, [1, 0, 0])])
    boxes = sf.PolygonMesh.of_faces(corners, np.concatenate([SIDES, np.add(SIDES, 8)]))
    graph = sf.region_graph(boxes, np.repeat([0, 1], 6))
    # At each edge, the two outer sides are coplanar. Each outer side is at a right angle to the
    # wall of the other box, once convex and once concave. The two walls have an angle of -pi.
    mean, signed = (0 + QUARTER + QUARTER + np.pi) / 4, (0 + QUARTER - QUARTER - np.pi) / 4
    assert arcs_of(graph) == {(0, 1): (4, mean, -np.pi, signed, 4, NAN)}
    assert graph.areas.tolist() == [6, 6]
    assert graph.perimeters.tolist() == [4, 4]
    apart = sf.region_graph(boxes, np.repeat([0, 1], 6), weld=False)
    assert apart.n_arcs == 0
    assert apart.perimeters.tolist() == [0, 0]


def test_a_column_of_tetrahedra():
    graph = sf.region_graph(column(3), np.repeat([0, 1, 1], 6))
    assert arcs_of(graph) == {(0, 1): (1, 0, 0, 0, 2, NAN)}
    assert graph.measures == pytest.approx([1, 2])
    assert graph.perimeters == pytest.approx([6, 10])
    assert graph.open_lengths == pytest.approx([5, 9])
    assert graph.compactness == pytest.approx([6, 10 / 2 ** (2 / 3)])
    assert graph.centroids == pytest.approx(np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 2]]))
    assert graph.deviations == pytest.approx(SPREAD * np.array([[1, 1, 1], [2, 1, 1]]))
    assert graph.bounds[1].tolist() == [[0, 0, 1], [1, 1, 3]]
    assert np.isnan(graph.normals).all()
    # A cube has no plane, and two cubes on top of each other are a long column.
    assert np.isnan(graph.plane_normals).all()
    assert np.isnan(graph.normal_lengths).all()
    assert (graph.dimension, graph.cell_counts.tolist()) == (3, [6, 12])
    assert graph.table()["volume"] is graph.measures
    with pytest.raises(
        ValueError, match="regions of tetrahedra have volumes, not areas: use `measures`"
    ):
        graph.areas  # noqa: B018


def test_a_grid_of_squares_one_of_which_is_in_no_region():
    # 0  2  -
    # 0  0  1
    graph = sf.region_graph(shapes.squares(3, 2), [0, 0, 1, 0, 2, -1])
    assert arcs_of(graph) == {(0, 1): (1, 0, 0, 0, 1, 0), (0, 2): (2, 0, 0, 0, 2, 0)}
    assert graph.areas.tolist() == [3, 1, 1]
    assert graph.perimeters.tolist() == [8, 4, 4]
    assert graph.open_lengths.tolist() == [5, 2, 1]  # sides without a neighboring region
    assert graph.centroids[0] == pytest.approx([5 / 6, 5 / 6, 0])
    # Variances 1/12 + 2/9 along both axes, covariance -1/9.
    assert graph.deviations[0] == pytest.approx([np.sqrt(15) / 6, np.sqrt(7) / 6, 0])
    assert graph.centers.tolist() == [0, 2, 4]
    assert graph.cell_counts.tolist() == [3, 1, 1]
    assert graph.labels.tolist() == [0, 0, 1, 0, 2, -1]
    assert graph.bounds[0].tolist() == [[0, 0, 0], [2, 2, 0]]


def test_centers_are_those_given():
    graph = sf.region_graph(shapes.squares(3, 2), [0, 0, 1, 0, 2, -1], centers=[3, 2, 4])
    assert graph.centers.tolist() == [3, 2, 4]


def test_where_normals_of_points_were_left_out_regions_have_none():
    points = np.random.default_rng(0).uniform(size=(500, 3)) * [1, 1, 0]
    cloud, labels = sf.PointCloud(points), (points[:, 0] > 0.4).astype(np.int32)
    behind = np.ones((500, 3))  # values that a read past the end would return
    bare = point_surface(replace(find_point_graph(cloud, 1), normals=behind[:0]), 1)
    graph, expected = region_graph_of(bare, labels, 2), sf.region_graph(cloud, labels)
    assert np.isnan(graph.normals).all()
    assert np.isnan(graph.normal_lengths).all()
    assert not np.isnan(expected.normals).any()
    assert expected.normal_lengths == pytest.approx([1, 1])
    assert graph.mean_angles.tolist() == [0.0]
    for name in ("measures", "centroids", "deviations", "bounds", "perimeters"):
        assert np.array_equal(getattr(graph, name), getattr(expected, name)), name


def test_points_are_where_they_are():
    points = np.array([[x, y, 0.0] for x in range(6) for y in range(4)])
    cloud = sf.PointCloud(points, np.tile([0, 0, 2.0], (24, 1)))
    labels = np.repeat([0, 1], 12)
    graph = sf.region_graph(cloud, labels)
    cells = sf.build_point_graph(cloud)
    assert graph.areas == pytest.approx(np.bincount(labels, cells.measures))
    assert graph.normals.tolist() == [[0, 0, 1], [0, 0, 1]]
    assert graph.bounds.tolist() == [[[0, 0, 0], [2, 3, 0]], [[3, 0, 0], [5, 3, 0]]]
    mean = np.average(points[:12], axis=0, weights=cells.measures[:12])
    assert graph.centroids[0] == pytest.approx(mean)
    covariance = np.cov(points[:12].T, aweights=cells.measures[:12], bias=True)
    variances = np.linalg.eigvalsh(covariance)[::-1].clip(0)
    assert graph.deviations[0] == pytest.approx(np.sqrt(variances))
    assert graph.open_lengths.tolist() == [0, 0]
    crosses = np.flatnonzero(labels[cells.neighbors] > np.repeat(labels, np.diff(cells.offsets)))
    assert graph.edge_counts.tolist() == [len(crosses)]
    length = cells.arc_measures.border_lengths[crosses].sum()
    assert graph.border_lengths == pytest.approx([length])
    assert graph.perimeters == pytest.approx([length, length])


def test_regions_without_area_have_plain_means():
    flat = shapes.slivers()  # the second face is collinear, the third a point
    graph = sf.region_graph(flat, [0, 1, 2, 0])
    assert graph.areas == pytest.approx([2, 0, 0])
    assert graph.centroids[1:] == pytest.approx(np.array([[1, 1, 0], [5, 5, 5]]))
    assert np.isnan(graph.normals[1:]).all()
    assert np.isnan(graph.normal_lengths[1:]).all()
    assert np.isnan(graph.compactness[1:]).all()
    assert np.isnan(graph.planarity[2])
    assert graph.normals[0] == pytest.approx([0, 0, 1])
    assert graph.plane_normals[0] == pytest.approx([0, 0, 1])
    assert np.isnan(graph.plane_normals[1:]).all()


def test_plane_normals_are_of_the_plane_and_face_the_side_of_the_mean_normal():
    rng = np.random.default_rng(0)
    flat = np.append(rng.uniform(-1, 1, (200, 2)), np.zeros((200, 1)), axis=1)
    slope = np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]])  # rows: axes of the plane
    points = np.concatenate([flat @ slope, [[5, 0, 0], [6, 0, 0], [9, 9, 9]]]) + 5e6
    labels = np.repeat([0, 1, 2], [200, 2, 1])
    for sign in (1, -1):
        # The normals are 10 degrees off, as beside a crease.
        normals = np.tile([0, 0, sign], (203, 1)) + [sign * 0.5, 0, 0]
        graph = sf.region_graph(sf.PointCloud(points, normals), labels)
        assert graph.plane_normals[0] == pytest.approx(sign * slope[2], abs=1e-9)
        assert graph.normals[0] != pytest.approx(sign * slope[2], abs=0.1)
        assert np.isnan(graph.plane_normals[1:]).all()  # of a line, and of one point
        assert graph.table()["plane_normal_z"][0] == pytest.approx(sign * 0.8)
    slab = sf.TetMesh(column(1).vertices @ np.diag([3, 2, 1]) @ -slope, column(1).tets)
    assert sf.region_graph(slab, [0] * 6).plane_normals[0] == pytest.approx(slope[2], abs=1e-9)
    with pytest.raises(ValueError, match="read-only"):
        graph.plane_normals[0] = 0


def numbers_of(graph):
    """Return all arrays of a graph in a dict."""
    return {name: value for name, value in vars(graph).items() if isinstance(value, np.ndarray)}


def random_labels(n_cells, n_regions, seed):
    """Return random labels in which each label occurs."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, n_regions, n_cells)
    labels[rng.permutation(n_cells)[:n_regions]] = np.arange(n_regions)
    return labels


def as_quads(n):
    """Return a bent sheet of non-planar quads, one of which is replaced by two triangles."""
    sheet = shapes.bumpy_sheet(n)
    a, b, c = sheet.faces[: n * n].T
    quads = np.stack([a, b, c, sheet.faces[n * n :, 2]], axis=1).tolist()
    return sf.PolygonMesh.of_faces(
        sheet.vertices, [quads[0][:3], [a[0], c[0], quads[0][3]], *quads[1:]]
    )


TWINS = {
    "triangles": shapes.bumpy_sheet(6), "polygons": as_quads(5), "tetrahedra": column(4),
    "inconsistent": shapes.moebius(),
    "non-manifold": shapes.together([shapes.fins(5), shapes.cube(), shapes.cube()]),
    "inside out": shapes.inside_out_cube(),
}  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", TWINS)
def test_the_kernels_give_what_the_reference_gives(name, seed):
    mesh = TWINS[name]
    surface = as_surface(mesh, weld=True, n_threads=1)
    labels = random_labels(surface.n_cells, 4, seed)
    graph = sf.region_graph(mesh, labels)
    for region, shape in enumerate(reference.region_shapes(mesh, labels)):
        assert graph.measures[region] == pytest.approx(shape.measure)
        assert graph.centroids[region] == pytest.approx(shape.centroid)
        assert graph.bounds[region].tolist() == shape.box.tolist()
        places = surface.positions[[graph.centers[region], shape.center]] - shape.centroid
        nearest, distance = np.linalg.norm(places, axis=1)  # rounding decides ties
        assert nearest == pytest.approx(distance)
        variances = np.linalg.eigvalsh(shape.covariance)[::-1].clip(0)
        assert graph.deviations[region] == pytest.approx(np.sqrt(variances), abs=1e-7)
        length = np.linalg.norm(shape.area_vector)
        if surface.dimension == 2:
            expected = length / shape.measure
            assert graph.normal_lengths[region] == pytest.approx(expected, abs=1e-9)
        if length > 1e-9:
            assert graph.normals[region] == pytest.approx(shape.area_vector / length)
    borders, _, angles, sides, open_lengths = surface.handle.arc_measures(1)
    measures = sf.ArcMeasures(borders, None, angles, sides, open_lengths)
    expected = reference.region_arcs(*surface.arcs, measures, labels)
    check_arcs(graph, expected)
    assert graph.open_lengths == pytest.approx(np.bincount(labels, open_lengths))


def check_arcs(graph, expected):
    assert graph.edge_index.T.tolist() == [[arc.low, arc.high] for arc in expected]
    columns = zip(*(arc[2:] for arc in expected), strict=True)
    names = ("border_lengths", "mean_angles", "concavities", "max_angles", "edge_counts")
    for name, values in zip(names, columns, strict=True):
        assert getattr(graph, name) == pytest.approx(values, abs=1e-14), name


@pytest.mark.parametrize("seed", range(4))
def test_arcs_of_a_graph_count_once_whichever_way_they_lead(seed):
    rng = np.random.default_rng(seed)
    given = shapes.random_one_way_graph(40, 200, seed)
    has_length = rng.uniform(size=given.n_arcs) > 0.2
    measures = sf.ArcMeasures(
        rng.uniform(size=given.n_arcs) * has_length,
        angles=rng.choice([-2.0, -0.5, 0.0, 0.5, 2.0], given.n_arcs),
    )
    arrays = (given.positions, given.measures, given.offsets, given.neighbors, given.weights)
    graph = sf.CellGraph(*arrays, arc_measures=measures)
    labels = random_labels(40, 9, seed) - 1
    expected = reference.region_arcs(graph.offsets, graph.neighbors, measures, labels)
    check_arcs(sf.region_graph(graph, labels), expected)


def test_the_numbers_are_the_same_on_any_number_of_threads():
    mesh = shapes.bumpy_sheet(140)
    labels = np.arange(mesh.n_faces) // 300
    one, two = (numbers_of(sf.region_graph(mesh, labels, n_threads=n)) for n in (1, 3))
    for name, value in one.items():
        assert np.array_equal(value, two[name], equal_nan=True), name


def test_regions_far_from_the_origin_keep_their_shape():
    mesh = shapes.bumpy_sheet(12)
    labels = random_labels(mesh.n_faces, 5, 0)
    here = sf.region_graph(mesh, labels)
    there = sf.region_graph(sf.Mesh(mesh.vertices + [1e6, -2e6, 3e6], mesh.faces), labels)
    for name in ("measures", "deviations", "perimeters", "border_lengths", "concavities"):
        assert getattr(there, name) == pytest.approx(getattr(here, name), rel=1e-6, abs=1e-7), name


def test_the_border_of_a_region_is_its_arcs_and_what_is_open():
    mesh = shapes.bumpy_sheet(20)
    graph = sf.region_graph(mesh, random_labels(mesh.n_faces, 30, 1))
    sums = np.bincount(graph.edge_index.ravel(), np.tile(graph.border_lengths, 2))
    assert sums + graph.open_lengths == pytest.approx(graph.perimeters)
    assert (np.abs(graph.concavities) <= graph.mean_angles + 1e-15).all()
    assert (graph.mean_angles <= np.abs(graph.max_angles) + 1e-15).all()
    parts = graph.linearity + graph.planarity + graph.sphericity
    assert parts == pytest.approx(np.ones(30))


@pytest.mark.parametrize(("labels", "centers", "message"), [
    ([0, 1, 2], None, r"labels must have one value per cell \(4\), got 3 values"),
    ([0, 1, -2, 0], None, r"labels\[2\] must be -1 to 3 for 4 cells, got -2"),
    ([0, 1, 2**40, 0], None, r"labels\[2\] must be -1 to 3 for 4 cells, got 1099511627776"),
    ([0, 2, 2, 0], None, "no cell has label 1"),
    ([-1, -1, -1, -1], None, "labels must contain at least one region, but all labels are -1"),
    ([0, 1, 1, 1], [0], r"centers must have one cell per region \(2\), got 1 cell"),
    ([0, 1, 1, 1], [1, 0], r"centers\[0\] must be a cell of region 0, got cell 1 of region 1"),
])  # fmt: skip
def test_wrong_labels_and_centers_are_refused(labels, centers, message):
    with pytest.raises(ValueError, match=message):
        sf.region_graph(shapes.strip(4), labels, centers=centers)


def test_a_graph_without_measures_of_arcs_is_refused():
    with pytest.raises(
        ValueError,
        match=r"the CellGraph must have border lengths: make it with"
        r" arc_measures=ArcMeasures\(\.\.\.\)",
    ):
        sf.region_graph(shapes.line_graph([1, 1]), [0, 0, 1])


def test_what_is_not_there_is_refused():
    graph = sf.region_graph(shapes.strip(4), [0, 0, 1, 1])
    for region in (-1, 2):
        with pytest.raises(IndexError, match=f"region must be 0 to 1, got {region}"):
            graph.neighbors(region)
    with pytest.raises(ValueError, match="value must be one of border_length"):
        graph.to_scipy("color")
    with pytest.raises(ValueError, match="read-only"):
        graph.measures[0] = 1


def test_a_graph_of_networkx():
    networkx = pytest.importorskip("networkx")
    graph = sf.region_graph(L_SHAPE, [0, 1, 2]).to_networkx()
    assert isinstance(graph, networkx.Graph)
    assert list(graph.nodes) == [0, 1, 2]
    assert list(graph.edges) == [(0, 1), (1, 2)]
    assert graph.nodes[0]["area"] == 2
    assert type(graph.nodes[0]["cell_count"]) is int
    assert graph.edges[1, 2]["concavity"] == pytest.approx(-QUARTER)
    assert graph.edges[1, 2]["weight"] == graph.edges[1, 2]["border_length"] == 1


def test_a_matrix_of_scipy():
    pytest.importorskip("scipy")
    graph = sf.region_graph(L_SHAPE, [0, 1, 2])
    assert graph.to_scipy().toarray().tolist() == [[0, 1, 0], [1, 0, 1], [0, 1, 0]]
    assert graph.to_scipy().indices.dtype == graph.to_scipy().indptr.dtype == np.int32
    signed = graph.to_scipy("concavity")
    assert signed.toarray() == pytest.approx(
        QUARTER * np.array([[0, 1, 0], [1, 0, -1], [0, -1, 0]])
    )
    flat = sf.region_graph(shapes.squares(2, 1), [0, 1]).to_scipy("mean_angle")
    assert (flat.nnz, flat.shape) == (2, (2, 2))  # one of the two stored values is 0
    assert sf.region_graph(shapes.squares(2, 1), [0, 0]).to_scipy().toarray().tolist() == [[0]]


def test_changing_a_matrix_or_an_array_of_neighbors_in_place_leaves_the_graph():
    pytest.importorskip("scipy")
    graph = sf.region_graph(L_SHAPE, [0, 1, 2])
    neighbors = graph.neighbors(1).tolist()
    matrix = graph.to_scipy("concavity")
    matrix.data = matrix.data > 0
    matrix.eliminate_zeros()
    graph.neighbors(1)[:] = 7
    assert graph.neighbors(1).tolist() == neighbors
    assert graph.to_scipy().toarray().tolist() == [[0, 1, 0], [1, 0, 1], [0, 1, 0]]


def test_arrays_for_pytorch_geometric():
    arrays = sf.region_graph(L_SHAPE, [1, 0, 2]).to_pyg()
    assert arrays["edge_index"].tolist() == [[0, 0, 1, 2], [1, 2, 0, 0]]
    assert arrays["edge_attr"][:, 3] == pytest.approx(QUARTER * np.array([1, -1, 1, -1]))
    assert arrays["super_index"].tolist() == [1, 0, 2]
    assert arrays["pos"].tolist() == [[0, 0.5, 0.5], [1, 0.5, 0], [-0.5, 0.5, 1]]
    assert arrays["x"][1] == pytest.approx([2, 6, 6 / np.sqrt(2), 0.5, 0.5, 0, 0, 0, 0, 1])
    kinds = {name: array.dtype.name for name, array in arrays.items()}
    assert kinds == {
        "edge_index": "int64", "edge_attr": "float32", "pos": "float32", "x": "float32",
        "super_index": "int64",
    }  # fmt: skip
    of_tets = sf.region_graph(column(2), [0] * 6 + [1] * 6)
    assert np.isnan(of_tets.normal_angles).all()
    assert np.isfinite(of_tets.to_pyg()["x"]).all()
    assert np.isfinite(of_tets.to_pyg()["edge_attr"]).all()


def test_a_table_of_pandas():
    pytest.importorskip("pandas")
    table = sf.region_graph(L_SHAPE, [0, 1, 2]).to_pandas()
    assert table.index.tolist() == [0, 1, 2]
    assert table["area"].tolist() == [2, 1, 1]
    assert table["surface_variation"].tolist() == [0, 0, 0]
    assert table["normal_length"].tolist() == [1, 1, 1]
    assert table.loc[1, ["normal_x", "low_z", "high_z"]].tolist() == [1, 0, 1]


@pytest.mark.parametrize(
    ("module", "method"),
    [("pandas", "to_pandas"), ("networkx", "to_networkx"), ("scipy.sparse", "to_scipy")],
)
def test_without_the_library_the_message_says_what_to_install(monkeypatch, module, method):
    monkeypatch.setitem(sys.modules, module, None)
    graph = sf.region_graph(L_SHAPE, [0, 1, 2])
    with pytest.raises(sf.MissingExtraError, match=r"superfacets\[graph\]"):
        getattr(graph, method)()


@pytest.mark.parametrize("source", [shapes.bumpy_sheet(12), as_quads(12), column(20)])
def test_a_segmentation_knows_its_regions(source):
    result = sf.segment(source, 9)
    graph = result.regions
    assert result.regions is graph
    assert result.cells is source  # no copy
    expected = sf.region_graph(source, result.labels, centers=result.centers)
    for name, value in numbers_of(expected).items():
        assert np.array_equal(value, getattr(graph, name), equal_nan=True), name
    again = pickle.loads(pickle.dumps(result))
    assert np.array_equal(again.regions.measures, graph.measures)


def test_regions_are_welded_as_the_segmentation_was():
    soup = shapes.soup(shapes.strip(6))
    assert sf.segment(soup, 2).regions.n_arcs == 1
    assert sf.segment(sf.prepare(soup, weld=False), 6).regions.n_arcs == 0


def test_a_segmentation_of_a_graph_has_regions_where_arcs_have_measures():
    mesh = shapes.bumpy_sheet(8)
    faces = sf.build_face_graph(mesh)
    weights = superfacet_weights(mesh, faces)
    with pytest.raises(
        ValueError,
        match=r"the CellGraph must have border lengths: make it with"
        r" arc_measures=ArcMeasures\(\.\.\.\)",
    ):
        sf.segment_graph(faces.with_weights(weights), 4).regions  # noqa: B018
    arrays = (faces.positions, faces.measures, faces.offsets, faces.neighbors, weights)
    graph = sf.CellGraph(*arrays, arc_measures=arc_measures(mesh, faces))
    result = sf.segment_graph(graph, 4)
    expected = sf.region_graph(mesh, result.labels)
    assert result.regions.border_lengths == pytest.approx(expected.border_lengths)
    assert result.regions.concavities == pytest.approx(expected.concavities)
    assert np.isnan(result.regions.normals).all()
    assert np.isnan(result.regions.normal_lengths).all()


def test_a_segmentation_made_by_hand_does_not_know_its_cells():
    result = sf.Segmentation(np.zeros(2, np.int32), np.zeros(1, np.int32), 1, "converged", {}, {})
    with pytest.raises(ValueError, match=r"region_graph\(mesh, labels\)"):
        result.regions  # noqa: B018


@pytest.mark.parametrize("name", ["bunny.ply", "cow.obj"])
def test_regions_of_real_meshes_add_up(data_dir, name):
    mesh = sf.read_mesh(data_dir / "meshes" / name)
    result = sf.segment(mesh, 200)
    graph = result.regions
    faces = sf.build_face_graph(mesh)
    assert graph.areas.sum() == pytest.approx(faces.measures.sum())
    assert graph.compactness.mean() == pytest.approx(sf.metrics.compactness(mesh, result.labels))
    assert (graph.neighbor_counts > 0).all()
    inside = (graph.bounds[:, 0] <= graph.centroids) & (graph.centroids <= graph.bounds[:, 1])
    assert inside.all()
    assert np.median(graph.sphericity) < 0.2


@pytest.mark.parametrize("seed", range(60))
def test_ugly_meshes_have_finite_numbers(seed):
    """Meshes have repeated corners and faces, flat cells, edges of many cells, and any unit."""
    rng = np.random.default_rng(seed)
    n_vertices = int(rng.integers(4, 12))
    vertices = np.round(rng.normal(size=(n_vertices, 3)), 1) * 10.0 ** rng.choice([-13, 0, 13])
    kind = [sf.Mesh, sf.PolygonMesh.of_faces, sf.TetMesh][seed % 3]
    n_cells = int(rng.integers(4, 30))
    mesh = kind(vertices, rng.integers(0, n_vertices, (n_cells, [3, 5, 4][seed % 3])))
    labels = random_labels(n_cells, 3, seed)
    graph = sf.region_graph(mesh, labels)
    for name, value in numbers_of(graph).items():
        may_be_nan = name in ("normals", "normal_lengths", "normal_angles", "plane_normals")
        assert may_be_nan or np.isfinite(value).all(), name
    size = np.ptp(mesh.bounds, axis=0).max()
    inside = (graph.bounds[:, 0] - 1e-9 * size <= graph.centroids) & (
        graph.centroids <= graph.bounds[:, 1] + 1e-9 * size
    )
    assert inside.all()
    assert (graph.deviations <= size).all()
    lengths = np.linalg.norm([*graph.normals, *graph.plane_normals], axis=1)
    assert ((np.abs(lengths - 1) < 1e-12) | np.isnan(lengths)).all()
    assert not (graph.normal_lengths > 1).any()
    if not isinstance(mesh, sf.TetMesh):
        lines = sf.border_lines(mesh, labels)
        table = np.zeros((3, 4))
        np.add.at(table, tuple(lines.regions.T), lines.lengths)
        lengths = table[tuple(graph.edge_index)]
        assert lengths == pytest.approx(graph.border_lengths, rel=1e-9, abs=0)
