"""The replacement of the package `segmentator`."""

import inspect
import json

import numpy as np
import pytest
import reference
import shapes
from numpy.testing import assert_array_equal
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import superfacets as sf
from superfacets import kit
from superfacets_scans import segmentator
from superfacets_scans.segmentator import compute_vn, segment_mesh, segment_point


class Tensor:
    """The part of a torch tensor that is used: values, dtype and device."""

    def __init__(self, values, device="cpu"):
        self.values = np.asarray(values)
        self.device = device
        self.dtype = self.values.dtype

    def detach(self):
        return self

    def cpu(self):
        return Tensor(self.values)

    def numpy(self):
        assert self.device == "cpu"
        return self.values

    def new_tensor(self, data):
        return Tensor(np.asarray(data, dtype=self.dtype), self.device)

    def long(self):
        return Tensor(self.values.astype(np.int64), self.device)


@pytest.fixture(scope="module")
def bear():
    return sf.sample_mesh(3000)


def steps_of(mesh):
    return [step for i, j, k in mesh.faces.tolist() for step in ((i, j), (i, k), (k, j))]


def literal_count(mesh, threshold=0.01, least=20, normals=None):
    """Return the number of segments that the original finds."""
    normals = reference.mean_normals(mesh) if normals is None else normals
    return reference.count_segments(mesh.vertices, normals, steps_of(mesh), threshold, least)


def parts_of(n_nodes, edges, ids):
    """Return the connected part of each node, where parts consist of nodes with equal ids."""
    ends = edges[ids[edges[:, 0]] == ids[edges[:, 1]]].T.astype(np.int32)  # for older SciPy
    pairs = coo_array((np.ones(ends.shape[1]), tuple(ends)), (n_nodes, n_nodes))
    return connected_components(pairs, directed=False)[1]


def check_ids(ids, edges, least):
    """Check that ids are connected, without gaps, and large enough, except whole components."""
    assert_array_equal(np.unique(ids), np.arange(ids.max() + 1))
    assert parts_of(len(ids), edges, ids).max() == ids.max()
    components = parts_of(len(ids), edges, np.zeros(len(ids), int))
    is_small = np.bincount(ids)[ids] < least
    assert_array_equal(
        np.bincount(components)[components[is_small]], np.bincount(ids)[ids[is_small]]
    )


def number_asked_for(monkeypatch, *arguments, **keywords):
    """Return the number of regions that `segment_mesh` requests from `segment`."""
    return numbers_and_ids(monkeypatch, "segment", segment_mesh, *arguments, **keywords)[0][0]


def numbers_and_ids(monkeypatch, name, call, *arguments, **keywords):
    """Return the numbers of regions that a function requests from `segment...`, and its ids."""
    numbers = []

    def segment(cells, number, **options):
        numbers.append(number)
        return getattr(sf, name)(cells, number, **options)

    monkeypatch.setattr(segmentator, name, segment)
    ids = call(*arguments, **keywords)
    return numbers, ids


def test_the_signatures_are_those_of_the_original():
    for function, first in ((segment_mesh, ["vertices", "faces"]),
                            (segment_point, ["points", "normals", "edges"])):  # fmt: skip
        parameters = inspect.signature(function).parameters
        assert list(parameters) == [*first, "kThresh", "segMinVerts", "n_segments"]
        assert parameters["kThresh"].default == 0.01
        assert parameters["segMinVerts"].default == 20


@pytest.mark.parametrize(("threshold", "least"), [(0.01, 20), (0.001, 5), (0.05, 60)])
def test_there_are_as_many_regions_as_the_original_finds(monkeypatch, threshold, least):
    rough = shapes.bumpy_sheet(20)  # on noise, the direction of an edge matters
    expected = literal_count(rough, threshold, least)
    assert expected > 1
    found = number_asked_for(
        monkeypatch, rough.vertices, rough.faces, kThresh=threshold, segMinVerts=least
    )
    assert found == expected


def test_a_smooth_mesh_is_counted_as_the_original_counts_it(bear, monkeypatch):
    assert number_asked_for(monkeypatch, bear.vertices, bear.faces) == literal_count(bear)


def test_small_components_are_regions_in_addition(monkeypatch):
    speck = shapes.cube()
    sheet = shapes.bumpy_sheet(20)
    both = shapes.together([sheet, sf.Mesh(speck.vertices * 0.01 + 5, speck.faces)])
    number = number_asked_for(monkeypatch, both.vertices, both.faces)
    assert number == number_asked_for(monkeypatch, sheet.vertices, sheet.faces)
    ids = segment_mesh(both.vertices, both.faces)
    assert ids.max() == number  # 0 to number - 1, and the speck
    assert len(set(ids[sheet.n_vertices :].tolist())) == 1


@pytest.mark.parametrize("seed", range(12))
def test_regions_of_scans_are_connected_and_have_the_minimum(seed):
    scan = shapes.scan(seed)
    for threshold, least in ((0.01, 20), (0.001, 5), (0.001, 40)):
        ids = segment_mesh(scan.vertices, scan.faces, threshold, least)
        check_ids(ids, np.array(steps_of(scan)), least)


@pytest.mark.parametrize("seed", range(12))
def test_regions_of_points_are_connected_and_have_the_minimum(seed):
    scan = shapes.scan(seed)
    normals = compute_vn(scan)
    rng = np.random.default_rng(seed)
    edges = rng.permuted(np.array(steps_of(scan)), axis=1)
    edges = edges[rng.random(len(edges)) < 0.9]
    for threshold, least in ((0.01, 20), (0.001, 5), (0.001, 40)):
        check_ids(segment_point(scan.vertices, normals, edges, threshold, least), edges, least)


def test_vertex_normals_are_means_of_face_normals():
    scan = shapes.scan(3)
    normals = compute_vn(scan)
    assert normals.dtype == np.float64
    assert_array_equal(normals, reference.mean_normals(scan))
    unused = np.setdiff1d(np.arange(scan.n_vertices), scan.faces)
    assert len(unused)
    assert_array_equal(normals[unused], 0)
    soup = shapes.soup(shapes.fold(90))
    assert_array_equal(np.linalg.norm(compute_vn(soup), axis=1), 1)  # not welded
    assert_array_equal(compute_vn(shapes.slivers())[[0, 4]], [[0, 0, 0.5], [0, 0, 0]])


def test_every_vertex_has_an_id_and_every_id_a_vertex(bear):
    ids = segment_mesh(bear.vertices.astype(np.float32), bear.faces.astype(np.int64))
    assert (ids.dtype, ids.shape) == (np.int64, (bear.n_vertices,))
    assert_array_equal(np.unique(ids), np.arange(ids.max() + 1))


def test_the_number_may_be_given(bear):
    ids = segment_mesh(bear.vertices, bear.faces, n_segments=60)
    assert len(np.unique(ids)) == 60
    labels = sf.segment(bear, 60, **sf.SCANS).labels
    assert_array_equal(ids, sf.vertex_labels(bear, labels, method="creases", min_vertices=20))


def test_regions_of_single_faces_have_vertices_while_there_are_enough():
    sheet = shapes.bumpy_sheet(3)
    for n_segments in (4, 6, 8, 10):  # of 18 faces with 16 vertices
        ids = segment_mesh(sheet.vertices, sheet.faces, n_segments=n_segments)
        assert len(np.unique(ids)) == n_segments
    assert len(np.unique(segment_mesh(sheet.vertices, sheet.faces, n_segments=18))) <= 16


def test_files_of_ids_have_the_same_regions(bear, tmp_path):
    labels = sf.segment(bear, 400, **sf.SCANS).labels
    ids = segment_mesh(bear.vertices, bear.faces, n_segments=400)
    majority = sf.vertex_labels(bear, labels, method="majority")
    assert len(np.unique(majority)) < len(np.unique(ids)) == 400
    creases = sf.vertex_labels(bear, labels, method="creases", min_vertices=20)
    assert_array_equal(ids, creases)
    sf.write_mesh(tmp_path / "bear.segs.json", bear, labels)
    assert_array_equal(json.loads((tmp_path / "bear.segs.json").read_text())["segIndices"], ids)


def test_vertices_of_no_face_have_ids_of_their_own():
    vertices = [[9, 9, 9], *shapes.fold(0).vertices, [8, 8, 8]]
    with pytest.warns(sf.IslandWarning, match="3 regions instead of 1: components without"):
        ids = segment_mesh(vertices, [[1, 2, 3], [2, 1, 4]], n_segments=1)
    assert ids.tolist() == [1, 0, 0, 0, 0, 2]


def test_tensors_give_a_tensor_on_the_same_device(bear):
    expected = segment_mesh(bear.vertices, bear.faces, n_segments=30)
    ids = segment_mesh(Tensor(bear.vertices, "cuda:1"), Tensor(bear.faces, "cuda:1"), n_segments=30)
    assert (type(ids), ids.device, ids.dtype) == (Tensor, "cuda:1", np.int64)
    assert_array_equal(ids.values, expected)
    points, normals, edges = row_of_points()
    ids = segment_point(Tensor(points), Tensor(normals), Tensor(edges), n_segments=2)
    assert_array_equal(ids.values, segment_point(points, normals, edges, n_segments=2))


def test_tensors_of_torch_give_one():
    torch = pytest.importorskip("torch")
    sheet = shapes.bumpy_sheet(12)
    ids = segment_mesh(torch.tensor(sheet.vertices).float(), torch.tensor(sheet.faces).long(),
                       n_segments=9)  # fmt: skip
    assert ids.dtype == torch.int64
    assert_array_equal(
        ids.numpy(), segment_mesh(sheet.vertices.astype("f4"), sheet.faces, n_segments=9)
    )


def row_of_points():
    """Return ten points in a row with a corner after the fifth, and a separate point."""
    points = [[x, 0, 0] for x in range(5)] + [[5, 0, z] for z in range(1, 6)] + [[50, 0, 0]]
    normals = [[0, 0, 2]] * 5 + [[-1, 0, 0]] * 5 + [[0, 0, 1]]
    return np.array(points, float), np.array(normals, float), [[i, i + 1] for i in range(9)]


def test_points_are_cut_at_the_concave_crease():
    ids = segment_point(*row_of_points(), n_segments=2)
    assert ids.dtype == np.int64
    assert ids.tolist() == [0] * 5 + [1] * 5 + [2]


def test_edges_may_be_given_in_one_direction_or_both():
    points, normals, edges = row_of_points()
    doubled = [*edges, *[[b, a] for a, b in edges], [3, 3]]
    for n_segments in (2, 4):
        assert_array_equal(
            segment_point(points, normals, edges, n_segments=n_segments),
            segment_point(points, normals, doubled, n_segments=n_segments),
        )


def test_points_of_a_mesh_are_counted_as_the_mesh(monkeypatch):
    sheet = shapes.bumpy_sheet(20)
    normals = compute_vn(sheet)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    numbers, ids = numbers_and_ids(
        monkeypatch, "segment_graph", segment_point, sheet.vertices, 7 * normals, steps_of(sheet),
        kThresh=0.001,
    )  # fmt: skip
    assert numbers == [literal_count(sheet, 0.001, normals=normals)]
    assert len(np.unique(ids)) == numbers[0]


@pytest.mark.parametrize(
    ("arguments", "keywords", "error", "message"),
    [
        (2, {"kThresh": -1}, ValueError, "kThresh must be finite and not negative"),
        (2, {"segMinVerts": 0}, ValueError, "segMinVerts must be at least 1"),
        (2, {"n_segments": 3}, ValueError,
         "n_segments must be at most 2, the number of faces, got 3"),
        (3, {"n_segments": 12}, ValueError,
         "n_segments must be at most 11, the number of points, got 12"),
        (3, {"edges": [[0, 11]]}, sf.MeshError,
         r"edges\[0\] must be points from 0 to 10, got \[0, 11\]"),
        (3, {"edges": [0, 1]}, ValueError, r"edges must have shape \(E, 2\), got \(2,\)"),
        (3, {"edges": [[0.5, 1]]}, TypeError, "edges must contain integers, got float64"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused(arguments, keywords, error, message):
    if arguments == 2:
        fold = shapes.fold(30)
        call = lambda **given: segment_mesh(fold.vertices, fold.faces, **given)  # noqa: E731
    else:
        points, normals, edges = row_of_points()
        edges = keywords.pop("edges", edges)
        call = lambda **given: segment_point(points, normals, edges, **given)  # noqa: E731
    with pytest.raises(error, match=message):
        call(**keywords)


def test_edges_to_vertices_that_do_not_exist_are_refused():
    edges = kit.VertexEdges(np.zeros(3, int), np.zeros(0, np.int32), *np.zeros((2, 2, 3)))
    with pytest.raises(ValueError, match="pairs must be vertices from 0 to 1"):
        edges.count_segments(np.array([[0, 2]]), 0.01, 1, 1)


def test_components_without_a_seed_are_among_the_regions():
    plate = shapes.bumpy_sheet(8)
    small = [sf.Mesh(plate.vertices / 20 + [3, i, 0], plate.faces) for i in range(4)]
    scan = shapes.together([shapes.bumpy_sheet(30), *small])
    ids = segment_mesh(scan.vertices, scan.faces)
    assert ids.max() + 1 == literal_count(scan) > 5
