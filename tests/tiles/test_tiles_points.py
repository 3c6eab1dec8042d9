"""Labels of tiles equal those of the cloud in memory, point for point."""

import re

import numpy as np
import pytest
from shapes import bumpy_sheet, dumbbell
from tiled_checks import check, check_number_of_tiles, compare, in_memory

from superfacets import MeshError, PointCloud, estimate_normals, segment_tiled
from superfacets.errors import IslandWarning
from superfacets.tiles import borders, cloud_normals
from superfacets.tiles.cloud_order import in_halves
from superfacets.tiles.part import Part
from superfacets.workers.scratch import scratch_folder

pytestmark = pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")


def sampled(n_points, seed=0):
    """Return points of a ball with bumps, in random order."""
    generator = np.random.default_rng(seed)
    points = generator.normal(size=(n_points, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    bumps = 0.1 * np.sin(7 * points[:, 0]) * np.cos(5 * points[:, 1])
    return points * (1 + bumps)[:, None]


@pytest.fixture(scope="module")
def ball():
    """Return 9,000 points: 3 tiles of 4,096."""
    return sampled(9_000)


def with_copies(points, seed=0):
    """Return the points in random order, some of them two or three times."""
    generator = np.random.default_rng(seed)
    chosen = generator.integers(0, len(points), len(points) // 2)
    return generator.permutation(np.concatenate([points, points[chosen]]))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"smooth": False, "eta_convex": 0.5},
        {"weights": "superfacets"},
        {"alpha": 5.0, "islands": "nearest"},
        {"tol": 0.0, "max_num_iter": 2},
        {"max_num_iter": 0},
    ],
    ids=str,
)
def test_all_options(ball, tmp_path, options):
    check(PointCloud(ball), 12, tmp_path, **options)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (1.5, 0.1, 0.0)])
def test_normals_that_face_a_viewpoint(ball, tmp_path, place):
    points = with_copies(np.concatenate([ball[:4_000], ball[:4_000] + [3.0, 0.0, 0.0]]))
    cloud = PointCloud(points, estimate_normals(points, viewpoint=place))
    for tile_size in (8192, 4096):
        found = segment_tiled(
            points, 20, viewpoint=place, tile_size=tile_size, scratch=tmp_path, cache=0
        )
        compare(found, in_memory(cloud, 20))
    outwards = segment_tiled(points, 20, scratch=tmp_path)
    is_inside = place == (0.0, 0.0, 0.0)
    assert np.array_equal(found.labels, outwards.labels) != is_inside


def test_cells_that_know_their_sides_have_no_viewpoint(ball, tmp_path):
    for cells in (PointCloud(ball, ball), bumpy_sheet(10)):
        with pytest.raises(
            MeshError,
            match="omit viewpoint: it is only for point clouds without normals or viewpoints",
        ):
            segment_tiled(cells, 5, viewpoint=(0, 0, 9), scratch=tmp_path)


def test_clouds_are_not_smoothed(ball, tmp_path):
    with pytest.raises(
        ValueError, match="denoise needs a mesh of faces, got points: leave denoise out"
    ):
        segment_tiled(ball, 5, denoise=1, scratch=tmp_path)


@pytest.mark.parametrize("options", [{}, {"weights": "superfacets"}], ids=str)
def test_given_normals(ball, tmp_path, options):
    vectors = ball + 0.1 * np.random.default_rng(0).normal(size=ball.shape)
    vectors[::50] = 0.0
    check(PointCloud(ball, vectors), 12, tmp_path, **options)
    check(PointCloud(with_copies(ball), with_copies(vectors, seed=1)), 12, tmp_path)


@pytest.mark.parametrize(
    ("n_points", "n_tiles", "options"),
    [
        (8_000, 2, {}),
        (8_000, 2, {"tol": 0.0, "max_num_iter": 2}),
        (28_000, 7, {}),
        (262_144, 64, {}),
    ],
    ids=str,
)
def test_2_and_7_and_64_tiles(tmp_path, n_points, n_tiles, options):
    check_number_of_tiles(PointCloud(sampled(n_points)), 30, tmp_path, n_tiles, **options)


@pytest.mark.parametrize("options", [{}, {"tol": 0.0, "max_num_iter": 2}], ids=str)
def test_copies(ball, tmp_path, options):
    check(PointCloud(with_copies(ball)), 12, tmp_path, **options)


def test_tiles_of_copies_alone(tmp_path):
    few = np.array([[0.0, 0, 0], [1, 0, 0], [-0.0, 1, 0], [1, 1, 0.5]])
    points = few[np.random.default_rng(0).integers(0, 4, 20_000)]
    points[::3] *= -1.0
    points[::3] *= -1.0  # some zeros are negative
    check(PointCloud(points), 3, tmp_path)


@pytest.mark.parametrize("islands", ["keep", "nearest"])
def test_several_components(ball, tmp_path, islands):
    apart = np.concatenate([ball, 0.3 * ball[:4_000] + 5.0, [[9.0, 9, 9], [9.1, 9, 9]]])
    wanted = check(PointCloud(apart), 12, tmp_path, islands=islands)
    assert wanted.n_unreached > 0


@pytest.mark.parametrize("size", [0.003, 0.03])
def test_noise(ball, tmp_path, size):
    noise = size * np.random.default_rng(0).normal(size=ball.shape)
    check(PointCloud(ball + noise), 12, tmp_path)


def test_equal_distances(tmp_path):
    x, y = np.meshgrid(np.arange(110.0), np.arange(110.0))
    points = np.stack([x, y, np.round(3 * np.sin(x / 9))], axis=-1).reshape(-1, 3)
    check(PointCloud(np.random.default_rng(0).permutation(points)), 12, tmp_path)


def test_a_cloud_on_one_step_of_the_curve(ball, tmp_path):
    far = np.concatenate([with_copies(ball), [[1e4, 0.0, 0.0]]])
    check(PointCloud(far), 12, tmp_path)


def test_points_in_a_volume(tmp_path):
    check(PointCloud(np.random.default_rng(0).random((9_000, 3))), 12, tmp_path)


@pytest.mark.parametrize("n_points", [2, 5, 40])
def test_few_points(tmp_path, n_points):
    check(PointCloud(sampled(n_points)), 2, tmp_path)


def test_shapes(tmp_path):
    for mesh in (bumpy_sheet(80), dumbbell(80, 60)):
        check(PointCloud(mesh.vertices), 12, tmp_path)


@pytest.mark.parametrize("seed", range(4))
def test_random_cases(tmp_path, seed):
    generator = np.random.default_rng(seed)
    points = sampled(9_000, seed)
    points *= 10.0 ** generator.integers(-20, 20)
    if seed % 2:
        points = with_copies(np.round(points / np.ptp(points) * 90))
    options = [{}, {"smooth": False}, {"islands": "nearest"}, {"tol": 0.0, "max_num_iter": 3}][seed]
    check(PointCloud(points), int(generator.integers(1, 40)), tmp_path, **options)


def test_pairs_of_normals_are_joined_in_portions(ball, tmp_path, monkeypatch):
    monkeypatch.setattr(cloud_normals, "PAIRS_AT_ONCE", 500)
    noise = 0.02 * np.random.default_rng(0).normal(size=ball.shape)
    check(PointCloud(ball + noise), 12, tmp_path)


@pytest.mark.parametrize("options", [{}, {"weights": "superfacets"}], ids=str)
def test_a_band_that_is_too_narrow_grows(ball, tmp_path, monkeypatch, options):
    grown = []
    add = borders._Marks.add
    monkeypatch.setattr(borders, "STEPS", {"points": 1})
    monkeypatch.setattr(
        borders._Marks, "add", lambda self, cells: grown.append(len(cells)) or add(self, cells)
    )
    check(PointCloud(ball), 12, tmp_path, **options)
    assert grown


def test_one_region_has_no_borders(ball, tmp_path):
    assert check(PointCloud(ball), 1, tmp_path).n_segments == 1


def test_two_workers(ball, tmp_path):
    pytest.importorskip("distributed")
    cloud = PointCloud(with_copies(ball))
    found = segment_tiled(cloud, 12, tile_size=4096, scratch=tmp_path, workers=2)
    assert np.array_equal(found.labels, in_memory(cloud, 12).labels)


def test_labels_are_in_the_order_of_the_input(ball, tmp_path):
    result = segment_tiled(ball, 12, tile_size=4096, scratch=tmp_path, out=tmp_path / "a.npy")
    assert np.array_equal(np.load(tmp_path / "a.npy"), result.labels)
    assert np.array_equal(result.labels, in_memory(ball, 12).labels)
    assert np.array_equal(result.labels[result.centers], np.arange(12))


def test_warnings_name_the_caller(ball, tmp_path):
    apart = np.concatenate([ball, [[9.0, 9, 9], [9.1, 9, 9]]])
    with pytest.warns(IslandWarning) as caught:
        segment_tiled(apart, 12, tile_size=4096, scratch=tmp_path)
    assert {warning.filename for warning in caught} == {__file__}


def test_halves_follow_the_order_in_memory(tmp_path):
    points = np.round(sampled(3_000) * 8)  # many coordinates are equal
    points[:, 0] *= 2
    points = np.unique(points, axis=0)
    numbers = np.random.default_rng(0).permutation(len(points)).astype(np.int32)

    def halved(chosen):
        if len(chosen) <= 50:
            return [np.sort(numbers[chosen])]
        axis = np.argmax(np.ptp(points[chosen], axis=0))
        order = chosen[np.lexsort((numbers[chosen], points[chosen, axis]))]
        middle = len(order) // 2
        return [*halved(order[:middle]), *halved(order[middle:])]

    with scratch_folder(tmp_path) as scratch:
        names = [f"halves/0-{chunk}" for chunk in range(12)]
        for name, part in zip(names, np.array_split(np.arange(len(points)), 12), strict=True):
            Part({"numbers": numbers[part], "positions": points[part]}).save(scratch, name)
        found = [part.columns["numbers"] for part in in_halves(scratch, names, 50)]
    wanted = halved(np.arange(len(points)))
    assert [part.tolist() for part in found] == [part.tolist() for part in wanted]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda points: points.__setitem__((7_000, 1), np.nan),
            "points[7000] must be finite, got [",
        ),
        (
            lambda points: points.fill(3.0),
            "all points lie at one point: the bounding box has no size",
        ),
        (
            lambda points: points.__imul__(1e300),
            "box must be 1e-15 to 1e+15, got 2.15e+300: rescale the cloud",
        ),
    ],
)
def test_wrong_points(ball, tmp_path, change, message):
    points = ball.copy()
    change(points)
    with pytest.raises(MeshError, match=re.escape(message)):
        segment_tiled(points, 12, tile_size=4096, scratch=tmp_path)


def test_too_many_points(monkeypatch, ball, tmp_path):
    monkeypatch.setattr("superfacets.tiles.chunks.MAX_CELLS", 9)
    with pytest.raises(MeshError, match="the cloud has 9000 points; at most 9 are supported"):
        segment_tiled(ball, 12, scratch=tmp_path)
