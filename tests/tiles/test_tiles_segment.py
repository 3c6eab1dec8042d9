"""Labels of tiles equal those of the mesh in memory, face for face."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from cut_mesh import cut_mesh, run_serially
from shapes import bowl, bumpy_sheet, drilled_block, gears, soup, together
from tiled_checks import check, check_number_of_tiles, compare, in_memory
from tiled_meshes import as_ply, random_polygons

import superfacets as sf
from superfacets import (
    IslandWarning,
    Mesh,
    PolygonMesh,
    SliverWarning,
    _core,
    segment_tiled,
)
from superfacets.cells.weights import WeightOptions
from superfacets.mesh.faces import measure_faces
from superfacets.mesh.triangle_mesh import split_in_four
from superfacets.tiles import borders, tiled_graph
from superfacets.tiles.arrays import rows
from superfacets.tiles.tile_arcs import WeightRule, find_arcs
from superfacets.workers.scratch import scratch_folder

pytestmark = [
    pytest.mark.filterwarnings("ignore::superfacets.IslandWarning"),
    pytest.mark.filterwarnings("ignore::superfacets.SliverWarning"),
]


@pytest.fixture(scope="module")
def bear():
    """Return 19,568 faces in random order: 2 and 5 tiles."""
    mesh = sf.sample_mesh(12_000)
    order = np.random.default_rng(0).permutation(mesh.n_faces)
    return Mesh(mesh.vertices, mesh.faces[order])


@pytest.fixture(scope="module")
def torn(bear):
    """Return the same bear with many holes, and islands between them."""
    kept = np.random.default_rng(0).random(bear.n_faces) < 0.93
    return Mesh(bear.vertices, bear.faces[kept])


@pytest.fixture(scope="module")
def sheet():
    """Return a wavy sheet of quads, some of them divided into two triangles."""
    n = 150
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    vertices = np.stack([x, y, np.sin(0.3 * x) * np.cos(0.2 * y)], axis=-1).reshape(-1, 3)
    corners = (np.arange(n - 1) + n * np.arange(n - 1)[:, None]).ravel()
    quads = np.stack([corners, corners + 1, corners + n + 1, corners + n], axis=1)
    quads = np.random.default_rng(0).permutation(quads).tolist()
    cut = [[q[:3], [q[0], q[2], q[3]]] if i % 3 == 0 else [q] for i, q in enumerate(quads)]
    return PolygonMesh.of_faces(vertices, [face for faces in cut for face in faces])


def steps(seed):
    """Return a sheet of quads with folds in both directions, some of which are ridges.

    Whether a fold is a ridge depends on the surface at its ends, and on the next folds there.
    """
    n = 120
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    slopes = np.random.default_rng(seed).choice([-2.0, 0.0, 2.0], (2, n))
    heights = np.cumsum(slopes, axis=1)
    vertices = np.stack([x, y, heights[0][x] + heights[1][y]], axis=-1).reshape(-1, 3)
    corners = (np.arange(n - 1) + n * np.arange(n - 1)[:, None]).ravel()
    return PolygonMesh.of_faces(
        vertices, np.stack([corners, corners + 1, corners + n + 1, corners + n], axis=1)
    )


@pytest.mark.parametrize(
    "options",
    [
        {"smooth": False},
        {},
        {"weights": "creases"},
        {"weights": "creases", "relocate": True},
        {"weights": "superfacets"},
        {"alpha": 5.0, "eta_convex": 0.5, "ridges": 0.35},
        {"alpha": 0.0},
        {"relocate": False},
        {"islands": "nearest"},
        {"max_num_iter": 3},
    ],
    ids=str,
)
def test_loops_on_coarse_cells(bear, tmp_path, options):
    wanted = check(bear, 12, tmp_path, **options)
    assert len(wanted.levels) > 1


@pytest.mark.parametrize(
    "options",
    [
        {"tol": 0.0, "max_num_iter": 6},
        {"tol": 0.0, "islands": "nearest", "max_num_iter": 3},
        {"weights": "creases", "tol": 0.0, "max_num_iter": 2},
        {"weights": "superfacets", "max_num_iter": 1},
        {"max_num_iter": 0},
    ],
    ids=str,
)
def test_loops_on_all_faces(bear, tmp_path, options):
    wanted = check(bear, 12, tmp_path, tile_sizes=(4096,), **options)
    assert len(wanted.levels) == 1


@pytest.mark.parametrize("weights", ["parts", "creases"])
def test_small_regions(bear, tmp_path, weights):
    check(bear, 1_000, tmp_path, tile_sizes=(4096,), weights=weights)


@pytest.mark.parametrize("n_segments", [101, 102])
def test_the_size_of_regions_from_which_labels_spread_from_coarse_cells(bear, tmp_path, n_segments):
    wanted = check(bear, n_segments, tmp_path, tile_sizes=(4096,))
    assert (wanted.levels[-1].n_iter == 1) == (n_segments == 101)


def test_loose_pieces_join_over_the_borders_of_tiles(tmp_path, monkeypatch):
    """With noise, labels spread from coarse cells are in pieces, some of them at tile borders."""
    counts = []
    join = tiled_graph.TiledGraph.join_loose_pieces

    def counted(graph, labels, centers):
        joined = join(graph, labels, centers)
        counts.append(np.count_nonzero(joined != labels))
        return joined

    monkeypatch.setattr(tiled_graph.TiledGraph, "join_loose_pieces", counted)
    mesh = bumpy_sheet(100, 1)
    noise = np.random.default_rng(0).normal(0.0, 0.3, mesh.vertices.shape)
    check(Mesh(mesh.vertices + noise, mesh.faces), 60, tmp_path, tile_sizes=(4096,))
    assert counts[0] > 0


def test_soup_has_no_coarse_cells(bear, tmp_path):
    apart = soup(Mesh(bear.vertices, bear.faces[:9_000]))
    wanted = check(apart, 12, tmp_path, tile_sizes=(4096,), weld=False, islands="nearest")
    assert len(wanted.levels) == 1


def test_sums_of_regions_are_those_of_all_cells(bear, tmp_path):
    labels = np.random.default_rng(0).integers(0, 9, bear.n_faces).astype(np.int32)
    labels[500:40_000] = 3  # a run longer than a block
    mesh = Mesh(*split_in_four(bear.vertices, bear.faces))
    labels = np.resize(labels, mesh.n_faces).astype(np.int32)
    positions, measures = measure_faces(mesh, 1)
    wanted = np.zeros((4, 9))
    for begin in range(0, mesh.n_faces, borders.SUM_BLOCK):
        end = min(begin + borders.SUM_BLOCK, mesh.n_faces)
        cuts = np.flatnonzero(np.diff(labels[begin:end])) + 1
        for run in np.split(np.arange(begin, end), cuts):
            rows = np.column_stack([measures[run], measures[run, None] * positions[run]])
            wanted[:, labels[run[0]]] += np.cumsum(rows, axis=0)[-1]
    with scratch_folder(tmp_path) as scratch:
        store = cut_mesh(mesh, scratch, 5, weld=True)
        areas, moments = borders.region_sums(store, labels, 9, run_serially)
    assert np.array_equal(areas, wanted[0])
    assert np.array_equal(moments, wanted[1:].T)


@pytest.mark.parametrize("denoise", [0, 1, 12, "auto"])
def test_noise_is_smoothed(bear, tmp_path, denoise):
    noise = np.random.default_rng(0).normal(0.0, 0.004, bear.vertices.shape)
    noisy = Mesh(bear.vertices + noise, bear.faces)
    wanted = check(noisy, 12, tmp_path, tile_sizes=(8192, 4096), denoise=denoise)
    n_steps = wanted.params["denoise"]
    assert n_steps >= 5 if denoise == "auto" else n_steps == denoise


def test_what_has_no_noise_stays_as_it_is(bear, sheet, tmp_path):
    for mesh in (bear, sheet):
        wanted = check(mesh, 12, tmp_path, tile_sizes=(4096,), denoise="auto")
        assert wanted.params["denoise"] == 0


@pytest.mark.parametrize("weld", [True, False])
def test_noise_of_soup_polygons_and_unused_vertices(bear, sheet, tmp_path, weld):
    corners = soup(Mesh(bear.vertices, bear.faces[:6_000]))
    extra = Mesh(np.concatenate([corners.vertices, [[9.0, 9.0, 9.0]]]), corners.faces)
    for mesh in (extra, sheet):
        check(mesh, 12, tmp_path, tile_sizes=(4096,), denoise=3, weld=weld)


def test_noise_of_torn_meshes(torn, tmp_path):
    check(torn, 12, tmp_path, tile_sizes=(4096,), denoise=4)


def test_a_radius(bear, tmp_path):
    check(bear, None, tmp_path, radius=0.2)
    check(bear, None, tmp_path, expected_radius=0.3)


@pytest.mark.parametrize("options", [{}, {"tol": 0.0, "max_num_iter": 2}], ids=str)
@pytest.mark.parametrize(("tile_size", "n_tiles"), [(1 << 14, 2), (4096, 7)])
def test_2_and_7_tiles(bear, tmp_path, tile_size, n_tiles, options):
    mesh = together([bear, Mesh(bear.vertices[:, [1, 0, 2]] + 3.0, bear.faces[:8_000])])
    check_number_of_tiles(mesh, 20, tmp_path, n_tiles, tile_size, **options)


def test_64_tiles(tmp_path):
    mesh = sf.sample_mesh(400_000)
    wanted = check(mesh, 150, tmp_path, tile_sizes=(-(-mesh.n_faces // 64 // 4096) * 4096,))
    assert len(wanted.levels) == 3


@pytest.mark.parametrize("islands", ["keep", "nearest"])
def test_holes_and_islands(torn, tmp_path, islands):
    wanted = check(torn, 12, tmp_path, islands=islands)
    assert wanted.n_unreached > 0


def test_islands_of_loops_on_all_faces(torn, tmp_path):
    wanted = check(torn, 12, tmp_path, tile_sizes=(4096,), tol=0.0, max_num_iter=2)
    assert wanted.n_unreached > 0


@pytest.mark.parametrize("islands", ["keep", "nearest"])
def test_several_components(bear, tmp_path, islands):
    check(together([bear, gears()]), 20, tmp_path, tile_sizes=(4096,), islands=islands)


def test_edges_of_many_faces(bear, tmp_path):
    extra = bear.faces[::40].copy()
    extra[:, 2] = bear.faces[5, 0]
    mesh = Mesh(bear.vertices, np.concatenate([bear.faces, extra, bear.faces[::50]]))
    check(mesh, 12, tmp_path)


def test_normals_inwards(bear, tmp_path):
    check(Mesh(bear.vertices, bear.faces[:, ::-1]), 12, tmp_path, weights="superfacets")


def test_normals_that_disagree(bear, tmp_path):
    faces = bear.faces.copy()
    faces[::3] = faces[::3, ::-1]
    check(Mesh(bear.vertices, faces), 12, tmp_path)


def test_faces_without_area(bear, tmp_path):
    faces = bear.faces.copy()
    faces[::37, 2] = faces[::37, 1]
    faces[5::91] = faces[5::91, :1]
    check(Mesh(bear.vertices, faces), 12, tmp_path, tile_sizes=(4096,))
    check(Mesh(bear.vertices, faces), 12, tmp_path, tile_sizes=(4096,), tol=0.0, max_num_iter=2)


def test_a_closed_mesh_with_a_face_that_runs_twice_through_an_edge(bear, tmp_path):
    faces = bear.faces[:, ::-1].copy()
    flap = [[faces[0, 0], faces[0, 1], faces[0, 0]]]
    mesh = Mesh(bear.vertices, np.concatenate([faces, flap]))
    check(mesh, 12, tmp_path, weights="superfacets")


def test_soup(bear, tmp_path):
    check(soup(bear), 12, tmp_path, tile_sizes=(4096,))


def test_soup_that_is_not_welded(bear, tmp_path):
    mesh = soup(Mesh(bear.vertices, bear.faces[:6_000]))
    check(mesh, 12, tmp_path, tile_sizes=(4096,), weld=False)


def test_ridges_of_parts(tmp_path):
    check(sf.subdivide(gears(2), max_edge=0.1).mesh, 20, tmp_path, tile_sizes=(4096,))


@pytest.mark.parametrize("n_segments", [20, 300])
def test_coarse_cells_end_at_rims_of_parts(n_segments, tmp_path):
    """With 300 regions, all faces are in memory, and loose pieces of regions are not."""
    block = drilled_block()
    arrays = (block.vertices * (1, 1, 0.1), block.faces)
    for _ in range(3):
        arrays = split_in_four(*arrays)
    result = check(Mesh(*arrays), n_segments, tmp_path, tile_sizes=(4096,))
    upwards = np.repeat((block.vertices[block.faces, 2] > 0).all(axis=1), 64)
    assert not set(result.labels[upwards]) & set(result.labels[~upwards])


@pytest.mark.parametrize("seed", range(3))
def test_ridges_that_depend_on_faces_two_steps_away(tmp_path, seed):
    mesh = steps(seed)
    graph = sf.build_face_graph(mesh)
    wanted = sf.crease_weights(mesh, graph, 5.0, ridges=1.0)
    assert not np.allclose(wanted, sf.crease_weights(mesh, graph, 5.0, ridges=0.0), rtol=1e-3)
    rule = WeightRule(5.0, WeightOptions.checked("creases", None, None, 1.0), False, 1)
    with scratch_folder(tmp_path) as scratch:
        store = cut_mesh(mesh, scratch, 4, weld=True)
        unit = find_arcs(store, rule, run_serially).unit
        for tile in range(store.n_tiles):
            _, at = rows(graph.offsets, store.read(tile, "cells"))
            lengths = _core.round_weights(wanted[at], unit, 1)
            assert np.array_equal(store.read(tile, "arcs/lengths"), lengths)


def hollow(is_inside_out=False, times=3):
    """Return a bowl of 18,432 faces, neither fully hollow nor solid."""
    mesh = bowl(24, 0.6)
    arrays = (mesh.vertices, mesh.faces[:, ::-1] if is_inside_out else mesh.faces)
    for _ in range(times):
        arrays = split_in_four(*arrays)
    return Mesh(*arrays)


@pytest.mark.parametrize("is_inside_out", [False, True])
def test_hollow_shapes(tmp_path, is_inside_out):
    check(hollow(is_inside_out), 20, tmp_path, tile_sizes=(4096,))


def test_hollow_shapes_by_weights_of_the_paper(tmp_path):
    check(hollow(), 20, tmp_path, tile_sizes=(4096,), weights="superfacets")


def test_hollow_polygons(tmp_path):
    mesh = hollow()
    offsets = 3 * np.arange(mesh.n_faces + 1)
    check(PolygonMesh(mesh.vertices, offsets, mesh.faces.ravel()), 20, tmp_path, (4096,))


@pytest.mark.parametrize("how", ["whole", "open", "a face turned over"])
def test_weights_of_hollow_shapes(tmp_path, how):
    mesh = hollow(times=2)
    faces = mesh.faces[1 if how == "open" else 0 :].copy()
    if how == "a face turned over":
        faces[7] = faces[7, ::-1]
    mesh = Mesh(mesh.vertices, faces)
    graph = sf.build_face_graph(mesh)
    wanted, solid = (sf.crease_weights(mesh, graph, 0.1, hollows=on) for on in (True, False))
    assert np.array_equal(wanted, solid) == (how != "whole")
    rule = WeightRule(0.1, WeightOptions.checked("creases", None, None), False, 1)
    with scratch_folder(tmp_path) as scratch:
        store = cut_mesh(mesh, scratch, 1024, weld=True)
        unit = find_arcs(store, rule, run_serially).unit
        for tile in range(store.n_tiles):
            _, at = rows(graph.offsets, store.read(tile, "cells"))
            lengths = _core.round_weights(wanted[at], unit, 1)
            assert np.array_equal(store.read(tile, "arcs/lengths"), lengths)


def test_ridges_of_polygons(tmp_path):
    check(steps(1), 40, tmp_path, tile_sizes=(4096,), ridges=1.0)


@pytest.mark.parametrize(
    "options", [{}, {"weights": "superfacets"}, {"tol": 0.0, "max_num_iter": 2}], ids=str
)
def test_polygons(sheet, tmp_path, options):
    check(sheet, 15, tmp_path, tile_sizes=(4096,), **options)


def test_polygons_with_holes(sheet, tmp_path):
    kept = np.flatnonzero(np.random.default_rng(0).random(sheet.n_faces) < 0.9)
    offsets, at = rows(sheet.offsets, kept)
    check(PolygonMesh(sheet.vertices, offsets, sheet.indices[at]), 15, tmp_path, islands="nearest")


def test_polygons_that_touch_little(tmp_path):
    check(random_polygons(9_000), 20, tmp_path, tile_sizes=(4096,))


def test_meshes_of_the_data_folder(data_dir, tmp_path):
    for name in ("fandisk.obj", "bunny.ply"):
        check(sf.read_mesh(data_dir / "meshes" / name), 50, tmp_path)


def test_a_band_that_is_too_narrow_grows(bear, tmp_path, monkeypatch):
    sizes = []

    class Band(borders._Band):
        def straightened(self, *args):
            sizes.append(len(self.part))
            return super().straightened(*args)

    monkeypatch.setattr(borders, "STEPS", {"triangles": 1})
    monkeypatch.setattr(borders, "_Band", Band)
    found = segment_tiled(bear, 300, tile_size=4096, scratch=tmp_path)
    compare(found, in_memory(bear, 300))
    assert len(sizes) > 2
    assert sizes == sorted(sizes)


@pytest.mark.parametrize("seed", range(3))
def test_a_narrow_band_grows_over_holes(tmp_path, monkeypatch, seed):
    """Faces that share a vertex may be far apart along arcs, and each may lack a neighbor."""
    monkeypatch.setattr(borders, "STEPS", {"triangles": 2})
    monkeypatch.setattr(borders, "MAX_STEPS", 4)
    sheet = bumpy_sheet(48, seed)
    kept = np.random.default_rng(seed).random(sheet.n_faces) < 0.75
    holey = Mesh(sheet.vertices, sheet.faces[kept])
    check(holey, 38, tmp_path, tile_sizes=(4096,), islands="nearest")


@pytest.mark.parametrize("seed", range(3))
def test_cells_that_may_not_move_at_the_rim_of_the_band(tmp_path, monkeypatch, seed):
    monkeypatch.setattr(borders, "STEPS", {"triangles": 2})
    check(bumpy_sheet(50, seed), 12, tmp_path, tile_sizes=(4096,))


def test_labels_are_written(bear, tmp_path):
    result = segment_tiled(bear, 12, tile_size=4096, scratch=tmp_path, out=tmp_path / "labels.npy")
    assert np.array_equal(np.load(tmp_path / "labels.npy"), result.labels)
    assert [path.name for path in tmp_path.iterdir()] == ["labels.npy"]  # nothing is left


def test_stages_and_tiles_are_told(bear, tmp_path):
    stages, tiles, moves = [], [], []
    result = segment_tiled(
        bear,
        12,
        tile_size=4096,
        scratch=tmp_path,
        on_stage=stages.append,
        on_tile=lambda n_done, n: tiles.append((stages[-1], n_done, n)),
        progress=lambda *move: moves.append(move),
    )
    assert stages == ["tiles", "weights", "coarsen", "seeding", "classify", "regions"]
    assert list(result.timings) == ["tiles", *stages[1:5], "update", "regions"]
    assert ("weights", 5, 5) in tiles
    passes = [(n_done, n) for stage, n_done, n in tiles if stage == "classify"]
    assert (1, 1) not in passes
    visits = [done for done in passes if done[0] > 5]  # of paths from tile to tile
    assert visits[0][0] == 6
    assert [n_done for n_done, _ in visits] == list(range(6, 6 + len(visits)))
    assert all(n_done <= n for n_done, n in visits)
    assert visits[-1][0] == visits[-1][1]
    assert len(moves) == sum(level.n_iter for level in result.levels[:-1])


def test_warnings_name_the_caller(torn, tmp_path):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        segment_tiled(torn, 12, tile_size=4096, scratch=tmp_path)
        long = Mesh(torn.vertices * [1.0, 1e3, 1.0], torn.faces)
        segment_tiled(long, 12, tile_size=4096, scratch=tmp_path)
    assert {IslandWarning, SliverWarning} <= {warning.category for warning in caught}
    assert {warning.filename for warning in caught} == {__file__}


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"init": "grid"}, ValueError, "init must be one of geodesic, got 'grid'"),
        ({"radius_factor": 2.0}, TypeError, "unexpected keyword argument 'radius_factor'"),
        ({"weights": [1.0]}, ValueError, "weights must be one of"),
        ({"weights": "stk02"}, ValueError, "weights must be one of parts, creases, superfacets"),
        ({"relocate": 1}, TypeError, "relocate"),
        ({"out": "labels.txt"}, ValueError, r"out must end in \.npy, got 'labels\.txt'"),
        ({"tile_size": 0}, ValueError, "tile_size"),
        ({"cache": -1}, ValueError, "cache must be at least 0, got -1"),
        ({"cache": 0.5}, TypeError, "cache must be an integer"),
        (
            {"cache": 1, "workers": 2},
            ValueError,
            "cache must be 0 or None with several workers or with a scheduler",
        ),
        (
            {"cache": 1, "scheduler": "tcp://a:1"},
            ValueError,
            "cache must be 0 or None with several workers or with a scheduler",
        ),
        ({"workers": 0}, ValueError, "workers"),
        ({"weld": 1}, TypeError, "weld"),
        ({"denoise": "much"}, ValueError, "denoise must be 'auto', a number of steps, or None"),
        ({"viewpoint": (1, 2)}, ValueError, "viewpoint must be three finite numbers"),
    ],
    ids=str,
)
def test_wrong_arguments_are_found_before_the_mesh_is_read(options, error, message):
    with pytest.raises(error, match=message):
        segment_tiled("no such file", 12, **options)


def test_a_folder_that_is_not_there(bear, tmp_path):
    with pytest.raises(OSError, match="nowhere"):
        segment_tiled(bear, 12, out=tmp_path / "nowhere" / "labels.npy")


LIMITED = """
import resource, sys
import superfacets
path, folder, room = sys.argv[1], sys.argv[2], int(sys.argv[3])
mesh = superfacets.sample_mesh(3_000)
superfacets.segment(mesh, 5)
superfacets.segment_tiled(mesh, 5, scratch=folder, n_threads=1)  # all that is imported
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + room, used + room))
if sys.argv[4] == "tiled":
    labels = superfacets.segment_tiled(
        path, 20, tile_size=1 << 14, scratch=folder, out=sys.argv[5], n_threads=1
    )
else:
    superfacets.segment(path, 20, n_threads=1)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs more")
def test_tiles_need_less_memory(tmp_path):
    mesh = sf.sample_mesh(400_000)
    mesh = Mesh(*split_in_four(mesh.vertices, mesh.faces))
    path, room = as_ply(tmp_path, mesh), 96 << 20
    wanted = in_memory(mesh, 20).labels
    run = [sys.executable, "-c", LIMITED, path, tmp_path, str(room)]
    out = tmp_path / "labels.npy"
    subprocess.run([*run, "tiled", out], check=True, timeout=300)
    assert np.array_equal(np.load(out), wanted)
    whole = subprocess.run([*run, "whole"], check=False, timeout=300, capture_output=True)
    assert b"MemoryError" in whole.stderr
