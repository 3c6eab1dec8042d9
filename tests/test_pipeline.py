"""Stage 4: the loop, its stop criteria, and its result."""

import dataclasses
import time

import loops
import numpy as np
import pytest
import shapes

import superfacets
import superfacets as sf
from superfacets.clustering.update import update_centers
from superfacets.metrics import compactness
from superfacets.paper import superfacet_weights

PLAIN = {"weights": "superfacets", "init": "farthest", "smooth": False, "denoise": 0}
"""The weights and seeds of the paper, without smoothing."""


@pytest.fixture(scope="module")
def sheet():
    """Return a mesh whose faces are in the order in which `segment` works."""
    return sf.prepare(shapes.bumpy_sheet(32), denoise=0).cells


def graph_of(mesh, **options):
    graph = sf.build_face_graph(mesh)
    return graph.with_weights(superfacet_weights(mesh, graph, **options))


def test_labels_are_int32_and_count_from_zero_without_gaps(sheet):
    result = sf.segment(sheet, 20)
    assert result.labels.dtype == result.centers.dtype == np.int32
    assert result.labels.shape == (sheet.n_faces,)
    assert np.array_equal(np.unique(result.labels), np.arange(20))
    assert result.n_segments == 20


@pytest.mark.parametrize("k", [1, 2, 37, 300])
def test_exact_regions_are_connected_and_exactly_as_many_as_asked(sheet, k):
    result = sf.segment(sheet, k)
    assert result.n_segments == k
    assert shapes.count_pieces(sf.build_face_graph(sheet), result.labels) == k


@pytest.mark.parametrize("options", [{}, {"radius_factor": 2.0}, {"max_num_iter": 3}, {"tol": 0.5}])
def test_labels_are_the_classification_of_the_centers_whatever_stopped_the_loop(sheet, options):
    result = loops.segment(sheet, 20, **{**PLAIN, **options})
    graph = graph_of(sheet)
    reach = None
    if "radius_factor" in options:
        reach = options["radius_factor"] * result.params["radius"]
    again = sf.classify(graph, result.centers, reach=reach)
    assert np.array_equal(result.labels, again.labels)
    assert np.array_equal(result.labels[result.centers], np.arange(20))


def test_a_crease_becomes_a_border():
    """In a sheet folded into a valley, no region has faces on both sides."""
    n = 20
    flat = shapes.flat(2 * n, n)
    places = flat.vertices / n - [1, 0, 0]
    mesh = sf.Mesh(places + np.abs(places[:, :1]) * [0, 0, 1], flat.faces)
    is_left = sf.build_face_graph(mesh).positions[:, 0] < 0

    def straddling(alpha):
        labels = sf.segment(mesh, 12, alpha=alpha).labels
        left = np.bincount(labels, is_left)
        return np.count_nonzero((left > 0) & (left < np.bincount(labels)))

    assert straddling(alpha=200) == 0
    assert straddling(alpha=0) > 0


def test_two_islands_never_share_a_region():
    result = sf.segment(shapes.two_islands(), 3)
    assert result.n_segments == 3
    assert not set(result.labels[:4]) & set(result.labels[4:])


def test_a_component_without_a_seed_adds_a_region_and_a_warning():
    with pytest.warns(
        sf.IslandWarning,
        match="^2 regions instead of 1: 1 component got no seed; to join them"
        " to the nearest region as separate pieces, use islands='nearest'",
    ):
        result = sf.segment(shapes.two_islands(), 1)
    assert result.n_segments == 2
    assert result.labels.tolist() == [0] * 4 + [1] * 4


def test_more_regions_than_the_default_number_are_a_surprise_too():
    soup = shapes.soup(shapes.bumpy_sheet(12))
    with pytest.warns(sf.IslandWarning, match=r"^288 regions instead of 150: 138 components"):
        assert sf.segment(sf.prepare(soup, weld=False)).n_segments == 288
    with pytest.warns(sf.IslandWarning, match=r"^288 regions: 218 components got no seed; to join"):
        sf.segment(sf.prepare(soup, weld=False), radius=0.07)  # no number given, but most have none


def test_as_many_regions_as_faces_leaves_each_alone():
    mesh = shapes.bumpy_sheet(6)
    result = sf.segment(mesh, mesh.n_faces)
    assert sorted(result.labels.tolist()) == list(range(mesh.n_faces))


@pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")
@pytest.mark.parametrize("make", [
    shapes.cube, shapes.inside_out_cube, shapes.moebius, shapes.bowtie, shapes.fins,
    shapes.slivers, shapes.two_islands, lambda: shapes.soup(shapes.cube()),
    lambda: shapes.strip(1), lambda: shapes.fold(180),
])  # fmt: skip
@pytest.mark.parametrize(
    ("segment", "options"),
    [(sf.segment, {}), (sf.segment, {"init": "farthest"}), (sf.paper.segment, {}),
     *((sf.paper.segment, {"init": init, "radius_factor": None}) for init in ("flood", "grid"))],
)  # fmt: skip
def test_awkward_meshes_are_segmented_into_connected_or_halted_regions(make, segment, options):
    mesh = make()
    for k in {1, mesh.n_faces}:
        result = segment(mesh, k, **options)
        assert np.array_equal(np.unique(result.labels), np.arange(result.n_segments))
        assert np.array_equal(result.labels[result.centers], np.arange(result.n_segments))
        if result.params["radius_factor"] is None:
            assert (
                shapes.count_pieces(sf.build_face_graph(mesh), result.labels) == result.n_segments
            )


def test_without_number_or_radius_there_are_150_regions(sheet):
    assert sf.segment(sheet).n_segments == 150
    assert sf.segment(shapes.cube()).n_segments == 12  # at most the number of faces


def test_regions_of_a_radius_do_not_depend_on_the_bounding_box(sheet):
    result = sf.segment(sheet, radius=0.1, denoise=0)
    assert result.params["n_segments"] is None
    assert result.params["radius"] == 0.1
    assert result.n_segments == round(sf.mesh_info(sheet).area / (np.pi * 0.1**2))
    graph = sf.build_face_graph(sheet)
    weighted = graph.with_weights(sf.crease_weights(sheet, graph, 0.1))
    assert sf.segment_graph(weighted, radius=0.1).n_segments == result.n_segments


def test_tol_zero_runs_until_no_center_changes(sheet):
    result = sf.segment(sheet, 3, **PLAIN, tol=0, max_num_iter=500)
    assert result.stop_reason == "converged"
    assert np.array_equal(update_centers(graph_of(sheet), result.labels), result.centers)
    assert {level.n_iter for level in loops.segment(sheet, 3, tol=1, relocates=False).levels} == {1}


def test_none_stands_for_the_default_of_names():
    bear = sf.sample_mesh(3_000)
    usual = sf.segment(bear, 10).labels
    assert np.array_equal(
        sf.segment(bear, 10, weights=None, init=None, features=None).labels, usual
    )
    with pytest.raises(ValueError, match="weights"):
        sf.segment(bear, 10, weights="")


def test_a_radius_too_small_to_square_gives_one_region_a_face(sheet):
    with pytest.warns(sf.RadiusWarning):
        result = sf.segment(sheet, radius=1e-200, max_num_iter=1)
    assert result.n_segments == sheet.n_faces


def test_the_first_small_move_converges(sheet):
    result = sf.segment(sheet, 40, **PLAIN, tol=0.1)
    assert result.stop_reason == "converged"
    graph = graph_of(sheet)
    moved = update_centers(graph, result.labels)
    move = graph.positions[moved] - graph.positions[result.centers]
    assert np.sqrt((move**2).sum(axis=1).mean()) <= 0.1 * result.params["radius"]
    before = sf.segment(sheet, 40, **PLAIN, tol=0, max_num_iter=result.n_iter - 1)
    assert before.stop_reason == "max_num_iter"


def test_centers_that_come_back_end_the_loop_as_settled():
    """For some of these graphs, the loop would alternate between the same centers forever."""
    found = []
    for seed in range(60):
        graph = shapes.random_graph(40, 70, seed=seed, weight_values=[1.0, 2.0])
        result = sf.segment_graph(graph, 6, tol=0, max_num_iter=1000)
        assert result.stop_reason in ("converged", "settled")
        if result.stop_reason == "settled":
            found.append(result.n_iter)
            moved = update_centers(graph, result.labels)
            assert not np.array_equal(moved, result.centers)
    assert found


@pytest.mark.parametrize("n_segments", [50, 200])
def test_max_num_iter_bounds_all_iterations_of_a_level_with_those_of_relocation(n_segments):
    mesh = shapes.bumpy_sheet(40)
    free = sf.segment(mesh, n_segments).levels[0].n_iter
    still = loops.segment(mesh, n_segments, relocates=False).levels[0].n_iter
    assert free > still + 2
    for most in (2, still, still + 1, free - 1):
        result = sf.segment(mesh, n_segments, max_num_iter=most)
        assert result.levels[0].n_iter == most
        assert all(level.n_iter <= most for level in result.levels)


def test_the_callback_hears_of_every_iteration(sheet):
    calls = []
    result = sf.segment(sheet, 40, callback=lambda *call: calls.append(call))
    iterations = [call for call in calls if call[1]]
    assert [n_iter for _, n_iter, _ in iterations] == list(range(1, result.n_iter + 1))
    assert all(stage == "classify" and 0 <= n_moved <= 40 for stage, _, n_moved in iterations)
    assert iterations[0][2] > 0


def test_the_callback_can_cancel_and_what_is_there_is_returned(sheet):
    result = sf.segment(sheet, 40, callback=lambda stage, n_iter, n_moved: n_iter < 2)
    assert (result.n_iter, result.stop_reason) == (2, "cancelled")
    assert np.array_equal(result.labels, sf.segment(sheet, 40, max_num_iter=2).labels)


@pytest.mark.parametrize("stage", ["mesh", "weights", "seeding", "classify"])
def test_a_run_that_is_cancelled_in_any_stage_has_one_iteration(sheet, stage):
    result = sf.segment(sheet, 40, callback=lambda name, *_: name != stage)
    assert (result.n_iter, result.stop_reason) == (1, "cancelled")
    assert result.n_segments == 40


def test_only_false_cancels(sheet):
    for answer in (None, 0, True):
        result = sf.segment(sheet, 20, callback=lambda *_, answer=answer: answer)
        assert result.stop_reason != "cancelled"
    assert sf.segment(sheet, 20, callback=lambda *_: np.bool_(False)).stop_reason == "cancelled"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
@pytest.mark.parametrize("where", ["mesh", "seeding"])
def test_an_error_in_the_callback_comes_through(sheet, error, where):
    def stop(stage, *_):
        if stage == where:
            raise error

    with pytest.raises(error):
        sf.segment(sheet, 20, callback=stop)


def test_given_weights_take_the_place_of_the_paper_s(sheet):
    graph = sf.build_face_graph(sheet)
    weights = superfacet_weights(sheet, graph, alpha=50)
    given = sf.segment(sheet, 20, weights=weights, denoise=0)
    named = sf.segment(sheet, 20, weights="superfacets", alpha=50, smooth=False, denoise=0)
    rough = sf.segment(sheet, 20, weights=weights, smooth=False, denoise=0)
    assert np.array_equal(rough.labels, named.labels)
    assert given.params["weights"] == "given"
    assert "alpha" not in given.params


def test_given_seeds_are_the_first_centers(sheet):
    result = sf.segment(sheet, init=[5, 600, 1200], max_num_iter=1)
    assert result.centers.tolist() == [5, 600, 1200]


def test_segment_graph_does_the_work_of_segment(sheet):
    result = sf.segment(sheet, 20, weights="superfacets", smooth=False, denoise=0)
    assert np.array_equal(result.labels, sf.segment_graph(graph_of(sheet), 20).labels)


def test_the_result_is_its_labels_to_numpy(sheet):
    result = sf.segment(sheet, 20)
    assert np.array_equal(np.asarray(result), result.labels)
    assert np.asarray(result, dtype=np.int64).dtype == np.int64
    assert np.asarray(result) is result.labels
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.labels = None


def test_the_result_says_what_was_done_and_how_long_it_took(sheet):
    result = sf.segment(sheet, 20, alpha=100)
    stages = ["mesh", "face_graph", "weights", "order", "coarsen", "seeding", "classify", "update"]
    assert list(result.timings) == [*stages, "regions"]
    assert list(sf.segment(sheet, 20, smooth=False).timings) == stages
    assert result.params["alpha"] == 100
    assert result.params["n_segments"] == 20
    assert repr(result).startswith(f"Segmentation({sheet.n_faces} cells, 20 regions, ")


def test_the_timings_add_up_to_most_of_the_wall_time():
    mesh = superfacets.sample_mesh(50_000)
    shares = []
    for _ in range(3):  # other processes may delay the code between stages
        start = time.perf_counter()
        result = sf.segment((mesh.vertices, mesh.faces), 50)
        shares.append(sum(result.timings.values()) / (time.perf_counter() - start))
        assert min(result.timings.values()) > 0
    assert 0.8 < max(shares) < 1


def test_the_time_of_a_stage_is_spent_in_it(sheet, monkeypatch):
    """With a clock that only advances in one function of the core, only its stage takes time."""
    from superfacets import _core

    calls = {
        "mesh": "check_mesh", "face_graph": "build_triangle_graph", "weights": "triangle_weights",
        "order": "OrderedGraph", "seeding": "geodesic_seeds", "classify": "Clustering",
        "regions": "smooth_borders",
    }  # fmt: skip
    seconds = 0
    monkeypatch.setattr(time, "perf_counter", lambda: seconds)
    for stage, name in calls.items():
        kernel = getattr(_core, name)

        def slow(*arguments, kernel=kernel, **options):
            nonlocal seconds
            seconds += 1
            return kernel(*arguments, **options)

        with monkeypatch.context() as patch:
            patch.setattr(_core, name, slow)
            timings = sf.segment(
                (sheet.vertices, sheet.faces), 20, weights="creases", max_num_iter=2, denoise=0
            ).timings
        assert [taken for taken, duration in timings.items() if duration] == [stage]


def test_the_paper_has_its_own_defaults(sheet):
    result = sf.paper.segment(sheet, 20)
    expected = {
        "weights": "superfacets", "alpha": 200.0, "eta_convex": 0.2, "init": "farthest",
        "radius_factor": 2.0, "tol": 0.0, "smooth": False, "denoise": 0, "relocates": False,
        "islands": "keep", "max_num_iter": 50,
    }  # fmt: skip
    assert expected.items() <= result.params.items()
    with pytest.raises(ValueError, match="radius_factor must be finite and positive, got 0"):
        sf.paper.segment(sheet, 20, radius_factor=0)
    with pytest.raises(ValueError, match=r"init must be one of geodesic, .*, got 'best'"):
        sf.paper.segment(sheet, 20, init="best")


def test_each_seeding_of_the_paper_gives_its_own_regions(sheet):
    found = [
        sf.paper.segment(sheet, 20, init=init).labels for init in ("farthest", "flood", "grid")
    ]
    assert not np.array_equal(found[0], found[1])
    assert not np.array_equal(found[1], found[2])


@pytest.mark.parametrize(("options", "error", "message"), [
    ({"n_segments": 0}, ValueError, "n_segments must be at least 1"),
    ({"n_segments": 3000}, ValueError,
     "n_segments must be at most 2048, the number of faces, got 3000"),
    ({"n_segments": 2, "radius": 0.1}, ValueError,
     "n_segments is 2 and radius is 0.1: give only one of them"),
    ({"radius": 0}, ValueError, "radius must be finite and positive, got 0"),
    ({"n_segments": np.zeros((9, 3), int)}, TypeError,
     r"n_segments must be an integer, got an array: pass vertices and faces as one pair"
     r" \(vertices, faces\)"),
    ({"alpha": -1}, ValueError, "alpha must be finite and not negative, got -1"),
    ({"weights": "stk"}, ValueError, "weights must be one of parts, creases,.* got 'stk'"),
    ({"weights": [1.0, 2.0]}, ValueError, "one value per arc.*; for values of cells, use features"),
    ({"init": "here"}, ValueError, "init must be one of"),
    ({"init": "flood"}, ValueError, "init must be one of geodesic, curve, farthest"),
    ({"max_num_iter": -1}, ValueError, "max_num_iter must be at least 0"),
    ({"max_num_iter": 1.5}, TypeError, "max_num_iter must be an integer"),
    ({"tol": -0.1}, ValueError, "tol must be finite and not negative"),
    ({"tol": None}, TypeError, "tol must be a number"),
    ({"alpha": "200"}, TypeError, "alpha must be a number, got '200'"),
    ({"alpha": True}, TypeError, "alpha must be a number, got True"),
    ({"alpha": np.float64(np.inf)}, ValueError, "not negative, got inf$"),
    ({"alpha": np.bool_(True)}, TypeError, "alpha must be a number, got True$"),
    ({"alpha": 10**400}, ValueError, "alpha must be finite and not negative"),
    ({"radius": "0.1"}, TypeError, "radius must be a number"),
    ({"init": 3}, ValueError, "init must be one-dimensional"),
    ({"n_threads": 0}, ValueError, "n_threads must be at least 1"),
    ({"smooth": 1}, TypeError, "smooth must be True or False, got 1"),
    ({"islands": "drop"}, ValueError, "islands must be one of keep, nearest, got 'drop'"),
    ({"callback": 1}, TypeError, "callback must be callable, got 1"),
    ({"mask": [True]}, ValueError, r"mask must have shape \(2048,\), got \(1,\)"),
])  # fmt: skip
def test_wrong_parameters_are_refused(sheet, options, error, message):
    with pytest.raises(error, match=message):
        sf.segment(sheet, **options)


def test_stages_take_any_mesh_and_say_what_graph_they_want(sheet):
    pair = (sheet.vertices, sheet.faces)
    graph = sf.build_face_graph(pair)
    weights = superfacet_weights(pair, graph)
    assert np.array_equal(weights, superfacet_weights(sheet, graph))
    for call in (
        lambda: sf.segment_graph(sheet, 3), lambda: superfacets.place_seeds(graph, 3),
        lambda: sf.classify(graph, [0]), lambda: update_centers(pair, [0]),
    ):  # fmt: skip
        with pytest.raises(TypeError, match=r"expected a CellGraph, got (Mesh|FaceGraph|tuple)"):
            call()


def test_the_environment_sets_the_number_of_threads(sheet, monkeypatch):
    expected = sf.segment(sheet, 20, n_threads=1).labels
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "3")
    assert np.array_equal(sf.segment(sheet, 20).labels, expected)
    for bad in ("0", "many", "-1"):
        monkeypatch.setenv("SUPERFACETS_NUM_THREADS", bad)
        with pytest.raises(ValueError, match="SUPERFACETS_NUM_THREADS"):
            sf.segment(sheet, 20)


def test_borders_are_straight_by_default_and_centers_stay_in_connected_regions(sheet):
    rough = sf.segment(sheet, 20, smooth=False)
    result = sf.segment(sheet, 20)
    assert np.array_equal(result.centers, rough.centers)
    assert np.array_equal(result.labels[result.centers], np.arange(20))
    assert compactness(sheet, result.labels) < compactness(sheet, rough.labels) - 0.3
    assert shapes.count_pieces(sf.build_face_graph(sheet), result.labels) == 20


def test_the_borders_of_segment_are_those_of_smooth_borders(sheet):
    rough = sf.segment(sheet, 20, weights="creases", smooth=False, denoise=0)
    result = sf.segment(sheet, 20, weights="creases", denoise=0)
    graph = sf.build_face_graph(sheet)
    weights = sf.crease_weights(sheet, graph, rough.params["radius"])
    cells = graph.with_weights(weights)  # paths and borders are measured in whole units
    again = sf.smooth_borders(
        sheet, rough.labels, centers=rough.centers, weights=cells.lengths * cells.unit
    )
    assert np.array_equal(result.labels, again)


def test_stages_are_told_when_they_begin():
    told = []

    def tell(stage, n_iter, n_moved):
        if not n_iter:
            assert n_moved == 0
            told.append(stage)

    mesh = shapes.bumpy_sheet(8)
    result = sf.segment(mesh, 10, callback=tell, smooth=False)
    assert told == ["mesh", "face_graph", "weights", "order", "coarsen", "seeding", "classify"]
    assert set(told) | {"update"} == set(result.timings)
    told.clear()
    sf.segment(mesh, 10, callback=tell)
    assert told[-1] == "regions"


@pytest.mark.parametrize(("name", "meant"), [
    ("compactness", "alpha"), ("sigma", "denoise"), ("max_iter", "max_num_iter"),
    ("k", "n_seg"), ("n_superpoints", "n_segments"),
    ("kThresh", "n_segments, or superfacets.segmentator"),
    ("voxel_size", "radius: the radius of a region in the unit of the file"),
    ("balance", r"sizes=superfacets.Sizes\(balance=...\)"),
    ("weld", r"segment\(superfacets.prepare\(mesh, weld=False\), ...\)"),
    ("scans", r"\*\*superfacets.SCANS"),
])  # fmt: skip
def test_names_of_other_tools_are_told_what_is_meant(name, meant):
    with pytest.raises(TypeError, match=f"segment has no parameter {name}: use {meant}"):
        sf.segment(shapes.cube(), 3, **{name: 1})
    with pytest.raises(
        TypeError, match=r"barrier_angle: pass barriers=.*\.sharp_edges\(mesh, 30\)"
    ):
        sf.segment(shapes.cube(), 3, barrier_angle=30)
    with pytest.raises(TypeError, match="unexpected keyword argument 'compactnes'"):
        sf.segment(shapes.cube(), 3, compactnes=1)


def test_a_mesh_without_colors_says_where_they_come_from(sheet, tmp_path):
    hint = (
        "a Mesh has no colors, so features='color' is not available: pass the path"
        " of the file instead, or an array of colors as features"
    )
    with pytest.raises(sf.MeshError, match=hint):
        sf.segment(sheet, 3, features="color")
    hint = "it has normals, height: name one of these, or a file such as heat.npy"
    with pytest.raises(sf.MeshError, match=f"features heat: .* no property heat; {hint}"):
        sf.segment(sheet, 3, features="heat")
    sf.write_mesh(tmp_path / "plain.ply", sheet)
    with pytest.raises(
        sf.MeshError,
        match="features color: the mesh has no property red, green, blue; it has normals, height",
    ):
        sf.segment(tmp_path / "plain.ply", 3, features="color")


def test_a_radius_in_another_unit_than_the_mesh_is_doubted():
    sheet = shapes.bumpy_sheet(20)
    mesh = sf.Mesh(1000 * sheet.vertices, sheet.faces)
    note = r"regions have 1\.0 faces on average: is the radius in the unit of the mesh\?"
    with pytest.warns(sf.RadiusWarning, match=note):
        sf.segment(mesh, radius=0.2)
    sf.segment(mesh, radius=200.0)
    sf.segment(mesh, mesh.n_faces)
    with pytest.warns(sf.RadiusWarning, match="only one region: is the radius in the unit of the"):
        sf.segment(sheet, radius=200.0)
