"""Values of cells pooled to regions and spread to cells again, and labels snapped to regions."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

import superfacets as sf
from superfacets.graph.kinds import kind_of

HOWS = ("mean", "sum", "max", "min", "majority")


def naive_pool(values, labels, how, measures):
    """Reference: apply the rule to one region at a time."""
    pooled = []
    for region in range(labels.max() + 1):
        inside = labels == region
        value, weight = values[inside], measures[inside]
        if how == "majority":
            sums = {v: weight[value == v].sum() for v in value.tolist() if v != -1}
            pooled.append(min(sums, key=lambda v: (-sums[v], v), default=-1))
        elif how == "mean":
            pooled.append(np.average(value, weights=weight if weight.any() else None))
        else:
            pooled.append(
                {"sum": (value * weight).sum(), "max": value.max(), "min": value.min()}[how]
            )
    return np.array(pooled)


def random_regions(rng, n, n_regions):
    """Return random labels -1..K-1 of n cells, with each of 0..K-1 at least once."""
    labels = rng.integers(-1, n_regions, n)
    labels[rng.permutation(n)[:n_regions]] = range(n_regions)
    return labels


def test_values_of_two_regions_by_hand():
    values, labels, measures = [1, 3, 5, 7], [0, 0, 1, -1], [1, 3, 2, 9]
    by_area = {how: sf.pool(labels, values, how=how, measures=measures).tolist() for how in HOWS}
    assert by_area == {
        "mean": [2.5, 5.0], "sum": [10.0, 10.0], "max": [3, 5], "min": [1, 5], "majority": [3, 5],
    }  # fmt: skip
    alike = {how: sf.pool(labels, values, how=how).tolist() for how in HOWS}
    assert alike == {
        "mean": [2.0, 5.0], "sum": [4.0, 5.0], "max": [3, 5], "min": [1, 5], "majority": [1, 5],
    }  # fmt: skip


class Tensor(list):
    """Stand-in for a tensor of torch, which has a method `size`, and becomes an array."""

    def size(self):
        return self.__array__().shape

    def __array__(self, dtype=None, copy=None):
        return np.array(list(self), dtype)


def test_tensors_are_accepted_like_arrays():
    labels, ones = Tensor([0, 0, 1]), Tensor([1.0, 1.0, 1.0])
    assert sf.pool(labels, Tensor([1.0, 3.0, 5.0]), measures=ones).tolist() == [2.0, 5.0]
    assert sf.unpool(labels, Tensor([4, 7])).tolist() == [4, 4, 7]
    assert sf.metrics.area_overlap(labels, Tensor([0, 1, 1]), ones).areas.tolist() == [1, 1, 1]


def test_integers_stay_integers_but_for_means_and_sums():
    for dtype in (np.uint8, np.int16, np.int64, np.float32, bool):
        values = np.array([1, 0, 1], dtype)
        for how in ("max", "min", "majority")[: 2 if dtype == np.float32 else 3]:
            assert sf.pool([0, 0, 1], values, how=how).dtype == dtype
        for how in ("mean", "sum"):
            assert sf.pool([0, 0, 1], values, how=how).dtype == np.float64
    large = np.array([2**63 - 1, -(2**62), 2**63 - 1])
    assert sf.pool([0, 0, 1], large, how="max").tolist() == [2**63 - 1] * 2
    assert sf.pool([0, 0, 1], large, how="majority").tolist() == [-(2**62), 2**63 - 1]


@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_rule_on_random_values(how, seed):
    rng = np.random.default_rng(seed)
    n, n_regions = 400, [1, 7, 200][seed]
    labels = random_regions(rng, n, n_regions)
    measures = rng.choice([0.0, 0.5, 1.0], n)
    values = rng.integers(-1, 4, (n, 3))
    found = sf.pool(labels, values, how=how, measures=measures)
    for column in range(3):
        expected = naive_pool(values[:, column], labels, how, measures)
        assert_allclose(found[:, column], expected, rtol=1e-12, atol=1e-12)
        assert_array_equal(
            sf.pool(labels, values[:, column], how=how, measures=measures), found[:, column]
        )


@pytest.mark.parametrize("n_features", [None, 1, 5])
def test_a_field_that_is_constant_per_region_comes_back(n_features):
    rng = np.random.default_rng(4)
    mesh = shapes.bumpy_sheet(20)
    labels = random_regions(rng, mesh.n_faces, 60)
    field = rng.normal(1e6, 1, (60, n_features) if n_features else 60)
    of_faces = sf.unpool(labels, field)
    for how in ("mean", "max", "min"):
        assert_array_equal(sf.pool(labels, of_faces, how=how, mesh=mesh), field)
    assert_array_equal(of_faces[labels < 0], np.nan)
    names = rng.integers(0, 9, 60)
    majority = sf.pool(labels, sf.unpool(labels, names), how="majority", mesh=mesh)
    assert_array_equal(majority, names)


def test_means_keep_their_digits_far_from_zero():
    values = 1e12 + np.array([0.0, 0.5, 1.0, 0.5])
    assert sf.pool([0, 0, 0, 0], values, measures=[0.1, 0.2, 0.1, 0.3]).tolist() == [1e12 + 0.5]


def test_cells_give_their_areas():
    house = shapes.house()
    assert sf.pool([0, 0], [3.0, 6.0], mesh=house).tolist() == [4.0]
    assert sf.pool([0, 0], [3.0, 6.0], how="sum", mesh=house).tolist() == [6.0]
    tets = sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -2]],
                      [[0, 1, 2, 3], [0, 1, 2, 4]])  # fmt: skip
    assert_allclose(sf.pool([0, 0], [0.0, 3.0], mesh=tets), [2.0])
    graph = sf.CellGraph([[0, 0, 0], [1, 0, 0]], [1, 3], [0, 1, 2], [1, 0], [1, 1])
    assert sf.pool([0, 0], [0.0, 4.0], mesh=graph).tolist() == [3.0]
    cloud = sf.PointCloud(np.random.default_rng(0).random((50, 3)))
    areas = kind_of(cloud).measures(cloud, 1)
    assert_allclose(sf.pool(np.zeros(50, int), areas > areas.mean(), how="sum", mesh=cloud),
                    [areas[areas > areas.mean()].sum()])  # fmt: skip


def test_values_of_vertices_count_by_corners():
    mesh = sf.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    values = np.array([0.0, 3.0, 6.0, 9.0])
    assert_allclose(sf.pool([0, 1], values, mesh=mesh), [3.0, 5.0])
    assert_allclose(sf.pool([0, 1], values, how="sum", mesh=mesh), [1.5, 2.5])
    assert sf.pool([0, 0], values, how="max", mesh=mesh).tolist() == [9.0]
    assert sf.pool([1, 0], values.astype(int), how="min", mesh=mesh).tolist() == [0, 0]
    # Vertices 0 and 2 are corners of two faces, and so get twice the area of the others.
    assert sf.pool([0, 0], [5, 1, 7, 1], how="majority", mesh=mesh).tolist() == [1]
    assert sf.pool([0, 0], [5, 1, 7, 2], how="majority", mesh=mesh).tolist() == [5]
    tets = sf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]],
                      [[0, 1, 2, 3], [0, 1, 2, 4]])  # fmt: skip
    assert_allclose(sf.pool([0, 1], [0.0, 0, 0, 4, 8], mesh=tets), [1.0, 2.0])


def test_a_linear_field_of_vertices_has_the_mean_of_the_centroids():
    mesh = shapes.bumpy_sheet(12)
    labels = random_regions(np.random.default_rng(0), mesh.n_faces, 20)
    of_vertices = sf.pool(labels, mesh.vertices, mesh=mesh)
    of_faces = sf.pool(labels, mesh.vertices[mesh.faces].mean(axis=1), mesh=mesh)
    assert_allclose(of_vertices, of_faces, atol=1e-12)


def test_nan_makes_nan_of_its_region_alone():
    values = np.array([1.0, np.nan, 3.0, np.inf])
    for how in ("mean", "sum", "max", "min"):
        pooled = sf.pool([0, 0, 1, 2], values, how=how)
        assert_array_equal(pooled, [np.nan, 3.0, np.inf])
    assert_array_equal(sf.pool([-1, -1, 0, 0], values), [np.inf])


def test_regions_without_an_area_count_their_cells_alike():
    assert sf.pool([0, 0, 1], [1.0, 2.0, 9.0], measures=[0, 0, 1]).tolist() == [1.5, 9.0]
    assert sf.pool([0, 0, 1], [1.0, 2.0, 9.0], how="sum", measures=[0, 0, 1]).tolist() == [0, 9]
    assert sf.pool([0, 0, 1], [3, 2, 9], how="majority", measures=[0, 0, 1]).tolist() == [2, 9]


def test_there_may_be_no_region_at_all():
    for how in HOWS:
        assert sf.pool([-1, -1], [1, 2], how=how).shape == (0,)
        assert sf.pool([], np.empty(0, int), how=how).shape == (0,)
        assert sf.pool([-1, -1], [[1, 2], [3, 4]], how=how).shape == (0, 2)
    assert (
        sf.unpool([-1, -1], np.empty((0, 2))).tolist()
        == [[pytest.approx(np.nan, nan_ok=True)] * 2] * 2
    )


def test_large_regions_and_many_small_ones_are_pooled_in_blocks(limit):
    rng = np.random.default_rng(0)
    labels = random_regions(rng, 500, 90)
    labels[::2] = 11  # longer than a block
    labels[rng.permutation(500)[:90]] = range(90)
    values = rng.random((500, 2))
    expected = {how: sf.pool(labels, values, how=how) for how in ("mean", "sum", "max")}
    limit("rows pooled at once", 16)
    for how, pooled in expected.items():
        assert_array_equal(sf.pool(labels, values, how=how), pooled)


def test_unpool_fills_what_is_in_no_region():
    assert_array_equal(sf.unpool([1, -1, 0], [1.5, 2.5]), [2.5, np.nan, 1.5])
    assert sf.unpool([1, -1, 0], [7, 8]).tolist() == [8, -1, 7]
    assert sf.unpool([1, -1, 0], [7, 8], fill=0).tolist() == [8, 0, 7]
    assert sf.unpool([1, -1], [True, False], fill=True).tolist() == [False, True]
    assert sf.unpool([1, 0], np.array([1, 2], np.uint8)).dtype == np.uint8
    assert sf.unpool([0, -1], np.float32([1, 2]), fill=0.1).dtype == np.float32
    assert sf.unpool([1, -1], ["a", "b"], fill="").tolist() == ["b", ""]
    assert sf.unpool([1, 1], [7, 8, 9]).tolist() == [8, 8]  # regions 0 and 2 have no cells here
    needs = r"fill must be representable as \S+ because some cells are labeled -1, got \S+: choose"
    for values, fill in [([1, 2], np.nan), ([1, 2], 0.5), (np.uint8([1, 2]), None),
                         ([True, False], None), (np.int8([1, 2]), 300), (["wood", "a"], "other"),
                         (["a", "b"], None), (np.array([1, 2], "M8[D]"), None)]:  # fmt: skip
        with pytest.raises(ValueError, match=needs):
            sf.unpool([0, -1], values, fill=fill)


def test_noisy_labels_become_the_majority_by_area():
    house = sf.PolygonMesh.of_faces(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]], [[0, 1, 2, 3], [3, 2, 4]]
    )
    for mesh, expected in ((house, [8, 8]), (None, [2, 2])):
        majority = sf.pool([0, 0], [8, 2], how="majority", mesh=mesh)
        assert sf.unpool([0, 0], majority).tolist() == expected


def test_a_segmentation_stands_for_its_labels():
    mesh = shapes.bumpy_sheet(8)
    result = sf.segment(mesh, 5)
    areas = sf.pool(result, np.ones(mesh.n_faces), how="sum", mesh=mesh)
    assert_allclose(areas.sum(), sf.build_face_graph(mesh).measures.sum())
    assert_array_equal(sf.unpool(result, areas), areas[result.labels])


def test_labels_of_vertices_are_refused_with_the_function_that_converts_them():
    mesh = shapes.strip(3)
    of_vertices = (
        r"labels must have one value per cell \(3\), got 5 values\. For one label per vertex,"
        r" convert the labels to faces with superfacets\.face_labels\(mesh, labels\)$"
    )
    cases = [
        (lambda: sf.pool([0] * 5, [1] * 3, mesh=mesh), of_vertices),
        (lambda: sf.write_mesh("a.ply", mesh, [0] * 5), of_vertices),
        (lambda: sf.submesh(mesh, [0] * 5, 0), of_vertices),
        (lambda: sf.cut_borders(mesh, [0] * 5), of_vertices),
        (lambda: sf.view(mesh, ground_truth=[0] * 5), of_vertices),
    ]  # fmt: skip
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()


def test_what_does_not_fit_is_refused():
    mesh = shapes.strip(3)
    cases = [
        (lambda: sf.pool([0, 0, 0], [1, 2, 3], how="median"), "how must be one of mean, sum"),
        (lambda: sf.pool([0, 0, 0], [1, 2]),
         r"^values must have one row per cell \(3\), got 2 rows; for values of vertices, pass"),
        (lambda: sf.pool([0, 0, 0], [1, 2], mesh=mesh),
         r"^values must have one row per cell \(3\) or per vertex \(5\), got 2 rows$"),
        (lambda: sf.pool([0], [[[1]]]), r"values must have shape \(N,\) or \(N, F\), got"),
        (
            lambda: sf.pool([0, 2, 0], [1, 2, 3]),
            r"no cell has label 1: .* np\.unique\(labels, return_inverse=True\)\[1\]$",
        ),
        (lambda: sf.pool([-1, 2, 0], [1, 2, 3]), r"return_inverse=True\)\[1\] - 1$"),
        (lambda: sf.pool([0, 3, 0], [1, 2, 3]), r"labels\[1\] must be -1 to 2 for 3 cells, got 3"),
        (lambda: sf.pool([0, -2, 0], [1, 2, 3]),
         r"labels\[1\] must be -1 to 2 for 3 cells, got -2"),
        (lambda: sf.pool([0, 0], [1, 2, 3], mesh=mesh),
         r"labels must have one value per cell \(3\), got 2 values$"),
        (lambda: sf.pool([0, 0], [1, 2], measures=[1]),
         r"measures must have one value per cell, shape \(2,\), got \(1,\)"),
        (lambda: sf.pool([0, 0], [1, 2], measures=[1, -1]),
         r"measures\[1\] must be finite and not negative, got -1"),
        (lambda: sf.pool([0, 0, 0], [1, 2, 3], mesh=mesh, measures=[1, 1, 1]),
         "the mesh already defines the measures: leave out mesh or measures"),
        (lambda: sf.pool([0, 0], np.ma.masked_less([1, 2], 2)),
         "values must not have masked entries: fill or remove these entries"),
        (lambda: sf.unpool([0, 0], 3),
         "values must have one value or row per region, got a single number"),
        (lambda: sf.unpool([0, 2], [1, 2]),
         r"labels\[1\] must be less than 2, the number of values, got 2"),
        (lambda: sf.unpool([0, -2], [1, 2]), r"labels\[1\] must be -1 to 2147483647, got -2"),
    ]  # fmt: skip
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()


def test_values_and_labels_of_other_types_are_refused():
    with pytest.raises(
        TypeError, match="values must be integers or bools for 'majority', got float64"
    ):
        sf.pool([0, 0], [1.0, 2.0], how="majority")
    with pytest.raises(TypeError, match="values must be numbers or bools, got <U1"):
        sf.pool([0, 0], ["a", "b"])
    with pytest.raises(TypeError, match="labels must contain integers, got float64"):
        sf.pool([0.0, 0.0], [1, 2])
