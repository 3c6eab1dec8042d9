"""The objects that carry options of `segment`, prepared meshes, and the algorithm of the paper."""

import numpy as np
import pytest
import shapes

import superfacets as sf

MESH = shapes.bumpy_sheet(24)


def same(one, other):
    return np.array_equal(one.labels, other.labels) and np.array_equal(one.centers, other.centers)


# --- Weights


def test_weights_without_parameters_are_their_name():
    for name in ("parts", "creases", "superfacets"):
        named, given = (sf.segment(MESH, 20, weights=w) for w in (name, sf.Weights(name)))
        assert same(named, given)
        assert named.params == given.params
    assert sf.Weights().name == "parts"
    assert sf.Weights().given == {}


def test_parameters_of_weights_are_used_and_told():
    usual = sf.segment(MESH, 20, weights="creases")
    weights = sf.Weights("creases", alpha=90, eta_convex=1, ridges=2)
    result = sf.segment(MESH, 20, weights=weights)
    assert weights.given == {"alpha": 90.0, "eta_convex": 1.0, "ridges": 2.0}
    assert weights.given.items() <= result.params.items()
    assert not np.array_equal(result.labels, usual.labels)


def test_alpha_may_be_given_beside_weights_but_once():
    within = sf.segment(MESH, 20, weights=sf.Weights("creases", alpha=40))
    assert same(within, sf.segment(MESH, 20, weights=sf.Weights("creases"), alpha=40))
    with pytest.raises(ValueError, match=r"alpha is 3\.0 and, in Weights, 40\.0: give it once"):
        sf.segment(MESH, 20, weights=sf.Weights(alpha=40), alpha=3.0)
    arcs = np.ones(sf.build_face_graph(MESH).n_arcs)
    with pytest.raises(
        ValueError, match="alpha does not change weights given as an array: leave it out"
    ):
        sf.segment(MESH, 20, weights=arcs, alpha=3.0)


@pytest.mark.parametrize(("name", "options", "error", "message"), [
    ("best", {}, ValueError, "weights must be one of parts, creases,.* got 'best'"),
    ("parts", {"alpha": -1}, ValueError, "alpha must be finite and not negative, got -1"),
    ("parts", {"eta_convex": np.nan}, ValueError, "eta_convex must be finite and not negative"),
    ("creases", {"ridges": np.inf}, ValueError, "ridges must be finite and not negative"),
    ("creases", {"ridges": "1"}, TypeError, "ridges must be a number, got '1'"),
    ("parts", {"alpha": True}, TypeError, "alpha must be a number, got True"),
    ("superfacets", {"ridges": 0.5}, ValueError,
     "weights 'superfacets' have no parameter ridges: leave it out"),
    ("parts", {"gamma": 1}, TypeError, "unexpected keyword argument 'gamma'"),
])  # fmt: skip
def test_wrong_weights_are_refused(name, options, error, message):
    with pytest.raises(error, match=message):
        sf.Weights(name, **options)


# --- prepare

ARCS = sf.crease_weights(MESH, sf.build_face_graph(MESH), 0.1)
FIELD = np.arange(MESH.n_faces) % 7

OPTIONS = {
    "defaults": {}, "creases": {"weights": "creases", "alpha": 50}, "array": {"weights": ARCS},
    "radius": {"radius": 0.2}, "farthest": {"init": "farthest"}, "seeds": {"init": [5, 99, 7]},
    "mask": {"mask": FIELD > 0}, "vertices": {"mask": np.arange(MESH.n_vertices) > 50},
    "barriers": {"barriers": FIELD // 4}, "balance": {"sizes": sf.Sizes(balance=1)},
    "sizes": {"sizes": sf.Sizes(balance=1, weights=FIELD + 1.0)}, "rough": {"smooth": False},
    "cells": {"sizes": sf.Sizes(cells=64)}, "steps": {"denoise": 4}, "none": {"denoise": 0},
    "features": {"features": sf.Features(FIELD, weight=9)}, "names": {"features": "normals"},
    "threads": {"n_threads": 3}, "iterations": {"max_num_iter": 2, "tol": 0},
}  # fmt: skip
PREPARED = {denoise: sf.prepare(MESH, denoise=denoise) for denoise in ("auto", 0, 4)}


@pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_a_prepared_mesh_gives_the_same_results(options):
    if not {"radius", "init", "sizes"} & options.keys():
        options = {"n_segments": 20, **options}
    for denoise, prepared in PREPARED.items():
        expected = sf.segment(MESH, **{"denoise": denoise, **options})
        result = sf.segment(prepared, **options)
        assert same(result, expected)
        assert result.params == expected.params
        assert result.cells is MESH


def test_a_mesh_that_is_prepared_without_welding_stays_so():
    soup = shapes.soup(shapes.strip(6))
    apart = sf.prepare(soup, weld=False)
    for options in ({}, {"denoise": 3}, {"weights": []}):  # the last two need another graph
        with pytest.warns(sf.IslandWarning, match="6 regions instead of 2"):
            result = sf.segment(apart, 2, **options)
        assert result.params["weld"] is False
        assert result.regions.n_arcs == 0
    assert sf.segment(sf.prepare(soup), 2).params["weld"] is True


def test_prepared_polygons_tets_and_clouds_give_the_same_results(tmp_path):
    quads = sf.PolygonMesh.of_faces(MESH.vertices, MESH.faces)
    cloud = sf.PointCloud(MESH.vertices)
    mask = np.arange(cloud.n_points) % 3 > 0
    for cells, options in (
        (quads, {}), (quads, {"features": "height"}), (cloud, {}), (cloud, {"mask": mask}),
        (cloud, {"mask": mask, "features": "normals"}), (cloud, {"denoise": 0}),
        (cloud, {"weights": sf.build_point_graph(cloud).weights}),
    ):  # fmt: skip
        assert same(sf.segment(sf.prepare(cells), 9, **options), sf.segment(cells, 9, **options))
    sf.write_mesh(tmp_path / "sheet.ply", MESH)
    for given in (tmp_path / "sheet.ply", sf.prepare(tmp_path / "sheet.ply")):
        assert same(sf.segment(given, 9), sf.segment(MESH, 9))


@pytest.mark.parametrize(("options", "error", "message"), [
    ({"weld": "all"}, TypeError, "weld must be True or False, got 'all'"),
    ({"weld": -1.0}, ValueError, "weld must be"),
    ({"denoise": -1}, ValueError, "denoise must be at least 0"),
    ({"denoise": "some"}, (TypeError, ValueError), "denoise must be"),
    ({"n_threads": 0}, ValueError, "n_threads must be at least 1"),
])  # fmt: skip
def test_wrong_arguments_of_prepare_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        sf.prepare(MESH, **options)
    with pytest.raises(ValueError, match="denoise needs a mesh of faces, got points: leave denois"):
        sf.prepare(sf.PointCloud(MESH.vertices), denoise=2)


# --- the algorithm of the paper


@pytest.mark.parametrize("init", ["farthest", "flood", "grid", "geodesic", [5, 99, 7]])
def test_the_paper_takes_a_prepared_mesh(init):
    n_segments = 20 if isinstance(init, str) else None
    expected = sf.paper.segment(MESH, n_segments, init=init)
    for prepared in PREPARED.values():  # smoothed or not: the paper does not smooth
        assert same(sf.paper.segment(prepared, n_segments, init=init), expected)


def test_parameters_of_the_paper_are_used_and_told():
    result = sf.paper.segment(
        MESH, radius=0.15, alpha=50, eta_convex=1, radius_factor=None, max_num_iter=3, n_threads=1
    )
    expected = {
        "n_segments": None, "radius": 0.15, "alpha": 50.0, "eta_convex": 1.0,
        "radius_factor": None, "max_num_iter": 3,
    }  # fmt: skip
    assert expected.items() <= result.params.items()
    masked = sf.paper.segment(MESH, 9, mask=FIELD > 0, barriers=FIELD // 4, islands="nearest")
    assert np.array_equal(masked.labels < 0, FIELD == 0)
    told = []
    cancelled = sf.paper.segment(MESH, 20, callback=lambda *call: told.append(call) or False)
    assert cancelled.stop_reason == "cancelled"
    assert told[0] == ("mesh", 0, 0)


@pytest.mark.parametrize(("options", "error", "message"), [
    ({"weights": "parts"}, TypeError, "no parameter weights: use superfacets.segment"),
    ({"tol": 0.1}, TypeError, "no parameter tol: use superfacets.segment"),
    ({"radius_factor": "2"}, TypeError, "radius_factor must be a number, got '2'"),
    ({"alpha": -1}, ValueError, "alpha must be finite and not negative"),
    ({"n_segments": 2, "radius": 1.0}, ValueError, r"n_segments is 2 and radius is 1\.0: give"),
])  # fmt: skip
def test_wrong_parameters_of_the_paper_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        sf.paper.segment(MESH, **options)


def test_warnings_name_the_line_that_calls(recwarn):
    islands = shapes.two_islands()
    sf.segment(islands, 1)
    sf.paper.segment(islands, 1, radius_factor=None)
    sf.segment(MESH, 3, features=np.zeros(MESH.n_faces))
    assert [one.category for one in recwarn] == [sf.IslandWarning] * 2 + [sf.FeatureWarning]
    assert {one.filename for one in recwarn} == {__file__}
