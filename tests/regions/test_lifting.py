"""Masks of images as votes for the labels of regions."""

import tracemalloc
import warnings

import numpy as np
import pytest
import reference
import shapes
from looking import camera_at, cameras_in_room, masks_of
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets.kit import MaskedAreas
from superfacets_scans import ViewWarning, project_labels

SQUARE = sf.Mesh([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])


def above(name=""):
    """Return a camera from above, each pixel of which shows a unit square."""
    pose = [[1, 0, 0, 2], [0, -1, 0, 2], [0, 0, -1, 10], [0, 0, 0, 1]]
    return sf.PinholeCamera(pose, (10, 10, 2, 2), (4, 4), name)


UPPER = np.array([[1, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]])
"""Pixels of the second face."""


def test_regions_get_the_label_of_most_of_their_visible_area():
    mask = np.where(UPPER, 7, 5)
    mask[3, 1:] = 9  # 3 of the 10 pixels of the first face
    result = sf.lift(SQUARE, [0, 1], [mask], [above()], consistent_ids=True)
    assert result.labels.tolist() == result.region_labels.tolist() == [5, 7]
    assert np.allclose(result.scores, [0.7, 1.0])
    assert np.allclose(result.label_scores, [0.7, 1.0])
    assert result.mask_labels == ({5: 5, 7: 7, 9: -1},)
    assert result.found.tolist() == [5, 7]
    assert repr(result) == "LiftedLabels(2 labels, 2 regions, 1 image)"
    assert result.seen.tolist() == [True, True]
    one = sf.lift(SQUARE, [0, 0], [mask], [above()], consistent_ids=True)
    assert one.labels.tolist() == [5, 5]  # 7 pixels against 6 and 3
    same = np.full((4, 4), 7)
    same[3] = 0  # 4 of the 10 pixels of the first face
    both = sf.lift(SQUARE, [0, 1], [same], [above()], consistent_ids=True)
    assert np.allclose(both.scores, [0.6, 1.0])
    assert np.allclose(both.label_scores, [0.75])  # by area: 12 of 16 pixels


def test_a_region_that_is_mostly_in_no_mask_has_no_label():
    mask = np.zeros((4, 4), int)
    mask[3] = 2  # 4 of the 10 pixels of the first face
    result = sf.lift(SQUARE, [0, 1], [mask], [above()], consistent_ids=True)
    assert result.labels.tolist() == [-1, -1]
    assert not result.scores.any()
    assert len(result.label_scores) == len(result.found) == 0
    mask[2, 2:] = 2
    half = sf.lift(SQUARE, [0, 1], [mask], [above()])
    assert half.labels.tolist() == [0, -1]
    assert np.allclose(half.label_scores, [half.scores[0]])


def test_labels_of_vertices_are_superpoints_with_a_row_each():
    vertices = np.r_[SQUARE.vertices, [[9, 9, 9]]]  # the last vertex is in no face
    mesh = sf.Mesh(vertices, SQUARE.faces)
    superpoints = [10, 20, 10, 30, 99]  # no face gets 20, and 30 has one corner of the second face
    result = sf.lift(mesh, superpoints, [np.full((4, 4), 7)], [above()], consistent_ids=True)
    assert result.region_labels.tolist() == [7, -1, -1, -1]
    assert result.labels.tolist() == [7, 7]
    with pytest.raises(ValueError, match="labels must contain at least one region, but all"):
        sf.lift(mesh, [-1] * 5, [UPPER], [above()])


def test_labels_are_projected_to_the_images_of_cameras():
    (image,) = project_labels(SQUARE, [7, 3], [above()])
    assert image.dtype == np.int32
    assert image.tolist() == np.where(UPPER, 3, 7).tolist()
    images = project_labels(SQUARE, [0, -1], [above(), camera_at([2, 2, 5], [2, 2, 9])])
    assert images[0].tolist() == np.where(UPPER, -1, 0).tolist()
    assert images[1].shape == (48, 64)
    assert (images[1] == -1).all()
    with pytest.raises(ValueError, match=r"labels must have one value per cell \(2\), got 1 value"):
        project_labels(SQUARE, [0], [above()])


def test_cells_in_no_region_have_no_label_but_are_seen():
    result = sf.lift(SQUARE, [-1, 0], [np.full((4, 4), 3)], [above()], consistent_ids=True)
    assert result.labels.tolist() == [-1, 3]
    assert result.seen.tolist() == [True, True]


def test_masks_come_in_all_the_forms_of_segmenters():
    ids = np.where(UPPER, 2, 1)
    stack = np.stack([UPPER == 0, UPPER == 1])
    forms = [
        ids, ids.astype(np.uint16), ids.tolist(), stack, list(stack),
        [{"segmentation": one, "area": 6} for one in stack], [one.tolist() for one in stack],
        ids.astype(np.uint8),
    ]  # fmt: skip
    for form in forms:
        result = sf.lift(SQUARE, [0, 1], [form], [above()], consistent_ids=True)
        assert result.labels.tolist() == [1, 2]
    result = sf.lift(SQUARE, [0, 1], [UPPER == 1], [above()], consistent_ids=True)
    assert result.labels.tolist() == [-1, 1]
    result = sf.lift(SQUARE, [0, 1], [UPPER.astype(np.uint8)], [above()], consistent_ids=True)
    assert result.labels.tolist() == [-1, 1]
    result = sf.lift(SQUARE, [0, 1], [np.where(UPPER, 4, -1)], [above()], consistent_ids=True)
    assert result.labels.tolist() == [-1, 4]


def test_where_masks_overlap_the_smallest_or_the_largest_counts():
    whole, part = np.ones((4, 4), bool), UPPER == 1
    for overlap, stack, expected in (
        ("smallest", [whole, part], [1, 2]),
        ("smallest", [part, whole], [2, 1]),
        ("smallest", [part, part, whole], [3, 1]),  # as large: the first wins
        ("largest", [part, whole], [2, 2]),
        ("largest", [whole, whole, part], [1, 1]),
    ):
        given = (SQUARE, [0, 1], [stack], [above()])
        result = sf.lift(*given, overlap=overlap, consistent_ids=True)
        assert result.labels.tolist() == expected


def box_views(n=12):
    """Return a cube on a plate, its sides as regions, and views from around it."""
    mesh = shapes.cube()
    labels = np.arange(mesh.n_faces) // 2
    middle = mesh.vertices.mean(axis=0)
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    places = [middle + [3 * np.cos(a), 3 * np.sin(a), 2 * (-1) ** i] for i, a in enumerate(angles)]
    return mesh, labels, [camera_at(place, middle) for place in places]


def test_ids_of_each_image_become_objects_that_are_seen_together():
    mesh, sides, cameras = box_views()
    truth = sides // 3  # two objects of three sides each
    rng = np.random.default_rng(0)
    masks = []
    for mask in masks_of(mesh, truth, cameras):
        masks.append(np.concatenate([[0], rng.permutation(90)[:2] + 1])[mask])
    result = sf.lift(mesh, sides, masks, cameras)
    # Objects are numbered in the order of their lowest regions.
    assert_array_equal(result.labels, truth)
    assert (result.scores > 0.9).all()
    for mask, found in zip(masks, result.mask_labels, strict=True):
        assert sorted(found) == np.unique(mask[mask > 0]).tolist()
        assert set(found.values()) <= {0, 1}
    apart = sf.lift(mesh, sides, masks_of(mesh, sides, cameras), cameras)
    assert_array_equal(apart.labels, sides)


def test_agreement_decides_between_wholes_and_parts():
    mesh, sides, cameras = box_views(12)
    wholes, parts = (masks_of(mesh, labels, cameras) for labels in (0 * sides, sides))
    mixed = [w if i % 3 else p for i, (w, p) in enumerate(zip(wholes, parts, strict=True))]
    assert not sf.lift(mesh, sides, mixed, cameras, agreement=0.3).labels.any()
    strict = sf.lift(mesh, sides, mixed, cameras, agreement=0.99)
    assert len(np.unique(strict.region_labels)) > 1


def test_too_many_regions_for_objects_are_refused(limit):
    mesh, sides, cameras = box_views()
    masks = masks_of(mesh, 0 * sides, cameras)
    limit("pairs of regions in masks", 50)
    with pytest.raises(
        sf.MeshError,
        match="masks contain up to 3 regions, which is too many to find objects: make"
        " fewer regions, or use consistent_ids=True if possible",
    ):
        sf.lift(mesh, sides, masks, cameras)
    assert sf.lift(mesh, sides, masks, cameras, consistent_ids=True).found.tolist() == [1]


def test_an_image_whose_masks_show_no_region_much_gives_no_objects():
    mask = np.zeros((4, 4), int)
    mask[0, :2] = 1
    result = sf.lift(SQUARE, [0, 1], [mask], [above()])
    assert result.labels.tolist() == [-1, -1]
    assert result.mask_labels == ({1: -1},)


@pytest.mark.parametrize("seed", range(6))
def test_groups_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    n_regions, counts = 9, rng.integers(1, 5, 4)
    whole = seed % 2  # many ties
    areas = [
        (rng.integers(0, 3, (n_regions, n)) if whole else rng.random((n_regions, n)))
        * (rng.random((n_regions, n)) < 0.5)
        for n in counts
    ]
    table = np.concatenate(areas, axis=1).astype(float)
    regions, masks = np.nonzero(table)
    image_of = np.repeat(np.arange(4, dtype=np.int32), counts)
    for least in (0.2, 0.5, 0.8):
        votes = MaskedAreas(regions, masks.astype(np.int32), table[regions, masks], image_of)
        found = votes.groups(n_regions, least)
        assert found.tolist() == reference.join_by_masks(areas, least)


def test_areas_of_masks_that_do_not_exist_are_refused():
    one, images = np.ones(1, np.int32), np.zeros(1, np.int32)
    with pytest.raises(ValueError, match="each area must have a region and a mask, with indi"):
        MaskedAreas(one * 0, one, np.ones(1), images).groups(1, 0.5)


def test_the_result_does_not_depend_on_the_number_of_threads():
    mesh, sides, cameras = box_views()
    masks = masks_of(mesh, sides // 3, cameras)
    expected = sf.lift(mesh, sides, masks, cameras, n_threads=1)
    for n_threads in (2, 5):
        found = sf.lift(mesh, sides, masks, cameras, n_threads=n_threads)
        assert_array_equal(found.labels, expected.labels)
        assert_array_equal(found.scores, expected.scores)
        assert_array_equal(found.seen, expected.seen)


def test_polygons_and_tetrahedra_are_seen_from_outside():
    quad = sf.PolygonMesh.of_faces(SQUARE.vertices, [[0, 1, 2, 3]])
    assert sf.lift(quad, [0], [np.full((4, 4), 3)], [above()]).labels.tolist() == [0]
    tets = sf.TetMesh(
        [[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, -4], [1, 1, -9]], [[0, 1, 2, 3], [0, 1, 2, 4]]
    )
    result = sf.lift(tets, [0, 1], [np.full((4, 4), 3)], [above()], consistent_ids=True)
    assert result.labels.max() == 3


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"masks": [np.ones((4, 5), int)]}, sf.MeshError,
     "masks must have the size of the camera, 4 x 4 pixels, got 5 x 4 pixels"),
    ({"masks": [np.ones((2, 5, 4), bool)]}, sf.MeshError,
     "masks must have the size of the camera, 4 x 4 pixels, got 4 x 5 pixels"),
    ({"masks": [np.ones((4, 4, 3), np.uint8)]}, sf.MeshError, "uint8 of shape"),
    ({"masks": [np.ones((4, 4))]}, sf.MeshError, "integers or bools, got float64"),
    ({"masks": [np.full((4, 4), 2**31)]}, sf.MeshError,
     r"image 0 \(a\.png\): ids in masks must be less than 2\*\*31, got 2147483648"),
    ({"masks": [[UPPER == 1, UPPER[:2] == 1]]}, sf.MeshError,
     r"image 0 \(a\.png\): all masks of an image must have the same shape"),
    ({"masks": [np.zeros((4, 4), int)]}, sf.MeshError,
     "all images are without masks: mask ids start at 1, and 0 is background"),
    ({"masks": [[]]}, sf.MeshError,
     "all images are without masks: mask ids start at 1, and 0 is background"),
    ({"masks": []}, ValueError, r"masks must have one item per camera \(1\), got 0 items"),
    ({"masks": [UPPER, UPPER]}, ValueError,
     r"masks must have one item per camera \(1\), got more items"),
    ({"cameras": []}, ValueError, "cameras must contain at least one camera, but it is empty"),
    ({"cameras": [np.eye(4)]}, TypeError, r"cameras\[0\] must be a PinholeCamera, got ndarray"),
    ({"mesh": SQUARE.vertices, "labels": [0, 1, 1, 1]}, TypeError,
     "masks need a mesh, got points, which have no surface: lift the masks to a mesh of the"
     " object, then use transfer"),
    ({"labels": [0, 2]}, ValueError, r"^labels\[1\] must be -1 to 1 for 2 cells, got 2$"),
    ({"labels": [1, 1]}, ValueError, r"^labels must be consecutive .* no cell has label 0"),
    ({"labels": [-1, -1]}, ValueError, "^labels must contain at least one region, but"),
    ({"agreement": 0}, ValueError, "above 0"),
    ({"agreement": 1.5}, ValueError, "agreement must be from 0 to 1, got 1.5"),
    ({"overlap": "first"}, ValueError, "overlap must be one of smallest, largest"),
    ({"consistent_ids": 1}, TypeError, "consistent_ids must be True or False"),
])  # fmt: skip
def test_what_is_wrong_is_said_in_a_line(change, error, words):
    given = {"mesh": SQUARE, "labels": [0, 1], "masks": [UPPER], "cameras": [above("a.png")]}
    with pytest.raises(error, match=words) as caught:
        sf.lift(**{**given, **change})
    assert "\n" not in str(caught.value)
    if error is sf.MeshError and "all images" not in words:
        assert str(caught.value).startswith("image 0 (a.png): ")


def test_cameras_that_see_nothing_are_named():
    away = camera_at([2, 2, 5], [2, 2, 9], (4, 4), name="b.png")
    with pytest.raises(
        sf.MeshError, match="no camera sees the mesh: check that poses are camera-to-world"
    ):
        sf.lift(SQUARE, [0, 1], [UPPER], [away])
    cameras, masks = [above(), away, above("c.png")], [UPPER, UPPER, 0 * UPPER]
    with pytest.warns(ViewWarning) as caught:
        result = sf.lift(SQUARE, [0, 1], masks, cameras, consistent_ids=True)
    assert [str(one.message) for one in caught] == [
        "the mesh is not visible in image 1 (b.png)",
        "there is no mask in image 2 (c.png)",
    ]
    assert caught[0].filename == __file__
    assert result.labels.tolist() == [-1, 1]
    with pytest.warns(ViewWarning, match=r"is not visible in image 1 \(b.png\) and 1 more"):
        sf.lift(SQUARE, [0, 1], 3 * [UPPER], [above(), away, away])
    with pytest.raises(
        sf.MeshError,
        match="no mask contains a visible part of the mesh: check that masks and cameras"
        " are in the same order",
    ):
        sf.lift(SQUARE, [0, 1], [0 * UPPER, UPPER], [above(), away])


@pytest.mark.parametrize(("values", "error", "words"), [
    ({"pose": np.eye(3)}, ValueError, r"shape \(4, 4\) or \(3, 4\), got \(3, 3\)"),
    ({"pose": "here"}, TypeError, "pose must be an array of numbers"),
    ({"pose": [[1, 2], [3]]}, TypeError, "pose must be an array of numbers"),
    ({"pose": np.full((4, 4), -np.inf)}, ValueError,
     "pose must be finite: leave out images whose pose is unknown"),
    ({"pose": np.ones((4, 4))}, ValueError, "last row of pose"),
    ({"pose": np.diag([2.0, 2, 2, 1])}, ValueError, "without scale or shear"),
    ({"pose": np.diag([-1.0, 1, 1, 1])}, ValueError,
     "pose must be a rotation, got a reflection: reverse one of its axes"),
    ({"intrinsics": (1, 2, 3)}, ValueError, "fx, fy, cx, cy"),
    ({"intrinsics": (0, 2, 3, 4)}, ValueError, "positive focal lengths"),
    ({"intrinsics": [[5, 1, 2], [0, 5, 2], [0, 0, 1]]}, ValueError,
     "the skew of intrinsics must be 0, got 1"),
    ({"size": 640}, TypeError, "width and height"),
    ({"size": (640, 0)}, ValueError, "size must be at least 1"),
    ({"size": (65536, 65536)}, ValueError, "at most 536870912 pixels, got 65536 x 65536"),
])  # fmt: skip
def test_wrong_cameras_are_refused(values, error, words):
    given = {"pose": np.eye(4), "intrinsics": (5, 5, 2, 2), "size": (4, 4)}
    with pytest.raises(error, match=words):
        sf.PinholeCamera(**{**given, **values})


def test_cameras_take_matrices_and_axes_of_opengl():
    matrix = [[5, 0, 2], [0, 6, 3], [0, 0, 1]]
    camera = sf.PinholeCamera.of_opengl(np.eye(4)[:3], matrix, [4, 6])
    assert camera.intrinsics.tolist() == [5, 6, 2, 3]
    assert camera.pose.tolist() == np.diag([1, -1, -1, 1]).tolist()
    assert camera.size == (4, 6)
    assert camera.projection @ [1, 1, -2, 1] == pytest.approx([5 + 4, -6 + 6, 2])


@pytest.mark.parametrize("name", ["office_d1", "storage_d1"])
def test_masks_of_rooms_are_lifted_to_what_they_show(name, data_dir):
    path = data_dir / "rooms" / f"{name}.npz"
    if not path.exists():
        pytest.skip("there are no rooms")
    with np.load(path) as file:
        mesh = sf.Mesh(file["vertices"], file["faces"])
        truth = file["instances"][file["faces"]][:, 0].astype(int)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        regions = sf.segment(mesh, 500, weights="creases").labels
    cameras = cameras_in_room(mesh.bounds, 20, (320, 240))
    masks = masks_of(mesh, truth, cameras)
    area = sf.build_face_graph(mesh).measures
    result = sf.lift(mesh, regions, masks, cameras, consistent_ids=True)
    seen = area * result.seen
    assert seen.sum() > 0.6 * area.sum()
    assert seen[result.labels - 1 == truth].sum() > 0.985 * seen.sum()
    # The same masks with new ids in each image give the objects of the truth.
    rng = np.random.default_rng(0)
    fresh = [np.append(0, 1 + rng.permutation(mask.max()))[mask] for mask in masks]
    objects = sf.lift(mesh, regions, fresh, cameras).labels
    table = np.zeros((objects.max() + 1, truth.max() + 1))
    np.add.at(table, (objects[objects >= 0], truth[objects >= 0]), seen[objects >= 0])
    # Count the largest part of each true object that is in one object of the result.
    assert len(table) <= len(np.unique(truth)) + 4
    best = np.unique(table.argmax(axis=0)[table.any(axis=0)])
    assert table[best].max(axis=1).sum() > 0.97 * seen.sum()


def test_memory_grows_with_the_pixels_and_not_with_masks_times_regions():
    side = 100
    sheet = shapes.flat(side)
    ids = np.arange(side * side).reshape(side, side) + 1  # a mask per pixel, and a region per face
    pose = [[1, 0, 0, side / 2], [0, -1, 0, side / 2], [0, 0, -1, 10], [0, 0, 0, 1]]
    camera = sf.PinholeCamera(pose, (10, 10, side / 2, side / 2), (side, side))
    tracemalloc.start()
    sf.lift(sheet, np.arange(sheet.n_faces), [ids], [camera], consistent_ids=True)
    assert tracemalloc.get_traced_memory()[1] < 100 << 20
    tracemalloc.stop()


def test_a_camera_much_larger_than_its_masks_is_refused_before_pixels_are_computed():
    cameras = [above(), sf.PinholeCamera(above().pose, (10, 10, 2, 2), (65536, 8192))]
    with pytest.raises(
        sf.MeshError, match="image 1: masks must have the size of the camera, 65536"
    ):
        sf.lift(SQUARE, [0, 1], [UPPER, UPPER], cameras)


def test_masks_without_pixels_are_refused_in_one_line():
    with pytest.raises(sf.MeshError, match="image 0: each mask that is a dict must have an array"):
        sf.lift(SQUARE, [0, 1], [[{"bbox": [0, 0, 1, 1]}]], [above()])
