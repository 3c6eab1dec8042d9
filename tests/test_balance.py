"""Regions of equal, bounded or exact size."""

import itertools
import re
import warnings
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import reference
import shapes
from hypothesis import given, reject, settings
from hypothesis import strategies as st

import superfacets as sf
from superfacets import _core
from superfacets.cleanup.edit import CREASE_SCALE, read_labeled
from superfacets.graph.kinds import as_surface

THREADS = (1, 2, 5)


def areas_of(mesh, labels):
    return np.bincount(labels, sf.build_face_graph(mesh).measures)


def pieces_of(cells, labels):
    surface = as_surface(cells, weld=True, n_threads=1)
    kept = np.where(labels < 0, labels.max() + 1, labels).astype(np.int32)
    return _core.find_components(surface.offsets, surface.neighbors, kept)[0]


def n_pieces(cells, labels):
    return len(np.unique(pieces_of(cells, labels)[labels >= 0]))


def components_of(cells):
    return pieces_of(cells, np.zeros(cells.n_cells, int))


def spread(sizes):
    return sizes.std() / sizes.mean()


def apart(first, second):
    """Return two meshes as one, far from each other."""
    return shapes.together([first, sf.Mesh(second.vertices + [100.0, 0, 0], second.faces)])


# --- equal sizes


def test_regions_are_equal_connected_and_as_many_as_asked_for():
    mesh = sf.sample_mesh(20_000)
    usual = sf.segment(mesh, 60)
    equal = sf.segment(mesh, 60, sizes=sf.Sizes(balance=1.0))
    assert equal.n_segments == 60 == n_pieces(mesh, equal.labels)
    assert spread(areas_of(mesh, usual.labels)) > 0.2
    areas = areas_of(mesh, equal.labels)
    assert spread(areas) < 0.12
    assert areas.max() < 1.25 * areas.mean()
    assert equal.labels[equal.centers].tolist() == list(range(60))
    assert equal.params["balance"] == 1.0
    assert "balance" not in usual.params


def test_without_balance_nothing_changes():
    mesh = shapes.bumpy_sheet(40)
    assert np.array_equal(
        sf.segment(mesh, 20).labels, sf.segment(mesh, 20, sizes=sf.Sizes(balance=0.0)).labels
    )


def test_half_a_balance_is_in_between():
    mesh = sf.sample_mesh(10_000)
    spreads = [
        spread(areas_of(mesh, sf.segment(mesh, 40, sizes=sf.Sizes(balance=b)).labels))
        for b in (0, 0.5, 1)
    ]
    assert spreads[0] > spreads[1] > spreads[2]


@pytest.mark.parametrize(("n", "options"), [
    (50, {"sizes": sf.Sizes(balance=1.0)}), (None, {"sizes": sf.Sizes(cells=64)}),
    (50, {"sizes": sf.Sizes(balance=1.0), "weights": "creases"}),
])  # fmt: skip
def test_labels_do_not_depend_on_the_number_of_threads(n, options):
    mesh = sf.sample_mesh(30_000)
    first = sf.segment(mesh, n, n_threads=1, **options)
    for n_threads in THREADS[1:]:
        again = sf.segment(mesh, n, n_threads=n_threads, **options)
        assert np.array_equal(again.labels, first.labels)
        assert np.array_equal(again.centers, first.centers)


def test_cell_weights_replace_areas():
    mesh = sf.sample_mesh(10_000)
    costs = np.where(np.arange(mesh.n_faces) % 10 == 0, 7.0, 1.0)
    costs[sf.build_face_graph(mesh).positions[:, 2] > 0] *= 3
    result = sf.segment(mesh, 40, sizes=sf.Sizes(balance=1.0, weights=costs))
    assert np.ptp(np.bincount(result.labels, costs)) < 0.41 * costs.sum() / 40  # 20 % to each side
    assert spread(np.bincount(result.labels)) > 0.3
    assert n_pieces(mesh, result.labels) == 40


@pytest.mark.parametrize("weights", ["creases", "superfacets"])
def test_all_weights_can_be_balanced(weights):
    mesh = sf.sample_mesh(12_000)
    result = sf.segment(mesh, 25, sizes=sf.Sizes(balance=1.0), weights=weights)
    assert spread(areas_of(mesh, result.labels)) < 0.2
    assert n_pieces(mesh, result.labels) == 25


def test_components_get_regions_by_their_areas():
    mesh = apart(shapes.flat(30), shapes.flat(20))
    result = sf.segment(mesh, 26, sizes=sf.Sizes(balance=1.0))
    assert len(np.unique(result.labels[: 2 * 30 * 30])) == 18  # 18 of 26, as 900 of 1,300
    assert spread(areas_of(mesh, result.labels)) < 0.13


def test_barriers_keep_areas_apart_and_each_is_divided_evenly():
    mesh = shapes.flat(40)
    x = sf.build_face_graph(mesh).positions[:, 0]
    sides = (x > np.quantile(x, 0.25)).astype(int)
    result = sf.segment(mesh, 20, sizes=sf.Sizes(balance=1.0), barriers=sides)
    assert [len(np.unique(result.labels[sides == side])) for side in (0, 1)] == [5, 15]
    assert all(len(np.unique(sides[result.labels == region])) == 1 for region in range(20))
    assert spread(areas_of(mesh, result.labels)) < 0.13


def test_regions_of_regions_are_equal_children():
    mesh = sf.sample_mesh(20_000)
    parents = sf.segment(mesh, 10, sizes=sf.Sizes(balance=1.0)).labels
    children = sf.segment(mesh, 40, sizes=sf.Sizes(balance=1.0), barriers=parents).labels
    parent_of = np.zeros(40, int)
    parent_of[children] = parents
    assert np.array_equal(parent_of[children], parents)
    assert set(np.bincount(parent_of)) <= {3, 4, 5}
    assert spread(areas_of(mesh, children)) < 0.15


def test_a_mask_counts_for_no_area():
    mesh = shapes.flat(40)
    mask = sf.build_face_graph(mesh).positions[:, 0] > 10
    result = sf.segment(mesh, 12, sizes=sf.Sizes(balance=1.0), mask=mask)
    assert (result.labels[~mask] == -1).all()
    areas = np.bincount(result.labels[mask], sf.build_face_graph(mesh).measures[mask])
    assert len(areas) == 12
    assert spread(areas) < 0.13


def test_features_polygons_points_and_tets():
    sheet = shapes.flat(40)
    colors = (sf.build_face_graph(sheet).positions[:, 1] > 17.3).astype(float)
    striped = sf.segment(sheet, 12, sizes=sf.Sizes(balance=1.0), features=colors[:, None])
    assert spread(areas_of(sheet, striped.labels)) < 0.16
    cloud = sf.PointCloud(shapes.squares(39).vertices, np.tile([0.0, 0.0, 1.0], (1600, 1)))
    points = sf.segment(cloud, 16, sizes=sf.Sizes(balance=1.0))
    assert spread(np.bincount(points.labels)) < 0.13
    assert n_pieces(cloud, points.labels) == 16
    tets = shapes.block(8)
    volumes = sf.segment(tets, 12, sizes=sf.Sizes(balance=1.0))
    assert spread(np.bincount(volumes.labels)) < 0.19
    assert n_pieces(tets, volumes.labels) == 12
    squares = sf.segment(shapes.squares(30), 9, sizes=sf.Sizes(balance=1.0))
    assert spread(np.bincount(squares.labels)) < 0.13


# --- bounds


@given(
    seed=st.integers(0, 10**6), k=st.integers(2, 20), low=st.floats(0.2, 0.9),
    high=st.floats(1.1, 2),
)  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_bounds_hold(seed, k, low, high):
    """Bounds are kept, or an error says that they could not be, as in one of about 400 runs."""
    mesh = shapes.bumpy_sheet(14)
    costs = np.random.default_rng(seed).integers(1, 4, mesh.n_faces).astype(float)
    mean = costs.sum() / k
    sizes = sf.Sizes(bounds=(low * mean, high * mean), weights=costs)
    try:
        result = sf.segment(mesh, k, sizes=sizes)
    except sf.MeshError as error:
        if "Sizes(bounds=...) cannot be met" not in str(error):
            raise
        reject()
    sizes = np.bincount(result.labels, costs, k)
    assert sizes.min() >= low * mean - 1e-6
    assert sizes.max() <= high * mean + 1e-6
    assert n_pieces(mesh, result.labels) == result.n_segments == k


def test_bounds_of_the_sample_hold():
    mesh = sf.sample_mesh(10_000)
    mean = sf.build_face_graph(mesh).measures.sum() / 50
    areas = areas_of(mesh, sf.segment(mesh, 50, sizes=sf.Sizes(bounds=(None, 1.2 * mean))).labels)
    assert areas.max() <= 1.2 * mean * (1 + 1e-9)
    areas = areas_of(mesh, sf.segment(mesh, 50, sizes=sf.Sizes(bounds=(0.8 * mean, None))).labels)
    assert areas.min() >= 0.8 * mean * (1 - 1e-9)


def test_islands_that_are_too_small_are_told():
    mesh = apart(shapes.flat(20), shapes.flat(2))
    area = sf.build_face_graph(mesh).measures.sum()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        with pytest.raises(ValueError, match=r"^Sizes\(bounds=\.\.\.\) cannot be met: region"):
            sf.segment(mesh, 4, sizes=sf.Sizes(bounds=(0.1 * area, None)))


@pytest.mark.parametrize(("options", "message"), [
    ({"balance": 1.5}, "balance must be from 0 to 1, got 1.5"),
    ({"balance": True}, "balance must be a number, got True"),
    ({"bounds": 40.0}, "bounds must be a pair (lowest, highest), got 40.0"),
    ({"bounds": (1.0, 2.0, 3.0)}, "bounds must be a pair (lowest, highest), got (1.0, 2.0, 3"),
    ({"bounds": (-1.0, None)}, "bounds[0] must be finite and not negative, got -1.0"),
    ({"bounds": (None, 0.0)}, "bounds[1] must be finite and positive, got 0.0"),
    ({"bounds": ("1", None)}, "bounds[0] must be a number, got '1'"),
    ({"bounds": (2.0, 1.0)}, "bounds[0] must be at most bounds[1], 1, got 2"),
    ({"weights": np.ones(1600)}, "Sizes.weights have no effect without balance or bounds:"
     " give one of them, or leave weights out"),
    ({"cells": 0}, "cells must be at least 1, got 0"),
    ({"cells": 1.5}, "cells must be an integer"),
    ({"cells": 64, "balance": 1.0}, "Sizes(cells=...) already sets all sizes: leave balance"),
    ({"cells": 64, "bounds": (1.0, None)}, "already sets all sizes: leave bounds out"),
    ({"cells": 64, "bounds": (None, 1.0)}, "already sets all sizes: leave bounds out"),
    ({"cells": 64, "weights": np.ones(9)}, "already sets all sizes: leave weights out"),
])  # fmt: skip
def test_wrong_sizes_are_told_before_there_is_a_mesh(options, message):
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        sf.Sizes(**options)


def test_sizes_take_named_parameters_alone_and_do_not_change():
    with pytest.raises(TypeError, match="positional"):
        sf.Sizes(1.0)
    sizes = sf.Sizes(balance=1, bounds=[2, None])
    assert (sizes.balance, sizes.bounds) == (1.0, (2.0, None))
    with pytest.raises(AttributeError):
        sizes.balance = 0.5
    result = sf.segment(shapes.flat(20), 10, sizes=sizes)
    assert (result.params["balance"], result.params["bounds"]) == (1.0, [2.0, None])
    assert not {"size_weights", "cells"} & result.params.keys()


@pytest.mark.parametrize(("sizes", "options", "message"), [
    ({"balance": 1.0}, {}, "sizes must be superfacets.Sizes(...), got dict"),
    (sf.Sizes(bounds=(None, 20.0)), {"n_segments": 3},
     "Sizes(bounds=(None, 20)) allows 3 regions to cover only 60 of 800: use at least 40"
     " regions"),
    (sf.Sizes(bounds=(300.0, None)), {"n_segments": 3},
     "Sizes(bounds=(300, None)) needs 900 for 3 regions, but the total size of all cells is"
     " 800: use at most 2 regions"),
    (sf.Sizes(bounds=(900.0, None)), {"n_segments": 3},
     "Sizes(bounds=(900, None)) must allow at most 800, the total size of all cells: lower the"
     " lowest size"),
    (sf.Sizes(bounds=(None, 0.1)), {"n_segments": 3},
     "Sizes(bounds=(None, 0.1)) must allow at least 0.5, the size of the largest cell: raise"
     " the highest size"),
    (sf.Sizes(balance=1.0, weights=np.ones(7)), {},
     "Sizes.weights must have one value per cell, shape (1600,), got (7,)"),
    (sf.Sizes(balance=1.0, weights=-np.ones(1600)), {},
     "Sizes.weights[0] must be finite and not negative, got -1.0"),
    (sf.Sizes(balance=1.0, weights=["a"] * 1600), {},
     "Sizes.weights must contain numbers, got <U1"),
    (sf.Sizes(balance=1.0, weights=np.zeros(1600)), {},
     "at least one cell must have a size above 0, but all sizes are 0"),
    *((sf.Sizes(cells=64), options,
       "Sizes(cells=...) already sets the number of regions: leave out n_segments and radius,"
       " and do not pass seeds as init")
      for options in ({"n_segments": 3}, {"radius": 1.0}, {"init": [1, 2]})),
    (sf.Sizes(cells=64), {"islands": "nearest"},
     "Sizes(cells=...) keeps each region in one component: leave islands='nearest' out"),
])  # fmt: skip
def test_sizes_that_do_not_fit_the_mesh_or_other_options_are_told(sizes, options, message):
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        sf.segment(shapes.flat(40, 20), sizes=sizes, **options)


# --- exact sizes


def check_exact(cells, per_region, labels, components=None):
    """Check that each component has full regions and at most one region with the remainder."""
    components = components_of(cells) if components is None else components
    counts = np.bincount(labels)
    component_of = np.zeros(len(counts), int)
    component_of[labels] = components
    assert np.array_equal(component_of[labels], components)
    for component, n in enumerate(np.bincount(components)):
        found = sorted(counts[component_of == component].tolist(), reverse=True)
        full, rest = divmod(int(n), per_region)
        assert found == [per_region] * full + [rest] * (rest > 0)


@pytest.mark.parametrize("per_region", [1, 2, 7, 64, 500, 10**6])
def test_regions_have_exactly_as_many_cells(per_region):
    mesh = shapes.bumpy_sheet(30)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.BalanceWarning)
        result = sf.segment(mesh, sizes=sf.Sizes(cells=per_region))
    check_exact(mesh, per_region, result.labels)
    assert result.n_extra_pieces == n_pieces(mesh, result.labels) - result.n_segments
    if per_region not in (2, 7):  # for 2 and 7, few pairs are left to choose from
        assert result.n_extra_pieces <= 0.01 * result.n_segments


@st.composite
def meshes(draw):
    """Draw sheets without some faces: components of all sizes, holes and thin bridges."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    mesh = shapes.flat(draw(st.integers(1, 19)), draw(st.integers(1, 19)))
    is_kept = rng.random(mesh.n_faces) > draw(st.sampled_from([0.0, 0.05, 0.2, 0.5]))
    is_kept[0] = True
    heights = rng.normal(0, draw(st.sampled_from([0.0, 0.2, 1.0])), (mesh.n_vertices, 1))
    return sf.Mesh(mesh.vertices + heights * [0, 0, 1], mesh.faces[is_kept])


@given(mesh=meshes(), per_region=st.sampled_from([1, 3, 8, 64]))
@settings(max_examples=40, deadline=None)
def test_sizes_are_exact_on_random_meshes(mesh, per_region):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = sf.segment(mesh, sizes=sf.Sizes(cells=per_region))
    check_exact(mesh, per_region, result.labels)
    assert result.labels[result.centers].tolist() == list(range(result.n_segments))
    assert result.n_extra_pieces == n_pieces(mesh, result.labels) - result.n_segments


def test_what_cannot_be_connected_is_told_and_counted():
    """A star of three arms and a center, one face each, cannot be divided into connected pairs."""
    legs = [[0, 1, 2], [1, 0, 3], [2, 1, 4], [0, 2, 5]]
    vertices = [[0, 0, 0], [2, 0, 0], [1, 2, 0], [1, -2, 0], [3, 2, 0], [-1, 2, 0]]
    star = sf.Mesh(vertices, legs)
    with pytest.warns(
        sf.BalanceWarning, match="no connected regions of the requested sizes were found"
    ):
        result = sf.segment(star, sizes=sf.Sizes(cells=2))
    check_exact(star, 2, result.labels)
    assert result.n_extra_pieces == 1


def test_exact_sizes_of_points_tets_and_polygons():
    cloud = sf.PointCloud(shapes.squares(19).vertices, np.tile([0.0, 0.0, 1.0], (400, 1)))
    for cells in (cloud, shapes.block(5), shapes.squares(12)):
        result = sf.segment(cells, sizes=sf.Sizes(cells=32))
        check_exact(cells, 32, result.labels)
        assert result.n_extra_pieces == 0


def test_exact_sizes_between_barriers_and_in_masks():
    mesh = shapes.flat(20)
    x = sf.build_face_graph(mesh).positions[:, 0]
    sides = (x > np.quantile(x, 0.3)).astype(int)
    result = sf.segment(mesh, sizes=sf.Sizes(cells=50), barriers=sides)
    check_exact(mesh, 50, result.labels, sides)
    masked = sf.segment(mesh, sizes=sf.Sizes(cells=50), mask=sides == 1)
    counts = np.bincount(masked.labels[sides == 1])
    assert sorted(counts)[1:] == [50] * (len(counts) - 1)
    assert (masked.labels[sides == 0] < 0).all()


# --- patches


def test_patches_hold_each_cell_once_in_the_order_of_a_walk():
    mesh = sf.sample_mesh(6_000)
    result = sf.segment(mesh, sizes=sf.Sizes(cells=64))
    patches = result.patches
    assert patches.shape == (result.n_segments, 64)
    assert sorted(patches[patches >= 0].tolist()) == list(range(mesh.n_faces))
    for region, patch in enumerate(patches):
        assert (result.labels[patch[patch >= 0]] == region).all()
        assert (patch[np.argmax(patch < 0) :] < 0).all() or (patch >= 0).all()
    graph = sf.build_face_graph(mesh)
    arcs = set(zip(graph.sources.tolist(), graph.neighbors.tolist(), strict=True))
    steps = [pair for patch in patches for pair in itertools.pairwise(patch)]
    assert np.mean([pair in arcs for pair in steps]) > 0.85


def test_patches_need_cells_and_leave_masked_cells_out():
    mesh = shapes.flat(10)
    mask = np.arange(mesh.n_faces) % 7 > 0
    result = sf.segment(mesh, 5, mask=mask, islands="nearest")
    assert sorted(result.patches[result.patches >= 0].tolist()) == np.flatnonzero(mask).tolist()
    with pytest.raises(
        ValueError,
        match=r"this segmentation does not store its mesh: call region_graph\(mesh,"
        r" labels\) instead",
    ):
        sf.Segmentation(result.labels, result.centers, 1, "converged", {}, {}).patches  # noqa: B018


# --- references


@pytest.mark.parametrize("may_split", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_moves_of_cells_equal_their_twin(seed, may_split):
    mesh = shapes.bumpy_sheet(9)
    rng = np.random.default_rng(seed)
    seeds = rng.permutation(mesh.n_faces)[:6]
    labels = sf.segment(mesh, init=seeds, max_num_iter=0, smooth=False).labels
    _, costs, array, k = read_labeled(mesh, labels, None, True, 1)
    sizes = np.ones(mesh.n_faces) if may_split else rng.integers(1, 4, mesh.n_faces).astype(float)
    goals = np.full(k, sizes.sum() / k)
    lows, highs = (goals // 1, goals // 1) if may_split else (0.9 * goals, 1.1 * goals)
    if may_split:
        lows[: mesh.n_faces - int(lows.sum())] += 1
        highs = lows
    unit = costs.unit * costs.surface.weight_unit
    expected = reference.move_cells(
        sf.build_face_graph(mesh), mesh, costs.lengths.astype(np.float64) * unit, array.tolist(),
        sizes.tolist(), (lows.tolist(), highs.tolist()),
        crease_scale=CREASE_SCALE * costs.radius, may_split=may_split,
    )  # fmt: skip
    found = _core.move_cells(*costs.args, array, sizes, lows, highs, may_split, 1)
    assert found.tolist() == expected
    if may_split:
        assert np.bincount(found).tolist() == lows.tolist()


@pytest.mark.parametrize("k", [1, 5, 30])
def test_the_walk_equals_its_twin(k):
    mesh = shapes.bumpy_sheet(12)
    labels = sf.segment(mesh, k).labels
    labels[::17] = -1
    graph = sf.build_face_graph(mesh)
    neighbors = [graph.neighbors[a:b].tolist() for a, b in itertools.pairwise(graph.offsets)]
    expected = reference.walk_regions(neighbors, labels.tolist())
    for n_threads in THREADS:
        found = _core.walk_regions(graph.offsets, graph.neighbors, labels, k, n_threads)
        assert found.tolist() == expected


# --- files, commands, benchmarks


def solids_of(path):
    """Return the number of facets of each solid."""
    solids = {}
    for line in path.read_text().splitlines():
        if line.startswith("solid"):
            name = line.split(maxsplit=1)[1]
            assert name not in solids
            solids[name] = 0
        solids[name] += line.startswith("  facet")
    return solids


def test_stl_has_a_solid_for_each_region_or_class(tmp_path):
    mesh = sf.sample_mesh(5_000)
    labels = sf.segment(mesh, 4).labels
    path = tmp_path / "part.stl"
    sf.write_mesh(path, mesh, labels)
    counts = np.bincount(labels).tolist()
    assert solids_of(path) == {f"region_{i}": n for i, n in enumerate(counts)}
    again = sf.read_mesh(path)
    order = np.argsort(labels, kind="stable")
    assert np.allclose(again.vertices[again.faces], mesh.vertices[mesh.faces[order]], atol=1e-8)
    normals = [line.split()[2:] for line in path.read_text().splitlines() if "normal" in line]
    corners = mesh.vertices[mesh.faces[order]]
    expected = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(np.array(normals, float), expected)
    sf.write_mesh(path, mesh, labels, classes=["inlet", "side wall", "outlet", "side wall"])
    found = {"inlet": counts[0], "side_wall": counts[1] + counts[3], "outlet": counts[2]}
    assert solids_of(path) == found


def test_stl_of_masked_and_of_unlabeled_faces(tmp_path):
    mesh = shapes.flat(3)
    path = tmp_path / "part.stl"
    sf.write_mesh(path, mesh, np.repeat([-1, 2], 9))
    assert solids_of(path) == {"unlabeled": 9, "region_2": 9}
    sf.write_mesh(path, mesh, ascii=True)
    assert solids_of(path) == {"mesh": 18}
    with pytest.raises(sf.MeshError, match=r"not as \.stl"):
        sf.write_mesh(path, shapes.squares(2), np.zeros(4, int))


def test_the_benchmark_compares_with_metis_and_pyacvd(real_data):
    if real_data is None or not (find_spec("pymetis") and find_spec("pyacvd")):
        pytest.skip("needs the Princeton benchmark, pymetis and pyacvd")
    from benchmarks.balance import METHODS, balance_table, measure_balance

    rows = measure_balance(real_data / "psb", [50], 95, lambda _: None)
    assert [row.method for row in rows] == list(METHODS)
    assert balance_table(rows).count("\n") == 1 + len(METHODS)
    of = {row.method: row for row in rows}
    assert of["superfacets, balance=1"].variation < 0.5 * of["superfacets"].variation
    assert of["METIS, 3 %"].variation < of["METIS, 20 %"].variation


def test_the_table_of_the_readme_compares_all_peers(real_data, tmp_path):
    names = ("pymetis", "pyacvd", "superfacets_vsa")
    if real_data is None or not all(find_spec(name) for name in names):
        pytest.skip("needs the Princeton benchmark, pymetis, pyacvd and superfacets_vsa")
    from benchmarks.peers import PEERS, measure_peers
    from benchmarks.report import fill_peers

    rows = measure_peers(real_data / "psb", 150, 48, lambda _: None)
    assert [row["method"] for row in rows] == list(PEERS)
    assert min(rows, key=lambda row: row["error"])["method"] == "superfacets"
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    assert all(f"| {name} " in readme for name in PEERS)
    assert fill_peers(readme, rows) != readme


@pytest.mark.parametrize("options", [{}, {"weights": "superfacets"}, {"init": "farthest"}])
def test_exact_sizes_hold_in_each_of_several_components(options):
    bear = sf.sample_mesh(3000)
    mesh = shapes.together([shapes.bumpy_sheet(20), sf.Mesh(bear.vertices + [5, 0, 0], bear.faces)])
    sizes = np.bincount(sf.segment(mesh, sizes=sf.Sizes(cells=64), **options).labels)
    assert set(sorted(sizes)[:2]) == {800 % 64, bear.n_faces % 64}
    assert set(sorted(sizes)[2:]) == {64}


def test_bounds_that_components_need_more_regions_for_are_told():
    mesh = apart(shapes.flat(10), shapes.flat(10))
    area = sf.build_face_graph(mesh).measures.sum() / 2
    with pytest.raises(
        sf.MeshError,
        match=r"Sizes\(bounds=\(None, 90\)\) needs at least 4 regions, because no region can extend"
        " over two components, got 3 regions",
    ):
        sf.segment(mesh, 3, sizes=sf.Sizes(bounds=(None, 0.9 * area)))
    assert sf.segment(mesh, 4, sizes=sf.Sizes(bounds=(None, 0.9 * area))).n_segments == 4


@pytest.mark.parametrize(
    ("weight", "number"),
    [(1e308, "the largest value"), (5e-324, "the largest value"), (9e149, "the sum")],
)
def test_sizes_that_overflow_are_refused(weight, number):
    mesh = shapes.bumpy_sheet(8)
    with pytest.raises(
        ValueError, match=rf"{number} of Sizes.weights must be 1e-150 to 1e\+150, got .*: rescale"
    ):
        sf.segment(mesh, 4, sizes=sf.Sizes(balance=1.0, weights=np.full(mesh.n_faces, weight)))


@pytest.mark.parametrize("n_regions", [12, 30, 60])
def test_each_face_of_a_part_gets_regions_in_proportion_to_its_area(n_regions):
    block = sf.subdivide(shapes.drilled_block(64), 0.05).mesh
    edges = sf.sharp_edges(block)
    faces = sf.segment(block, 1, barriers=edges)
    result = sf.segment(block, n_regions, sizes=sf.Sizes(balance=1), barriers=edges)
    counts = np.bincount(faces.labels[result.centers], minlength=7)
    areas = faces.regions.areas
    assert result.n_segments == n_regions
    assert np.abs(counts - n_regions * areas / areas.sum()).max() < 1


def test_fewer_regions_than_requested_because_of_a_minimum_area_are_explained():
    mesh = apart(shapes.flat(10), shapes.flat(10))
    least = 0.3 * sf.build_face_graph(mesh).measures.sum()
    with pytest.warns(sf.IslandWarning) as warned:
        result = sf.segment(mesh, 3, sizes=sf.Sizes(bounds=(least, None)))
    assert result.n_segments == 2
    assert str(warned[0].message) == (
        "2 regions instead of 3: some components are too small for more regions with"
        f" Sizes(bounds=({least:g}, None))"
    )


@pytest.mark.parametrize("seed", [497, 802])
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_no_region_of_random_faces_loses_its_last_cell(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.random((int(rng.integers(6, 30)), 3))
    faces = rng.integers(0, len(vertices), (int(rng.integers(4, 30)), 3))
    k = int(rng.integers(2, len(faces)))
    labels = sf.segment(
        (vertices, faces), k, sizes=sf.Sizes(balance=1), islands="nearest", n_threads=1
    ).labels
    assert np.bincount(labels, minlength=k).all()


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_part_without_a_seed_does_not_change_the_balance_of_the_others():
    sheet = shapes.flat(20)
    both = apart(sheet, sf.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    found = sf.segment(both, 8, sizes=sf.Sizes(balance=1), smooth=False, islands="nearest")
    assert areas_of(sheet, found.labels[:-1]).max() <= 1.2 * 400 / 8


def spread_and_shape(result):
    """Return the coefficient of variation of areas, and the largest compactness."""
    regions = result.regions
    return regions.areas.std() / regions.areas.mean(), regions.compactness.max()


@pytest.mark.parametrize("weights", ["parts", "creases"])
def test_equal_regions_between_barriers_are_compact(weights):
    block = shapes.drilled_block(64)
    fine = sf.subdivide(block, 0.04)
    faces = sf.cad_faces(block)[fine.sources]
    result = sf.segment(fine.mesh, 100, weights=weights, barriers=faces, sizes=sf.Sizes(balance=1))
    spread, compactness = spread_and_shape(result)
    assert spread < 0.08
    assert compactness < 7


@pytest.mark.parametrize("weights", ["parts", "creases"])
def test_equal_regions_of_a_fine_mesh_are_compact(weights, data_dir):
    bunny = sf.read_mesh(data_dir / "meshes" / "bunny.ply")
    result = sf.segment(bunny, 150, weights=weights, sizes=sf.Sizes(balance=1))
    spread, compactness = spread_and_shape(result)
    assert spread < 0.1
    assert compactness < 8


def test_areas_between_barriers_that_are_too_small_for_equal_regions_are_noted():
    fine = sf.subdivide(shapes.rounded_slab(12), 0.5)
    faces = sf.cad_faces(fine.mesh)
    with pytest.warns(
        sf.BalanceWarning, match=r"sizes of regions vary by \d\d%, because some areas"
    ):
        sf.segment(fine.mesh, 15, barriers=faces, sizes=sf.Sizes(balance=1))
